//! The opaque surface of a node, with its edges.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::format::NodeMesh;
use crate::mesh::AlphaMode;

/// The opaque surface of a node: which triangles meet at which edges.
///
/// Corners are one where they are drawn at one place: where their coordinates are equal bit for bit, and
/// the same program draws them.
pub(super) struct Surface {
    /// Metres from the node's origin.
    pub points: Vec<DVec3>,
    pub triangles: Vec<Triangle>,
    /// The ends of each edge, the lower number first.
    pub edges: Vec<[u32; 2]>,
    /// Length of the diagonal of the box around it.
    pub diagonal: f64,
}

pub(super) struct Triangle {
    pub points: [u32; 3],
    /// Its edges; and 1 where it goes from the edge's first end to the second, −1 where it goes back.
    pub sides: [(u32, i32); 3],
    /// Of length 1, or 0.
    pub normal: DVec3,
    pub area: f64,
    /// Drawn from either side.
    pub double_sided: bool,
}

impl Surface {
    pub fn new(mesh: &NodeMesh) -> Self {
        let mut numbers = FxHashMap::default();
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        let is_opaque = |alpha: &AlphaMode| matches!(alpha, AlphaMode::Opaque);
        for primitive in mesh.primitives.iter().filter(|at| is_opaque(&at.surface.alpha)) {
            // What is textured and what is plain is drawn by two programs, which may round differently.
            let program = primitive.surface.image.is_some();
            let mut number = |at: &[f32; 3]| {
                let bits = at.map(|x| (x + 0.0).to_bits()); // −0 is 0
                *numbers.entry((program, bits)).or_insert_with(|| {
                    points.push(Vec3::from(*at).as_dvec3());
                    points.len() as u32 - 1
                })
            };
            let own: Vec<u32> = primitive.positions.iter().map(&mut number).collect();
            let triples: &[[u32; 3]] = primitive.indices.as_chunks().0;
            triangles.extend(triples.iter().map(|triple| {
                let corners = triple.map(|at| own[at as usize]);
                let [a, b, c] = corners.map(|at| points[at as usize]);
                let cross = (b - a).cross(c - a);
                Triangle {
                    points: corners,
                    sides: [(0, 0); 3],
                    normal: cross.normalize_or_zero(),
                    area: cross.length() / 2.0,
                    double_sided: primitive.surface.double_sided,
                }
            }));
        }
        let edges = find_edges(&mut triangles);
        let (min, max) = points
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &at: &DVec3| {
                (min.min(at), max.max(at))
            });
        let diagonal = if points.is_empty() { 0.0 } else { min.distance(max) };
        Self { points, triangles, edges, diagonal }
    }
}

fn find_edges(triangles: &mut [Triangle]) -> Vec<[u32; 2]> {
    let mut sides = Vec::with_capacity(triangles.len() * 3);
    for (at, triangle) in triangles.iter().enumerate() {
        for side in 0..3 {
            let [a, b] = [triangle.points[side], triangle.points[(side + 1) % 3]];
            sides.push(([a.min(b), a.max(b)], at, side));
        }
    }
    sides.sort_unstable();
    let mut edges = Vec::new();
    for (ends, at, side) in sides {
        if edges.last() != Some(&ends) {
            edges.push(ends);
        }
        let triangle = &mut triangles[at];
        let turns = if triangle.points[side] == ends[0] { 1 } else { -1 };
        triangle.sides[side] = (edges.len() as u32 - 1, turns);
    }
    edges
}
