//! `hlod-bench OUT PATH.csv`: arguments in, exit code out.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use hlod::bench::{
    BenchOptions, ClockConstants, Context, FrameRecord, Limits, Pace, Run, Session, Size,
    SummaryFile, check_output, compare, summary, summary_text, write_run,
};
use hlod::camera::{self, CameraPath, DEFAULT_FPS, Ground, PathKind};
use hlod::runtime::lakhia::{LakhiaOptions, ShareFeedback, StartOfHysteresis};
use hlod::runtime::residency::ResidencyOptions;
use hlod::{Error, Result};
use indicatif::{ProgressBar, ProgressStyle};

/// Replays a camera path over a built scene and logs what a user would have felt.
///
/// Chooses levels of detail for every frame as Lakhia's thesis (2004) describes, loads nodes
/// beside drawing below a memory cap, draws offscreen, and writes frames.csv, summary.json and
/// report.html into the folder --out.
#[derive(Parser, Debug)]
#[command(
    version,
    allow_negative_numbers = true,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "hlod-bench [OPTIONS] OUT PATH.csv\n       hlod-bench make-path [OPTIONS] OUT --kind KIND --out PATH.csv\n       hlod-bench calibrate [OPTIONS] OUT --out CLOCK.json\n       hlod-bench compare [OPTIONS] BASE.json NEW.json",
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
        scene: PathBuf,
        /// walk and drive: along the streets at 1.5 and 15 m/s; fly: from a street up and over
        /// the city; orbit: a circle and two passes through the middle; still: standing;
        /// shake: swaying a little
        #[arg(long, value_enum)]
        kind: PathKind,
        /// Frames, 1 or more [default: what suits the kind]
        #[arg(long, value_name = "N")]
        frames: Option<usize>,
        /// Frames a second
        #[arg(long, value_name = "FPS", default_value_t = DEFAULT_FPS)]
        fps: f64,
        /// Another seed gives another route
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
        /// Compare runs over different scenes, paths or parameters all the same
        #[arg(long)]
        force: bool,
        /// One JSON object instead of a table
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        limits: Box<Limits>,
    },
    /// Measures the constants of the model clock on this machine
    Calibrate {
        /// The output folder of hlod-build
        scene: PathBuf,
        /// Which graphics adapter: part of its name, or its number
        #[arg(long, value_name = "NAME")]
        adapter: Option<String>,
        /// Width and height of the picture in pixels
        #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
        size: Size,
        /// The file to write, for --constants
        #[arg(long, value_name = "CLOCK.json")]
        out: PathBuf,
    },
}

#[derive(Args, Debug)]
struct RunArgs {
    /// The output folder of hlod-build
    #[arg(required = true)]
    scene: Option<PathBuf>,
    /// The path: frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg
    #[arg(required = true, value_name = "PATH.csv")]
    path: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "bench")]
    out: PathBuf,
    /// `wall` draws and measures; `model` takes times from a model, needs no graphics adapter and
    /// gives the same on every machine
    #[arg(long, value_enum, default_value_t = Clock::Wall)]
    clock: Clock,
    /// Constants that `calibrate` wrote [default: wall: measured at the start; model: built in]
    #[arg(long, value_name = "CLOCK.json")]
    constants: Option<PathBuf>,
    /// `recorded`: a frame begins no sooner than the path has it; `unthrottled`: at once
    #[arg(long, value_enum, default_value_t = Pace::Recorded)]
    pace: Pace,
    /// Frames for which the camera stands at the first pose before the log begins
    #[arg(long, value_name = "N", default_value_t = 0)]
    settle_frames: u64,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,

    /// c_targetTime: milliseconds that a frame may take, above 0
    #[arg(long, value_name = "MS", default_value_t = 30.0, help_heading = "Selection")]
    target_ms: f64,
    /// c_vis: what being in view adds to a node's benefit, 0 or more
    #[arg(long, value_name = "C", default_value_t = 1.275, help_heading = "Selection")]
    vis: f64,
    /// c_fore: how much the angle counts at which a node is seen, 0-1
    #[arg(long, value_name = "C", default_value_t = 0.45, help_heading = "Selection")]
    fore: f64,
    /// c_hystSwitch: how far a counter goes before it counts. More: fewer and later switches
    #[arg(long, value_name = "C", default_value_t = 1500.0, help_heading = "Selection")]
    hyst_switch: f64,
    /// c_hystLimit: how far counters go at most, --hyst-switch or more
    #[arg(long, value_name = "C", default_value_t = 4510.0, help_heading = "Selection")]
    hyst_limit: f64,
    /// Where counters begin: `affordable` lets nodes in at once only where their time suffices
    #[arg(long, value_enum, default_value_t = StartOfHysteresis::Affordable, help_heading = "Selection")]
    hyst_start: StartOfHysteresis,
    /// Seconds by which the camera is moved on before distances are taken
    #[arg(long, value_name = "S", default_value_t = 0.5, help_heading = "Selection")]
    lookahead: f64,
    /// Metres; what is nearer counts as this near [default: 1, less in scenes below 100 m]
    #[arg(long, value_name = "M", help_heading = "Selection")]
    least_distance: Option<f64>,
    /// Draw children only where all of them are in memory, not only those in view
    #[arg(long, help_heading = "Selection")]
    all_siblings: bool,
    /// By what part v_time follows the last frame, 0-1; 0 turns this feedback off
    #[arg(long, value_name = "PART", default_value_t = 0.1, help_heading = "Selection")]
    v_time_gain: f64,
    /// By what part shareTime changes in a frame, 0-1; 0 turns this feedback off
    #[arg(long, value_name = "PART", default_value_t = 0.01, help_heading = "Selection")]
    share_gain: f64,
    /// The part of the target by which frames must miss it before shareTime changes
    #[arg(long, value_name = "PART", default_value_t = 0.05, help_heading = "Selection")]
    share_slack: f64,
    /// How many times the time for nodes shareTime may be, 1 or more. More: finer where little is
    /// in view, and later back on target when more comes
    #[arg(long, value_name = "TIMES", default_value_t = 10.0, help_heading = "Selection")]
    share_limit: f64,
    /// `plain` as the thesis words it, which swings; `damped` waits for what is on its way
    #[arg(long, value_enum, default_value_t = ShareFeedback::Damped, help_heading = "Selection")]
    share_feedback: ShareFeedback,

    /// maxMemory: the most bytes in use, loads under way included; with KiB, MiB or GiB
    #[arg(long, value_name = "BYTES", default_value = "1GiB", value_parser = parse_bytes, help_heading = "Memory and loading")]
    max_memory: u64,
    /// Bytes read before looking again at what matters most
    #[arg(long, value_name = "BYTES", default_value = "64KiB", value_parser = parse_bytes, help_heading = "Memory and loading")]
    portion: u64,
    /// Bytes that become resident in a frame; one node always does
    #[arg(long, value_name = "BYTES", default_value = "4MiB", value_parser = parse_bytes, help_heading = "Memory and loading")]
    upload: u64,
    /// A node makes room only for one whose priority is higher by this part
    #[arg(long, value_name = "PART", default_value_t = 0.1, help_heading = "Memory and loading")]
    evict_margin: f64,

    /// Width and height of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size, help_heading = "Drawing")]
    size: Size,
    /// Which graphics adapter: part of its name, or its number
    #[arg(long, value_name = "NAME", help_heading = "Drawing")]
    adapter: Option<String>,
    /// Write every Nth frame as PNG into DIR/snapshots, N 1 or more
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Drawing")]
    snapshots: Option<u64>,
    /// Draw every Nth frame from the leaves too, outside of its time, and log how far it is from
    /// that: FLIP, PSNR, SSIM, gaps, and the pop where levels toggled. N 1 or more
    #[arg(long, value_name = "N", conflicts_with = "show_levels", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Drawing")]
    reference_every: Option<u64>,
    /// Tint nodes by level
    #[arg(long, help_heading = "Drawing")]
    show_levels: bool,
    /// `photo`: pictures as they are; `head-light`: lit from behind the viewer; `unlit`
    #[arg(long, value_enum, default_value_t = ShadingArg::Photo, help_heading = "Drawing")]
    shading: ShadingArg,
    /// Leave away the backs of triangles that are not double-sided
    #[arg(long, help_heading = "Drawing")]
    cull: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Clock {
    Wall,
    Model,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ShadingArg {
    Photo,
    HeadLight,
    Unlit,
}

/// A number of bytes, with or without KiB, MiB or GiB.
fn parse_bytes(text: &str) -> Result<u64, String> {
    let units = [("KiB", 10), ("MiB", 20), ("GiB", 30), ("K", 10), ("M", 20), ("G", 30), ("B", 0)];
    let (number, shift) = units
        .iter()
        .find_map(|&(unit, shift)| text.strip_suffix(unit).map(|number| (number, shift)))
        .unwrap_or((text, 0));
    let wanted = "expected bytes such as 1048576, 512MiB or 1.5GiB";
    let number: f64 = number.trim().parse().map_err(|_| wanted.to_owned())?;
    let bytes = number * f64::from(1u32 << shift);
    if bytes.is_finite() && (0.0..=1e18).contains(&bytes) {
        Ok(bytes as u64)
    } else {
        Err(wanted.to_owned())
    }
}

fn parse_size(text: &str) -> Result<Size, String> {
    let wanted = "expected width and height in pixels, such as 1280x720";
    let (width, height) = text.split_once('x').ok_or(wanted)?;
    let side = |text: &str| match text.parse::<u32>() {
        Ok(side @ 1..=16384) => Ok(side),
        _ => Err(wanted),
    };
    Ok(Size([side(width)?, side(height)?]))
}

impl RunArgs {
    fn options(&self, session: &Session) -> BenchOptions {
        let least = (session.tree().diagonal() / 100.0).clamp(1e-6, 1.0);
        BenchOptions {
            selection: LakhiaOptions {
                target_ms: self.target_ms,
                vis: self.vis,
                fore: self.fore,
                hyst_switch: self.hyst_switch,
                hyst_limit: self.hyst_limit,
                hyst_start: self.hyst_start,
                lookahead_s: self.lookahead,
                least_distance: self.least_distance.unwrap_or(least),
                all_siblings: self.all_siblings,
                v_time_gain: self.v_time_gain,
                share_gain: self.share_gain,
                share_slack: self.share_slack,
                share_limit: self.share_limit,
                share_feedback: self.share_feedback,
                ..LakhiaOptions::default()
            },
            residency: ResidencyOptions {
                max_memory_bytes: self.max_memory,
                portion_bytes: self.portion,
                upload_bytes: self.upload,
                evict_margin: self.evict_margin,
            },
            pace: self.pace,
            size: self.size,
            settle_frames: self.settle_frames,
        }
    }
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
    let session = Session::open(dir)?;
    let ground = Ground::read(session.scene(), dir)?;
    let frames = frames.unwrap_or(kind.default_frames());
    let path = camera::make_path(&ground, kind, frames, fps, seed)?;
    camera::write_path(&path, out)?;
    print(&format!("{} frames written to {}\n", path.frames.len(), out.display()))
}

fn replay(arguments: &RunArgs) -> Result<()> {
    let (Some(dir), Some(path)) = (&arguments.scene, &arguments.path) else {
        return Err(Error::Usage("expected OUT and PATH.csv".into()));
    };
    let session = Session::open(dir)?;
    let path_name = path.display().to_string();
    let path = camera::read_path(path, session.scene().up)?;
    let constants = arguments.constants.as_deref().map(ClockConstants::read).transpose()?;
    let options = arguments.options(&session);
    options.check()?;
    check_output(&arguments.out)?;
    let bar = Bar::new(arguments.quiet, path.frames.len());
    let (run, mut context) = run(arguments, &session, &path, options, constants, &bar)?;
    bar.bar.finish_and_clear();
    context.path_name = path_name;
    let summary = summary(&run, &context);
    let files = write_run(&arguments.out, &run, &context, &summary)?;
    if !arguments.quiet {
        let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        print(&format!("{}\nwritten: {}\n", summary_text(&summary), files.join(", ")))?;
    }
    match context.broken.as_slice() {
        [] => Ok(()),
        [first, ..] => Err(Error::input(
            dir,
            format!(
                "the run went on without {} that cannot be used; build again. The first: {first}",
                match context.broken.len() {
                    1 => "1 file".to_owned(),
                    count => format!("{count} files"),
                }
            ),
        )),
    }
}

#[cfg(feature = "render")]
fn run(
    arguments: &RunArgs,
    session: &Session,
    path: &CameraPath,
    options: BenchOptions,
    constants: Option<ClockConstants>,
    bar: &Bar,
) -> Result<(Run, Context)> {
    use hlod::bench::{Reference, Snapshots, Witness};
    use hlod::render::{RenderOptions, Renderer, Shading};
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
        ..RenderOptions::default()
    };
    let reference = |every| Reference::new(session, &render, every);
    let mut reference = arguments.reference_every.map(reference).transpose()?;
    let witness = reference.as_mut().map(|reference| reference as &mut dyn Witness);
    let progress = |frame: &FrameRecord| bar.frame(frame);
    let (run, mut context) = match arguments.clock {
        Clock::Model => {
            let constants = constants.unwrap_or_default();
            session.run_model(path, options, constants, witness, progress)?
        }
        Clock::Wall => {
            let mut renderer = Renderer::new(&render)?;
            let dir = arguments.out.join("snapshots");
            let snapshots = arguments.snapshots.map(|every| Snapshots { every, dir });
            session.run_wall(
                path,
                options,
                constants,
                &mut renderer,
                snapshots,
                witness,
                progress,
            )?
        }
    };
    context.reference = reference.map(Reference::context).transpose()?;
    Ok((run, context))
}

#[cfg(feature = "render")]
fn calibrate(dir: &Path, adapter: Option<String>, size: Size, out: &Path) -> Result<()> {
    use hlod::render::{RenderOptions, Renderer};
    let session = Session::open(dir)?;
    let mut renderer =
        Renderer::new(&RenderOptions { size: size.0, adapter, ..RenderOptions::default() })?;
    let ground = Ground::read(session.scene(), dir)?;
    let kind = PathKind::Fly;
    let path = camera::make_path(&ground, kind, kind.default_frames(), DEFAULT_FPS, 0)?;
    let constants = session.calibrate(&path, &mut renderer)?;
    constants.write(out)?;
    print(&format!(
        "an empty frame    {:.2} ms\na unit of cost    {:.6} ms\nthe whole picture {:.0} units of cost\na node            {:.4} ms\n\
         loading           {:.1} MB/s\nc_textured        {:.3}\nwritten: {}\n",
        constants.fixed_ms,
        constants.ms_per_cost,
        constants.fill_cost,
        constants.ms_per_node,
        constants.load_bytes_per_ms / 1e3,
        constants.textured_weight,
        out.display()
    ))
}

#[cfg(not(feature = "render"))]
fn run(
    arguments: &RunArgs,
    session: &Session,
    path: &CameraPath,
    options: BenchOptions,
    constants: Option<ClockConstants>,
    bar: &Bar,
) -> Result<(Run, Context)> {
    if arguments.clock == Clock::Wall || arguments.reference_every.is_some() {
        return Err(cannot_draw());
    }
    let constants = constants.unwrap_or_default();
    session.run_model(path, options, constants, None, |frame| bar.frame(frame))
}

#[cfg(not(feature = "render"))]
fn calibrate(_: &Path, _: Option<String>, _: Size, _: &Path) -> Result<()> {
    Err(cannot_draw())
}

#[cfg(not(feature = "render"))]
fn cannot_draw() -> Error {
    Error::NoAdapter("this hlod-bench was compiled without drawing; use --clock model alone".into())
}

/// Progress on a terminal, and nothing elsewhere.
struct Bar {
    bar: ProgressBar,
}

impl Bar {
    fn new(quiet: bool, frames: usize) -> Self {
        let hidden = quiet || !std::io::stderr().is_terminal();
        let bar = if hidden { ProgressBar::hidden() } else { ProgressBar::new(frames as u64) };
        let template = "{wide_bar} {pos}/{len} frames, {msg}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar }
    }

    fn frame(&self, frame: &FrameRecord) -> bool {
        self.bar.inc(1);
        if !self.bar.is_hidden() {
            self.bar
                .set_message(format!("{:.1} ms, {} triangles", frame.frame_ms, frame.triangles));
        }
        true
    }
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
