//! What can be asked of a run.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hlod::Result;
use hlod::bench::{BenchOptions, Pace, PolicyChoice, Size};
use hlod::bytes::Bytes;
use hlod::engine::FarFieldMode;
use hlod::engine::policies::{POLICIES, Settings};
use hlod::render::content::TextureFormat;
use hlod::runtime::residency::ResidencyOptions;

const RESIDENCY: ResidencyOptions = ResidencyOptions::DEFAULT;

/// A scene, a path, and all that determines a run.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// The output folder of hlod-build
    #[arg(required = true, value_name = "OUT")]
    pub scene: Option<PathBuf>,
    /// The camera path, a row for each frame: frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg
    #[arg(required = true, value_name = "PATH.csv")]
    pub path: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "bench")]
    pub out: PathBuf,
    /// `wall` draws and measures; `model` takes times from a cost model, needs no graphics adapter
    /// and gives the same log on every machine
    #[arg(long, value_enum, default_value_t = Clock::Wall)]
    pub clock: Clock,
    /// Constants that `calibrate` wrote [default: wall: measured at the start; model: built in]
    #[arg(long, value_name = "CLOCK.json")]
    pub constants: Option<PathBuf>,
    /// When the next frame begins: `recorded`, not before its time in the path; `unthrottled`, at once
    #[arg(long, value_enum, default_value_t = Pace::Recorded)]
    pub pace: Pace,
    /// Seed of the model clock's noise and stalls
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub seed: u64,
    /// Warm-up frames at the first pose, before the log begins. Image error leaves out the loading
    /// phase, two seconds at most, with or without them
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub warm_up_frames: u64,
    /// Print nothing but errors
    #[arg(long, short)]
    pub quiet: bool,

    /// c_targetTime: milliseconds that a frame may take, above 0 [default: 30]
    #[arg(long, value_name = "MS", help_heading = "Selection")]
    pub target_ms: Option<f64>,
    /// How levels of detail are chosen; `hlod-bench policies --list` describes each
    #[arg(long, value_name = "NAME", default_value = POLICIES[0].name, value_parser = POLICIES.map(|kind| kind.name), help_heading = "Selection")]
    pub policy: String,
    /// Sets a constant of the policy; may be given several times
    #[arg(long, value_name = "CONSTANT=VALUE", value_parser = parse_setting, help_heading = "Selection")]
    pub set: Vec<(String, f64)>,

    /// Whether nodes are left out that are hidden by what is drawn before them: the same images, in less
    /// time
    #[arg(long, value_enum, default_value_t = Switch::On, help_heading = "Selection")]
    pub visibility: Switch,
    /// What is drawn of what is far: `off`, the hierarchy; `cells`, the faces of the cell in which the eye is,
    /// which `hlod-build cells` makes, and elsewhere the hierarchy; `auto`, these faces where they are
    /// expected to show a view better in the time that there is
    #[arg(long, value_enum, default_value_t = FarFieldArg::Auto, help_heading = "Selection")]
    pub far_field: FarFieldArg,

    /// maxMemory: memory cap in bytes, loads in progress included; with KiB, MiB, GiB or TiB
    #[arg(long, value_name = "BYTES", default_value_t = Bytes(RESIDENCY.max_memory_bytes), help_heading = "Memory and loading")]
    pub max_memory: Bytes,
    /// Chunk of a file that is read before the most important node is determined again, in bytes
    #[arg(long, value_name = "BYTES", default_value_t = Bytes(RESIDENCY.chunk_bytes), help_heading = "Memory and loading")]
    pub chunk: Bytes,
    /// Upload limit in bytes a second; a frame always uploads one node
    #[arg(long, value_name = "BYTES", default_value_t = Bytes(RESIDENCY.upload_bytes_per_s), help_heading = "Memory and loading")]
    pub upload_rate: Bytes,
    /// Fraction by which a node's priority must be higher than that of the nodes that are evicted
    /// for it, 0 or more
    #[arg(long, value_name = "PART", default_value_t = RESIDENCY.evict_margin, help_heading = "Memory and loading")]
    pub evict_margin: f64,
    /// How textures are stored in memory: `bc7` takes a quarter of the bytes of `rgba8`, at a PSNR
    /// of some 42 dB; `auto` is bc7 on graphics cards that sample it where the scene would not fit into
    /// memory otherwise, and rgba8 elsewhere and by the model clock
    #[arg(long, value_enum, default_value_t = Textures::Auto, help_heading = "Memory and loading")]
    pub textures: Textures,

    /// Width and height of the image, 1-16384 each, in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size, help_heading = "Drawing")]
    pub size: Size,
    /// Graphics adapter: part of its name, or its number [default: the first, graphics cards before
    /// software]
    #[arg(long, value_name = "NAME", help_heading = "Drawing")]
    pub adapter: Option<String>,
    /// Write every Nth frame as PNG into DIR/snapshots, N 1 or more
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Drawing")]
    pub snapshots: Option<u64>,
    /// Draw every Nth frame from the leaves as well, excluded from its time, and log the image error:
    /// FLIP, PSNR, SSIM, gaps, and the pop where levels toggled. N 1 or more
    #[arg(long, value_name = "N", conflicts_with = "show_levels", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Drawing")]
    pub reference_every: Option<u64>,
    /// Draw the frames before and after every toggle, and every change of cell, as well
    #[arg(long, requires = "reference_every", help_heading = "Drawing")]
    pub pops: bool,
    /// Pixels that an outline may be off before background inside of it counts as a gap, 0 or more
    #[arg(long, value_name = "PIXELS", default_value_t = 2.0, value_parser = parse_not_negative, help_heading = "Drawing")]
    pub gap_tolerance: f64,
    /// Most pixels that the geometric errors of the nodes drawn there add to it, 0 or more
    #[arg(long, value_name = "PIXELS", default_value_t = 8.0, value_parser = parse_not_negative, help_heading = "Drawing")]
    pub gap_error: f64,
    /// Tint nodes by level
    #[arg(long, help_heading = "Drawing")]
    pub show_levels: bool,
    /// `photo`: textures unlit, the rest lit from above and one side of the scene; `head-light`: lit from
    /// behind the viewer; `unlit`
    #[arg(long, value_enum, default_value_t = ShadingArg::Photo, help_heading = "Drawing")]
    pub shading: ShadingArg,
    /// Cull back faces of materials that are not double-sided
    #[arg(long, help_heading = "Drawing")]
    pub cull: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Clock {
    Wall,
    Model,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    On,
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Textures {
    Auto,
    Rgba8,
    Bc7,
}

impl Textures {
    /// The format that was asked for by name.
    pub fn format(self) -> Option<TextureFormat> {
        match self {
            Self::Auto => None,
            Self::Rgba8 => Some(TextureFormat::Rgba8),
            Self::Bc7 => Some(TextureFormat::Bc7),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShadingArg {
    Photo,
    HeadLight,
    Unlit,
}

fn parse_not_negative(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number >= 0.0 && number.is_finite() => Ok(number),
        _ => Err("expected a number of 0 or more".into()),
    }
}

pub fn parse_size(text: &str) -> std::result::Result<Size, String> {
    let wanted = "expected width and height in pixels, such as 1280x720";
    let (width, height) = text.split_once('x').ok_or(wanted)?;
    let side = |text: &str| match text.parse::<u32>() {
        Ok(side @ 1..=16384) => Ok(side),
        _ => Err(wanted),
    };
    Ok(Size([side(width)?, side(height)?]))
}

fn parse_setting(text: &str) -> std::result::Result<(String, f64), String> {
    let wanted = "expected the name of a constant and a number, such as hyst_switch=50";
    let (name, value) = text.split_once('=').ok_or(wanted)?;
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((name.trim().replace('-', "_"), value)),
        _ => Err(wanted.into()),
    }
}

/// What is drawn of what is far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FarFieldArg {
    Off,
    Cells,
    Auto,
}

impl From<FarFieldArg> for FarFieldMode {
    fn from(mode: FarFieldArg) -> Self {
        match mode {
            FarFieldArg::Off => Self::Off,
            FarFieldArg::Cells => Self::Cells,
            FarFieldArg::Auto => Self::Auto,
        }
    }
}

impl RunArgs {
    pub fn options(&self) -> Result<BenchOptions> {
        let settings: Settings = self.set.iter().cloned().collect();
        Ok(BenchOptions {
            target_ms: self.target_ms.unwrap_or(BenchOptions::TARGET_MS),
            policy: PolicyChoice::new(&self.policy, &settings)?,
            residency: ResidencyOptions {
                max_memory_bytes: self.max_memory.0,
                chunk_bytes: self.chunk.0,
                upload_bytes_per_s: self.upload_rate.0,
                evict_margin: self.evict_margin,
            },
            pace: self.pace,
            size: self.size,
            warm_up_frames: self.warm_up_frames,
            cull_hidden: self.visibility == Switch::On,
            far_field: self.far_field.into(),
            textures: self.textures.format().unwrap_or_default(),
            seed: self.seed,
        })
    }
}
