//! Cells where viewers can be, and textured depth meshes of what is far from them: the MMR system of
//! Aliaga and others, 1999, over a hierarchy.

pub mod depths;
pub mod parallax_mesh;
pub mod parallax_simplify;

pub use depths::Depths;
pub use parallax_mesh::ParallaxMesh;
