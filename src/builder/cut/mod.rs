//! Cutting at planes: where, and what becomes of the triangles that cross.

pub mod plane;
pub mod split;
pub mod uncut;
