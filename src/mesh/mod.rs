//! What the build side works on: imported [`Model`]s, [`Material`]s, and the [`Mesh`] of a block, a
//! chunk or a node.

pub mod box_tree;
mod coordinate;
mod disjoint_set;
mod ears;
mod material;
mod model;
mod normal;
mod oriented_box;
mod outline;
mod part_normals;
mod polygon;
mod renumber;
mod surface;
mod triangle_mesh;
mod up_evidence;
mod vertex_normals;

pub use coordinate::{Coordinate, Key, PositionKey, color_key, key, texcoord_key, wide};
pub(crate) use disjoint_set::DisjointSet;
pub use material::{AlphaMode, Material, TextureData, TextureSource, Wrap};
pub use model::{Group, Model, Part, UpAxis, Warnings};
pub use normal::Normal;
pub(crate) use oriented_box::OrientedBox;
pub use outline::{Outline, OutlineCoverage, OutlineFrame};
pub(crate) use polygon::Triangulator;
pub use renumber::renumber;
pub(crate) use surface::Surface;
pub use triangle_mesh::Mesh;
pub(crate) use triangle_mesh::all_differ;
pub use up_evidence::{UpEvidence, UpGuess};
pub(crate) use vertex_normals::{SAME_NORMAL, VertexNormals};
