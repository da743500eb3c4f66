//! The model clock: the same bytes always, and no more work than what is drawn asks for.

use std::sync::{Arc, Mutex};

use glam::DVec3;
use hlod::bench::{
    BenchOptions, ClockConstants, FrameRecord, ModelBackend, PolicyChoice, Replay, run,
};
use hlod::camera::{CameraPath, PathFrame, Pose, from_angles};
use hlod::engine::CostModel;
use hlod::engine::policies::Settings;
use hlod::format::Scene;
use hlod::mesh::UpAxis;
use hlod::runtime::SceneTree;
use hlod::runtime::residency::{Residency, Sizes};
use serde_json::Value;

use crate::bench_support::{Place, city, hlod_bench};
use crate::support::result::contents;
use crate::tall_street::street;

#[test]
fn the_same_bytes_on_any_number_of_threads_and_from_any_folder() {
    let place = Place::new(city());
    let elsewhere = tempfile::tempdir().unwrap();
    let mut results = Vec::new();
    for (number, threads) in ["1", "2", "7", "7"].iter().enumerate() {
        let result = place.path().join(format!("r{number}"));
        let from = if number % 2 == 0 { place.path() } else { elsewhere.path() };
        hlod_bench()
            .current_dir(from)
            .env("RAYON_NUM_THREADS", threads)
            .args([place.out(), place.path().join("fly.csv")])
            .args(["--clock", "model", "--target-ms", "5", "--max-memory", "3MiB", "-q", "--out"])
            .arg(&result)
            .assert()
            .success();
        results.push(contents(&result));
    }
    assert!(results[0]["frames.csv"].len() > 1_000);
    for other in &results[1..] {
        for file in ["frames.csv", "summary.json"] {
            assert!(results[0][file] == other[file], "{file} differs");
        }
    }
}

#[test]
fn compressed_textures_take_less_and_are_recorded() {
    let place = Place::new(city());
    // Without what is held beside nodes.
    let run = ["out", "fly.csv", "-q", "--clock", "model", "--target-ms", "2000"];
    let run = [&run[..], &["--policy", "best-first", "--visibility", "off"]].concat();
    for textures in ["auto", "rgba8", "bc7"] {
        let options = ["--warm-up-frames", "600", "--textures", textures, "--out", textures];
        place.bench(&[&run[..], &options].concat()).success();
    }
    let [auto, rgba8, bc7] = ["auto", "rgba8", "bc7"].map(|result| place.summary(result));
    assert_eq!(auto, rgba8);
    assert_eq!(rgba8["parameters"]["textures"], "rgba8");
    assert_eq!(bc7["parameters"]["textures"], "bc7");
    // Everything fits: the same is drawn. Half of what is held is texels.
    assert_eq!(bc7["triangles_mean"], rgba8["triangles_mean"]);
    let peak = |summary: &Value| summary["memory"]["peak_bytes"].as_f64().unwrap();
    assert!(peak(&bc7) < peak(&rgba8) * 0.6, "{} of {}", peak(&bc7), peak(&rgba8));
}

fn replay(scene: &Scene, frames: usize, target_ms: f64) -> Vec<FrameRecord> {
    assert_eq!(scene.check(), []);
    let frame = |frame: usize| PathFrame {
        frame: frame as u64,
        time_s: frame as f64 / 30.0,
        pose: Pose {
            position: DVec3::new(frame as f64 * 0.2, 0.0, 0.0),
            rotation: from_angles(UpAxis::Z, 20.0, 0.0, 0.0),
            fov_y_deg: 60.0,
        },
    };
    let path = CameraPath { frames: (0..frames).map(frame).collect() };
    let tree = SceneTree::new(scene);
    // 0.1 ms for each node.
    let mut constants = ClockConstants::default();
    constants.prices.triangle = 1e-3;
    // Of a policy that draws what fits and no more.
    let policy = PolicyChoice::new("best-first", &Settings::new()).unwrap();
    let options = BenchOptions { target_ms, policy, ..BenchOptions::default() };
    let sizes = Sizes::new(scene, |vertices, _, _| u64::from(vertices) * 24, |_| 0);
    let residency = Residency::new(&tree, sizes, options.residency).unwrap();
    let mut policy = options.policy.make().unwrap();
    let mut backend = ModelBackend::new(&tree, constants, options.seed);
    let replay = Replay {
        tree: &tree,
        path: &path,
        policy: &mut *policy,
        residency: Arc::new(Mutex::new(residency)),
        backend: &mut backend,
        occluders: None,
        cells: None,
        costs: CostModel::new(&constants.prices),
        inspector: None,
        options,
    };
    run(replay, |_| true).unwrap().frames
}

/// What a frame does is counted, not timed: nodes that nobody draws cost nothing.
#[test]
fn work_does_not_grow_with_what_stands_below_the_front() {
    let (shallow, deep) = (street(12, 4), street(12, 6));
    assert!((3_000..5_000).contains(&shallow.nodes.len()));
    assert!(deep.nodes.len() > 15 * shallow.nodes.len());
    let [shallow, deep] = [shallow, deep].map(|scene| replay(&scene, 300, 6.0));
    assert_eq!(shallow.len(), 300);
    for (one, other) in shallow.iter().zip(&deep) {
        // The front stays above where the two differ, and nodes below it are met only once.
        assert_eq!(one.report.nodes_by_level[4], 0);
        assert_eq!(other.report.nodes_by_level[..5], one.report.nodes_by_level);
        assert_eq!(
            (one.report.visited, one.report.culled),
            (other.report.visited, other.report.culled)
        );
        assert_eq!(
            (one.report.waiting, one.report.read_bytes),
            (other.report.waiting, other.report.read_bytes)
        );
        assert_eq!(one.report.estimated_ms.to_bits(), other.report.estimated_ms.to_bits());
        assert!(one.report.visited <= 12 + 4 * 4 * one.report.nodes.max(4), "{one:?}");
    }
    let levels: Vec<u32> = (0..5)
        .map(|level| shallow.iter().map(|frame| frame.report.nodes_by_level[level]).sum())
        .collect();
    assert!(levels[1] > 0 && levels[2] > 0, "{levels:?}: the front is of some depth");
}
