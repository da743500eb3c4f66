//! From imported models to nodes on disk.
//!
//! - [`pipeline`]: the whole build; [`mod@prepare`]: an input as it is built; [`inputs`]: looking at it
//! - [`sources`]: what is read as one input: files, and tiles of large ones
//! - [`partition`]: one tree of cells over all inputs; [`plan`]: what each block is made of
//! - [`building`]: inputs one after another, blocks when their inputs are there; [`scatter`], [`block`]
//! - [`upper`]: nodes above the blocks, made from the files below them
//! - [`mod@finish`]: scene, tileset and report
//! - [`reuse`]: blocks of an earlier result; [`subset`] and [`merge`]: shares for several machines
//! - [`copyright`]: notices of the inputs, which every node repeats
//! - [`stitch`]: borders of the source that touch without sharing vertices
//! - [`hierarchy`]: the tree of one block
//! - [`cut`]: planes, and the triangles that cross them
//! - [`border`]: what planes leave behind: thinning, skirts, caps
//! - [`simplify`]: bringing a node to its triangle budget
//! - [`error`]: the distance between a node and the original
//! - [`emit`]: nodes as files
//! - [`constants`]: what was chosen by measuring

pub mod block;
pub mod block_materials;
pub mod block_setup;
pub mod border;
pub mod building;
mod checkpoint;
pub mod constants;
pub mod copyright;
pub mod cut;
pub mod emit;
pub mod error;
pub mod finish;
pub mod folding;
pub mod gather;
pub mod hierarchy;
pub mod inputs;
pub mod memory;
pub mod merge;
pub mod options;
pub mod outliers;
pub mod partition;
pub mod pipeline;
pub mod plan;
pub mod prepare;
pub mod progress;
pub mod reuse;
pub mod scans;
pub mod scatter;
pub mod simplify;
pub mod sources;
pub mod stages;
pub mod stitch;
pub mod subset;
pub mod threads;
pub mod upper;

pub use options::BuildOptions;
pub use pipeline::{Outcome, build, build_subset, merge_subsets};
pub use subset::Subset;
