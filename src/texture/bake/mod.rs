//! Textures for nodes that were simplified without regard to texture seams.
//!
//! Such a node has no texture coordinates. Its triangles are gathered to planar charts
//! ([`planar`]) and laid flat ([`flat`]). Tile by tile ([`tile`]), what of the original lies nearest
//! above or below each sample is drawn ([`project`]) onto the chart's triangles ([`facet`]) and gives
//! the sample its colour ([`shading`]), at the resolution of the node's level; a texel over which
//! nothing lies takes the colour of the point nearest to it ([`source`]). The charts' images then go
//! the way of all others, into an atlas with gutters.

mod baked_mesh;
mod chart_plane;
pub(super) mod classes;
mod density;
mod facet;
mod flat;
mod light_votes;
mod nearby;
mod paint;
#[cfg(test)]
mod patchwork_tests;
pub(super) mod plan;
mod planar;
pub(super) mod prepared;
mod project;
mod shading;
pub(super) mod source;
mod source_image;
#[cfg(test)]
mod tests;
mod tile;
mod wrong_colors;

pub use baked_mesh::BakedMesh;
pub use classes::BakeClasses;
pub use plan::{BakePlan, BakeReason};
