//! Hierarchies of levels of detail (HLOD) for city meshes too large to draw.
//!
//! Conventions: metres and seconds unless a name says otherwise (`_ms`, `_bytes`); right-handed
//! axes, counter-clockwise front faces; input axes are kept and which axis is up is recorded.
//! Source coordinates are f64 until a block gives them an f64 origin and f32 offsets.
//! The library neither prints nor exits nor panics on input; only the programs do.
//!
//! Layers: a module uses those of the layers above it in this list alone, which a test checks.
//!
//! 1. [`error`], [`bytes`], [`color`], [`random`], [`stage_timer`]: what all may use
//! 2. [`mesh`]: what the build side works on; [`city`]: generated cities; [`picture_error`]: FLIP
//! 3. [`format`](mod@format): files of a result; [`lattice`]: rounded positions; [`place`]: the globe
//! 4. `side_file`: files that inputs name; [`camera`]: paths; [`tileset`]: 3D Tiles
//! 5. [`decode`]: images; [`runtime`]: scenes in memory; [`render`]: drawing
//! 6. [`import`]: OBJ and glTF; [`texture`]: atlases and baking; [`engine`]: what to draw
//! 7. [`report`]: how a result was made; [`loading`]: nodes on their way into memory
//! 8. [`builder`]: from inputs to a result; [`bench`](mod@bench): replaying paths
//! 9. [`cells`]: faces of what is far off
//! 10. [`verify`]: checking a result

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
#[cfg(test)]
mod layers;
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
