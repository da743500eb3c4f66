//! Coarse nodes that would lose too much of the covered ground or of the skyline.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use hlod::builder::BuildOptions;
use hlod::builder::constants::{Constants, OutlineConstants};
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::verify::{Silent, VerifyReport, verify};
use tempfile::TempDir;

use crate::houses::town;
use crate::support::inputs::write;
use crate::support::result::{Built, difference, lasting, report};
use crate::support::{Random, build_with, run_build};

const SIDE: usize = 70;

fn quad(text: &mut String, corners: [DVec3; 4]) {
    for corner in corners {
        writeln!(text, "v {:.3} {:.3} {:.3}", corner.x, corner.y, corner.z).unwrap();
    }
    writeln!(text, "f -4 -3 -2 -1").unwrap();
}

/// Slabs without walls, each apart from all others: what covers the ground here cannot be joined.
fn slabs(folder: &Path) {
    let mut random = Random::new(3, 0);
    let mut text = String::new();
    for slab in 0..SIDE * SIDE {
        let [x, y] = [slab % SIDE, slab / SIDE].map(|at| 10.0 * at as f64);
        let low = DVec3::new(x, y, random.between(0.0, 0.5));
        let [width, depth] = [DVec3::X, DVec3::Y].map(|axis| axis * random.between(4.0, 8.0));
        quad(&mut text, [low, low + width, low + width + depth, low + depth]);
    }
    write(folder, "slabs.obj", text);
}

/// A field, and poplars on it that are two upright sheets each: the skyline is theirs alone.
fn poplars(folder: &Path) {
    let mut random = Random::new(4, 0);
    let mut text = String::new();
    let far = 10.0 * SIDE as f64;
    quad(&mut text, [DVec3::ZERO, DVec3::X * far, DVec3::new(far, far, 0.0), DVec3::Y * far]);
    for tree in 0..SIDE * SIDE {
        let [x, y] = [tree % SIDE, tree / SIDE].map(|at| 10.0 * at as f64 + 5.0);
        let foot = DVec3::new(x + random.between(-4.0, 4.0), y + random.between(-4.0, 4.0), 0.1);
        let up = DVec3::Z * if random.below(12) == 0 { random.between(15.0, 40.0) } else { 1.0 };
        for half in [DVec3::X, DVec3::Y].map(|axis| axis * 0.4) {
            quad(&mut text, [foot - half, foot + half, foot + half + up, foot - half + up]);
        }
    }
    write(folder, "poplars.obj", text);
}

fn options(least_kept: f64) -> BuildOptions {
    let outline = OutlineConstants { least_kept, ..Default::default() };
    let constants = Constants { outline, ..Constants::default() };
    let hierarchy =
        HierarchyOptions { desired_tris: 300, constants, ..HierarchyOptions::default() };
    BuildOptions { hierarchy, upper_levels: false, ..BuildOptions::default() }
}

fn verified(out: &Path) -> VerifyReport {
    verify(out, &[], &Default::default(), &Silent).unwrap()
}

/// Builds a model with and without the rule; the folder, and the least that any level keeps.
fn built(model: fn(&Path), name: &str) -> (TempDir, [f64; 2]) {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let least = [("out", 0.9), ("all", 0.0)].map(|(out, least_kept)| {
        let out = folder.path().join(out);
        build_with(&[folder.path().join(name)], &out, &options(least_kept));
        let report = verified(&out);
        assert!(report.checks.iter().all(|check| check.passed), "{:?}", report.checks);
        report.levels.iter().map(|level| level.kept.least()).fold(1.0, f64::min)
    });
    (folder, least)
}

#[test]
fn what_loses_much_of_the_ground_or_the_skyline_is_not_written() {
    for (model, name) in [(slabs as fn(&Path), "slabs.obj"), (poplars, "poplars.obj")] {
        let (folder, [kept, all]) = built(model, name);
        assert!(all < 0.75, "{name}: {all}: the case tells");
        assert!(kept > 0.89, "{name}: {kept}");

        let out = folder.path().join("out");
        let left_out = report(&out)["blocks"].clone();
        let blocks = left_out.as_array().unwrap().iter();
        let left_out: Vec<_> =
            blocks.flat_map(|block| block["left_out"].as_array().unwrap()).collect();
        assert!(!left_out.is_empty(), "{name}");
        let scene = Built::read(&out).scene;
        let whole = Built::read(&folder.path().join("all")).scene;
        for node in &left_out {
            let file = node["file"].as_str().unwrap();
            assert!(!out.join("nodes").join(file).exists(), "{file}");
            assert!(whole.nodes.iter().any(|node| node.file == file), "{file}");
            let kept = |what: &str| node["kept"][what].as_f64().unwrap();
            assert!(kept("area").min(kept("skyline")) < 0.9, "{node}");
        }
        // All others are there, the same leaves among them.
        assert_eq!(scene.nodes.len() + left_out.len(), whole.nodes.len(), "{name}");
        assert_eq!(scene.blocks, whole.blocks, "{name}");
        assert!(scene.roots().count() > whole.roots().count(), "{name}");
    }
}

/// A node comes back with more triangles before it is left out, and the report says why.
#[test]
fn a_node_that_keeps_enough_with_more_triangles_has_them() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    town(folder.path(), 0);
    build_with(&[folder.path().join("town.obj")], &out, &options(0.9));
    let levels = verified(&out).levels;
    assert!(levels[1].kept.least() > 0.9);
    // On level 0, fewer and larger boxes stand for the houses, which stand apart, and cover as much ground.
    assert!(levels[0].kept.least() < 0.5);
    assert!((0.9..1.1).contains(&levels[0].kept.covered()), "{:?}", levels[0].kept);
    let report = report(&out);
    let over = report["over_budget"].as_array().unwrap();
    let given: Vec<_> =
        over.iter().filter(|node| node["reason"].as_str().unwrap().contains("keeps")).collect();
    assert!(!given.is_empty());
    for node in given {
        let [budget, triangles] = ["budget", "triangles"].map(|name| node[name].as_u64().unwrap());
        assert!(triangles > budget && triangles < 4 * budget, "{node}");
    }
}

/// The block of several roots is taken over as it is.
#[test]
fn an_input_with_nodes_left_out_is_taken_over_whole() {
    let folder = tempfile::tempdir().unwrap();
    slabs(folder.path());
    write(folder.path(), "one.obj", "v 5000 0 0\nv 5001 0 0\nv 5000 1 0\nf 1 2 3\n");
    let build = |arguments: &[&str]| {
        let options = ["--desired-tris", "300", "--blocks", "grid:2000", "slabs.obj"];
        run_build(folder.path(), &[&options[..], arguments].concat())
    };
    let text = build(&["one.obj", "out"]);
    assert!(text.contains("left out"), "{text}");
    build(&["one.obj", "clean"]);
    write(folder.path(), "one.obj", "v 5000 0 0\nv 5002 0 0\nv 5000 1 0\nf 1 2 3\n");
    let before = report(&folder.path().join("out"))["inputs"].clone();
    build(&["one.obj", "out"]);
    let after = report(&folder.path().join("out"))["inputs"].clone();
    assert_ne!(before, after, "the other input has changed");
    write(folder.path(), "one.obj", "v 5000 0 0\nv 5001 0 0\nv 5000 1 0\nf 1 2 3\n");
    build(&["one.obj", "out"]);
    let left_out = |out: &str| {
        let blocks = report(&folder.path().join(out))["blocks"].clone();
        let slabs = |block: &&serde_json::Value| block["name"].to_string().contains("slabs");
        blocks.as_array().unwrap().iter().find(slabs).unwrap()["left_out"].clone()
    };
    assert!(!left_out("out").as_array().unwrap().is_empty());
    assert_eq!(left_out("out"), left_out("clean"));
    let [mut out, mut clean] = ["out", "clean"].map(|name| lasting(&folder.path().join(name)));
    for files in [&mut out, &mut clean] {
        // Budgets that were met are not kept from build to build.
        assert!(files.remove("build.json").is_some());
    }
    assert_eq!(difference(&out, &clean), None);
}
