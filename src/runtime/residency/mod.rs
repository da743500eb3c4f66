//! Which nodes are in memory (thesis, section 4.3): what is loaded next, what is evicted for it,
//! and a cap that is never exceeded. No files and no threads: whoever loads asks what to read and
//! tells what was read.

mod cap;
#[cfg(test)]
mod cap_tests;
mod eviction;
mod list;
mod manager;
mod memory_budget;
mod options;
mod recent_priority;
mod sizes;
mod state;
#[cfg(test)]
mod tests;

pub use list::PriorityList;
pub use manager::{Changes, Step};
pub use options::ResidencyOptions;
pub use sizes::{NodeSize, Sizes, TextureSize};
pub use state::{Counters, MemoryUse, NodeState, Residency};
