//! What a cutting plane leaves behind: a border that both sides thin alike, skirts and caps.

pub mod cap;
pub mod chain;
pub(crate) mod cover;
pub mod face;
pub mod mark;
pub mod rank;
pub mod record;
pub mod skirt;
pub mod skirt_rules;
pub mod slit;
pub mod span;
pub mod thin;
pub mod vertex;
