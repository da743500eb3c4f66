//! Dividing an input into blocks, and bringing the geometry of each together.

pub mod block_plan;
pub mod gather;
pub mod merge_adjacent;
pub mod merge_untextured;
pub mod outliers;
pub mod plan;
