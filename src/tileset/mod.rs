//! The scene as an OGC 3D Tiles 1.1 tileset over the same node files, so that `out/` opens in any
//! viewer that reads 3D Tiles.
//!
//! | file | what it does |
//! |---|---|
//! | `tile` | tiles in memory, and boxes that enclose all below |
//! | `regions` | one root over all blocks, with regions of neighbours between |
//! | `placed` | transforms from source coordinates to the Earth |
//! | `files` | division into files, and their JSON |
//! | `walk`, `rules` | checks what stands on the disk against the specification's rules |
//!
//! Tiles have the source's coordinates, turned to Z up where the source has Y up: a viewer turns
//! glTF's Y up to Z up, and each node's file turns the source to glTF's axes. Where the city has a
//! place on the Earth, the root's transform takes these coordinates there. A map projection is not
//! affine, so blocks, and pieces of large blocks, have small transforms of their own.

mod files;
mod first_view;
mod placed;
mod regions;
mod rules;
#[cfg(test)]
mod tests;
mod tile;
mod walk;

pub use files::{MOST_TILES, TilesetFile, files};
pub use first_view::FirstView;
pub use rules::{Checked, Fault, check};

/// The version of 3D Tiles that is written.
pub const VERSION: &str = "1.1";
