//! From imported models to nodes on disk.
//!
//! Layers: a module uses those of the layers above it in this list alone, which a test checks.
//!
//! 1. [`constants`]: what was chosen by measuring; [`partition`]: one tree of cells over all inputs;
//!    [`folding`]: untextured materials as vertex colours; [`copyright`]: notices of inputs;
//!    [`progress`], [`stages`], [`memory`], [`threads`]: where time and memory go
//! 2. [`border`]: what planes leave behind, thinned alike on both sides, and skirts; [`error`]: the
//!    distance between a node and the source; [`stitch`]: borders that touch without sharing vertices;
//!    [`scatter`]: the triangles of an input by block; [`outliers`]: what is far off
//! 3. [`simplify`]: bringing a node to its triangle budget; [`cut`]: planes, and triangles that cross them
//! 4. [`hierarchy`]: the tree of one block; [`gather`]: its triangles as one mesh
//! 5. [`emit`]: nodes as files; [`options`]
//! 6. [`plan`]: what each block is made of; [`block_setup`]: how its nodes are made; [`built`]: what they
//!    come to
//! 7. [`block_materials`]: those of all inputs of a block; [`scans`]: what is known of inputs, on disk
//! 8. [`block`]: from its triangles to its nodes; [`reuse`]: what is taken over from an earlier result
//! 9. [`sources`]: files, and tiles of large ones; [`upper`]: nodes above blocks, from the files below
//! 10. [`mod@prepare`]: an input as it is built
//! 11. [`inputs`]: looking at them; [`merge`]: shares of several machines
//! 12. [`mod@finish`]: scene, tileset and report
//! 13. `checkpoint`: what a build that is stopped leaves behind
//! 14. [`building`]: inputs one after another, and blocks when their inputs are there
//! 15. [`pipeline`]: the whole

pub mod block;
pub mod block_materials;
pub mod block_setup;
pub mod border;
pub mod building;
pub mod built;
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
pub mod threads;
pub mod upper;

pub use crate::format::Subset;
pub use options::BuildOptions;
pub use pipeline::{Outcome, build, build_subset, merge_subsets};
