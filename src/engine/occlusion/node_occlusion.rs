//! A node as what hides others, and as what may be hidden.

use glam::DVec3;

use super::find_slabs::find_slabs;
use super::pieces::Pieces;
use super::slab::Slab;
use super::surface::Surface;
use crate::format::NodeMesh;
use crate::mesh::UpAxis;

/// Slabs of a node, at most: the largest. Nodes of 2,000 triangles in houses have 198 in the median and 323
/// at the 90th percentile; with 64 of each, a walk among them draws two thirds more triangles.
const MOST_SLABS: usize = 320;

/// No more than one for so many triangles, so that small nodes hold little beside themselves,
const TRIANGLES: usize = 6;

/// but as many as these.
const LEAST_SLABS: usize = 4;

fn most_slabs(triangles: usize) -> usize {
    (triangles / TRIANGLES).clamp(LEAST_SLABS, MOST_SLABS)
}

/// A node as what hides others, and as what may be hidden.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeOcclusion {
    /// Source coordinates from which everything else is metres away.
    pub(super) origin: DVec3,
    /// Behind these nothing is seen; the largest first.
    pub(super) slabs: Vec<Slab>,
    /// Boxes around all of it, and around its parts.
    pieces: Pieces,
}

impl NodeOcclusion {
    /// Of what is drawn of a node, in a scene whose up axis is `up`.
    pub fn new(mesh: &NodeMesh, up: UpAxis) -> Self {
        let mut slabs = find_slabs(&Surface::new(mesh), up.from_z_up(DVec3::Z));
        let corners = mesh.primitives.iter().map(|primitive| primitive.indices.len());
        slabs.sort_by(|a, b| b.area().total_cmp(&a.area()));
        slabs.truncate(most_slabs(corners.sum::<usize>() / 3));
        slabs.shrink_to_fit();
        Self { origin: mesh.origin.into(), slabs, pieces: Pieces::new(mesh) }
    }

    /// Most bytes that it takes in memory, for a node of so many triangles.
    pub fn most_bytes(triangles: u32) -> u64 {
        let triangles = triangles as usize;
        let slabs = most_slabs(triangles) * size_of::<Slab>() + size_of::<Self>();
        slabs as u64 + Pieces::most_bytes(triangles)
    }

    /// Squared metres from a place to the box around all of it; 0 where there is none.
    pub(super) fn squared_distance(&self, from: DVec3) -> f64 {
        self.pieces.get(0).map_or(0.0, |whole| {
            let from = from - self.origin;
            let [min, max] = self.pieces.bbox(whole);
            from.distance_squared(from.clamp(min, max))
        })
    }

    /// Whether all of it is in boxes of which `is_out` says that nothing in them is seen; not where there
    /// is no box.
    pub(super) fn all_out(&self, is_out: impl Fn([DVec3; 2]) -> bool) -> bool {
        let mut at = 0;
        while let Some(piece) = self.pieces.get(at) {
            if is_out(self.pieces.bbox(piece).map(|corner| corner + self.origin)) {
                at += piece.boxes as usize;
            } else if piece.boxes > 1 {
                at += 1;
            } else {
                return false;
            }
        }
        !self.pieces.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::occlusion::test_mesh::{bumpy_wall, mesh};
    use crate::random::Random;

    #[test]
    fn it_takes_no_more_than_was_said() {
        let mut random = Random::new(8, 0);
        let walls: Vec<_> = (0..200).map(|_| bumpy_wall(&mut random)).collect();
        for many in [1, 200] {
            let mesh = mesh(&walls[..many].concat());
            let triangles = mesh.primitives[0].indices.len() as u32 / 3;
            let found = NodeOcclusion::new(&mesh, UpAxis::Z);
            let slabs = found.slabs.capacity() * size_of::<Slab>() + size_of::<NodeOcclusion>();
            let bytes = slabs as u64 + Pieces::most_bytes(triangles as usize);
            assert!(!found.slabs.is_empty() && bytes <= NodeOcclusion::most_bytes(triangles));
        }
    }
}
