//! From imported models to nodes on disk.
//!
//! - [`pipeline`]: the whole build; [`mod@prepare`]: an input as it is built; [`block`]: to the trees of its blocks
//! - [`sources`]: what is read as one input: files, and tiles of large ones
//! - [`subset`] and [`merge`]: shares of a build for several machines, and one result of all of them
//! - [`copyright`]: notices of the inputs, which every node repeats
//! - [`districts`]: nodes above the blocks, made from these nodes' files
//! - [`blocks`]: what a block is: groups merged, divided and gathered
//! - [`stitch`]: borders of the source that touch without sharing vertices
//! - [`tiles`]: inputs that touch, and how they meet
//! - [`hierarchy`]: the tree of one block
//! - [`cut`]: planes, and the triangles that cross them
//! - [`border`]: what planes leave behind: thinning, skirts, caps
//! - [`simplify`]: bringing a node to its triangle budget
//! - [`error`]: the distance between a node and the original
//! - [`emit`]: nodes as files
//! - [`constants`]: what was chosen by measuring

pub mod block;
pub mod block_setup;
pub mod blocks;
pub mod border;
mod checkpoint;
pub mod constants;
pub mod copyright;
pub mod cut;
pub mod districts;
pub mod emit;
pub mod error;
pub mod hierarchy;
pub mod inputs;
pub mod memory;
pub mod merge;
pub mod options;
pub mod pipeline;
pub mod plan;
pub mod prepare;
pub mod progress;
pub mod reuse;
pub mod simplify;
pub mod sources;
pub mod stages;
pub mod stitch;
pub mod subset;
pub mod threads;
pub mod tiles;

pub use options::BuildOptions;
pub use pipeline::{Outcome, build, build_subset, merge_subsets};
pub use subset::Subset;
