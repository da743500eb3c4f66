//! Textures for nodes that were simplified without regard to texture seams.
//!
//! Such a node has no texture coordinates. Its triangles are gathered to planar charts
//! ([`planar`]), laid flat ([`flat`]), and each texel takes the colour of what of the original lies
//! nearest above or below it ([`project`]), or where nothing does, of the point nearest to it
//! ([`source`]), at the resolution of the node's level. The charts' images then go the way of all
//! others, into an atlas with gutters.

mod baked_mesh;
pub(super) mod classes;
mod flat;
mod paint;
pub(super) mod plan;
mod planar;
mod project;
pub(super) mod source;
#[cfg(test)]
mod tests;

pub use baked_mesh::BakedMesh;
pub use classes::BakeClasses;
pub use plan::{BakePlan, BakeReason, Seams};
