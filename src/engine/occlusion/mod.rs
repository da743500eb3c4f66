//! What hides what, found on the processor: coarse geometry drawn into a small picture of depths.

mod depth_picture;
mod occluders;
mod seen_areas;

pub use occluders::Occluders;
pub use seen_areas::SeenAreas;
