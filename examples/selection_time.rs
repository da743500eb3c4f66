//! Measures how long it takes to choose what a frame draws, and what the engine adds to that, while
//! ever more stands below what can be drawn: `cargo run --release --no-default-features --example
//! selection_time`.
//!
//! Houses are in memory down to their fourth level. Policies visit these nodes and their
//! children, some 3,000 in all, however many there are below; those that go by a threshold stop
//! earlier. Scenes and policies take turns, and the median frame of the shortest turn counts:
//! what else a machine does only ever adds.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use glam::DVec3;
use hlod::Result;
use hlod::bench::ClockConstants;
use hlod::camera::{Pose, View, from_angles};
use hlod::engine::policies::{BY_ERROR, POLICIES, PolicyKind, Settings};
use hlod::engine::{Backend, CostModel, Drawn, Engine, lock};
use hlod::mesh::UpAxis;
use hlod::runtime::SceneTree;
use hlod::runtime::residency::{Changes, NodeSize, Residency, ResidencyOptions, Sizes};

#[path = "../tests/bench/tall_street.rs"]
mod tall_street;

const FRAMES: usize = 300;
/// Until all is there that can be.
const WARM_UP: usize = 200;
const ROUNDS: usize = 3;
const HOUSES: usize = 9;
/// Nodes from this level on cannot be loaded.
const ABSENT: u32 = 4;
const FRAME_S: f64 = 0.02;
/// Time for all of them.
const TARGET_MS: f64 = 1e6;

/// Draws nothing and loads at once.
struct Idle<'a> {
    tree: &'a SceneTree,
    start: Instant,
}

impl Backend for Idle<'_> {
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()> {
        let mut residency = lock(residency)?;
        for &root in roots {
            let step = residency.load_root(root);
            residency.chunk_read(root, step.bytes);
            residency.loaded(root);
        }
        Ok(())
    }

    fn apply(&mut self, _: &Changes) -> Result<f64> {
        Ok(0.0)
    }

    fn now_ms(&mut self) -> f64 {
        self.start.elapsed().as_secs_f64() * 1e3
    }

    fn draw(&mut self, _: &[u32], _: &View) -> Result<Drawn> {
        Ok(Drawn { draw_ms: 1.0, gpu_ms: None })
    }

    fn end_frame(&mut self, residency: &Mutex<Residency>, _: f64, _: f64) -> Result<()> {
        let mut residency = lock(residency)?;
        while let Some(step) = residency.next_step() {
            if self.tree.node(step.node).level >= ABSENT {
                residency.broken(step.node);
            } else if residency.chunk_read(step.node, step.bytes) {
                residency.loaded(step.node);
            }
        }
        Ok(())
    }

    fn process_bytes(&mut self) -> u64 {
        0
    }
}

/// In front of the street, all of it in view, on its way along it.
fn view(frame: usize) -> View {
    let pose = Pose {
        position: DVec3::new(-60.0 + frame as f64 * 0.01, 0.0, 0.0),
        rotation: from_angles(UpAxis::Z, 0.0, 0.0, 0.0),
        fov_y_deg: 60.0,
    };
    View::new(pose, DVec3::X * 0.3, [1280, 720])
}

/// A policy over a scene, with the shortest times so far.
struct Case {
    kind: PolicyKind,
    tree: Arc<SceneTree>,
    select_ms: f64,
    rest_ms: f64,
    visited: u32,
    drawn: u32,
}

impl Case {
    fn measure(&mut self) -> Result<()> {
        let tree = &*self.tree;
        let node = NodeSize { file_bytes: 1000, held_bytes: 1000, ..NodeSize::default() };
        let sizes = Sizes { nodes: vec![node; tree.len()], textures: Vec::new() };
        let residency = Residency::new(tree, sizes, ResidencyOptions::default())?;
        let mut settings = Settings::new();
        if self.kind.name == BY_ERROR {
            settings.insert("pixels".to_owned(), 0.1);
        }
        let mut policy = self.kind.make(&settings)?;
        let mut backend = Idle { tree, start: Instant::now() };
        let costs = CostModel::new(&ClockConstants::default().prices);
        let residency = Arc::new(Mutex::new(residency));
        let mut engine =
            Engine::start(tree, &mut *policy, residency, &mut backend, costs, TARGET_MS)?;
        let (mut select_ms, mut rest_ms) = (Vec::new(), Vec::new());
        for frame in 0..WARM_UP + FRAMES {
            let view = view(frame);
            let begin = Instant::now();
            let report = engine.frame(&view, FRAME_S)?;
            let whole_ms = begin.elapsed().as_secs_f64() * 1e3;
            if frame >= WARM_UP {
                select_ms.push(report.select_ms);
                rest_ms.push(whole_ms - report.select_ms);
                (self.visited, self.drawn) = (report.visited, report.nodes);
            }
        }
        self.select_ms = self.select_ms.min(median(select_ms));
        self.rest_ms = self.rest_ms.min(median(rest_ms));
        Ok(())
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() -> Result<()> {
    let trees: Vec<Arc<SceneTree>> = [ABSENT, ABSENT + 3]
        .map(|depth| Arc::new(SceneTree::new(&tall_street::street(HOUSES, depth).breadth_first())))
        .into();
    let case = |(kind, tree): (PolicyKind, &Arc<SceneTree>)| Case {
        kind,
        tree: Arc::clone(tree),
        select_ms: f64::INFINITY,
        rest_ms: f64::INFINITY,
        visited: 0,
        drawn: 0,
    };
    let pairs = POLICIES.into_iter().flat_map(|kind| trees.iter().map(move |tree| (kind, tree)));
    let mut cases: Vec<Case> = pairs.map(case).collect();
    for _ in 0..ROUNDS {
        for case in &mut cases {
            case.measure()?;
        }
    }
    println!(
        "{:>17} {:>8} {:>8} {:>6} {:>9} {:>9}",
        "policy", "nodes", "visited", "drawn", "select ms", "engine ms"
    );
    for case in &cases {
        let Case { kind, tree, select_ms, rest_ms, visited, drawn } = case;
        let (policy, nodes) = (kind.name, tree.len());
        println!("{policy:>17} {nodes:>8} {visited:>8} {drawn:>6} {select_ms:>9.3} {rest_ms:>9.3}");
    }
    for pair in cases.chunks(2) {
        let counts = |case: &Case| (case.visited, case.drawn);
        assert_eq!(counts(&pair[0]), counts(&pair[1]), "{}: more is visited", pair[0].kind.name);
    }
    assert!(cases[0].visited > 3_000, "{} nodes are visited", cases[0].visited);
    Ok(())
}
