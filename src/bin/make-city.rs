//! Generates a city for tests and benchmarks: arguments in, exit code out.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use hlod::city::{self, CityOptions, TextureSize};
use hlod::{Error, Result};

/// Generates a city of scanned façades, for tests and benchmarks.
///
/// A block is one side of a city block, and one group of the file: a noisy façade with windows,
/// ledges, occlusion holes and one large texture of numbered tiles, and coarser roofs and ground
/// without texture. Metres, z up.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 success, 1 internal error, 2 usage, 4 output not written.\n\n\
        Examples:\n  \
        make-city --blocks 25 --triangles 400000 city.obj\n  \
        make-city --blocks 70 --triangles 5600000 --offset 678016,5403456,400 city.obj\n  \
        make-city --blocks 25 --triangles 8950000 --texels-per-triangle 105 city.glb"
)]
struct Arguments {
    /// OUT.obj (with OUT.mtl and OUT_textures/ beside it) or OUT.glb; with --split a folder.
    /// An earlier city there is replaced, missing parent folders are created
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Blocks, 1 to 100000
    #[arg(long, value_name = "N", default_value_t = CityOptions::default().blocks)]
    blocks: usize,
    /// Triangles of the whole city, met within 1 %; 2000 to 20 million a block
    #[arg(long, value_name = "N", default_value_t = CityOptions::default().triangles)]
    triangles: u64,
    /// Texture size, in texels for each triangle of the block, 0.1 to 10000 [default: 17]
    #[arg(long, value_name = "X", conflicts_with_all = ["texture_size", "no_textures"], help_heading = "Textures")]
    texels_per_triangle: Option<f64>,
    /// Texture size of every block in texels, 16 to 16384 on each side
    #[arg(long, value_name = "WxH", value_parser = parse_size, conflicts_with = "no_textures", help_heading = "Textures")]
    texture_size: Option<(u32, u32)>,
    /// Charts that each block's texture is torn into, shuffled as in the atlases of scans, 1 to
    /// 100000; 1 leaves it whole
    #[arg(long, value_name = "N", default_value_t = CityOptions::default().charts, conflicts_with = "no_textures", help_heading = "Textures")]
    charts: u32,
    /// No textures and no texture coordinates
    #[arg(long, help_heading = "Textures")]
    no_textures: bool,
    /// World position of the city's corner, metres within ±16000000, rounded to 0.1 mm
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_parser = parse_offset,
        default_value = "0,0,0",
        allow_hyphen_values = true
    )]
    offset: Offset,
    /// Seed of the random numbers: another seed gives another city
    #[arg(long, value_name = "N", default_value_t = CityOptions::default().seed)]
    seed: u64,
    /// One closed surface for each block: no holes; façade, roofs and base welded
    #[arg(long)]
    watertight: bool,
    /// Quality of the JPEG textures, 1 to 100
    #[arg(long, value_name = "Q", default_value_t = CityOptions::default().jpeg_quality, help_heading = "Textures")]
    jpeg_quality: u8,
    /// Write a folder with an OBJ, an MTL and a texture for each block, rather than one file
    #[arg(long)]
    split: bool,
    /// Threads, 1-1024; the result does not depend on it [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy)]
struct Offset([f64; 3]);

fn parse_offset(text: &str) -> Result<Offset, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| format!("{part:?} is no number")))
        .collect::<Result<_, String>>()?;
    <[f64; 3]>::try_from(numbers)
        .map(Offset)
        .map_err(|found| format!("expected three numbers, found {}", found.len()))
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    text.split_once(['x', 'X'])
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)))
        .ok_or_else(|| "expected WIDTHxHEIGHT, as 4096x1024".to_owned())
}

impl Arguments {
    fn options(&self) -> CityOptions {
        let texture = match (self.no_textures, self.texture_size, self.texels_per_triangle) {
            (true, ..) => TextureSize::None,
            (_, Some((width, height)), _) => TextureSize::Fixed(width, height),
            (.., Some(texels)) => TextureSize::PerTriangle(texels),
            _ => CityOptions::default().texture,
        };
        CityOptions {
            blocks: self.blocks,
            triangles: self.triangles,
            texture,
            charts: self.charts,
            offset: self.offset.0,
            seed: self.seed,
            watertight: self.watertight,
            jpeg_quality: self.jpeg_quality,
            split: self.split,
        }
    }

    fn run(&self) -> Result<()> {
        let threads = self.threads.map_or(0, usize::from);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| Error::Internal(format!("cannot start threads: {error}")))?;
        let start = std::time::Instant::now();
        let summary = pool.install(|| city::write(&self.options(), &self.out))?;
        if !self.quiet {
            println!("written           {}", self.out.display());
            println!("{summary}");
            println!("seconds           {:.2}", start.elapsed().as_secs_f64());
        }
        Ok(())
    }
}

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make-city: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
