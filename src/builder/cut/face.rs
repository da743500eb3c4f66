//! The border that two sides of a cell's side have in common.
//!
//! Every block knows all triangles that meet its sides, those beyond them too. So it finds the edges
//! along which both sides meet, and what each vertex of them is worth, by itself; the block beyond finds
//! the same, bit by bit, since nothing else counts and all of it is put in an order of its own.

use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use rustc_hash::FxHasher;

use crate::builder::border::chain::{BorderVertex, CutPlane, KeepRule};
use crate::builder::border::rank::SurfaceQuadric;
use crate::builder::cut::cell::CellSide;
use crate::builder::cut::section::{AxisPlane, Line, Place, Triangle, side};
use crate::builder::partition::CellBox;
use crate::lattice::Lattice;
use crate::mesh::{Normal, Part, PositionKey, color_key, key, texcoord_key};

/// A triangle that meets a side of a cell, and what it looks like.
#[derive(Clone, Debug)]
pub struct SideTriangle {
    /// The corners.
    pub triangle: Triangle,
    /// Appearance of each corner.
    looks: [Appearance; 3],
    material: u32,
    /// The same wherever the triangle is met.
    order: ([PositionKey<f64>; 3], u64),
}

/// Attributes of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Appearance {
    texcoord: [f32; 2],
    color: [u16; 4],
    normal: Normal,
}

impl SideTriangle {
    /// A triangle of a part.
    pub fn new(part: &Part, corners: [u32; 3], lattice: Lattice) -> Self {
        let look = |vertex: u32| Appearance {
            texcoord: part.texcoords.get(vertex as usize).copied().unwrap_or_default(),
            color: part.colors.get(vertex as usize).copied().unwrap_or([u16::MAX; 4]),
            normal: part.normals.get(vertex as usize).copied().unwrap_or(Normal::NONE),
        };
        let looks = corners.map(look);
        let positions = corners.map(|vertex| part.positions[vertex as usize]);
        let mut hasher = FxHasher::default();
        part.material.hash(&mut hasher);
        for Appearance { texcoord, color, normal } in looks {
            (texcoord_key(texcoord), color_key(color), normal).hash(&mut hasher);
        }
        Self {
            triangle: Triangle { corners: positions, lattice },
            looks,
            material: part.material,
            order: (positions.map(key), hasher.finish()),
        }
    }

    /// A number for what it looks like at a place: the same for triangles that look alike there.
    fn look_at(&self, place: &Place) -> u64 {
        let mut hasher = FxHasher::default();
        self.material.hash(&mut hasher);
        // The corners with a share in an order of their own, so that an edge is one from both sides.
        let mut shares: Vec<(PositionKey<f64>, u64, Appearance)> = (0..3)
            .filter(|&corner| place.weights[corner] > 0.0)
            .map(|corner| {
                let weight = place.weights[corner].to_bits();
                (key(self.triangle.corners[corner]), weight, self.looks[corner])
            })
            .collect();
        shares.sort_by_key(|&(position, weight, _)| (position, weight));
        for (_, weight, Appearance { texcoord, color, normal }) in shares {
            (weight, texcoord_key(texcoord), color_key(color), normal).hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// A vertex of a border, as whoever stands above both sides needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceVertex {
    /// Source coordinates.
    pub position: [f64; 3],
    /// The planes of the triangles around it, on both sides.
    pub surface: SurfaceQuadric,
}

/// The border in the plane of a cell's side.
#[derive(Clone, Debug, Default)]
pub struct FaceBorder {
    /// The plane, its vertices ranked for all levels of the block.
    pub plane: Arc<CutPlane<f64>>,
    /// Each vertex once for each cell beyond.
    pub vertices: Vec<FaceVertex>,
    /// Pairs of vertices.
    pub edges: Vec<[u32; 2]>,
    /// Points in which both sides touch without a common edge.
    pub touching: Vec<[f64; 3]>,
}

/// A vertex of a border in a cutting plane.
struct Vertex {
    position: [f64; 3],
    surface: SurfaceQuadric,
    look: u64,
    is_seam: bool,
    sides: u8,
}

const BELOW: u8 = 1;
const ABOVE: u8 = 2;
const BOTH: u8 = 3;

impl FaceBorder {
    /// The border on one side of a cell; `triangles` are those that meet it, in any order.
    pub fn new(side: &CellSide, triangles: &[SideTriangle], rule: &KeepRule) -> Self {
        let AxisPlane { axis, at } = side.plane;
        let meets = |triangle: &&SideTriangle| {
            let sides = triangle.triangle.sides(side.plane);
            sides.contains(&0) || sides.contains(&1) && sides.contains(&-1)
        };
        let mut meeting: Vec<(CellBox, &SideTriangle)> = triangles
            .iter()
            .filter(meets)
            .map(|triangle| (CellBox::around(triangle.triangle.corners), triangle))
            .collect();
        meeting.sort_by_key(|(_, triangle)| triangle.order);
        let mut face = Self::default();
        let mut chains = Vec::new();
        for patch in &side.patches {
            let of_patch = face.add(&meeting, side.plane, patch, rule);
            chains.extend(of_patch.chains);
        }
        face.plane = Arc::new(CutPlane::from_chains(axis, at, chains));
        face
    }

    /// Adds what the cell has in common with one beyond, which it returns as a plane.
    fn add(
        &mut self,
        meeting: &[(CellBox, &SideTriangle)],
        plane: AxisPlane,
        patch: &CellBox,
        rule: &KeepRule,
    ) -> CutPlane<f64> {
        let mut vertices: BTreeMap<PositionKey<f64>, Vertex> = BTreeMap::new();
        let mut sides: BTreeMap<[PositionKey<f64>; 2], u8> = BTreeMap::new();
        for (_, triangle) in meeting.iter().filter(|(place, _)| place.meets(patch)) {
            let Sections { lines, points, sides: own } = sections(&triangle.triangle, plane);
            let clipped = lines.into_iter().filter_map(|(line, ends)| {
                clipped(&triangle.triangle, line, ends, plane.axis, patch)
            });
            let clipped: Vec<[Place; 2]> = clipped.collect();
            let mut seen: Vec<PositionKey<f64>> = Vec::new();
            let inside = |place: &Place| is_inside(place, plane.axis, patch);
            for place in clipped.iter().flatten().chain(points.iter().filter(|at| inside(at))) {
                let at = key(place.position);
                if seen.contains(&at) {
                    continue;
                }
                seen.push(at);
                let look = triangle.look_at(place);
                let vertex = vertices.entry(at).or_insert_with(|| Vertex {
                    position: place.position,
                    surface: SurfaceQuadric::default(),
                    look,
                    is_seam: false,
                    sides: 0,
                });
                vertex.surface.add_triangle(triangle.triangle.wide());
                vertex.is_seam |= vertex.look != look;
                vertex.sides |= own;
            }
            for ends in clipped {
                let [a, b] = ends.map(|place| key(place.position));
                if a != b {
                    *sides.entry([a.min(b), a.max(b)]).or_default() |= own;
                }
            }
        }
        sides.retain(|_, side| *side == BOTH);
        let mut numbers: BTreeMap<PositionKey<f64>, u32> =
            sides.keys().flatten().map(|&at| (at, 0)).collect();
        numbers.values_mut().zip(0..).for_each(|(number, next)| *number = next);
        let edges: Vec<[u32; 2]> = sides.keys().map(|ends| ends.map(|end| numbers[&end])).collect();
        let of_border: Vec<BorderVertex<f64>> = numbers
            .keys()
            .map(|at| {
                let Vertex { position, surface, is_seam, .. } = vertices[at];
                let is_on_rim = (0..3).filter(|&axis| axis != plane.axis).any(|axis| {
                    position[axis] == patch.low[axis] || position[axis] == patch.high[axis]
                });
                BorderVertex { position, fixed: is_seam || is_on_rim, surface, gone: false }
            })
            .collect();
        let first = self.vertices.len() as u32;
        self.vertices.extend(numbers.keys().map(|at| {
            let Vertex { position, surface, .. } = vertices[at];
            FaceVertex { position, surface }
        }));
        self.edges.extend(edges.iter().map(|edge| edge.map(|end| first + end)));
        let touching = vertices
            .iter()
            .filter(|(at, vertex)| vertex.sides == BOTH && !numbers.contains_key(at));
        self.touching.extend(touching.map(|(_, vertex)| vertex.position));
        CutPlane::new(plane.axis, plane.at, &of_border, &edges, rule)
    }
}

/// The intersection of a triangle with a plane.
struct Sections {
    lines: Vec<(Line, [Place; 2])>,
    points: Vec<Place>,
    /// On which sides of the plane it is there.
    sides: u8,
}

fn sections(triangle: &Triangle, plane: AxisPlane) -> Sections {
    let of_corners = triangle.sides(plane);
    if let Some(ends) = triangle.section(plane) {
        return Sections {
            lines: vec![(Line::Section(plane), ends)],
            points: Vec::new(),
            sides: BOTH,
        };
    }
    let is_above = of_corners.contains(&1) || of_corners == [0; 3];
    let lines = (0..3)
        .filter(|&from| of_corners[from] == 0 && of_corners[(from + 1) % 3] == 0)
        .map(|from| {
            let ends = [from, (from + 1) % 3].map(|corner| triangle.corner(corner));
            (Line::Edge(from), ends)
        });
    let points = (0..3).filter(|&corner| of_corners[corner] == 0);
    Sections {
        lines: lines.collect(),
        points: points.map(|corner| triangle.corner(corner)).collect(),
        sides: if is_above { ABOVE } else { BELOW },
    }
}

/// The part of a line within a patch.
fn clipped(
    triangle: &Triangle,
    line: Line,
    mut ends: [Place; 2],
    across: usize,
    patch: &CellBox,
) -> Option<[Place; 2]> {
    for axis in (0..3).filter(|&axis| axis != across) {
        for (at, outside) in [(patch.low[axis], -1), (patch.high[axis], 1)] {
            let is_out = ends.map(|end| side(end.position[axis], at) == outside);
            match is_out {
                [true, true] => return None,
                [false, false] => {}
                [first, _] => {
                    let [out, other] = if first { [0, 1] } else { [1, 0] };
                    if side(ends[other].position[axis], at) == 0 {
                        ends[out] = ends[other];
                    } else {
                        ends[out] = triangle.crossing(line, AxisPlane { axis, at });
                    }
                }
            }
        }
    }
    Some(ends)
}

fn is_inside(place: &Place, across: usize, patch: &CellBox) -> bool {
    (0..3).all(|axis| {
        axis == across
            || patch.low[axis] <= place.position[axis] && place.position[axis] <= patch.high[axis]
    })
}
