//! Cells where viewers can be, and textured depth meshes of what is far from them: the MMR system of
//! Aliaga and others, 1999, over a hierarchy.
//!
//! [`prepare`] draws, for each cell, what is outside of its cull box, makes faces of the pictures, and
//! writes them with their index ([`crate::format::cells`]). The engine draws faces in the place of what they
//! show: [`FarField`](crate::engine::FarField).

#[cfg(feature = "render")]
mod cull_box;
#[cfg(feature = "render")]
mod face;
mod options;
#[cfg(feature = "render")]
mod other_corners;
mod places;
#[cfg(feature = "render")]
mod prepare;
mod seen_faces;

pub use options::{Balance, CellOptions};
#[cfg(feature = "render")]
pub use other_corners::seen_from_other_corners;
pub use places::{along, around};
#[cfg(feature = "render")]
pub use prepare::{Prepared, Progress, prepare};
pub use seen_faces::SeenFaces;
