//! What a level keeps of the source's outline: the ground that it covers, seen from above, and the
//! skyline that it makes, seen from all sides.
//!
//! Distances tell little of either: a tower that is gone is one point of a large error, and a
//! thousand sheds that are gone are none.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec2, DVec3, Vec2Swizzles};
use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::report::Kept;
use crate::mesh::UpAxis;

/// Cells along the longer side of the ground, and columns of a skyline.
const CELLS: usize = 4096;

/// Skylines, evenly over half a turn: from the other side each is the same.
const SIDES: usize = 8;

/// The ground and the heights that all outlines of a scene are compared on.
pub(super) struct Frame {
    up: UpAxis,
    /// The corner of the ground, and the height of its lowest point.
    low: DVec3,
    size: DVec2,
    /// The side of a cell, metres.
    cell: f64,
    cells: [usize; 2],
}

/// What nodes cover, and how high they rise.
pub(super) struct Outline {
    /// A bit for each cell whose centre is below or above a triangle, row by row.
    covered: Vec<AtomicU64>,
    /// Of each column of each side, the highest point above the frame's lowest as bits, which are in
    /// the order of the numbers as none is below 0; `EMPTY` where nothing is.
    top: Vec<AtomicU64>,
    /// Likewise the lowest, as the largest number less it, so that both are found by `max`.
    bottom: Vec<AtomicU64>,
}

const EMPTY: u64 = 0;

impl Frame {
    /// Around these nodes; `None` where they cover no ground or have no height.
    pub fn around(up: UpAxis, nodes: &[u32], geometry: &[NodeGeometry]) -> Option<Self> {
        let vertices = nodes.iter().flat_map(|&node| {
            let node = &geometry[node as usize];
            (0..node.positions.len() as u32).map(|vertex| up.z_up(node.position(vertex)))
        });
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for vertex in vertices {
            (low, high) = (low.min(vertex), high.max(vertex));
        }
        let size = high - low;
        if !(size.max_element().is_finite() && size.truncate().max_element() > 0.0) {
            return None;
        }
        let cell = size.truncate().max_element() / CELLS as f64;
        let cells = [size.x, size.y].map(|side| ((side / cell).ceil() as usize).max(1));
        Some(Self { up, low, size: size.truncate(), cell, cells })
    }

    /// The outline of some nodes.
    pub fn outline(&self, nodes: &[u32], geometry: &[NodeGeometry]) -> Outline {
        let none = |count: usize| (0..count).map(|_| AtomicU64::new(EMPTY)).collect();
        let outline = Outline {
            covered: none((self.cells[0] * self.cells[1]).div_ceil(64)),
            top: none(SIDES * CELLS),
            bottom: none(SIDES * CELLS),
        };
        let axes: Vec<(DVec2, f64, f64)> = (0..SIDES).map(|side| self.axis(side)).collect();
        nodes.par_iter().for_each(|&node| {
            for (_, corners) in geometry[node as usize].surface() {
                let corners = corners.map(|corner| self.up.z_up(corner) - self.low);
                self.cover(&outline.covered, corners);
                for (side, &(axis, first, column)) in axes.iter().enumerate() {
                    let along = |corner: DVec3| (corner.truncate().dot(axis) - first) / column;
                    let corners = corners.map(|corner| DVec2::new(along(corner), corner.z));
                    let columns = side * CELLS..(side + 1) * CELLS;
                    let (top, bottom) = (&outline.top[columns.clone()], &outline.bottom[columns]);
                    rise(top, bottom, corners);
                }
            }
        });
        outline
    }

    /// The direction along which a skyline runs, where it begins, and the width of its columns.
    fn axis(&self, side: usize) -> (DVec2, f64, f64) {
        let axis = DVec2::from_angle(PI * side as f64 / SIDES as f64);
        let corners =
            [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|at| (at * self.size).dot(axis));
        let first = corners.into_iter().fold(f64::INFINITY, f64::min);
        let last = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
        (axis, first, ((last - first) / CELLS as f64).max(f64::MIN_POSITIVE))
    }

    /// Marks the cells whose centres a triangle covers.
    fn cover(&self, covered: &[AtomicU64], corners: [DVec3; 3]) {
        let corners = corners.map(|corner| corner.truncate() / self.cell);
        let heights = corners.map(|corner| corner.y);
        for row in centres(heights, self.cells[1]) {
            let Some([from, to]) = across(corners.map(|corner| corner.yx()), row as f64 + 0.5)
            else {
                continue;
            };
            for column in centres([from, to, to], self.cells[0]) {
                let bit = row * self.cells[0] + column;
                let word = &covered[bit / 64];
                let mask = 1 << (bit % 64);
                // Most are there already, and reading is cheaper.
                if word.load(Ordering::Relaxed) & mask == 0 {
                    word.fetch_or(mask, Ordering::Relaxed);
                }
            }
        }
    }
}

/// The cells, of so many, whose centres lie in the range of some coordinates, in cells.
fn centres<const N: usize>(coordinates: [f64; N], count: usize) -> std::ops::Range<usize> {
    let low = coordinates.into_iter().fold(f64::INFINITY, f64::min);
    let high = coordinates.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let at = |coordinate: f64| (coordinate - 0.5).ceil().clamp(0.0, count as f64) as usize;
    at(low)..at(high)
}

/// Where a line of equal first coordinate crosses a triangle: the least and largest second one.
fn across(corners: [DVec2; 3], at: f64) -> Option<[f64; 2]> {
    let [a, b, c] = corners;
    let crossing = |[from, to]: [DVec2; 2]| {
        let is_across = (from.x <= at) != (to.x <= at);
        is_across.then(|| from.y + (to.y - from.y) * ((at - from.x) / (to.x - from.x)))
    };
    let crossings = [[a, b], [b, c], [c, a]].into_iter().filter_map(crossing);
    crossings.fold(None, |range, y| match range {
        None => Some([y, y]),
        Some([low, high]) => Some([low.min(y), high.max(y)]),
    })
}

/// Raises and lowers the columns of a skyline, at whose centres a triangle is there.
fn rise(top: &[AtomicU64], bottom: &[AtomicU64], corners: [DVec2; 3]) {
    for column in centres(corners.map(|corner| corner.x), CELLS) {
        let Some([low, high]) = across(corners, column as f64 + 0.5) else { continue };
        top[column].fetch_max(high.max(f64::MIN_POSITIVE).to_bits(), Ordering::Relaxed);
        bottom[column].fetch_max(u64::MAX - low.max(0.0).to_bits(), Ordering::Relaxed);
    }
}

impl Outline {
    /// What of the ground and of the skyline of `self` another outline has, and what it adds.
    pub fn kept_by(&self, other: &Self) -> Kept {
        let words = self.covered.iter().zip(&other.covered);
        let words = words.map(|(own, others)| [own, others].map(|w| w.load(Ordering::Relaxed)));
        let (mut area, mut both, mut more) = (0u64, 0u64, 0u64);
        for [own, others] in words {
            area += u64::from(own.count_ones());
            both += u64::from((own & others).count_ones());
            more += u64::from((others & !own).count_ones());
        }
        let (mut height, mut kept, mut added) = (0.0, 0.0, 0.0);
        for column in 0..self.top.len() {
            let of = |bits: &AtomicU64| bits.load(Ordering::Relaxed);
            let (own, others) = (of(&self.top[column]), of(&other.top[column]));
            if own == EMPTY {
                continue;
            }
            let bottom = f64::from_bits(u64::MAX - of(&self.bottom[column]));
            let rises = |top: u64| (f64::from_bits(top) - bottom).max(0.0);
            let (own, others) = (rises(own), rises(others));
            height += own;
            kept += own.min(others);
            added += (others - own).max(0.0);
        }
        let share = |part: f64, of: f64| (of > 0.0).then(|| part / of);
        Kept {
            area: share(both as f64, area as f64),
            area_added: share(more as f64, area as f64),
            skyline: share(kept, height),
            skyline_added: share(added, height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Upright boxes: corner, size.
    fn boxes(boxes: &[[DVec3; 2]]) -> NodeGeometry {
        let mut node = NodeGeometry::default();
        for &[low, size] in boxes {
            let first = node.positions.len() as u32;
            let corner = |at: u32| {
                let at = DVec3::new(f64::from(at & 1), f64::from(at >> 1 & 1), f64::from(at >> 2));
                (low + at * size).as_vec3().to_array()
            };
            node.positions.extend((0..8).map(corner));
            let faces = [
                [0, 1, 3, 2],
                [4, 5, 7, 6],
                [0, 1, 5, 4],
                [2, 3, 7, 6],
                [0, 2, 6, 4],
                [1, 3, 7, 5],
            ];
            for [a, b, c, d] in faces.map(|face| face.map(|corner: u32| first + corner)) {
                node.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        node
    }

    fn kept(source: &[[DVec3; 2]], level: &[[DVec3; 2]]) -> Kept {
        let geometry = [boxes(source), boxes(level)];
        let frame = Frame::around(UpAxis::Z, &[0], &geometry).unwrap();
        frame.outline(&[0], &geometry).kept_by(&frame.outline(&[1], &geometry))
    }

    /// A row of houses as high as they are wide, on slabs that keep the ground where it is.
    fn houses(random: &mut Random) -> Vec<[DVec3; 2]> {
        let house = |n: usize| {
            let size = DVec3::new(
                random.between(4.0, 9.0),
                random.between(4.0, 9.0),
                random.between(3.0, 30.0),
            );
            let low = DVec3::new(n as f64 * 10.0, random.between(0.0, 50.0), 0.0);
            [low, size]
        };
        (0..12).map(house).collect()
    }

    #[test]
    fn what_is_the_same_is_kept_whole() {
        let all = houses(&mut Random::new(1, 0));
        let whole = Kept {
            area: Some(1.0),
            area_added: Some(0.0),
            skyline: Some(1.0),
            skyline_added: Some(0.0),
        };
        assert_eq!(kept(&all, &all), whole);
    }

    /// Areas are sums of rectangles, and a box's skyline is a rectangle of its own: naive sums, over
    /// columns of another width.
    #[test]
    fn houses_that_go_or_grow_are_missed_by_their_own_area_and_skyline() {
        for seed in 0..4 {
            let mut random = Random::new(seed, 1);
            let all = houses(&mut random);
            let mut level: Vec<[DVec3; 2]> = all.iter().copied().step_by(2).collect();
            level[2][1].z *= 2.0;
            level[3][1].z *= 0.5;
            let found = kept(&all, &level);

            let area =
                |boxes: &[[DVec3; 2]]| boxes.iter().map(|[_, size]| size.x * size.y).sum::<f64>();
            let expected = area(&level) / area(&all);
            assert!((found.area.unwrap() - expected).abs() < 1e-3, "{seed}: {found:?} {expected}");
            assert!(found.area_added.unwrap() < 1e-3);

            let (mut height, mut both, mut more) = (0.0, 0.0, 0.0);
            for side in 0..8 {
                let angle = PI / 8.0 * f64::from(side);
                let top = |boxes: &[[DVec3; 2]], at: f64| {
                    let over = boxes.iter().filter(|[low, size]| {
                        let middle = *low + *size * 0.5;
                        let off = middle.x * angle.cos() + middle.y * angle.sin() - at;
                        off.abs() < 0.5 * (size.x * angle.cos().abs() + size.y * angle.sin())
                    });
                    over.map(|[_, size]| size.z).fold(0.0, f64::max)
                };
                // Columns of a skyline are as many, however wide it is: so is each step here.
                let corners = |[low, size]: &[DVec3; 2]| [*low, *low + *size];
                let (low, high) = all
                    .iter()
                    .flat_map(corners)
                    .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), corner| {
                        (low.min(corner), high.max(corner))
                    });
                let ends = [low.x, high.x]
                    .into_iter()
                    .flat_map(|x| [low.y, high.y].map(|y| x * angle.cos() + y * angle.sin()));
                let ends: Vec<f64> = ends.collect();
                let first = ends.iter().copied().fold(f64::INFINITY, f64::min);
                let last = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                for step in 0..20_000 {
                    let at = first + (last - first) * (f64::from(step) + 0.5) / 20_000.0;
                    let (own, others) = (top(&all, at), top(&level, at));
                    height += own;
                    both += own.min(others);
                    more += (others - own).max(0.0);
                }
            }
            let (skyline, added) = (found.skyline.unwrap(), found.skyline_added.unwrap());
            assert!((skyline - both / height).abs() < 2e-3, "{seed}: {skyline} {}", both / height);
            assert!((added - more / height).abs() < 2e-3, "{seed}: {added} {}", more / height);
            assert!(skyline < 0.9 && added > 0.0, "the case tells: {skyline} {added}");
        }
    }

    #[test]
    fn whichever_axis_is_up() {
        let all = boxes(&houses(&mut Random::new(3, 2)));
        let turned = |node: &NodeGeometry| {
            let turn = |&p: &[f32; 3]| {
                UpAxis::Y.from_z_up(glam::Vec3::from(p).as_dvec3()).as_vec3().to_array()
            };
            NodeGeometry { positions: node.positions.iter().map(turn).collect(), ..node.clone() }
        };
        let mut few = all.clone();
        few.triangles.truncate(48);
        let of = |up: UpAxis, nodes: [NodeGeometry; 2]| {
            let frame = Frame::around(up, &[0], &nodes).unwrap();
            frame.outline(&[0], &nodes).kept_by(&frame.outline(&[1], &nodes))
        };
        let upright = of(UpAxis::Z, [all.clone(), few.clone()]);
        assert!(upright.area.unwrap() < 0.5);
        assert_eq!(of(UpAxis::Y, [turned(&all), turned(&few)]), upright);
    }

    #[test]
    fn what_has_no_ground_has_no_shares() {
        let line =
            NodeGeometry { positions: vec![[0.0; 3], [0.0, 0.0, 5.0]], ..Default::default() };
        assert!(Frame::around(UpAxis::Z, &[0], &[line]).is_none());
        let wall = NodeGeometry {
            positions: vec![[0.0; 3], [9.0, 0.0, 0.0], [9.0, 0.0, 4.0]],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        let geometry = [wall];
        let frame = Frame::around(UpAxis::Z, &[0], &geometry).unwrap();
        let outline = frame.outline(&[0], &geometry);
        let kept = outline.kept_by(&outline);
        assert_eq!((kept.area, kept.skyline), (None, Some(1.0)));
    }
}
