//! From imported models to nodes on disk: blocks, cutting planes, simplification, attributes.

pub mod attributes;
pub mod blocks;
pub mod border;
pub mod chain;
pub mod cluster;
pub mod compact;
pub mod cut;
pub mod distance;
pub mod gather;
pub mod hierarchy;
pub mod lattice;
pub mod merge;
pub mod options;
pub mod progress;
pub mod simplify;
pub mod skirt;
pub mod stages;
pub mod thin_border;
