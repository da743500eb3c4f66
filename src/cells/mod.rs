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
mod places;
#[cfg(feature = "render")]
mod prepare;

pub use options::{Balance, CellOptions};
pub use places::{along, around};
#[cfg(feature = "render")]
pub use prepare::{Prepared, Progress, prepare};
