//! A cutting plane leaves a border behind, which both sides thin alike, and skirts.

pub mod chain;
pub(crate) mod cover;
pub mod rank;
pub mod skirt;
pub mod skirt_rules;
pub mod slit;
pub mod span;
pub mod thin;
pub mod vertex;
