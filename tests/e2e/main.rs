//! End to end: models in, `out/` read back, as a user of the program or of the library would.
//!
//! One test program with a module for each promise, so that the library is linked once.

#[path = "../common/tiles.rs"]
mod cut_into_tiles;
mod support;

mod cli;
mod crash;
mod determinism;
mod encodings;
mod forest;
mod gltf_inputs;
mod golden;
mod groups;
mod houses;
mod incremental;
mod left_out;
mod level_colors;
mod memory;
mod normals;
mod output;
mod paths;
mod quantize;
mod real_data;
mod seams;
mod soups;
mod stored_errors;
mod subsets;
mod suburb;
mod tiles;
mod tileset;
mod touching;
mod upper_nodes;
mod verify;
mod verify_surface;
