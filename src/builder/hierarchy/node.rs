//! Finished nodes and where they go.

use super::outline::SkippedNode;
use crate::Result;
use crate::builder::border::skirt::Skirt;
use crate::builder::error::SurfaceError;
use crate::builder::simplify::simplified::LadderStep;
use crate::mesh::{Mesh, OutlineCoverage};
use crate::texture::BakeReason;

/// A finished node, on its way to disk.
#[derive(Debug)]
pub struct NodeDraft<'a> {
    /// Geometry with source texture coordinates, without skirts.
    pub mesh: &'a Mesh,
    /// What closes its borders.
    pub skirts: &'a [Skirt],
    /// How far it is simplified ([`super::shape`]): 0 is the block's coarsest, the last the
    /// leaves'.
    pub resolution: usize,
    /// Child numbers from the root down; empty for the root.
    pub child_path: &'a [u32],
    /// The triangles that it should have at most.
    pub budget: usize,
    /// What it would keep of its source's outline within its budget, where that is too little and it
    /// was given more ([`OutlineConstants`](crate::builder::constants::OutlineConstants)).
    pub within_budget: Option<OutlineCoverage>,
    /// Distance from the original; 0 for leaves, where they are not quantised.
    pub error: SurfaceError,
    /// How it was made.
    pub step: LadderStep,
    /// Why it needs a texture of its own, where it does.
    pub baked: Option<BakeReason>,
    /// Border vertices that were locked.
    pub locked: usize,
}

impl NodeDraft<'_> {
    /// How often its block was divided above it: its level, unless a node above is left out.
    pub fn level(&self) -> usize {
        self.child_path.len()
    }
}

/// Takes finished nodes, from many threads at once.
pub trait NodeSink: Sync {
    /// What is kept of a node once it is written.
    type Record: Send;

    /// Writes a node.
    fn take(&self, node: &NodeDraft) -> Result<Self::Record>;

    /// Called when chunks holding this many source triangles have become leaves.
    fn leaves_done(&self, _triangles: usize) {}
}

/// What becomes of a block: a tree, or where coarse nodes are left out, several.
#[derive(Debug)]
pub struct Forest<R> {
    /// In the order in which they were cut off.
    pub trees: Vec<Tree<R>>,
    /// Those above them, and others between them, that were not written; children first.
    pub left_out: Vec<SkippedNode>,
}

/// A node's record and its children.
#[derive(Clone, Debug)]
pub struct Tree<R> {
    /// Of the node itself.
    pub record: R,
    /// In the order in which they were cut off.
    pub children: Vec<Tree<R>>,
}

impl<R> Tree<R> {
    /// Visits all records, parents first.
    pub fn for_each<'a>(&'a self, visit: &mut impl FnMut(&'a R)) {
        visit(&self.record);
        self.children.iter().for_each(|child| child.for_each(visit));
    }
}
