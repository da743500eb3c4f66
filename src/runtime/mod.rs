//! What policies and the engine rest on, without files, threads of its own, or a graphics card: the
//! tree as selection needs it, and which nodes are in memory ([`residency`]).
//!
//! Time enters as an argument, so that a run can be replayed exactly.

mod front_before;
pub mod residency;
#[cfg(test)]
pub(crate) mod test_tree;
mod toggles;
mod tree;

pub use front_before::front_before;
pub use toggles::{ToggleCounter, Toggles};
pub use tree::{SceneTree, TreeNode};
