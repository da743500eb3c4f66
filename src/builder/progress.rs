//! What a build tells while it runs.

use std::path::Path;

/// Hears how far the build is; called from many threads.
pub trait Progress: Sync {
    /// An input is being read; `number` counts from 1.
    fn reading(&self, _input: &Path, _number: usize, _of: usize) {}
    /// An input that is too large to be read whole is being divided.
    fn dividing(&self, _input: &Path) {}
    /// Triangles that are known of now.
    fn found(&self, _triangles: u64) {}
    /// Source triangles whose leaves are written.
    fn built(&self, _triangles: u64) {}
    /// All nodes are written; the scene is being put in its place.
    fn finishing(&self) {}
}

/// Says nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}
