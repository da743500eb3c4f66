//! `hlod-build cells`.

use std::path::PathBuf;

use clap::Args;
use hlod::cells::{Balance, CellOptions};
use hlod::{Error, Result};

#[derive(Args, Debug)]
pub struct CellsArgs {
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
    /// Choose the cull box of each cell, 30 to 480 metres from it, so that what is near in a view comes to so many
    /// triangles, 1 or more, and the sum of its error in pixels and that of what is far is least. About as many
    /// as there is time for in a frame
    #[arg(long, value_name = "N", default_value_t = Balance::default().triangles)]
    triangles: u64,
    /// What a pixel of error of what is far counts, over one of what is near; above 0
    #[arg(long, value_name = "WEIGHT", default_value_t = Balance::default().far_weight)]
    far_weight: f64,
    /// The same cull box for all cells in place of these: metres from a cell to its sides, above 0. What is farther
    /// is drawn from its faces
    #[arg(long, value_name = "METRES", conflicts_with_all = ["triangles", "far_weight"])]
    cull: Option<f64>,
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

/// Makes cells where eyes may be, and prints what was made.
#[cfg(feature = "render")]
pub fn cells(arguments: &CellsArgs) -> Result<()> {
    use hlod::builder::threads::with_threads;
    use hlod::cells::prepare;

    use crate::terminal::{bar, print};
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
    let [least, most] = prepared.cull_m.map(|metres| format!("{metres:.0}"));
    let boxes = if least == most { least } else { format!("{least} to {most}") };
    print(&format!(
        "{} cells, {} of them from earlier; cull boxes of {boxes} m; {} faces: {} triangles and {} \
         bytes each on average\n",
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
    let scene = hlod::format::Scene::read(&arguments.out)?;
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
pub fn cells(_: &CellsArgs) -> Result<()> {
    Err(Error::NoAdapter(
        "cells are drawn, and this program was built without the feature `render`".into(),
    ))
}

impl CellsArgs {
    #[cfg(feature = "render")]
    fn options(&self) -> CellOptions {
        CellOptions {
            cell_m: self.grid.unwrap_or(self.cell),
            cull_m: self.cull.unwrap_or(CellOptions::default().cull_m),
            balance: match self.cull {
                Some(_) => None,
                None => Some(Balance { triangles: self.triangles, far_weight: self.far_weight }),
            },
            pixels: self.pixels,
            error_px: self.error,
            jpeg_quality: self.jpeg_quality,
        }
    }
}

/// Cells on a terminal; nothing elsewhere.
#[cfg(feature = "render")]
struct CellBar(indicatif::ProgressBar);

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
