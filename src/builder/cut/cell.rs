//! The part of a triangle that is within a cell of the partition.
//!
//! A triangle is clipped by the planes of the cell's sides, one after another (Sutherland and Hodgman,
//! "Reentrant polygon clipping", 1974). What lies on a side is also divided where cells beyond that side
//! end, since these divide it there: both sides have the same vertices.

use super::section::{AxisPlane, Line, Place, Triangle, side};
use crate::builder::partition::{CellBox, Partition};

/// A cell and those beyond its sides.
#[derive(Clone, Debug)]
pub struct CellCut {
    place: CellBox,
    sides: Vec<CellSide>,
}

/// A side of a cell that others are beyond.
#[derive(Clone, Debug)]
pub struct CellSide {
    /// The plane that it lies in.
    pub plane: AxisPlane,
    /// True for the plane at the upper end of the cell along its axis.
    pub is_upper: bool,
    /// The parts of it that other cells have too, flat boxes, in an order of places.
    pub patches: Vec<CellBox>,
}

/// A corner of a polygon and what the edge follows that begins there.
#[derive(Clone, Copy, Debug)]
struct Corner {
    place: Place,
    line: Line,
}

/// Part of a triangle, as triangles.
#[derive(Clone, Debug, Default)]
pub struct Piece {
    /// Corners of the triangles.
    pub places: Vec<Place>,
    /// Wound as the whole is.
    pub triangles: Vec<[u32; 3]>,
}

impl CellCut {
    /// Creates the cutter of one block of a partition.
    pub fn new(partition: &Partition, block: u32) -> Self {
        let place = partition.cell(block).place;
        let mut sides = Vec::new();
        for axis in 0..3 {
            for is_upper in [false, true] {
                let at = place.side(axis, is_upper);
                if at.is_infinite() {
                    continue;
                }
                let patch = |other: u32| {
                    let other = partition.cell(other).place;
                    let mut patch = CellBox {
                        low: std::array::from_fn(|i| place.low[i].max(other.low[i])),
                        high: std::array::from_fn(|i| place.high[i].min(other.high[i])),
                    };
                    (patch.low[axis], patch.high[axis]) = (at, at);
                    patch
                };
                let beyond = partition.beyond(block, axis, is_upper);
                let mut patches: Vec<CellBox> = beyond.into_iter().map(patch).collect();
                patches.sort_by(|a, b| {
                    let places = a.low.iter().zip(&b.low).map(|(a, b)| a.total_cmp(b));
                    places.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
                });
                sides.push(CellSide { plane: AxisPlane { axis, at }, is_upper, patches });
            }
        }
        Self { place, sides }
    }

    /// The sides that other cells are beyond.
    pub fn sides(&self) -> &[CellSide] {
        &self.sides
    }

    /// Returns whether a box lies strictly inside the cell.
    pub fn holds_within(&self, place: &CellBox) -> bool {
        self.place.holds_within(place)
    }

    /// The part of a triangle that is within the cell. What lies in a plane between two cells is of the
    /// one above it.
    pub fn piece(&self, triangle: &Triangle) -> Piece {
        let mut polygon: Vec<Corner> = (0..3)
            .map(|corner| Corner { place: triangle.corner(corner), line: Line::Edge(corner) })
            .collect();
        for CellSide { plane, is_upper, .. } in &self.sides {
            let inside = if *is_upper { -1 } else { 1 };
            let sides = triangle.sides(*plane);
            if sides == [0; 3] {
                if *is_upper {
                    return Piece::default();
                }
                continue;
            }
            polygon = clipped(triangle, &polygon, *plane, inside);
            let is_flat =
                polygon.iter().all(|corner| side(corner.place.position[plane.axis], plane.at) == 0);
            if polygon.len() < 3 || is_flat {
                return Piece::default();
            }
        }
        self.divided(triangle, &polygon)
    }

    /// A polygon as triangles, its edges on sides divided where cells beyond end.
    fn divided(&self, triangle: &Triangle, polygon: &[Corner]) -> Piece {
        let mut piece = Piece::default();
        piece.places.extend(polygon.iter().map(|corner| corner.place));
        let count = polygon.len();
        // Per edge of the polygon, the points that divide it, in order.
        let between: Vec<Vec<Place>> = (0..count)
            .map(|at| {
                let (from, to) = (&polygon[at], &polygon[(at + 1) % count]);
                self.between(triangle, from, to)
            })
            .collect();
        let mut fan = Vec::new();
        for third in 2..count as u32 {
            fan.push([0, third - 1, third]);
        }
        let mut divided_at: Vec<([u32; 2], Vec<u32>)> = Vec::new();
        for (at, places) in between.into_iter().enumerate().filter(|(_, places)| !places.is_empty())
        {
            let first = piece.places.len() as u32;
            piece.places.extend(&places);
            let numbers = (first..first + places.len() as u32).collect();
            divided_at.push(([at as u32, ((at + 1) % count) as u32], numbers));
        }
        for corners in fan {
            divide(corners, &divided_at, &mut piece.triangles);
        }
        let places = &piece.places;
        piece.triangles.retain(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|at| places[at as usize].position);
            a != b && b != c && c != a
        });
        piece
    }

    /// The places at which cells beyond a side end along an edge that lies on it, from its first end on.
    fn between(&self, triangle: &Triangle, from: &Corner, to: &Corner) -> Vec<Place> {
        let ends = [from.place.position, to.place.position];
        let mut found: Vec<Place> = Vec::new();
        for CellSide { plane, patches, .. } in &self.sides {
            if ends.iter().any(|end| end[plane.axis] != plane.at) {
                continue;
            }
            for patch in patches {
                for axis in (0..3).filter(|&axis| axis != plane.axis) {
                    for at in [patch.low[axis], patch.high[axis]] {
                        if side(ends[0][axis], at) * side(ends[1][axis], at) >= 0 {
                            continue;
                        }
                        let place = triangle.crossing(from.line, AxisPlane { axis, at });
                        let is_there = (0..3).all(|i| {
                            patch.low[i] <= place.position[i] && place.position[i] <= patch.high[i]
                        });
                        let known = |other: &Place| other.position == place.position;
                        if is_there && !found.iter().any(known) && !ends.contains(&place.position) {
                            found.push(place);
                        }
                    }
                }
            }
        }
        let along = |place: &Place| {
            (0..3)
                .map(|i| (place.position[i] - ends[0][i]) * (ends[1][i] - ends[0][i]))
                .sum::<f64>()
        };
        found.sort_by(|a, b| along(a).total_cmp(&along(b)));
        found
    }
}

/// The part of a convex polygon that is on one side of a plane.
fn clipped(triangle: &Triangle, polygon: &[Corner], plane: AxisPlane, inside: i8) -> Vec<Corner> {
    let side_of = |corner: &Corner| side(corner.place.position[plane.axis], plane.at) * inside;
    if polygon.iter().all(|corner| side_of(corner) >= 0) {
        return polygon.to_vec();
    }
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (at, corner) in polygon.iter().enumerate() {
        let next = &polygon[(at + 1) % polygon.len()];
        let (here, there) = (side_of(corner), side_of(next));
        let leaves = Line::Section(plane);
        match (here, there) {
            (-1, 1) => kept
                .push(Corner { place: triangle.crossing(corner.line, plane), line: corner.line }),
            (1, -1) => {
                kept.push(*corner);
                kept.push(Corner { place: triangle.crossing(corner.line, plane), line: leaves });
            }
            (0, -1) => kept.push(Corner { line: leaves, ..*corner }),
            (-1, _) => {}
            _ => kept.push(*corner),
        }
    }
    kept
}

/// A triangle as several, where some of its edges are divided.
fn divide(corners: [u32; 3], divided: &[([u32; 2], Vec<u32>)], triangles: &mut Vec<[u32; 3]>) {
    for turn in 0..3 {
        let [a, b, c] = [0, 1, 2].map(|at| corners[(at + turn) % 3]);
        let Some((_, places)) = divided.iter().find(|(edge, _)| *edge == [a, b]) else { continue };
        // The remaining part of the others belongs to the first and the last of them.
        let mut from = a;
        for &place in places.iter().chain([&b]) {
            divide([from, place, c], divided, triangles);
            from = place;
        }
        return;
    }
    triangles.push(corners);
}
