//! Brings nodes from files into memory: [`NodeFiles`] reads and decodes them, [`LoadingThreads`]
//! do so beside the thread that draws, in the order that
//! [`Residency`](crate::runtime::residency::Residency) asks for.

mod background;
mod node_files;
mod threads;

pub use node_files::{Arrival, NodeFiles, Reading};
pub use threads::{LoadingThreads, PauseGuard};
