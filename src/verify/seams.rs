//! Where leaves meet: the edges that two of them share, which cutting planes made.
//!
//! Positions at both sides of a cut are equal in every bit, so equal edges are found by sorting.

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

/// An edge that is not between just two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RimEdge {
    /// Its ends, by which edges are ordered and found.
    keys: [PositionKey<f64>; 2],
    /// Its ends, in the order of their keys, in source coordinates.
    pub ends: [DVec3; 2],
    /// Triangles that have it.
    uses: u32,
}

/// The edges of triangles that are not between just two of them. Vertices at one position are one.
fn rim_of(
    positions: impl Iterator<Item = DVec3>,
    triangles: impl Iterator<Item = [u32; 3]>,
) -> Vec<RimEdge> {
    let mut numbers: FxHashMap<PositionKey<f64>, u32> = FxHashMap::default();
    numbers.reserve(positions.size_hint().0);
    let mut corners: Vec<DVec3> = Vec::new();
    let welded: Vec<u32> = positions
        .map(|position| {
            *numbers.entry(key(position.to_array())).or_insert_with(|| {
                corners.push(position);
                corners.len() as u32 - 1
            })
        })
        .collect();
    drop(numbers);
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(triangles.size_hint().0 * 3);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| welded[vertex as usize]);
        edges.extend([[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)]));
    }
    edges.sort_unstable();
    edges
        .chunk_by(|a, b| a == b)
        .filter(|same| same.len() != 2 && same[0][0] != same[0][1])
        .map(|same| {
            let mut ends = same[0].map(|vertex| corners[vertex as usize]);
            let mut keys = ends.map(|end| key(end.to_array()));
            if keys[1] < keys[0] {
                (keys, ends) = ([keys[1], keys[0]], [ends[1], ends[0]]);
            }
            RimEdge { keys, ends, uses: same.len() as u32 }
        })
        .collect()
}

/// The rim of a node, triangles in cutting planes left out.
pub(super) fn rim(geometry: &NodeGeometry) -> Vec<RimEdge> {
    let positions = (0..geometry.positions.len() as u32).map(|vertex| geometry.position(vertex));
    let triangles = (0..).zip(&geometry.triangles);
    let surface = triangles.filter(|&(number, _)| geometry.is_surface(number));
    rim_of(positions, surface.map(|(_, &triangle)| triangle))
}

/// The edges at which a surface ends: those that an odd number of its triangles have.
pub(super) fn open_edges(
    positions: &[DVec3],
    triangles: impl Iterator<Item = [u32; 3]>,
) -> Vec<[DVec3; 2]> {
    let rim = rim_of(positions.iter().copied(), triangles);
    rim.into_iter().filter(|edge| edge.uses % 2 == 1).map(|edge| edge.ends).collect()
}

/// The rims of all leaves, equal edges side by side, in a fixed order.
pub(super) struct Rims(Vec<(RimEdge, u32)>);

impl Rims {
    /// Of these leaves.
    pub fn new(leaves: &[u32], geometry: &[NodeGeometry]) -> Self {
        let rim = |&leaf: &u32| rim(&geometry[leaf as usize]).into_iter().map(move |e| (e, leaf));
        let mut edges: Vec<(RimEdge, u32)> = leaves.par_iter().flat_map_iter(rim).collect();
        edges.par_sort_unstable_by_key(|&(edge, leaf)| (edge.keys, leaf));
        Self(edges)
    }

    fn equal(&self) -> impl Iterator<Item = &[(RimEdge, u32)]> {
        self.0.chunk_by(|a, b| a.0.keys == b.0.keys)
    }

    /// All edges that several leaves share, once for each pair of leaves.
    pub fn seams(&self) -> Vec<Seam> {
        let mut seams = Vec::new();
        for same in self.equal() {
            for (index, &(edge, a)) in same.iter().enumerate() {
                let others = same[index + 1..].iter().filter(|&&(_, b)| a != b);
                seams.extend(others.map(|&(_, b)| Seam { ends: edge.ends, leaves: [a, b] }));
            }
        }
        seams
    }

    /// Edges of one leaf alone that lie between two vertices of another's rim, once for each such
    /// other: where a cutting plane passes through borders of the source that have vertices within
    /// each other's edges, no edge is shared.
    pub fn between_vertices(&self) -> Vec<Seam> {
        let alone = || self.equal().filter(|same| same.len() == 1).map(|same| same[0]);
        let mut leaves_at: FxHashMap<PositionKey<f64>, Vec<u32>> = FxHashMap::default();
        for (edge, leaf) in alone() {
            for end in edge.keys {
                let leaves = leaves_at.entry(end).or_default();
                if !leaves.contains(&leaf) {
                    leaves.push(leaf);
                }
            }
        }
        let mut seams = Vec::new();
        for (edge, leaf) in alone() {
            let [from, to] = edge.keys.map(|end| &leaves_at[&end]);
            let others = from.iter().filter(|&&other| other != leaf && to.contains(&other));
            let seam =
                |&other: &u32| Seam { ends: edge.ends, leaves: [leaf.min(other), leaf.max(other)] };
            seams.extend(others.map(seam));
        }
        seams
    }

    /// The edges at which the leaves end, all together, and a leaf that has each.
    pub fn open(&self) -> Vec<([DVec3; 2], u32)> {
        let is_open =
            |same: &&[(RimEdge, u32)]| same.iter().map(|(edge, _)| edge.uses).sum::<u32>() % 2 == 1;
        let open = self.equal().filter(is_open).flatten();
        open.filter(|(edge, _)| edge.uses % 2 == 1).map(|&(edge, leaf)| (edge.ends, leaf)).collect()
    }
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
            skirts: Vec::new(),
            in_cut_plane: Vec::new(),
        }
    }

    #[test]
    fn leaves_with_different_origins_meet_at_equal_edges() {
        let nodes = [square(100.0, 0.0), square(101.0, 0.0), square(102.0, 0.5)];
        assert_eq!(rim(&nodes[0]).len(), 4, "the diagonal is inside");
        let rims = Rims::new(&[0, 1, 2], &nodes);
        let x = DVec3::new(101.0, 0.0, 0.0);
        assert_eq!(rims.seams(), [Seam { ends: [x, x + DVec3::Y], leaves: [0, 1] }]);
        // Three squares have twelve sides; two of them meet.
        let open = rims.open();
        assert_eq!(open.len(), 10);
        assert!(open.iter().all(|(ends, _)| *ends != [x, x + DVec3::Y]));
        let corners: Vec<DVec3> = (0..4).map(|vertex| nodes[1].position(vertex)).collect();
        assert_eq!(open_edges(&corners, nodes[1].triangles.iter().copied()).len(), 4);

        // The third begins half way along the second; one that is twice as high has the second's
        // side within its own.
        assert_eq!(rims.between_vertices(), []);
        let mut high = square(101.0, -1.0);
        high.positions[2][1] = 2.0;
        high.positions[3][1] = 2.0;
        let mut halves = square(101.0, 0.0);
        halves.positions.extend([[1.0, 2.0, 0.0], [0.0, 2.0, 0.0]]);
        halves.triangles.extend([[3, 2, 4], [3, 4, 5]]);
        let nodes = [high, halves];
        let rims = Rims::new(&[0, 1], &nodes);
        assert_eq!(rims.seams(), []);
        let ends = [x, x + DVec3::Y * 2.0];
        assert_eq!(rims.between_vertices(), [Seam { ends, leaves: [0, 1] }]);
    }
}
