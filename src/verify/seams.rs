//! Where leaves meet: the edges that two of them share, which cutting planes made.
//!
//! Positions at both sides of a cut are equal in every bit, so equal edges are found by sorting.
//! Where two blocks of the source touch in the same way, their common edges count too.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::geometry::NodeGeometry;
use crate::mesh::{PositionKey, key};

/// An edge that two leaves share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seam {
    /// Its ends, in source coordinates.
    pub ends: [DVec3; 2],
    /// The leaves, the lower number first.
    pub leaves: [u32; 2],
}

/// An edge by its ends, in order, and a leaf that it bounds.
type RimEdge = ([PositionKey<f64>; 2], u32, [DVec3; 2]);

/// Edges on the rim of a node, ends in order of their keys: those that are not between two of its
/// own triangles.
pub(super) fn rim(geometry: &NodeGeometry) -> Vec<([PositionKey<f64>; 2], [DVec3; 2])> {
    let mut numbers: FxHashMap<PositionKey<f64>, u32> = FxHashMap::default();
    let mut positions: Vec<DVec3> = Vec::new();
    let welded: Vec<u32> = (0..geometry.positions.len() as u32)
        .map(|vertex| {
            let position = geometry.position(vertex);
            *numbers.entry(key(position.to_array())).or_insert_with(|| {
                positions.push(position);
                positions.len() as u32 - 1
            })
        })
        .collect();
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(geometry.triangles.len() * 3);
    for (number, triangle) in (0..).zip(&geometry.triangles) {
        if !geometry.is_surface(number) {
            continue;
        }
        let [a, b, c] = triangle.map(|vertex| welded[vertex as usize]);
        edges.extend([[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)]));
    }
    edges.sort_unstable();
    edges
        .chunk_by(|a, b| a == b)
        .filter(|same| same.len() != 2 && same[0][0] != same[0][1])
        .map(|same| {
            let mut ends = same[0].map(|vertex| positions[vertex as usize]);
            let mut keys = ends.map(|end| key(end.to_array()));
            if keys[1] < keys[0] {
                (keys, ends) = ([keys[1], keys[0]], [ends[1], ends[0]]);
            }
            (keys, ends)
        })
        .collect()
}

/// All edges that several leaves share, once for each pair of leaves, in a fixed order.
pub(super) fn seams(leaves: &[u32], geometry: &[NodeGeometry]) -> Vec<Seam> {
    let mut edges: Vec<RimEdge> = leaves
        .par_iter()
        .flat_map_iter(|&leaf| {
            rim(&geometry[leaf as usize]).into_iter().map(move |(keys, ends)| (keys, leaf, ends))
        })
        .collect();
    edges.par_sort_unstable_by_key(|&(keys, leaf, _)| (keys, leaf));
    let mut seams = Vec::new();
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        for (place, &(_, a, ends)) in same.iter().enumerate() {
            for &(_, b, _) in &same[place + 1..] {
                if a != b {
                    seams.push(Seam { ends, leaves: [a, b] });
                }
            }
        }
    }
    seams
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(origin: f64, from: f32) -> NodeGeometry {
        NodeGeometry {
            origin: DVec3::new(origin, 0.0, 0.0),
            positions: vec![
                [from, 0.0, 0.0],
                [from + 1.0, 0.0, 0.0],
                [from + 1.0, 1.0, 0.0],
                [from, 1.0, 0.0],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            in_cut_plane: Vec::new(),
        }
    }

    #[test]
    fn leaves_with_different_origins_meet_at_equal_edges() {
        let nodes = [square(100.0, 0.0), square(101.0, 0.0), square(102.0, 0.5)];
        assert_eq!(rim(&nodes[0]).len(), 4, "the diagonal is inside");
        let seams = seams(&[0, 1, 2], &nodes);
        let x = DVec3::new(101.0, 0.0, 0.0);
        assert_eq!(seams, [Seam { ends: [x, x + DVec3::Y], leaves: [0, 1] }]);
    }
}
