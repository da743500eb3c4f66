//! Textures of nodes: the source's texels that a node's triangles use, at the node's resolution,
//! and no others.
//!
//! [`TexturePlan`] decides for each texture of an input whether it is cut up or, as it repeats,
//! kept whole. [`TextureCache`] decodes each image once. [`BlockTextures`] scales what a block
//! uses for every level, in linear light and without mixing in texels that nothing uses; its
//! [`node_mesh`](BlockTextures::node_mesh) copies what a node uses into an atlas of its own.
//! [`SharedTextures`] keeps the repeating ones, once for each resolution.
//!
//! Texel `(x, y)` covers `x..x + 1`, `y..y + 1` of an image; a texture coordinate times the
//! image's size is a position in it. Bilinear filtering at a position reads the texels whose
//! centre is less than one texel away.

mod atlas;
mod bake;
mod bits;
mod block;
mod cache;
mod charts;
pub(crate) mod encode;
mod face_normals;
#[cfg(feature = "render")]
mod face_picture;
mod fill;
mod islands;
mod level;
mod node;
mod open_page;
mod pack;
mod packing;
mod placement;
mod plan;
mod primitives;
mod raster;
mod region;
mod sampler;
mod scale;
mod shape;
mod shared;
mod split;
#[cfg(test)]
mod tests;
mod tiles;
mod wrapped_page;

pub use bake::{BakeClasses, BakePlan, BakeReason, BakedMesh};
pub use block::{BlockTextures, TextureOptions, texture_factors};
pub use cache::{Announced, DecodedImages, TextureCache};
#[cfg(feature = "render")]
pub(crate) use face_picture::{FacePicture, Patch, face_picture};
pub use node::{AppendedSkirts, TexturedNode};
pub use plan::{TexturePlan, TextureUsage, TextureUse};
pub use shared::{SharedFile, SharedTextures};
