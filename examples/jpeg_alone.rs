//! Decodes and encodes the JPEGs of a folder, each once, and does nothing else: the least that a
//! build which changes every picture can take. `scripts/bench-build` sets the build against it.
//!
//! usage: jpeg_alone [--threads N] FOLDER

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use hlod::decode::decode_texture;
use hlod::mesh::{TextureData, TextureSource};
use jpeg_encoder::{ColorType, Encoder};
use rayon::prelude::*;

/// That of `hlod-build` where nothing else is asked for.
const QUALITY: u8 = 85;

fn main() -> Result<(), Box<dyn Error>> {
    let (threads, folder) = match &std::env::args().skip(1).collect::<Vec<_>>()[..] {
        [folder] => (0, PathBuf::from(folder)),
        [flag, threads, folder] if flag == "--threads" => (threads.parse()?, folder.into()),
        _ => return Err("usage: jpeg_alone [--threads N] FOLDER".into()),
    };
    let mut pictures = Vec::new();
    for entry in std::fs::read_dir(&folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "jpg") {
            pictures.push(path);
        }
    }
    pictures.sort();

    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let begin = Instant::now();
    let texels = pool.install(|| {
        pictures
            .par_iter()
            .map(|path| again(path).map_err(|error| error.to_string()))
            .sum::<Result<u64, String>>()
    })?;
    let seconds = begin.elapsed().as_secs_f64();
    println!("{} pictures, {texels} texels, {seconds:.4} s", pictures.len());
    Ok(())
}

/// Decodes and encodes one picture; the number of its texels.
fn again(path: &Path) -> Result<u64, Box<dyn Error>> {
    let name = path.display().to_string();
    let source = TextureSource { name, data: TextureData::File(path.into()), opacity: None };
    let picture = decode_texture(&source)?.into_opaque();
    let mut bytes = Vec::with_capacity(picture.pixels.len() / 8);
    let (width, height) = (u16::try_from(picture.width)?, u16::try_from(picture.height)?);
    Encoder::new(&mut bytes, QUALITY).encode(&picture.pixels, width, height, ColorType::Rgb)?;
    std::hint::black_box(&bytes);
    Ok(picture.texels())
}
