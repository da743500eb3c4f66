//! Whether frames are the same, bit for bit, with what `--visibility on` leaves out and without.
//!
//! usage: hidden_pixels OUT PATH.csv...
//!
//! Replays paths by the model clock and draws every frame in which nodes are hidden twice. Prints, for
//! each path, how many frames and nodes that were, and how many pixels differ; fails where any does.

use std::error::Error;
use std::path::Path;

use hlod::bench::{
    Accuracy, BenchOptions, ClockConstants, FrameInspector, FrameSample, PolicyChoice,
    ReferenceRenderer, Session,
};
use hlod::camera::read_path;
use hlod::render::RenderOptions;

const SIZE: [u32; 2] = [1280, 720];
const CAP_BYTES: u64 = 1 << 30;

struct Twice {
    renderer: ReferenceRenderer,
    frames: u64,
    nodes: u64,
    pixels: u64,
}

impl FrameInspector for Twice {
    fn wants(&self, _: usize, _: bool) -> bool {
        true
    }

    fn inspect(&mut self, frame: FrameSample<'_>) -> hlod::Result<Accuracy> {
        if !frame.hidden.is_empty() {
            let drawn = self.renderer.render(frame.front, &frame.view.pose)?;
            let whole = [frame.front, frame.hidden].concat();
            let whole = self.renderer.render(&whole, &frame.view.pose)?;
            let differ = drawn.pixels().zip(whole.pixels()).filter(|(a, b)| a != b).count();
            if differ > 0 {
                println!("frame {}: {differ} pixels of {:?}", frame.frame, frame.hidden);
            }
            self.frames += 1;
            self.nodes += frame.hidden.len() as u64;
            self.pixels += differ as u64;
        }
        Ok(Accuracy::default())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [out, paths @ ..] = &files[..] else { return Err("OUT PATH.csv...".into()) };
    let session = Session::open(Path::new(out))?;
    let options = RenderOptions { size: SIZE, ..RenderOptions::default() };
    let mut twice = Twice {
        renderer: ReferenceRenderer::new(&session, &options, CAP_BYTES)?,
        frames: 0,
        nodes: 0,
        pixels: 0,
    };
    let mut all = 0;
    for path in paths {
        let camera = read_path(Path::new(path), session.scene().up)?;
        let policy = PolicyChoice::new("gain-over-price", &Default::default())?;
        let options = BenchOptions { policy, ..BenchOptions::default() };
        let constants = ClockConstants::default();
        session.run_model(&camera, options, constants, Some(&mut twice), |_| true)?;
        let Twice { frames, nodes, pixels, .. } = &mut twice;
        println!(
            "{out} {path}: {frames} of {} frames, {nodes} nodes hidden, {pixels} pixels differ",
            camera.frames.len()
        );
        all += std::mem::take(pixels);
        (*frames, *nodes) = (0, 0);
    }
    if all > 0 { Err(format!("{all} pixels differ").into()) } else { Ok(()) }
}
