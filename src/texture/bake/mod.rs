//! Textures for nodes that were simplified without regard to texture seams.
//!
//! Such a node has no texture coordinates. Its triangles are gathered to planar charts
//! ([`planar`]), laid flat ([`flat`]), and each texel takes the colour of the point of the
//! original that is nearest to it ([`source`]), at the resolution of the node's level. The charts'
//! images then go the way of all others, into an atlas with gutters.

mod baked_mesh;
pub(super) mod classes;
mod flat;
mod paint;
pub(super) mod plan;
mod planar;
pub(super) mod source;
#[cfg(test)]
mod tests;

pub use baked_mesh::BakedMesh;
pub use classes::BakeClasses;
pub use plan::{BakePlan, BakeReason, Seams};
