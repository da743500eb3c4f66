//! Bringing a node to its triangle budget.

pub(crate) mod aggregate;
pub mod cap;
pub mod cards;
pub mod cluster;
pub mod collapse;
pub mod compact;
pub mod face_colors;
pub mod fallback;
mod far_parts;
pub mod ladder;
pub mod merge;
mod morton;
pub mod normal_sets;
mod one_sheet;
pub mod orient;
mod parts;
pub mod simplified;
pub mod split_mixed;
#[cfg(test)]
mod test_box;
pub mod weld_seams;

pub use self::aggregate::{ComponentRules, Extrudable};
