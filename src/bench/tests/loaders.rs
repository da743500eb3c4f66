//! Loaders that are slow, stall or fail, under every policy.

use std::sync::{Arc, Mutex};

use super::{constants, street, walk};
use crate::Result;
use crate::bench::{BenchOptions, ModelBackend, PolicyChoice, Replay, Run, run};
use crate::camera::View;
use crate::engine::policies::{POLICIES, Settings};
use crate::engine::{Backend, CostModel, Drawn, lock};
use crate::runtime::SceneTree;
use crate::runtime::residency::{Changes, Residency, ResidencyOptions, Sizes};

/// A chunk a frame, but in some frames none, and of some nodes none that can be used.
struct Loader<'a> {
    model: ModelBackend<'a>,
    frames: u32,
    /// Loads in this frame.
    loads: fn(u32) -> bool,
    /// The files of a node are damaged.
    is_broken: fn(u32) -> bool,
}

impl Backend for Loader<'_> {
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()> {
        self.model.load_roots(residency, roots)
    }

    fn apply(&mut self, changes: &Changes) -> Result<f64> {
        self.model.apply(changes)
    }

    fn now_ms(&mut self) -> f64 {
        0.0
    }

    fn draw(&mut self, front: &[u32], view: &View) -> Result<Drawn> {
        self.model.draw(front, view)
    }

    fn end_frame(&mut self, residency: &Mutex<Residency>, _: f64, _: f64) -> Result<()> {
        self.frames += 1;
        let mut residency = lock(residency)?;
        if !(self.loads)(self.frames) {
            return Ok(());
        }
        if let Some(step) = residency.next_step()
            && residency.chunk_read(step.node, step.bytes)
        {
            match (self.is_broken)(step.node) {
                true => residency.broken(step.node),
                false => residency.loaded(step.node),
            }
        }
        Ok(())
    }

    fn process_bytes(&mut self) -> u64 {
        0
    }
}

/// Every front of the run is sound, or it ends with an error.
fn replay(name: &str, cap: u64, loads: fn(u32) -> bool, is_broken: fn(u32) -> bool) -> Run {
    let (scene, path) = (street(20, 2), walk(600));
    let tree = SceneTree::new(&scene);
    let options = BenchOptions {
        target_ms: 6.0,
        policy: PolicyChoice::new(name, &Settings::new()).unwrap(),
        residency: ResidencyOptions { max_memory_bytes: cap, ..ResidencyOptions::DEFAULT },
        ..BenchOptions::default()
    };
    let sizes = Sizes::new(&scene, |vertices, _, _| u64::from(vertices) * 20, |_| 0);
    let residency = Residency::new(&tree, sizes, options.residency).unwrap();
    let model = ModelBackend::new(&tree, constants(), 0);
    let replay = Replay {
        tree: &tree,
        path: &path,
        policy: &mut *options.policy.make().unwrap(),
        residency: Arc::new(Mutex::new(residency)),
        backend: &mut Loader { model, frames: 0, loads, is_broken },
        occluders: None,
        cells: None,
        costs: CostModel::new(&constants().prices),
        inspector: None,
        options,
    };
    let run = run(replay, |_| true).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(run.frames.len(), 600, "{name}");
    assert!(run.peak_bytes <= cap, "{name}: {} of {cap}", run.peak_bytes);
    run
}

/// What a run has loaded by its end, but for the roots.
fn arrived(run: &Run) -> u32 {
    run.frames[1..].iter().map(|frame| frame.report.arrived).sum()
}

const ROOM: u64 = 1 << 20;
/// The roots, and seven more.
const TIGHT: u64 = 20 * 200 + 6 * 200 + 1000;

#[test]
fn a_slow_loader_and_one_that_stalls_for_seconds_are_waited_for() {
    for kind in POLICIES {
        let slow = replay(kind.name, ROOM, |frame| frame % 20 == 0, |_| false);
        let stalling = replay(kind.name, ROOM, |frame| frame % 200 > 150, |_| false);
        for run in [&slow, &stalling] {
            // Those that ask for anything here get it in the end.
            let asked = run.frames.iter().any(|frame| frame.report.waiting > 0);
            assert_eq!(arrived(run) > 0, asked, "{}", kind.name);
        }
    }
}

#[test]
fn a_loader_that_fails_for_some_nodes_keeps_their_parents_drawn() {
    for kind in POLICIES {
        let run = replay(kind.name, ROOM, |_| true, |node| node % 3 == 0);
        // A node that cannot be used is read once, and then no more.
        let nodes = street(20, 2).nodes.len() as u64;
        let read: u64 = run.frames[1..].iter().map(|at| at.report.read_bytes).sum();
        let evicted: u64 = run.frames.iter().map(|at| at.report.evictions).sum();
        assert!(read <= 1000 * (nodes + evicted), "{}: {read} bytes", kind.name);
    }
}

#[test]
fn a_tight_cap_is_kept_to() {
    for kind in POLICIES {
        let run = replay(kind.name, TIGHT, |_| true, |_| false);
        assert!(run.frames.iter().all(|frame| frame.report.memory_bytes <= TIGHT));
    }
}
