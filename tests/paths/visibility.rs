//! What hidden nodes leave out of an image: nothing.

use hlod::bench::{BenchOptions, ClockConstants, PolicyChoice, ReferenceRenderer, Session, Size};
use hlod::camera::{Ground, PathKind, make_path};

use crate::twice::Twice;

pub const SIZE: [u32; 2] = [640, 360];
/// Of so many frames one is drawn, with hidden nodes and without.
const DRAWN: usize = 9;

/// Along a walk, a flight and a rise: how many nodes were hidden in the frames drawn, and what differs
/// without them.
pub fn hidden_and_faults(
    session: &Session,
    ground: &Ground,
    renderer: &mut ReferenceRenderer,
) -> (usize, Vec<String>) {
    let mut twice = Twice::new(renderer, DRAWN);
    for kind in [PathKind::Walk, PathKind::Fly, PathKind::Rise] {
        let path = make_path(ground, kind, kind.default_frames(), 30.0, 3).unwrap();
        let policy = PolicyChoice::new("gain-over-price", &Default::default()).unwrap();
        let options = BenchOptions { policy, size: Size(SIZE), ..BenchOptions::default() };
        let constants = ClockConstants::default();
        session.run_model(&path, options, constants, Some(&mut twice), |_| true).unwrap();
    }
    let [_, nodes, _] = twice.counts;
    (nodes, twice.faults)
}
