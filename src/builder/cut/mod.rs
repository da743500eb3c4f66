//! Cutting at planes: where, and what becomes of the triangles that cross.

pub mod cell;
#[cfg(test)]
mod cell_tests;
pub mod face;
pub mod mark;
pub mod plane;
pub mod record;
pub mod section;
pub mod split;
pub mod uncut;
