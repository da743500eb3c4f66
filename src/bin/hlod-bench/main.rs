//! `hlod-bench OUT PATH.csv`: arguments in, exit code out.

mod policies;
mod progress;
mod run_args;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use hlod::bench::{
    BenchOptions, ClockConstants, Context, FrameRecord, Limits, Pace, Run, Session, Size,
    SummaryFile, Sweep, check_output, check_outside_scene, compare, summary, summary_text,
    write_run,
};
use hlod::camera::{self, CameraPath, DEFAULT_FPS, Ground, LONGEST_INTERVAL_S, PathKind};
use hlod::engine::FarFieldMode;
use hlod::{Error, Result};
use policies::PoliciesArgs;
use progress::Progress;
use run_args::{Clock, RunArgs, parse_size};

/// Replays a camera path over a built scene and measures frame times, toggles, memory and image error.
///
/// Selects levels of detail for every frame by one of several policies, loads nodes in another
/// thread within a memory cap, draws offscreen, and writes frames.csv, summary.json and report.html
/// into the folder --out.
#[derive(Parser, Debug)]
#[command(
    version,
    allow_negative_numbers = true,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "hlod-bench [OPTIONS] OUT PATH.csv\n       hlod-bench make-path [OPTIONS] OUT --kind KIND --out PATH.csv\n       hlod-bench calibrate [OPTIONS] OUT --out CLOCK.json\n       hlod-bench sweep [OPTIONS] OUT PATH.csv --targets MS,MS\n       hlod-bench policies [OPTIONS] OUT...\n       hlod-bench compare [OPTIONS] BASE.json NEW.json",
    after_help = "Examples:\n  hlod-bench make-path out/ --kind walk --out walk.csv\n  hlod-bench out/ walk.csv --target-ms 30\n  hlod-bench out/ walk.csv --clock model --max-memory 256MiB --out bench/walk\n\nExit codes: 0 success, 1 internal error, 2 usage, 3 input missing or invalid (also where a run went on without a node file that cannot be used), 4 output not written, 5 no graphics adapter, 6 compare: a limit was exceeded."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: RunArgs,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Writes a camera path for a built scene
    MakePath {
        /// The output folder of hlod-build
        #[arg(value_name = "OUT")]
        scene: PathBuf,
        /// walk and drive: along the streets at 1.5 and 15 m/s; fly: from a street up and over
        /// the city; orbit: a circle and two passes through the middle; still: no motion;
        /// shake: small swaying motion; turn: looks away and back at once; rise: from a street to
        /// above the city in a second, and back
        #[arg(long, value_enum)]
        kind: PathKind,
        /// Frames, 1 or more [default: what suits the kind]
        #[arg(long, value_name = "N")]
        frames: Option<usize>,
        /// Frames a second
        #[arg(long, value_name = "FPS", default_value_t = DEFAULT_FPS)]
        fps: f64,
        /// Seed of the random route
        #[arg(long, value_name = "SEED", default_value_t = 0)]
        seed: u64,
        /// The file to write
        #[arg(long, value_name = "PATH.csv")]
        out: PathBuf,
    },
    /// Compares two runs; exit code 6 where a limit is exceeded
    Compare {
        /// summary.json of the run to compare with
        base: PathBuf,
        /// summary.json of the run in question
        new: PathBuf,
        /// Compare even where scenes, paths or parameters differ
        #[arg(long)]
        force: bool,
        /// One JSON object instead of a table
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        limits: Box<Limits>,
    },
    /// Replays a path at several frame-time targets and writes image error against frame time, as
    /// sweep.csv and sweep.html, and a folder for each run
    Sweep {
        /// Frame-time targets in milliseconds, above 0; one run each
        #[arg(long, value_name = "MS,MS", value_delimiter = ',', default_value = "5,10,20,30,60")]
        targets: Vec<f64>,
        /// As for one run; --reference-every is 10 unless given
        #[command(flatten)]
        run: Box<RunArgs>,
    },
    /// Runs all policies along the same paths by the model clock, and writes image error against
    /// frame time, late frames, toggles and loading as policies.csv, policies.json and policies.html
    Policies(Box<PoliciesArgs>),
    /// Measures the constants of the model clock on this machine
    Calibrate {
        /// The output folder of hlod-build
        #[arg(value_name = "OUT")]
        scene: PathBuf,
        /// Which graphics adapter: part of its name, or its number
        #[arg(long, value_name = "NAME")]
        adapter: Option<String>,
        /// Width and height of the image in pixels, 1-16384 each
        #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
        size: Size,
        /// The file to write, for --constants
        #[arg(long, value_name = "CLOCK.json")]
        out: PathBuf,
    },
}

/// Keeps Mesa's device selection from asking for a display, of which there need be none, and from
/// writing to the console that it found none. It only matters which of several cards comes first,
/// and that is chosen here by `--adapter`.
fn hush_device_selection() {
    const SWITCH: &str = "NODEVICE_SELECT";
    if std::env::var_os(SWITCH).is_none() && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called before anything else in `main`, while there is no other thread that
        // could read the environment.
        unsafe { std::env::set_var(SWITCH, "1") };
    }
}

fn main() -> ExitCode {
    hush_device_selection();
    let cli = Cli::parse();
    let done = match cli.command {
        Some(Command::Compare { base, new, force, json, limits }) => {
            match compare_runs(&base, &new, &limits, force, json) {
                Ok(true) => return ExitCode::from(LIMIT_EXCEEDED),
                done => done.map(drop),
            }
        }
        Some(Command::MakePath { scene, kind, frames, fps, seed, out }) => {
            make_path(&scene, kind, frames, fps, seed, &out)
        }
        Some(Command::Calibrate { scene, adapter, size, out }) => {
            calibrate(&scene, adapter, size, &out)
        }
        Some(Command::Policies(arguments)) => policies::policies(&arguments),
        Some(Command::Sweep { targets, run }) => sweep(&targets, &run),
        None => replay(&cli.run),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("hlod-bench: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// The exit code of a comparison that exceeded its limits.
const LIMIT_EXCEEDED: u8 = 6;

/// True where a limit was exceeded.
fn compare_runs(base: &Path, new: &Path, limits: &Limits, force: bool, json: bool) -> Result<bool> {
    let (base, new) = (SummaryFile::read(base)?, SummaryFile::read(new)?);
    let comparison = compare(&base, &new, limits, force)?;
    let text = if json { format!("{:#}\n", comparison.to_json()) } else { comparison.text() };
    print(&text)?;
    Ok(comparison.exceeded())
}

fn make_path(
    dir: &Path,
    kind: PathKind,
    frames: Option<usize>,
    fps: f64,
    seed: u64,
    out: &Path,
) -> Result<()> {
    check_outside_scene(out, dir)?;
    let session = Session::open(dir)?;
    let ground = Ground::read(session.scene(), dir)?;
    let frames = frames.unwrap_or(kind.default_frames());
    let path = camera::make_path(&ground, kind, frames, fps, seed)?;
    camera::write_path(&path, out)?;
    print(&format!("{} frames written to {}\n", path.frames.len(), out.display()))
}

fn replay(arguments: &RunArgs) -> Result<()> {
    let (_, unusable) = replay_once(arguments, true)?;
    unusable.map_or(Ok(()), Err)
}

/// Frames between those that a sweep compares with the leaves.
const SWEEP_EVERY: u64 = 10;

fn sweep(targets: &[f64], arguments: &RunArgs) -> Result<()> {
    if arguments.target_ms.is_some() {
        return Err(Error::Usage("--target-ms: a sweep has --targets".into()));
    }
    if let Some(target) = targets.iter().find(|&&target| !(target > 0.0 && target.is_finite())) {
        return Err(Error::Usage(format!("--targets: {target}, expected milliseconds above 0")));
    }
    let mut sweep = Sweep::default();
    let mut first_unusable = None;
    for (index, &target) in targets.iter().enumerate() {
        let mut run = arguments.clone();
        run.target_ms = Some(target);
        run.reference_every.get_or_insert(SWEEP_EVERY);
        run.out = arguments.out.join(format!("target-{target}"));
        let (summary, unusable) = replay_once(&run, index == 0)?;
        sweep.summaries.push(summary);
        first_unusable = first_unusable.or(unusable);
    }
    let name =
        |path: &Option<PathBuf>| path.as_deref().unwrap_or(Path::new("")).display().to_string();
    let title = format!("{} along {}", name(&arguments.scene), name(&arguments.path));
    let files = sweep.write(&arguments.out, &title)?;
    if !arguments.quiet {
        let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        print(&format!("{}\nwritten: {}\n", sweep.text(), files.join(", ")))?;
    }
    first_unusable.map_or(Ok(()), Err)
}

/// Replays a path once, writes and prints the results, and warns of what is odd in the path where
/// `warns` says so. Its summary, and what is to be said of files that it could not use.
fn replay_once(arguments: &RunArgs, warns: bool) -> Result<(serde_json::Value, Option<Error>)> {
    let (Some(dir), Some(file)) = (&arguments.scene, &arguments.path) else {
        return Err(Error::Usage("expected OUT and PATH.csv".into()));
    };
    let mut session = Session::open(dir)?;
    let path_name = file.display().to_string();
    let warn = |what: &str| {
        if warns {
            eprintln!("hlod-bench: {}: warning: {what}", file.display());
        }
    };
    let path = played(camera::read_path(file, session.scene().up)?, warn);
    let constants = arguments.constants.as_deref().map(ClockConstants::read).transpose()?;
    let options = arguments.options()?;
    options.check()?;
    if arguments.clock == Clock::Model && arguments.snapshots.is_some() {
        return Err(Error::Usage(
            "--snapshots: the model clock draws nothing; use --clock wall, or --reference-every \
             for the image error of what would be drawn"
                .into(),
        ));
    }
    let options =
        BenchOptions { far_field: far_field(&mut session, options.far_field)?, ..options };
    check_output(&arguments.out)?;
    check_outside_scene(&arguments.out, dir)?;
    session.check_path(&path, file, options.size)?;
    let progress = ReplayProgress::new(arguments, &path);
    let job =
        Job { arguments, session: &session, path: &path, options, constants, progress: &progress };
    let (run, mut context) = run(job)?;
    drop(progress);
    if let Some(what) = session.unseen_warning(&path, &run) {
        warn(&what);
    }
    context.path_name = path_name;
    let summary = summary(&run, &context);
    let files = write_run(&arguments.out, &run, &context, &summary)?;
    if !arguments.quiet {
        let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        print(&format!("{}\nwritten: {}\n", summary_text(&summary), files.join(", ")))?;
    }
    Ok((summary, unusable(dir, &context.broken)))
}

/// Describes the files that a run could not use, if there are any.
fn unusable(dir: &Path, broken: &[String]) -> Option<Error> {
    let first = broken.first()?;
    let files = match broken.len() {
        1 => "1 file".to_owned(),
        count => format!("{count} files"),
    };
    let what = "that cannot be used; build again. The first:";
    Some(Error::input(dir, format!("the run went on without {files} {what} {first}")))
}

/// A path as it is played, with warnings of what is played in another way than the file says, and
/// of what looks wrong in it.
fn played(path: CameraPath, warn: impl Fn(&str)) -> CameraPath {
    let gaps = path.long_gaps();
    if gaps.count > 0 {
        warn(&format!(
            "{} of {} gaps between time stamps are longer than {LONGEST_INTERVAL_S} s and are played \
             as {LONGEST_INTERVAL_S} s; the longest, of {} s, comes after frame {}",
            gaps.count,
            path.frames.len() - 1,
            gaps.longest_s,
            path.frames[gaps.longest_after].frame
        ));
    }
    let widest_deg = path.frames.iter().fold(0.0, |most: f64, at| most.max(at.pose.fov_y_deg));
    if widest_deg <= std::f64::consts::PI {
        warn(&format!(
            "fov_y_deg is {widest_deg} at most: these look like radians; expected degrees, {:.1} \
             for this one",
            widest_deg.to_degrees()
        ));
    }
    if !path.is_without_time() {
        return path;
    }
    warn(&format!(
        "all {} time stamps are equal: played at {DEFAULT_FPS} frames a second",
        path.frames.len()
    ));
    path.at_rate(DEFAULT_FPS)
}

/// Reads cells where they are wanted. Where they are drawn only if they pay, none are needed, and what
/// cannot be used is told of.
fn far_field(session: &mut Session, mode: FarFieldMode) -> Result<FarFieldMode> {
    match mode {
        FarFieldMode::Off => return Ok(mode),
        FarFieldMode::Auto if !session.has_cells() => return Ok(FarFieldMode::Off),
        FarFieldMode::Cells => session.read_cells()?,
        FarFieldMode::Auto => {
            if let Err(error) = session.read_cells() {
                eprintln!("hlod-bench: {error}; what is far is drawn from the hierarchy");
                return Ok(FarFieldMode::Off);
            }
        }
    }
    Ok(mode)
}

/// What a run needs.
struct Job<'a> {
    arguments: &'a RunArgs,
    session: &'a Session,
    path: &'a CameraPath,
    options: BenchOptions,
    constants: Option<ClockConstants>,
    progress: &'a ReplayProgress<'a>,
}

#[cfg(feature = "render")]
fn run(job: Job) -> Result<(Run, Context)> {
    let Job { arguments, session, path, options, constants, progress } = job;
    use hlod::bench::{FrameInspector, Reference, SilhouetteTolerance, Snapshots};
    use hlod::render::{RenderOptions, Renderer, Shading, Side};
    use run_args::ShadingArg;
    let render = RenderOptions {
        size: options.size.0,
        adapter: arguments.adapter.clone(),
        shading: match arguments.shading {
            ShadingArg::Photo => Shading::Photo,
            ShadingArg::HeadLight => Shading::HeadLight,
            ShadingArg::Unlit => Shading::Unlit,
        },
        show_levels: arguments.show_levels,
        cull: arguments.cull,
        cut: (options.far_field != FarFieldMode::Off).then_some(Side::Inside),
        ..RenderOptions::default()
    };
    let tolerance = SilhouetteTolerance {
        pixels: arguments.gap_tolerance,
        most_error_pixels: arguments.gap_error,
    };
    let mut renderer = match arguments.clock {
        Clock::Wall => Some(Renderer::new(&render)?),
        Clock::Model => None,
    };
    let preferred = renderer.as_ref().map(Renderer::preferred_textures).unwrap_or_default();
    let suitable = session.suitable_textures(options.residency.max_memory_bytes, preferred);
    let textures = arguments.textures.format().unwrap_or(suitable);
    let options = BenchOptions { textures, ..options };
    let reference = |every| {
        let reference = Reference::new(session, &render, every, tolerance)?;
        let reference = if arguments.pops { reference.with_every_toggle() } else { reference };
        reference.with_textures(session, &render, textures)
    };
    let mut reference = arguments.reference_every.map(reference).transpose()?;
    let inspector = reference.as_mut().map(|reference| reference as &mut dyn FrameInspector);
    let progress = |frame: &FrameRecord| progress.frame(frame);
    let (run, mut context) = match &mut renderer {
        None => {
            let constants = constants.unwrap_or_default();
            session.run_model(path, options, constants, inspector, progress)?
        }
        Some(renderer) => {
            let dir = arguments.out.join("snapshots");
            let snapshots = arguments.snapshots.map(|every| Snapshots { every, dir });
            session.run_wall(path, options, constants, renderer, snapshots, inspector, progress)?
        }
    };
    context.reference = reference.map(Reference::context).transpose()?;
    let found = context.reference.iter().flat_map(|reference| &reference.broken);
    let more: Vec<String> = found.filter(|what| !context.broken.contains(what)).cloned().collect();
    context.broken.extend(more);
    Ok((run, context))
}

#[cfg(feature = "render")]
fn calibrate(dir: &Path, adapter: Option<String>, size: Size, out: &Path) -> Result<()> {
    use hlod::render::{RenderOptions, Renderer};
    check_outside_scene(out, dir)?;
    let session = Session::open(dir)?;
    let mut renderer =
        Renderer::new(&RenderOptions { size: size.0, adapter, ..RenderOptions::default() })?;
    let ground = Ground::read(session.scene(), dir)?;
    let kind = PathKind::Fly;
    let path = camera::make_path(&ground, kind, kind.default_frames(), DEFAULT_FPS, 0)?;
    let calibration = session.calibrate(&path, &mut renderer)?;
    let constants = calibration.constants;
    constants.write(out)?;
    print(&format!(
        "an empty frame       {:.2} ms\na draw call          {:.4} ms\n\
         1000 vertices        {:.4} ms\n1000 triangles       {:.4} ms\n\
         1e6 plain fragments  {:.3} ms\n1e6 textured ones    {:.3} ms\n1e6 hidden ones      {:.3} ms\n\
         1e6 edge fragments   {:.3} ms\noverlap of stages    {:.2}\n\
         1 MB uploaded        {:.3} ms\n1 MB drawn anew      {:.3} ms\n\
         noise                {:.1} %\nloading              {:.1} MB/s\n\
         c_textured           {:.3}\n\
         unexplained          {:.1} % of {} frames\nwritten: {}\n",
        constants.prices.frame,
        constants.prices.draw,
        constants.prices.vertex * 1e3,
        constants.prices.triangle * 1e3,
        constants.prices.plain_fragment * 1e6,
        constants.prices.textured_fragment * 1e6,
        constants.prices.hidden_fragment * 1e6,
        constants.edge_fragment * 1e6,
        constants.overlap,
        constants.prices.uploaded_byte * 1e6,
        constants.cold_byte * 1e6,
        constants.noise * 100.0,
        constants.load_bytes_per_ms / 1e3,
        constants.textured_weight,
        calibration.unexplained * 100.0,
        calibration.frames,
        out.display()
    ))
}

#[cfg(not(feature = "render"))]
fn run(job: Job) -> Result<(Run, Context)> {
    let Job { arguments, session, path, options, constants, progress } = job;
    if arguments.clock == Clock::Wall || arguments.reference_every.is_some() {
        return Err(cannot_draw());
    }
    let constants = constants.unwrap_or_default();
    session.run_model(path, options, constants, None, |frame| progress.frame(frame))
}

#[cfg(not(feature = "render"))]
fn calibrate(_: &Path, _: Option<String>, _: Size, _: &Path) -> Result<()> {
    Err(cannot_draw())
}

#[cfg(not(feature = "render"))]
fn cannot_draw() -> Error {
    Error::NoAdapter("this hlod-bench was compiled without drawing; use --clock model alone".into())
}

/// The progress of a replay. Its steps are milliseconds of the path where frames wait for their
/// time, and frames otherwise.
struct ReplayProgress<'a> {
    progress: Progress,
    path: &'a CameraPath,
    paced: bool,
    done: std::cell::Cell<usize>,
}

impl<'a> ReplayProgress<'a> {
    fn new(arguments: &RunArgs, path: &'a CameraPath) -> Self {
        let paced = arguments.clock == Clock::Wall && arguments.pace == Pace::Recorded;
        let steps = (0..path.frames.len()).map(|index| steps(path, index, paced)).sum();
        let progress = Progress::new(arguments.quiet, steps, "preparing the first frame");
        Self { progress, path, paced, done: std::cell::Cell::new(0) }
    }

    fn frame(&self, frame: &FrameRecord) -> bool {
        let index = self.done.replace(self.done.get() + 1);
        self.progress.advance(steps(self.path, index, self.paced), || {
            format!(
                "{}/{} frames, {:.1} ms, {} triangles",
                index + 1,
                self.path.frames.len(),
                frame.report.frame_ms,
                frame.report.triangles
            )
        });
        true
    }
}

fn steps(path: &CameraPath, index: usize, paced: bool) -> u64 {
    if paced { ((path.interval_s(index) * 1e3) as u64).max(1) } else { 1 }
}

/// Writes to the standard output; a reader that went away is none of our business.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::output("standard output", error.to_string()))
        }
        _ => Ok(()),
    }
}
