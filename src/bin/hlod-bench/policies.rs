//! `hlod-bench policies`: all policies along the same paths.

use std::path::PathBuf;

use clap::Args;
use hlod::Result;
use hlod::bench::policies::{Inspected, PoliciesPlan, PoliciesTable, PolicyRun};
use hlod::bench::{
    BenchOptions, ClockConstants, FrameInspector, FrameRecord, Session, Size, check_output,
    check_outside_scene,
};
use hlod::camera::{self, DEFAULT_FPS, Ground, PathKind};
use hlod::engine::policies::POLICIES;
use hlod::runtime::residency::ResidencyOptions;

use super::progress::Progress;
use super::run_args::{Switch, parse_size};
use super::{print, unusable};
use hlod::bytes::Bytes;

/// Noise of a frame's time and stalls, where no constants are given: those of a desktop machine
/// that does other things too.
const NOISE: f64 = 0.045;
const STALLS_PER_S: f64 = 0.1;
const STALL_MS: f64 = 15.0;

#[derive(Args, Clone, Debug)]
pub struct PoliciesArgs {
    /// Output folders of hlod-build
    #[arg(value_name = "OUT", required_unless_present = "list")]
    scenes: Vec<PathBuf>,
    /// Describe the policies and their constants, and run none
    #[arg(long)]
    list: bool,
    /// Folder for policies.csv, policies.json and policies.html
    #[arg(long, value_name = "DIR", default_value = "policies")]
    out: PathBuf,
    /// Which policies [default: all]
    #[arg(long = "policy", value_name = "NAME,NAME", value_delimiter = ',', value_parser = POLICIES.map(|kind| kind.name))]
    policies: Vec<String>,
    /// Run each policy with the cells of the scenes as well: rows `with cells`
    #[arg(long)]
    with_cells: bool,
    /// Which paths
    #[arg(
        long,
        value_name = "KIND,KIND",
        value_delimiter = ',',
        default_value = "walk,fly,rise,turn"
    )]
    paths: Vec<PathKind>,
    /// Seeds of routes, noise and stalls: 0 up to this many, 1 or more
    #[arg(long, value_name = "N", default_value_t = 3)]
    seeds: u64,
    /// Frame-time targets in milliseconds, above 0
    #[arg(long, value_name = "MS,MS", value_delimiter = ',', default_value = "5,10,20,30,60")]
    targets: Vec<f64>,
    /// Frames of a path
    #[arg(long, value_name = "N", default_value_t = 900)]
    frames: usize,
    /// Warm-up frames at the first pose, before the log begins
    #[arg(long, value_name = "N", default_value_t = 300)]
    warm_up_frames: u64,
    /// Draw every Nth frame and the same view of the leaves, for FLIP; 0: draw nothing
    #[arg(long, value_name = "N", default_value_t = 300)]
    reference_every: u64,
    /// Draw the frames before and after every toggle as well, for the sum of all pops
    #[arg(long)]
    pops: bool,
    /// Whether nodes are left out that are hidden by what is drawn before them
    #[arg(long, value_enum, default_value_t = Switch::On)]
    visibility: Switch,
    /// Constants of the model clock that `calibrate` wrote [default: lavapipe's, with noise]
    #[arg(long, value_name = "CLOCK.json")]
    constants: Option<PathBuf>,
    /// Memory cap in bytes, loads in progress included; with KiB, MiB, GiB or TiB
    #[arg(long, value_name = "BYTES", default_value_t = Bytes(ResidencyOptions::DEFAULT.max_memory_bytes))]
    max_memory: Bytes,
    /// Width and height of the image, 1-16384 each, in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: Size,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Describes the policies.
fn list() -> Result<()> {
    let mut text = String::new();
    for (at, kind) in POLICIES.iter().enumerate() {
        let default = if at == 0 { " (default)" } else { "" };
        text += &format!("{}{default}\n  {}\n  from: {}\n", kind.name, kind.summary, kind.source);
        for parameter in kind.parameters() {
            let [least, most] = parameter.range;
            text += &format!(
                "  --set {}={}  {}; {least} to {most}\n",
                parameter.name, parameter.default, parameter.help
            );
        }
        text.push('\n');
    }
    print(&text)
}

pub fn policies(arguments: &PoliciesArgs) -> Result<()> {
    if arguments.list {
        return list();
    }
    let plan = plan(arguments);
    plan.check()?;
    check_output(&arguments.out)?;
    for scene in &arguments.scenes {
        check_outside_scene(&arguments.out, scene)?;
    }
    let clock = match &arguments.constants {
        Some(path) => ClockConstants::read(path)?,
        None => ClockConstants {
            noise: NOISE,
            stalls_per_s: STALLS_PER_S,
            stall_ms: STALL_MS,
            ..ClockConstants::default()
        },
    };
    let runs = plan.runs().len() * arguments.scenes.len();
    let steps = (runs * plan.frames) as u64;
    let progress = Progress::new(arguments.quiet, steps, "reading the first scene");
    let mut run_number = 0;
    let mut first_unusable = None;
    let mut table = PoliciesTable::default();
    for dir in &arguments.scenes {
        let mut session = Session::open(dir)?;
        if plan.with_cells {
            session.read_cells()?;
        }
        let ground = Ground::read(session.scene(), dir)?;
        let name = dir
            .file_name()
            .map_or_else(|| dir.display().to_string(), |name| name.to_string_lossy().into_owned());
        let mut of_scene = Vec::new();
        let mut reference = reference(arguments, &session)?;
        for key in plan.runs() {
            run_number += 1;
            let path = camera::make_path(&ground, key.path, plan.frames, DEFAULT_FPS, key.seed)?;
            let (options, clock) = plan.settings(&key, &clock)?;
            let inspector = reference.as_mut().map(|at| at as &mut dyn FrameInspector);
            let message =
                || format!("run {run_number} of {runs}: {name}, {:?}, {}", key.path, key.policy);
            let frame = |_: &FrameRecord| {
                progress.advance(1, message);
                true
            };
            let (run, context) = session.run_model(&path, options, clock, inspector, frame)?;
            first_unusable = first_unusable.or(unusable(dir, &context.broken));
            of_scene.push(PolicyRun::new(&name, key, &run, arguments.inspected()));
        }
        table.add(of_scene);
    }
    drop(progress);
    let files = table.write(&arguments.out)?;
    if !arguments.quiet {
        let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        print(&format!("{}written: {}\n", table.text(), files.join(", ")))?;
    }
    first_unusable.map_or(Ok(()), Err)
}

fn plan(arguments: &PoliciesArgs) -> PoliciesPlan {
    let all = || POLICIES.iter().map(|kind| kind.name.to_owned()).collect();
    let policies = &arguments.policies;
    PoliciesPlan {
        policies: if policies.is_empty() { all() } else { policies.clone() },
        with_cells: arguments.with_cells,
        paths: arguments.paths.clone(),
        seeds: arguments.seeds,
        targets_ms: arguments.targets.clone(),
        frames: arguments.frames,
        warm_up_frames: arguments.warm_up_frames,
        options: BenchOptions {
            residency: ResidencyOptions {
                max_memory_bytes: arguments.max_memory.0,
                ..ResidencyOptions::DEFAULT
            },
            size: arguments.size,
            cull_hidden: arguments.visibility == Switch::On,
            ..BenchOptions::default()
        },
    }
}

impl PoliciesArgs {
    fn inspected(&self) -> Inspected {
        Inspected { every: self.reference_every as usize, every_toggle: self.pops }
    }
}

/// What draws the leaves of a scene, where that is asked for.
#[cfg(feature = "render")]
fn reference(
    arguments: &PoliciesArgs,
    session: &Session,
) -> Result<Option<hlod::bench::Reference>> {
    use hlod::bench::{Reference, SilhouetteTolerance};
    use hlod::render::{RenderOptions, Side};
    if arguments.reference_every == 0 {
        return Ok(None);
    }
    let tolerance = SilhouetteTolerance { pixels: 2.0, most_error_pixels: 8.0 };
    let cut = arguments.with_cells.then_some(Side::Inside);
    let render = RenderOptions { size: arguments.size.0, cut, ..RenderOptions::default() };
    let reference = Reference::new(session, &render, arguments.reference_every, tolerance)?;
    Ok(Some(if arguments.pops { reference.with_every_toggle() } else { reference }))
}

#[cfg(not(feature = "render"))]
fn reference(arguments: &PoliciesArgs, _: &Session) -> Result<Option<NoReference>> {
    match arguments.reference_every {
        0 => Ok(None),
        _ => Err(hlod::Error::NoAdapter(
            "this hlod-bench was compiled without drawing; use --reference-every 0".into(),
        )),
    }
}

/// There is none without drawing.
#[cfg(not(feature = "render"))]
enum NoReference {}

#[cfg(not(feature = "render"))]
impl FrameInspector for NoReference {
    fn wants(&self, _: usize, _: bool) -> bool {
        match *self {}
    }

    fn inspect(&mut self, _: hlod::bench::FrameSample<'_>) -> Result<hlod::bench::Accuracy> {
        match *self {}
    }
}
