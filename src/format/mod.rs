//! What stands in `out/`: the whole contract between the build side and the run side.

mod node_mesh;

pub use node_mesh::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
