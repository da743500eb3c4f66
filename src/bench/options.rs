//! All that determines a run, beside scene and path.

use serde::Serialize;

use crate::runtime::lakhia::LakhiaOptions;
use crate::runtime::residency::ResidencyOptions;

/// All that determines a run, beside scene and path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BenchOptions {
    /// How levels are chosen.
    pub selection: LakhiaOptions,
    /// Memory and loading.
    pub residency: ResidencyOptions,
    /// How fast frames follow each other.
    pub pace: Pace,
    /// Width and height of the picture, pixels.
    pub size: Size,
    /// Frames for which the camera stands at the first pose before the log begins.
    pub settle_frames: u64,
}

/// Width and height of the picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Size(pub [u32; 2]);

impl Default for Size {
    fn default() -> Self {
        Self([1280, 720])
    }
}

/// How fast frames follow each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Pace {
    /// As the path was recorded, or as fast as frames are drawn where that is slower: loading has
    /// the time that it would have had.
    #[default]
    Recorded,
    /// One right after the other.
    Unthrottled,
}
