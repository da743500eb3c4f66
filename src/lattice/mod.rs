//! Where coordinates may lie: the lattice of exact f32 offsets, and the coarser one of a quantised
//! build.

#[allow(clippy::module_inception)]
mod lattice;
mod quantization;

pub use lattice::Lattice;
pub use quantization::{Quantization, STEPS};
