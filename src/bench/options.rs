//! All that determines a run, beside scene and path.

use serde::Serialize;

use crate::engine::policies::{POLICIES, PolicyKind, Settings};
use crate::engine::{FarFieldMode, Policy};
use crate::render::content::TextureFormat;
use crate::runtime::residency::ResidencyOptions;
use crate::{Error, Result};

/// All that determines a run, beside scene and path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchOptions {
    /// Milliseconds that a frame may take (`c_targetTime`), above 0.
    pub target_ms: f64,
    /// How levels are chosen.
    pub policy: PolicyChoice,
    /// Memory and loading.
    pub residency: ResidencyOptions,
    /// How fast frames follow each other.
    pub pace: Pace,
    /// Width and height of the picture, pixels.
    pub size: Size,
    /// Frames for which the camera stands at the first pose before the log begins.
    pub warm_up_frames: u64,
    /// Whether what is hidden by what is before it is left out.
    pub cull_hidden: bool,
    /// What is drawn of what is far.
    // Left away where it is the hierarchy, so that summaries of before can be compared.
    #[serde(skip_serializing_if = "is_off")]
    pub far_field: FarFieldMode,
    /// How textures are stored, as far as they [can be](TextureFormat::of_picture); memory is counted
    /// so, drawn or not. RGBA8.
    pub textures: TextureFormat,
    /// Seed of the model clock's noise and stalls.
    pub seed: u64,
}

fn is_off(mode: &FarFieldMode) -> bool {
    *mode == FarFieldMode::Off
}

impl Default for BenchOptions {
    fn default() -> Self {
        Self {
            target_ms: Self::TARGET_MS,
            policy: PolicyChoice::default(),
            residency: ResidencyOptions::DEFAULT,
            pace: Pace::default(),
            size: Size::default(),
            warm_up_frames: 0,
            cull_hidden: true,
            far_field: FarFieldMode::Off,
            textures: TextureFormat::Rgba8,
            seed: 0,
        }
    }
}

impl BenchOptions {
    /// What a frame may take unless that is said.
    pub const TARGET_MS: f64 = 30.0;

    /// Refuses what is out of range, by the name of the option.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("--target-ms", self.target_ms, self.target_ms > 0.0, "above 0"),
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

/// A policy, by its name, with all of its constants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolicyChoice {
    name: &'static str,
    constants: Settings,
}

impl PolicyChoice {
    /// A policy with some constants set; refuses names and values that there are not.
    pub fn new(name: &str, settings: &Settings) -> Result<Self> {
        let kind = PolicyKind::find(name)?;
        kind.make(settings)?;
        Ok(Self { name: kind.name, constants: kind.values(settings) })
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The policy, before its first frame.
    pub fn make(&self) -> Result<Box<dyn Policy>> {
        PolicyKind::find(self.name)?.make(&self.constants)
    }
}

impl Default for PolicyChoice {
    /// The first of the table.
    fn default() -> Self {
        let kind = POLICIES[0];
        Self { name: kind.name, constants: kind.values(&Settings::new()) }
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
