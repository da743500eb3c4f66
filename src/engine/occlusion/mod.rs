//! What hides what, found on the processor.
//!
//! Two answers to two questions. How much of a node is seen, which need only be about right, is found
//! from coarse surfaces in a small picture of depths ([`SeenAreas`]). Which nodes need not
//! be drawn, of which no pixel may be wrong, is found from flat pieces of what is drawn
//! ([`HiddenNodes`]).

mod depth_picture;
mod find_slabs;
mod hidden_nodes;
mod hiding_picture;
mod node_occlusion;
mod occluders;
mod pieces;
mod rectangles;
mod seen_areas;
mod slab;
mod surface;
#[cfg(test)]
mod test_mesh;

pub use hidden_nodes::HiddenNodes;
pub use node_occlusion::NodeOcclusion;
pub use occluders::Occluders;
pub use seen_areas::{NodeScale, SeenAreas};
#[cfg(test)]
pub(in crate::engine) use test_mesh::{seen_past, test_wall};
