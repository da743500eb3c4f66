//! Blocks whose nodes are written.

use std::collections::BTreeMap;

use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::hierarchy::Tree;
use crate::format::{BORDERS_DIR, BlockInfo, SharedTexture};
use crate::report::build_report::{BlockReport, EmptyBlock};
use crate::texture::SharedTextures;

/// A block whose nodes are written.
#[derive(Clone, Debug)]
pub struct BuiltBlock {
    /// Entry of `scene.hlod`.
    pub info: BlockInfo,
    /// Node trees: one, or several if coarse nodes at the top were skipped.
    pub trees: Vec<Tree<NodeRecord>>,
    /// Entry of `build.json`.
    pub report: BlockReport,
}

impl BuiltBlock {
    /// Visits all records, parents first.
    pub fn for_each<'a>(&'a self, visit: &mut impl FnMut(&'a NodeRecord)) {
        self.trees.iter().for_each(|tree| tree.for_each(visit));
    }
}

/// The file of the borders of a block, inside an output folder.
pub fn border_file(name: &str) -> String {
    format!("{BORDERS_DIR}/{name}.border")
}

/// Blocks that were built or reused.
#[derive(Default)]
pub struct BuiltBlocks {
    /// Blocks by cell number, those of a cell in order.
    pub blocks: BTreeMap<u32, Vec<BuiltBlock>>,
    /// Planned blocks without a triangle.
    pub empty: Vec<EmptyBlock>,
    /// Shared textures of earlier results, by name.
    pub reused_textures: BTreeMap<String, SharedTexture>,
    /// Shared textures that this build made.
    pub shared: SharedTextures,
}
