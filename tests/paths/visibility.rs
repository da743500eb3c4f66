//! What hidden nodes leave out of an image: nothing.

use hlod::bench::{
    Accuracy, BenchOptions, ClockConstants, FrameInspector, FrameSample, PolicyChoice,
    ReferenceRenderer, Session, Size,
};
use hlod::camera::{Ground, PathKind, make_path};

pub const SIZE: [u32; 2] = [640, 360];
/// Of so many frames one is drawn, with hidden nodes and without.
const DRAWN: usize = 9;

struct Twice<'a> {
    renderer: &'a mut ReferenceRenderer,
    hidden: usize,
    faults: Vec<String>,
}

impl FrameInspector for Twice<'_> {
    fn wants(&self, index: usize, _: bool) -> bool {
        index.is_multiple_of(DRAWN)
    }

    fn inspect(&mut self, frame: FrameSample<'_>) -> hlod::Result<Accuracy> {
        if !frame.hidden.is_empty() {
            self.hidden += frame.hidden.len();
            let drawn = self.renderer.render(frame.front, &frame.view.pose)?;
            let all = [frame.front, frame.hidden].concat();
            let whole = self.renderer.render(&all, &frame.view.pose)?;
            let differ = drawn.pixels().zip(whole.pixels()).filter(|(a, b)| a != b).count();
            if differ > 0 {
                let (frame, hidden) = (frame.frame, frame.hidden);
                self.faults.push(format!("frame {frame}: {differ} pixels without {hidden:?}"));
            }
        }
        Ok(Accuracy::default())
    }
}

/// Along a walk, a flight and a rise: how many nodes were hidden in the frames drawn, and what differs
/// without them.
pub fn hidden_and_faults(
    session: &Session,
    ground: &Ground,
    renderer: &mut ReferenceRenderer,
) -> (usize, Vec<String>) {
    let mut twice = Twice { renderer, hidden: 0, faults: Vec::new() };
    for kind in [PathKind::Walk, PathKind::Fly, PathKind::Rise] {
        let path = make_path(ground, kind, kind.default_frames(), 30.0, 3).unwrap();
        let policy = PolicyChoice::new("gain-over-price", &Default::default()).unwrap();
        let options = BenchOptions { policy, size: Size(SIZE), ..BenchOptions::default() };
        let constants = ClockConstants::default();
        session.run_model(&path, options, constants, Some(&mut twice), |_| true).unwrap();
    }
    (twice.hidden, twice.faults)
}
