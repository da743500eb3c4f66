//! Whether frames are the same, bit for bit, with what `--visibility on` leaves out and without.
//!
//! usage: hidden_pixels OUT PATH.csv...
//!
//! Replays paths by the model clock and draws every frame in which nodes are hidden twice. Prints, for
//! each path, how many frames and nodes that were, and how many pixels differ; fails where any does.

use std::error::Error;
use std::path::Path;

use hlod::bench::{BenchOptions, ClockConstants, PolicyChoice, ReferenceRenderer, Session};
use hlod::camera::read_path;
use hlod::render::RenderOptions;
use twice::Twice;

#[path = "../tests/paths/twice.rs"]
mod twice;

const SIZE: [u32; 2] = [1280, 720];
const CAP_BYTES: u64 = 1 << 30;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [out, paths @ ..] = &files[..] else { return Err("OUT PATH.csv...".into()) };
    let session = Session::open(Path::new(out))?;
    let options = RenderOptions { size: SIZE, ..RenderOptions::default() };
    let mut renderer = ReferenceRenderer::new(&session, &options, CAP_BYTES)?;
    let mut all = 0;
    for path in paths {
        let camera = read_path(Path::new(path), session.scene().up)?;
        let policy = PolicyChoice::new("gain-over-price", &Default::default())?;
        let options = BenchOptions { policy, ..BenchOptions::default() };
        let mut twice = Twice::new(&mut renderer, 1);
        let constants = ClockConstants::default();
        session.run_model(&camera, options, constants, Some(&mut twice), |_| true)?;
        twice.faults.iter().for_each(|fault| println!("{fault}"));
        let ([frames, nodes, pixels], of) = (twice.counts, camera.frames.len());
        println!(
            "{out} {path}: {frames} of {of} frames, {nodes} nodes hidden, {pixels} pixels differ"
        );
        all += pixels;
    }
    if all > 0 { Err(format!("{all} pixels differ").into()) } else { Ok(()) }
}
