//! From imported models to nodes on disk: blocks, cutting planes, simplification, attributes.

mod aggregate;
pub mod attributes;
pub mod block;
pub mod blocks;
pub mod border;
pub mod border_run;
pub mod chain;
pub mod cluster;
pub mod compact;
pub mod cut;
pub mod disk_sink;
pub mod distance;
pub mod fold_untextured;
pub mod forest;
pub mod gather;
pub mod hierarchy;
pub mod inputs;
pub mod lattice;
pub mod memory;
pub mod mend_materials;
pub mod merge;
pub mod options;
pub mod pipeline;
pub mod progress;
pub mod remnant;
pub mod reuse;
pub mod seamless;
pub mod shared_borders;
pub mod simplify;
pub mod skirt;
pub mod stages;
pub mod stray;
pub mod thin_border;
pub mod up;

pub use options::BuildOptions;
pub use pipeline::{Outcome, build};
