//! Measures how long it takes to choose what a frame draws, while ever more stands below what can
//! be drawn: `cargo run --release --no-default-features --example selection_time`.
//!
//! Houses are in memory down to their fourth level. Selection visits these nodes and their
//! children, some 3,000 in all, however many there are below. Scenes take turns, and the shortest
//! of their turns counts: what else a machine does only ever adds.

use std::time::Instant;

use glam::DVec3;
use hlod::bench::ClockConstants;
use hlod::camera::{Pose, View, from_angles};
use hlod::engine::policies::lakhia::{Lakhia, LakhiaOptions};
use hlod::engine::{CostModel, FrameInput, Policy, Residents, Selection};
use hlod::mesh::UpAxis;
use hlod::runtime::SceneTree;
use hlod::runtime::residency::MemoryUse;

#[path = "../tests/bench/tall_street.rs"]
mod tall_street;

const FRAMES: u32 = 500;
const ROUNDS: usize = 10;
const HOUSES: usize = 9;
/// Nodes from this level on are not in memory.
const ABSENT: u32 = 4;

/// In front of the street, all of it in view, on its way along it.
fn view(frame: u32) -> View {
    let pose = Pose {
        position: DVec3::new(-60.0 + f64::from(frame) * 0.01, 0.0, 0.0),
        rotation: from_angles(UpAxis::Z, 0.0, 0.0, 0.0),
        fov_y_deg: 60.0,
    };
    View::new(pose, DVec3::X * 0.3, [1280, 720])
}

/// A scene, what of it is in memory, and the shortest time so far.
struct Case {
    tree: SceneTree,
    residents: Residents,
    best_ms: f64,
    selection: Selection,
}

impl Case {
    fn new(depth: u32) -> Self {
        let tree = SceneTree::new(&tall_street::street(HOUSES, depth));
        let mut residents = Residents::none(tree.len());
        (0..tree.len() as u32).for_each(|n| residents.set(n, tree.node(n).level < ABSENT));
        Self { tree, residents, best_ms: f64::INFINITY, selection: Selection::default() }
    }

    fn measure(&mut self) {
        let Self { tree, residents, best_ms, selection } = self;
        let costs = CostModel::new(&ClockConstants::default().prices);
        let mut policy = Lakhia::new(LakhiaOptions::default());
        let mut select = |frame| {
            // Time for all of them.
            let frame = FrameInput {
                tree,
                view: &view(frame),
                predicted: &[],
                residents,
                memory: MemoryUse::default(),
                costs: &costs,
                target_ms: 1e9,
                budget_ms: 1e9,
                dt_s: 0.02,
            };
            policy.select(&frame, selection);
        };
        select(0);
        let begin = Instant::now();
        (0..FRAMES).for_each(select);
        *best_ms = best_ms.min(begin.elapsed().as_secs_f64() * 1e3 / f64::from(FRAMES));
    }
}

fn main() {
    let mut cases: Vec<Case> = (ABSENT..ABSENT + 4).map(Case::new).collect();
    for _ in 0..ROUNDS {
        cases.iter_mut().for_each(Case::measure);
    }
    println!("{:>8} {:>8} {:>8} {:>10}", "nodes", "visited", "drawn", "ms a frame");
    let mut first = None;
    for Case { tree, best_ms, selection, .. } in &cases {
        let counts = (selection.visited(), selection.front.len());
        assert_eq!(*first.get_or_insert(counts), counts, "more is visited");
        assert!(counts.0 > 3_000 && selection.culled == 0, "{counts:?}");
        println!("{:>8} {:>8} {:>8} {best_ms:>10.3}", tree.len(), counts.0, counts.1);
    }
}
