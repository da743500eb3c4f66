//! The engine at run time, without files, threads of its own, or a graphics card: which nodes a
//! frame draws ([`Policy`]) and which are in memory ([`residency`]).
//!
//! Time enters as an argument, so that a run can be replayed exactly.

mod covered;
mod front_before;
pub mod lakhia;
mod policy;
pub mod residency;
#[cfg(test)]
pub(crate) mod test_tree;
mod toggles;
mod tree;

pub use covered::{Covered, covered};
pub use front_before::front_before;
pub use policy::{FrameOutcome, Policy, Residents, Selection};
pub use toggles::{ToggleCounter, Toggles};
pub use tree::{SceneTree, TreeNode};
