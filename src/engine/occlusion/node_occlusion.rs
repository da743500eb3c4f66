//! A node as what hides others, and as what may be hidden.

use glam::DVec3;

use super::find_slabs::find_slabs;
use super::pieces::{Piece, pieces};
use super::slab::Slab;
use super::surface::Surface;
use crate::format::NodeMesh;
use crate::mesh::UpAxis;

/// A node as what hides others, and as what may be hidden.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeOcclusion {
    /// Source coordinates from which everything else is metres away.
    pub(super) origin: DVec3,
    /// Behind these nothing is seen.
    pub(super) slabs: Vec<Slab>,
    /// Boxes around all of it, and around its parts.
    pub(super) pieces: Vec<Piece>,
}

impl NodeOcclusion {
    /// Of what is drawn of a node, in a scene whose up axis is `up`.
    pub fn new(mesh: &NodeMesh, up: UpAxis) -> Self {
        Self {
            origin: mesh.origin.into(),
            slabs: find_slabs(&Surface::new(mesh), up.from_z_up(DVec3::Z)),
            pieces: pieces(mesh),
        }
    }

    /// Whether all of it is in boxes of which `is_out` says that nothing in them is seen; not where there
    /// is no box.
    pub(super) fn all_out(&self, is_out: impl Fn([DVec3; 2]) -> bool) -> bool {
        let mut at = 0;
        while let Some(piece) = self.pieces.get(at) {
            let bbox = piece.bbox.map(|corner| corner.as_dvec3() + self.origin);
            if is_out(bbox) {
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
