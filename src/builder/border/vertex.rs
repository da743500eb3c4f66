//! Vertices that a chunk shares with its neighbours, and how they thin out from level to level.
//!
//! Neighbours are drawn at different levels, so a border may not be simplified by each side as it
//! likes; and if no border vertex may ever go, the borders eat the whole budget of the coarse
//! levels. So every cutting plane ranks its border vertices once, at full resolution, for both
//! sides and all levels ([`crate::builder::border::chain`]): level by level the same subset is kept, and each
//! subset contains the coarser ones. What remains between two levels lies in the cutting plane
//! and is covered by skirts ([`crate::builder::border::skirt`]).

use std::sync::Arc;

use crate::builder::border::chain::CutPlane;
use crate::mesh::Coordinate;

/// Per vertex, the planes that it lies on: bit `i` stands for plane `i` of the chunk's [`Path`].
pub type PlaneSet = u64;

/// Border facts of a chunk's vertices; arrays are parallel to the mesh's vertices.
#[derive(Clone, Debug, Default)]
pub struct Border {
    /// The cutting planes that each vertex lies on and shares with a neighbour across them.
    pub planes: Vec<PlaneSet>,
    /// The coarsest level at which a vertex on one plane is kept; below it (coarser) it is gone.
    pub keep: Vec<u8>,
}

impl Border {
    /// No vertex lies on a border.
    pub fn interior(vertices: usize) -> Self {
        Self { planes: vec![0; vertices], keep: vec![0; vertices] }
    }
}

/// What becomes of a vertex at a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BorderVertexState {
    /// Not on a border at this level: simplification may do as it likes.
    Free,
    /// On a border and kept where it is.
    Kept,
    /// On a border and to be moved along it to a kept neighbour.
    Gone,
}

/// The cutting planes on the way from the block to a chunk, outermost first.
#[derive(Clone, Debug, Default)]
pub struct Path<C: Coordinate = f32> {
    planes: Vec<Arc<CutPlane<C>>>,
}

impl<C: Coordinate> Path<C> {
    /// The path of a chunk on either side of one more plane.
    pub fn with(&self, plane: Arc<CutPlane<C>>) -> Self {
        let mut planes = self.planes.clone();
        planes.push(plane);
        Self { planes }
    }

    /// The number of planes, at most 64.
    pub fn len(&self) -> usize {
        self.planes.len()
    }

    /// True for a block that no plane bounds.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty()
    }

    /// The plane of a bit.
    pub fn plane(&self, bit: u32) -> &Arc<CutPlane<C>> {
        &self.planes[bit as usize]
    }

    /// All bits of this path.
    pub fn bits(&self) -> PlaneSet {
        if self.planes.len() >= 64 { !0 } else { (1 << self.planes.len()) - 1 }
    }

    /// What becomes of a vertex that lies on `planes` and ranks `keep`, in a node of this path
    /// at `level`.
    pub fn state(&self, planes: PlaneSet, keep: u8, level: u8) -> BorderVertexState {
        let planes = planes & self.bits();
        match planes.count_ones() {
            0 => BorderVertexState::Free,
            1 if keep > level => BorderVertexState::Gone,
            _ => BorderVertexState::Kept,
        }
    }
}
