//! All that determines a run, beside scene and path.

use serde::Serialize;

use crate::engine::policies::lakhia::LakhiaOptions;
use crate::runtime::residency::ResidencyOptions;
use crate::{Error, Result};

/// All that determines a run, beside scene and path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BenchOptions {
    /// Milliseconds that a frame may take (`c_targetTime`), above 0.
    pub target_ms: f64,
    /// How levels are chosen.
    pub selection: LakhiaOptions,
    /// Memory and loading.
    pub residency: ResidencyOptions,
    /// How fast frames follow each other.
    pub pace: Pace,
    /// Width and height of the picture, pixels.
    pub size: Size,
    /// Frames for which the camera stands at the first pose before the log begins.
    pub warm_up_frames: u64,
}

impl Default for BenchOptions {
    fn default() -> Self {
        Self {
            target_ms: Self::TARGET_MS,
            selection: LakhiaOptions::DEFAULT,
            residency: ResidencyOptions::DEFAULT,
            pace: Pace::default(),
            size: Size::default(),
            warm_up_frames: 0,
        }
    }
}

impl BenchOptions {
    /// What a frame may take unless that is said.
    pub const TARGET_MS: f64 = 30.0;

    /// Refuses what is out of range, by the name of the option.
    pub fn check(&self) -> Result<()> {
        let selection = &self.selection;
        let ranges = [
            ("--target-ms", self.target_ms, self.target_ms > 0.0, "above 0"),
            ("--vis", selection.vis, selection.vis >= 0.0, "at least 0"),
            ("--fore", selection.fore, (0.0..=1.0).contains(&selection.fore), "0 to 1"),
            ("--hyst-switch", selection.hyst_switch, selection.hyst_switch > 0.0, "above 0"),
            (
                "--hyst-limit",
                selection.hyst_limit,
                selection.hyst_limit >= selection.hyst_switch,
                "at least --hyst-switch",
            ),
            ("--lookahead", selection.lookahead_s, selection.lookahead_s >= 0.0, "at least 0"),
            (
                "--least-distance",
                selection.least_distance,
                selection.least_distance > 0.0,
                "above 0",
            ),
            (
                "--v-time-gain",
                selection.v_time_gain,
                (0.0..=1.0).contains(&selection.v_time_gain),
                "0 to 1",
            ),
            (
                "--share-gain",
                selection.share_gain,
                (0.0..1.0).contains(&selection.share_gain),
                "0 to 1, 1 excluded",
            ),
            ("--share-limit", selection.share_limit, selection.share_limit >= 1.0, "at least 1"),
            ("--share-slack", selection.share_slack, selection.share_slack >= 0.0, "at least 0"),
            (
                "--evict-margin",
                self.residency.evict_margin,
                self.residency.evict_margin >= 0.0,
                "at least 0",
            ),
        ];
        if let Some((name, value, _, range)) =
            ranges.iter().find(|(_, value, fits, _)| !(*fits && value.is_finite()))
        {
            return Err(Error::Usage(format!("{name}: expected {range}, found {value}")));
        }
        if self.residency.chunk_bytes == 0 {
            return Err(Error::Usage("--chunk: expected at least 1 byte, found 0".into()));
        }
        Ok(())
    }
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
