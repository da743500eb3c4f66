//! Hierarchies of levels of detail (HLOD) for city meshes too large to draw.
//!
//! Conventions: metres and seconds unless a name says otherwise (`_ms`, `_bytes`); right-handed
//! axes, counter-clockwise front faces; input axes are kept and which axis is up is recorded.
//! Source coordinates are f64 until a block gives them an f64 origin and f32 offsets.
//! The library neither prints nor exits nor panics on input; only the programs do.

pub mod bench;
pub mod builder;
pub mod bytes;
pub mod camera;
pub mod cells;
pub mod city;
pub mod color;
pub mod decode;
pub mod engine;
pub mod error;
pub mod format;
pub mod import;
pub mod lattice;
pub mod loading;
pub mod mesh;
pub mod picture_error;
pub mod place;
pub mod random;
pub mod render;
pub mod report;
pub mod runtime;
#[cfg(test)]
mod scaling;
mod side_file;
pub mod stage_timer;
pub mod texture;
pub mod tileset;
pub mod verify;

pub use error::{Error, Result};
