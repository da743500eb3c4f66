//! Cuts a model into N by N files, squares of the ground that have their borders in common.
//!
//! usage: cut_into_tiles MODEL N FOLDER [MILLIMETRES]
//!
//! With MILLIMETRES, each tile is shifted at random by at most that along each axis, so that borders agree only nearly.

use std::error::Error;
use std::path::Path;

use hlod::mesh::{UpAxis, UpEvidence};
use hlod::random::Random;

#[path = "../tests/common/tiles.rs"]
mod tiles;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, n, dir, rest @ ..] = &arguments[..] else {
        return Err("usage: cut_into_tiles MODEL N FOLDER [MILLIMETRES]".into());
    };
    let metres = rest.first().map_or(Ok(0.0), |text| text.parse::<f64>())? / 1000.0;
    let model = hlod::import::load(Path::new(model))?;
    let axes = match UpEvidence::of(&model).guess().axis {
        UpAxis::Y => [0, 2],
        UpAxis::Z => [0, 1],
    };
    let shift = |[x, y]: [usize; 2]| {
        let mut random = Random::new(1, (x * 1000 + y) as u64);
        [(); 3].map(|()| metres * (2.0 * random.unit() - 1.0))
    };
    let files = tiles::cut_into_tiles(&model, n.parse()?, axes, Path::new(dir), shift)?;
    println!("{} files", files.len());
    Ok(())
}
