//! Which nodes are in memory (thesis, section 4.3): what is loaded next, what makes room for it,
//! and a cap that is never exceeded. No files and no threads: whoever loads asks what to read and
//! tells what was read.

mod ledger;
mod list;
mod manager;
mod options;
mod room;
mod sizes;
mod state;
#[cfg(test)]
mod tests;
mod worth;

pub use list::PriorityList;
pub use manager::{Changes, Step};
pub use options::ResidencyOptions;
pub use sizes::{NodeSize, Sizes, TextureSize};
pub use state::{Counters, NodeState, Residency};
