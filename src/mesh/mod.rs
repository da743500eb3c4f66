//! What the build side works on: imported [`Model`]s, [`Material`]s, and the [`Mesh`] of one piece.

mod coordinate;
mod material;
mod model;
mod piece;
mod polygon;
mod runs;
mod surface;

pub use coordinate::{Coordinate, Key, PositionKey, color_key, key, texcoord_key, wide};
pub use material::{AlphaMode, Material, TextureData, TextureSource, Wrap};
pub use model::{Group, Model, Part, UpAxis, Warnings};
pub use piece::Mesh;
pub(crate) use piece::all_differ;
pub(crate) use polygon::Triangulator;
pub(crate) use runs::Runs;
pub(crate) use surface::Surface;
