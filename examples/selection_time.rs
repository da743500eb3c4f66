//! Measures how long it takes to choose what a frame draws, while ever more stands below what can
//! be drawn: `cargo run --release --no-default-features --example selection_time`.
//!
//! Houses are in memory down to their fourth level. Selection visits these nodes and their
//! children, however many there are below.

use std::time::Instant;

use glam::DVec3;
use hlod::camera::{Pose, View, from_angles};
use hlod::mesh::UpAxis;
use hlod::runtime::lakhia::{Lakhia, LakhiaOptions};
use hlod::runtime::{Policy, Residents, SceneTree, Selection};

#[path = "../tests/bench/tall_street.rs"]
mod tall_street;

const FRAMES: u32 = 500;
const ROUNDS: usize = 5;
const HOUSES: usize = 12;
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

fn main() {
    println!("{:>8} {:>8} {:>8} {:>10}", "nodes", "visited", "drawn", "ms a frame");
    let mut first = None;
    for depth in ABSENT..ABSENT + 4 {
        let tree = SceneTree::new(&tall_street::street(HOUSES, depth));
        let mut residents = Residents::none(tree.len());
        (0..tree.len() as u32).for_each(|n| residents.set(n, tree.node(n).level < ABSENT));
        // Time for all of them.
        let options = LakhiaOptions { target_ms: 1e9, ..LakhiaOptions::default() };
        let mut best_ms = f64::INFINITY;
        let mut selection = Selection::default();
        for _ in 0..ROUNDS {
            let mut policy = Lakhia::new(options);
            policy.select(&tree, &view(0), &residents, &mut selection);
            let begin = Instant::now();
            for frame in 0..FRAMES {
                policy.select(&tree, &view(frame), &residents, &mut selection);
            }
            best_ms = best_ms.min(begin.elapsed().as_secs_f64() * 1e3 / f64::from(FRAMES));
        }
        let counts = (selection.visited(), selection.front.len());
        assert_eq!(*first.get_or_insert(counts), counts, "more is visited");
        assert!(counts.0 > 3_000 && selection.culled == 0, "{counts:?}");
        println!("{:>8} {:>8} {:>8} {best_ms:>10.3}", tree.len(), counts.0, counts.1);
    }
}
