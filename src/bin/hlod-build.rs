//! `hlod-build INPUT... OUT`: arguments in, exit code out.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use hlod::builder::blocks::plan::BlockMode;
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions, SimplifyFrom, TreeShape};
use hlod::builder::progress::Progress;
use hlod::builder::simplify::ladder::Simplifier;
use hlod::builder::threads::with_threads;
use hlod::builder::{BuildOptions, Outcome, build};
use hlod::cells::CellOptions;
use hlod::format::Scene;
use hlod::mesh::UpAxis;
use hlod::place::{Place, Placement};
use hlod::report::{build_summary, inspect};
use hlod::texture::Seams;
use hlod::verify::{self, VerifyOptions, verify};
use hlod::{Error, Result};
use indicatif::{HumanCount, ProgressBar, ProgressStyle};

/// The exit code of a verification that found a fault: the scene is no valid input.
const NOT_HELD: u8 = 3;

/// Turns city meshes into a hierarchy of levels of detail.
///
/// Reads OBJ, glTF and GLB files, or folders of them; divides them into blocks; and writes for
/// every block a tree of nodes, coarse at the root, the original triangles at the leaves. Writes
/// OUT/scene.hlod (index), OUT/nodes/*.glb, OUT/tileset.json (3D Tiles) and OUT/build.json (report).
/// An earlier result in OUT stays until the new one is complete. Where inputs and options have not
/// changed, nothing is done.
#[derive(Parser, Debug)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "hlod-build [OPTIONS] INPUT... OUT\n       hlod-build inspect [--json] OUT\n       hlod-build verify [--json] [--source MODEL]... OUT\n       hlod-build cells [OPTIONS] OUT",
    after_help = "Examples:\n  hlod-build city.obj out/\n  hlod-build --blocks grid:200 tiles/ more.glb out/\n  hlod-build inspect out/\n  hlod-build verify out/ --source city.obj\n  hlod-build cells out/ --along walk.csv\n\nExit codes: 0 success, 1 internal error, 2 usage, 3 input missing or invalid, or what verify looked at does not hold, 4 output not written, 5 no graphics adapter (cells)."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    build: BuildArgs,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Prints a built hierarchy: for people, or with --json for programs
    Inspect {
        /// The output folder of an earlier build
        out: PathBuf,
        /// One JSON object with `nodes` and all their attributes
        #[arg(long)]
        json: bool,
        /// Show at most N blocks' trees
        #[arg(long, value_name = "N", default_value_t = 20)]
        blocks: usize,
    },
    /// Checks a built hierarchy against its source: files, attributes, distances, gaps, colours.
    /// Ends in pass or, with exit code 3, in fail
    Verify(VerifyArgs),
    /// Prepares cells where viewers are: what is far from each is drawn from textured depth meshes
    /// (`hlod-bench --far-field cells`). Writes OUT/cells.hlod (index) and OUT/cells/*.glb; goes on where an
    /// earlier run was stopped. Needs a graphics adapter, or Mesa's lavapipe (Debian: mesa-vulkan-drivers)
    Cells(CellsArgs),
}

#[derive(Args, Debug)]
struct CellsArgs {
    /// The output folder of an earlier build
    out: PathBuf,
    /// Make the cells that these camera paths pass through [default: along all streets and squares, at eye
    /// height]
    #[arg(long, value_name = "PATH.csv", num_args = 1..)]
    along: Vec<PathBuf>,
    /// Make cells of this size over all of the scene, above 0
    #[arg(long, value_name = "METRES", requires = "height", conflicts_with_all = ["along", "cell"])]
    grid: Option<f64>,
    /// Metres above the ground at which those of --grid are
    #[arg(long, value_name = "METRES", requires = "grid", allow_negative_numbers = true)]
    height: Option<f64>,
    /// Side of a cell, metres, above 0. Larger: fewer cells, and more that is seen from elsewhere in them
    #[arg(long, value_name = "METRES", default_value_t = CellOptions::default().cell_m)]
    cell: f64,
    /// Metres from a cell to the sides of its cull box, above 0: what is farther is drawn from its faces
    #[arg(long, value_name = "METRES", default_value_t = CellOptions::default().cull_m)]
    cull: f64,
    /// Pixels along the side of a face, 16-8192
    #[arg(long, value_name = "N", default_value_t = CellOptions::default().pixels)]
    pixels: u32,
    /// Pixels of a face by which what it shows may be off, seen from anywhere in the cell; above 0
    #[arg(long, value_name = "PIXELS", default_value_t = CellOptions::default().error_px)]
    error: f64,
    /// JPEG quality of the faces, 1-100
    #[arg(long, value_name = "Q", default_value_t = CellOptions::default().jpeg_quality)]
    jpeg_quality: u8,
    /// Graphics adapter: part of its name, or its number [default: the fastest kind there is]
    #[arg(long, value_name = "ADAPTER")]
    adapter: Option<String>,
    /// Threads, 0-1024; 0 is one for each core
    #[arg(long, short = 'j', value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Args, Debug)]
struct VerifyArgs {
    /// The output folder of an earlier build
    out: PathBuf,
    /// The models that it was built from, or folders of them; without any, the leaves stand for
    /// the source and are not checked themselves
    #[arg(long, value_name = "MODEL", num_args = 1..)]
    source: Vec<PathBuf>,
    /// One JSON object with all figures
    #[arg(long)]
    json: bool,
    /// Sample points on the source, 1000 or more, and as many on each level; all vertices are
    /// measured as well. More: rarer faults are found, and it takes longer
    #[arg(long, value_name = "N", default_value_t = 300_000)]
    samples: u64,
    /// Seed of the sample points: the same seed gives the same figures
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Also measure a front of mixed levels, chosen by the stored errors, of at most this fraction
    /// of the leaves' triangles, above 0 and up to 1
    #[arg(long, value_name = "SHARE")]
    front: Option<f64>,
    /// Number of worst nodes to list
    #[arg(long, value_name = "N", default_value_t = 5)]
    worst: usize,
    /// Threads, 0-1024; 0 is one for each core. The result does not depend on it
    #[arg(long, short = 'j', value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Show no progress
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Args, Debug)]
struct BuildArgs {
    /// Models (.obj, .gltf, .glb) or folders of them; the last is the output folder
    #[arg(value_name = "INPUT... OUT", required = true, num_args = 2..)]
    paths: Vec<PathBuf>,

    /// How inputs become blocks: `auto` (groups where they make sense; merged where tiny or one
    /// surface; divided where huge, or where they have more buildings than a root can show),
    /// `groups`, or `grid:METRES`
    #[arg(long, value_name = "MODE", default_value = "auto", help_heading = "Hierarchy")]
    blocks: BlockMode,
    /// The shape of the trees
    #[arg(long, value_enum, default_value_t = TreeArg::Balanced, help_heading = "Hierarchy")]
    tree: TreeArg,
    /// Ratio of triangles and texels between levels, and the number of children of a node, 2-64.
    /// More: fewer levels, coarser steps between them
    #[arg(long, value_name = "N", default_value_t = 4, help_heading = "Hierarchy")]
    level_factor: u32,
    /// Target number of triangles in a node, 1 or more. More: fewer, larger files
    #[arg(long, value_name = "N", default_value_t = 2000, help_heading = "Hierarchy")]
    desired_tris: u32,
    /// How coarse nodes are simplified
    #[arg(long, value_enum, default_value_t = SimplifierArg::Qem, help_heading = "Hierarchy")]
    simplifier: SimplifierArg,
    /// What coarse nodes are simplified from: `children`, the level below, or `original`, the source,
    /// as in Lakhia's thesis; slower
    #[arg(long, value_enum, default_value_t = FromArg::Children, help_heading = "Hierarchy")]
    simplify_from: FromArg,
    /// How borders on cutting planes are simplified: `skirts` identically on both sides, with strips
    /// over the gaps between levels; `shared` without the strips; `locked` not at all
    #[arg(long, value_enum, default_value_t = BordersArg::Skirts, help_heading = "Hierarchy")]
    borders: BordersArg,
    /// Texture seams of coarse nodes: `keep` preserves them, `bake` replaces the texture by one baked
    /// from the source, `auto` bakes where seams prevent simplification
    #[arg(long, value_enum, default_value_t = SeamsArg::Auto, help_heading = "Hierarchy")]
    seams: SeamsArg,
    /// Up axis, where the input does not say [default: the format's, else guessed from the shape]
    #[arg(long, value_enum, help_heading = "Hierarchy")]
    up: Option<UpArg>,

    /// Coordinate reference system: projected, in metres or feet; or, with --origin, in degrees
    /// (longitude, latitude, height in metres). Puts tileset.json on the globe
    #[arg(long, value_name = "EPSG:CODE", help_heading = "Georeferencing")]
    crs: Option<CrsArg>,
    /// Metres to add to the heights of --crs to make them heights above the ellipsoid: the height
    /// of the geoid where they are above sea level
    #[arg(
        long,
        value_name = "METRES",
        default_value_t = 0.0,
        requires = "crs",
        allow_negative_numbers = true,
        help_heading = "Georeferencing"
    )]
    height_offset: f64,
    /// Longitude and latitude in degrees and height above the ellipsoid, in metres, of the
    /// coordinates' origin, where these are metres east, north and up. With --crs in degrees: a
    /// point near the model, around which it is built in such metres
    #[arg(
        long,
        value_name = "LON,LAT,HEIGHT",
        allow_hyphen_values = true,
        help_heading = "Georeferencing"
    )]
    origin: Option<OriginArg>,

    /// Quality of the leaves' JPEG textures, 1-100; those of coarse levels are a quarter as far from 100.
    /// From 90 on, colour keeps its full resolution
    #[arg(long, value_name = "Q", default_value_t = 85, help_heading = "Textures")]
    jpeg_quality: u8,
    /// Longest side of a node's texture atlas in texels, 16-65535
    #[arg(long, value_name = "TEXELS", default_value_t = 4096, help_heading = "Textures")]
    max_atlas: u32,

    /// Round all positions to multiples of one step and store them in 16 bits
    /// (KHR_mesh_quantization). The step is the largest power of two not above METRES (0.000001 to
    /// 1000): 1/128 m for 0.01. Leaves are then within half a step of the source along each axis;
    /// stored errors include that. The city must be 1000 steps wide or more [default: 32-bit floats,
    /// relative to the block's origin]
    #[arg(long, value_name = "METRES", help_heading = "Files")]
    quantize: Option<f64>,
    /// Compress vertices and indices without loss: `meshopt` is EXT_meshopt_compression
    #[arg(long, value_enum, default_value_t = CompressArg::None, help_heading = "Files")]
    compress: CompressArg,

    /// Threads, 0-1024; 0 is one for each core. The result does not depend on it
    #[arg(long, short = 'j', value_name = "N", default_value_t = 0, help_heading = "Running")]
    threads: usize,
    /// Build even where nothing has changed
    #[arg(long, help_heading = "Running")]
    force: bool,
    /// Print nothing but errors
    #[arg(long, short, help_heading = "Running")]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum CompressArg {
    None,
    Meshopt,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SeamsArg {
    /// Preserve seams and source textures
    Keep,
    /// Bake where seams prevent simplification
    Auto,
    /// Bake every coarse node
    Bake,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum TreeArg {
    /// As deep as the geometry needs, with even ratios and cuts that balance triangles
    Balanced,
    /// Lakhia's law: slabs of even width, all branches equally deep
    Thesis,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SimplifierArg {
    /// Quadric error metrics
    Qem,
    /// Vertex clustering (Cozzi & Loo)
    Clustering,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FromArg {
    Original,
    Children,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum BordersArg {
    Locked,
    Shared,
    Skirts,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum UpArg {
    Y,
    Z,
}

impl BuildArgs {
    fn options(&self) -> BuildOptions {
        BuildOptions {
            hierarchy: HierarchyOptions {
                tree: match self.tree {
                    TreeArg::Balanced => TreeShape::Balanced,
                    TreeArg::Thesis => TreeShape::Thesis,
                },
                desired_tris: self.desired_tris,
                level_factor: self.level_factor,
                simplify_from: match self.simplify_from {
                    FromArg::Original => SimplifyFrom::Original,
                    FromArg::Children => SimplifyFrom::Children,
                },
                simplifier: match self.simplifier {
                    SimplifierArg::Qem => Simplifier::Qem,
                    SimplifierArg::Clustering => Simplifier::Clustering,
                },
                seams: match self.seams {
                    SeamsArg::Keep => Seams::Keep,
                    SeamsArg::Auto => Seams::Auto,
                    SeamsArg::Bake => Seams::Bake,
                },
                borders: match self.borders {
                    BordersArg::Locked => BorderMode::Locked,
                    BordersArg::Shared => BorderMode::Shared,
                    BordersArg::Skirts => BorderMode::Skirts,
                },
                ..Default::default()
            },
            blocks: self.blocks,
            up: self.up.map(|up| match up {
                UpArg::Y => UpAxis::Y,
                UpArg::Z => UpAxis::Z,
            }),
            placement: self.placement(),
            jpeg_quality: self.jpeg_quality,
            max_atlas: self.max_atlas,
            quantize: self.quantize,
            compress: self.compress == CompressArg::Meshopt,
            force: self.force,
            ..Default::default()
        }
    }
}

impl BuildArgs {
    fn placement(&self) -> Placement {
        match (self.crs, self.origin) {
            (Some(CrsArg(epsg)), None) => {
                Placement::Crs { epsg, height_offset: self.height_offset }
            }
            (Some(CrsArg(epsg)), Some(OriginArg(origin))) => {
                Placement::Degrees { epsg, height_offset: self.height_offset, origin }
            }
            (None, Some(OriginArg(origin))) => Placement::Origin(origin),
            (None, None) => Placement::Local,
        }
    }
}

/// `EPSG:25832`.
#[derive(Clone, Copy, Debug)]
struct CrsArg(u32);

impl std::str::FromStr for CrsArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let code = text.get(..5).filter(|start| start.eq_ignore_ascii_case("EPSG:"));
        code.and_then(|_| text[5..].parse().ok())
            .map(Self)
            .ok_or_else(|| format!("expected EPSG:CODE, such as EPSG:25832, found {text}"))
    }
}

/// `11.42,48.77,370`.
#[derive(Clone, Copy, Debug)]
struct OriginArg(Place);

impl std::str::FromStr for OriginArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|number| number.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[lon, lat, height]) => Ok(Self(Place { lon, lat, height })),
            _ => Err(format!("expected LON,LAT,HEIGHT, such as 11.42,48.77,370, found {text}")),
        }
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Some(Command::Inspect { out, json, blocks }) => inspect_scene(&out, json, blocks),
        Some(Command::Verify(arguments)) => return verify_scene(&arguments),
        Some(Command::Cells(arguments)) => cells(&arguments),
        None => run(&cli.build),
    };
    exit_code(done.map(|()| ExitCode::SUCCESS))
}

fn exit_code(done: Result<ExitCode>) -> ExitCode {
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("hlod-build: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(arguments: &BuildArgs) -> Result<()> {
    let [inputs @ .., out] = &arguments.paths[..] else {
        return Err(Error::Usage("expected INPUT... and OUT".into()));
    };
    let options = arguments.options();
    let bar = Bar::new(arguments.quiet);
    let outcome = with_threads(arguments.threads, || build(inputs, out, &options, &bar))?;
    bar.bar.finish_and_clear();
    let outcome = outcome?;
    if arguments.quiet {
        return Ok(());
    }
    print(&match outcome {
        Outcome::UpToDate(report) => build_summary::up_to_date(&report, out),
        Outcome::Built(report) => build_summary::built(&report, out),
    })
}

fn inspect_scene(out: &Path, json: bool, blocks: usize) -> Result<()> {
    let scene = Scene::read(out)?;
    print(&if json {
        format!("{:#}\n", inspect::json(&scene))
    } else {
        inspect::text(&scene, blocks)
    })
}

/// Makes cells where eyes may be.
#[cfg(feature = "render")]
fn cells(arguments: &CellsArgs) -> Result<()> {
    use hlod::cells::prepare;
    let options = arguments.options();
    options.check()?;
    let places = places(arguments, &options)?;
    let bar = CellBar(bar(arguments.quiet, "{msg:24} {wide_bar} {pos}/{len}  {eta} left"));
    let prepared = with_threads(arguments.threads, || {
        prepare(&arguments.out, &places, &options, arguments.adapter.as_deref(), &bar)
    });
    bar.0.finish_and_clear();
    let prepared = prepared??;
    if arguments.quiet {
        return Ok(());
    }
    let faces = prepared.faces.max(1) as u64;
    print(&format!(
        "{} cells, {} of them from earlier; {} faces: {} triangles and {} bytes each on average\n",
        prepared.cells,
        prepared.known,
        prepared.faces,
        prepared.triangles / faces,
        prepared.bytes / faces,
    ))
}

/// The cells that are asked for.
#[cfg(feature = "render")]
fn places(arguments: &CellsArgs, options: &CellOptions) -> Result<Vec<[i64; 3]>> {
    use hlod::camera::{Ground, eyes_over, read_path, street_eyes};
    use hlod::cells::{along, around};
    let scene = Scene::read(&arguments.out)?;
    let ground = || Ground::read(&scene, &arguments.out);
    match (arguments.height, &arguments.along[..]) {
        (Some(height), _) if !height.is_finite() => {
            Err(Error::Usage(format!("--height: expected metres, found {height}")))
        }
        (Some(height), _) => {
            Ok(around(eyes_over(&ground()?, options.cell_m, height), options.cell_m))
        }
        (None, []) => {
            let places = around(street_eyes(&ground()?), options.cell_m);
            let none = "there is no room to walk in; give paths with --along, or a --height";
            if places.is_empty() { Err(Error::input(&arguments.out, none)) } else { Ok(places) }
        }
        (None, paths) => {
            let mut places = Vec::new();
            for path in paths {
                places.extend(along(&read_path(path, scene.up)?, options.cell_m));
            }
            Ok(places)
        }
    }
}

#[cfg(not(feature = "render"))]
fn cells(_: &CellsArgs) -> Result<()> {
    Err(Error::NoAdapter(
        "cells are drawn, and this program was built without the feature `render`".into(),
    ))
}

impl CellsArgs {
    #[cfg(feature = "render")]
    fn options(&self) -> CellOptions {
        CellOptions {
            cell_m: self.grid.unwrap_or(self.cell),
            cull_m: self.cull,
            pixels: self.pixels,
            error_px: self.error,
            jpeg_quality: self.jpeg_quality,
        }
    }
}

/// Cells on a terminal; nothing elsewhere.
#[cfg(feature = "render")]
struct CellBar(ProgressBar);

#[cfg(feature = "render")]
impl hlod::cells::Progress for CellBar {
    fn begin(&self, cells: usize, known: usize) {
        self.0.set_length(cells as u64);
        self.0.set_position(known as u64);
        self.0.set_message("cells");
    }

    fn done(&self) {
        self.0.inc(1);
    }
}

fn verify_scene(arguments: &VerifyArgs) -> ExitCode {
    let options = VerifyOptions {
        samples: arguments.samples,
        seed: arguments.seed,
        worst: arguments.worst,
        front: arguments.front,
        ..Default::default()
    };
    let bar = PhaseBar::new(arguments.quiet);
    let verified = with_threads(arguments.threads, || {
        verify(&arguments.out, &arguments.source, &options, &bar)
    });
    bar.0.finish_and_clear();
    exit_code(verified.and_then(|verified| verified).and_then(|report| {
        print(&if arguments.json { report.to_json()? } else { verify::text(&report) })?;
        Ok(if report.passed { ExitCode::SUCCESS } else { ExitCode::from(NOT_HELD) })
    }))
}

/// To standard output; that nobody reads on (`| head`) is no error.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::output("standard output", error.to_string()))
        }
        _ => Ok(()),
    }
}

/// The phases of a verification on a terminal; nothing elsewhere.
struct PhaseBar(ProgressBar);

impl PhaseBar {
    fn new(quiet: bool) -> Self {
        Self(bar(quiet, "{msg:24} {wide_bar} {percent:>3} %  {eta} left"))
    }
}

impl verify::Progress for PhaseBar {
    fn phase(&self, name: &str, steps: u64) {
        self.0.reset();
        self.0.set_length(steps);
        self.0.set_message(name.to_owned());
    }

    fn done(&self, steps: u64) {
        self.0.inc(steps);
    }
}

/// Progress on a terminal; nothing elsewhere.
struct Bar {
    bar: ProgressBar,
    found: AtomicU64,
}

impl Bar {
    fn new(quiet: bool) -> Self {
        let bar = bar(quiet, "{msg:24} {wide_bar} {percent:>3} %  {rate}  {eta} left");
        Self { bar, found: AtomicU64::new(0) }
    }
}

/// A bar on a terminal that is not to be quiet.
fn bar(quiet: bool, template: &str) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key(
            "rate",
            |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
                let rate = HumanCount(state.per_sec() as u64);
                let _ = write!(out, "{rate} triangles/s");
            },
        ));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

impl Progress for Bar {
    fn reading(&self, input: &Path, number: usize, of: usize) {
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        self.bar.set_message(if of > 1 {
            format!("{name} ({number} of {of})")
        } else {
            name.into()
        });
    }

    fn found(&self, triangles: u64) {
        let total = self.found.fetch_add(triangles, Ordering::Relaxed) + triangles;
        self.bar.set_length(total);
    }

    fn built(&self, triangles: u64) {
        self.bar.inc(triangles);
    }

    fn finishing(&self) {
        self.bar.set_message("writing the scene");
    }
}
