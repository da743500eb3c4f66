//! Nodes as files.

pub mod disk_sink;
pub mod forest;
pub mod shared_textures;
