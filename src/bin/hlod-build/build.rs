//! `hlod-build INPUT... OUT`.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use clap::{Args, ValueEnum};
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions, TreeShape};
use hlod::builder::partition::BlockSplit;
use hlod::builder::progress::Progress;
use hlod::builder::simplify::ladder::Simplifier;
use hlod::builder::threads::with_threads;
use hlod::builder::{BuildOptions, Outcome, Subset, build, build_subset, merge_subsets};
use hlod::bytes::Bytes;
use hlod::mesh::UpAxis;
use hlod::place::{Place, Placement};
use hlod::report::build_summary;
use hlod::{Error, Result};
use indicatif::ProgressBar;

use crate::terminal::{bar, print};

#[derive(Args, Debug)]
pub struct BuildArgs {
    /// Models (.obj, .gltf, .glb) or folders of them; the last is the output folder
    #[arg(value_name = "INPUT... OUT", required = true, num_args = 2..)]
    paths: Vec<PathBuf>,

    /// Divides the city into blocks, whatever its files and groups are: `auto` (cells of at most 128
    /// times --desired-tris triangles and 2^26 texels), or `grid:METRES` (squares of METRES on the ground)
    #[arg(long, value_name = "MODE", default_value = "auto", help_heading = "Hierarchy")]
    blocks: BlockSplit,
    /// Nodes above the blocks, so that a view of a whole city costs the same however many blocks it
    /// has: `on`, or `off`, with which such a view draws at least the roots of all blocks
    #[arg(long, value_enum, default_value_t = SwitchArg::On, help_heading = "Hierarchy")]
    upper_levels: SwitchArg,
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
    /// How borders on cutting planes are simplified: `skirts` identically on both sides, with strips
    /// over the gaps between levels; `locked` not at all
    #[arg(long, value_enum, default_value_t = BordersArg::Skirts, help_heading = "Hierarchy")]
    borders: BordersArg,
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

    /// Copyright notice to write into every node and the tileset, behind those of glTF inputs
    /// (asset.copyright), which are kept in any case
    #[arg(long, value_name = "TEXT", help_heading = "Files")]
    copyright: Option<String>,
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
    /// Normals of triangles without a texture: those of the source where it has any, else one for each
    /// face. Viewers that need them to light such triangles draw one flat colour without
    #[arg(long, value_enum, default_value_t = SwitchArg::On, help_heading = "Files")]
    normals: SwitchArg,

    /// Build the Kth of N shares of the blocks, into OUT/subsets/K-of-N: N machines that see the same
    /// files build one each, and `hlod-build merge OUT` joins them. Inputs, as they are written here, and
    /// options must be the same for all; N is at most the number of blocks
    #[arg(long, value_name = "K/N", help_heading = "Running")]
    subset: Option<Subset>,
    /// Threads, 0-1024; 0 is one for each core. The result does not depend on it
    #[arg(long, short = 'j', value_name = "N", default_value_t = 0, help_heading = "Running")]
    threads: usize,
    /// Keep to this many bytes of memory, 128MiB or more: OBJ files of more than 16 MiB are divided into tiles on
    /// disk, which are read one at a time. During the build the tiles take up to 1.5 times the size of the files,
    /// beside the output. The result is the same for any number, and nearly that without
    #[arg(long, value_name = "BYTES", help_heading = "Running")]
    max_memory: Option<Bytes>,
    /// Go on from what a build with --resume that was stopped had finished, and leave what is finished beside
    /// the output where this one is stopped. A build without it removes what is left
    #[arg(long, conflicts_with = "force", help_heading = "Running")]
    resume: bool,
    /// Build even where nothing has changed
    #[arg(long, help_heading = "Running")]
    force: bool,
    /// Print nothing but errors
    #[arg(long, short, help_heading = "Running")]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum SwitchArg {
    On,
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum CompressArg {
    None,
    Meshopt,
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
enum BordersArg {
    Locked,
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
                simplifier: match self.simplifier {
                    SimplifierArg::Qem => Simplifier::Qem,
                    SimplifierArg::Clustering => Simplifier::Clustering,
                },
                borders: match self.borders {
                    BordersArg::Locked => BorderMode::Locked,
                    BordersArg::Skirts => BorderMode::Skirts,
                },
                ..Default::default()
            },
            blocks: self.blocks,
            upper_levels: self.upper_levels == SwitchArg::On,
            up: self.up.map(|up| match up {
                UpArg::Y => UpAxis::Y,
                UpArg::Z => UpAxis::Z,
            }),
            placement: self.placement(),
            copyright: self.copyright.clone(),
            jpeg_quality: self.jpeg_quality,
            max_atlas: self.max_atlas,
            quantize: self.quantize,
            compress: self.compress == CompressArg::Meshopt,
            normals: self.normals == SwitchArg::On,
            max_memory: self.max_memory.map(|Bytes(bytes)| bytes),
            resume: self.resume,
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

/// Builds, and prints what was built.
pub fn run(arguments: &BuildArgs) -> Result<()> {
    let [inputs @ .., out] = &arguments.paths[..] else {
        return Err(Error::Usage("expected INPUT... and OUT".into()));
    };
    let options = arguments.options();
    let bar = Bar::new(arguments.quiet);
    let outcome = with_threads(arguments.threads, || match arguments.subset {
        Some(subset) => build_subset(inputs, out, &options, subset, &bar),
        None => build(inputs, out, &options, &bar),
    })?;
    bar.bar.finish_and_clear();
    let outcome = outcome?;
    if arguments.quiet {
        return Ok(());
    }
    let out = arguments.subset.map_or_else(|| out.clone(), |subset| subset.dir(out));
    print(&match outcome {
        Outcome::UpToDate(report) => build_summary::up_to_date(&report, &out),
        Outcome::Built(report) => build_summary::built(&report, &out),
    })
}

#[derive(Args, Debug)]
pub struct MergeArgs {
    /// The output folder in which all subsets stand
    out: PathBuf,
    /// Threads, 0-1024; 0 is one for each core. The result does not depend on it
    #[arg(long, short = 'j', value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Joins subsets, and prints what was built.
pub fn merge(arguments: &MergeArgs) -> Result<()> {
    let MergeArgs { out, threads, quiet } = arguments;
    let bar = Bar::new(*quiet);
    let report = with_threads(*threads, || merge_subsets(out, &bar))?;
    bar.bar.finish_and_clear();
    let report = report?;
    match quiet {
        true => Ok(()),
        false => print(&build_summary::merged(&report, out)),
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

impl Progress for Bar {
    fn reading(&self, input: &Path, number: usize, of: usize) {
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        self.bar.set_message(if of > 1 {
            format!("{name} ({number} of {of})")
        } else {
            name.into()
        });
    }

    fn dividing(&self, input: &Path) {
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        self.bar.set_message(format!("{name}: dividing"));
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
