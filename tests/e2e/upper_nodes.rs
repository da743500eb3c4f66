//! Nodes above the blocks.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::partition::BlockSplit;
use hlod::builder::threads::with_threads;
use hlod::city::{self, CityOptions};
use hlod::format::Scene;
use hlod::verify::{Silent, VerifyOptions, verify};
use tempfile::TempDir;

use crate::support::inputs::{SQUARE, small_city, write_city, write_street};
use crate::support::result::{difference, lasting, report};
use crate::support::{build_with, run_build};

/// Nodes of 250 triangles, and blocks of up to 2,000.
fn small() -> BuildOptions {
    let mut hierarchy = HierarchyOptions { desired_tris: 250, ..HierarchyOptions::default() };
    hierarchy.constants.blocks.divided = 8;
    BuildOptions { hierarchy, ..BuildOptions::default() }
}

/// Builds the folder `parts` of a folder.
fn build_parts(folder: &TempDir, out: &str, options: &BuildOptions) {
    build_with(&[folder.path().join("parts")], &folder.path().join(out), options);
}

/// A model for each of 24 blocks, `parts/block_0000.obj` and so on.
fn parts() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let options = CityOptions { blocks: 24, triangles: 48_000, split: true, ..small_city() };
    city::write(&options, &folder.path().join("parts")).unwrap();
    folder
}

fn scene(out: &Path) -> Scene {
    Scene::read(out).unwrap()
}

fn roots(scene: &Scene) -> usize {
    scene.roots().count()
}

#[test]
fn few_trees_stand_above_the_blocks_which_are_as_without_them() {
    let folder = parts();
    build_parts(&folder, "off", &BuildOptions { upper_levels: false, ..small() });
    build_parts(&folder, "on", &small());
    let (off, on) = (scene(&folder.path().join("off")), scene(&folder.path().join("on")));
    assert!(roots(&off) > 24, "{} roots", roots(&off));
    assert!(roots(&on) <= 8, "{} roots", roots(&on));
    assert_eq!(on.blocks, off.blocks);
    assert_eq!(on.block_roots().count(), roots(&off));
    let of_blocks = |scene: &Scene| -> BTreeMap<String, (u32, u64, Option<u32>)> {
        let blocks = scene.nodes.iter().filter(|node| node.block.is_some());
        blocks
            .map(|node| {
                (node.file.clone(), (node.file_crc, node.geometric_error.to_bits(), node.block))
            })
            .collect()
    };
    assert_eq!(of_blocks(&on), of_blocks(&off));
    // Each has its share of the triangles below it.
    let above: Vec<u32> = (0..on.nodes.len() as u32)
        .filter(|&node| on.nodes[node as usize].block.is_none())
        .collect();
    assert!(above.len() >= 6, "{above:?}");
    let report = report(&folder.path().join("on"));
    let over = report["over_budget"].as_array().unwrap();
    let is_over = |file: &str| over.iter().any(|entry| entry["file"] == file);
    for &upper in &above {
        let children: Vec<u32> = on.children(upper).collect();
        assert!(children.len() >= 2, "{children:?}");
        let below: u32 = children.iter().map(|&child| on.nodes[child as usize].triangles).sum();
        let node = &on.nodes[upper as usize];
        // Where more are needed to keep the outline, the report says so.
        let share = f64::from(node.triangles) / f64::from(below);
        assert!(share <= 1.6 / 4.0 || is_over(&node.file) && share < 1.0, "{node:?}");
        let worst = children.iter().map(|&child| on.nodes[child as usize].geometric_error);
        assert!(node.geometric_error >= worst.fold(0.0, f64::max));
    }
    let reports = report["above"].as_array().unwrap().len();
    assert_eq!(reports, above.len());
}

#[test]
fn they_are_true_to_the_source() {
    let folder = parts();
    build_parts(&folder, "out", &small());
    let inputs = [folder.path().join("parts")];
    let options = VerifyOptions { samples: Some(40_000), ..VerifyOptions::default() };
    let report = verify(&folder.path().join("out"), &inputs, &options, &Silent).unwrap();
    let failed: Vec<_> = report.checks.iter().filter(|check| !check.passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn neither_threads_nor_the_order_of_inputs_change_them() {
    let folder = parts();
    let mut inputs: Vec<_> = fs::read_dir(folder.path().join("parts"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|kind| kind == "obj"))
        .collect();
    let options = small();
    let mut first = None;
    for (number, threads) in [1, 2, 7].into_iter().enumerate() {
        let out = folder.path().join(format!("out{number}"));
        inputs.rotate_left(number * 5);
        with_threads(threads, || build_with(&inputs, &out, &options)).unwrap();
        let result = lasting(&out);
        match &first {
            None => first = Some(result),
            Some(first) => assert_eq!(difference(first, &result), None, "{threads} threads"),
        }
    }
}

/// Repeating pictures, cut-outs, plain triangles and blocks that planes divide, with and without
/// rounding that shows.
#[test]
fn streets_in_squares_have_nodes_above_them_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_street(folder.path(), 60);
    for quantize in [None, Some(0.02)] {
        let hierarchy = HierarchyOptions { desired_tris: 1000, ..HierarchyOptions::default() };
        let blocks = BlockSplit::Grid(8.0);
        let options = BuildOptions {
            hierarchy,
            blocks,
            quantize,
            upper_levels: true,
            ..BuildOptions::default()
        };
        let mut first = None;
        for threads in [1, 4] {
            let out = folder.path().join(format!("out{threads}"));
            with_threads(threads, || build_with(std::slice::from_ref(&input), &out, &options))
                .unwrap();
            let scene = scene(&out);
            assert!(scene.block_roots().count() > 30 && roots(&scene) <= 8, "{}", roots(&scene));
            let text = report(&out).to_string();
            assert!(!text.contains("without texture"), "{text}");
            let options = VerifyOptions { samples: Some(40_000), ..VerifyOptions::default() };
            let found = verify(&out, &[], &options, &Silent).unwrap();
            // A node of a thousand triangles over a street of squares with pictures of their own shows
            // some of them elsewhere.
            let is_of_shape = |name: &str| name != "colours of the levels";
            let failed: Vec<_> = found
                .checks
                .iter()
                .filter(|check| !check.passed && is_of_shape(check.name))
                .collect();
            assert!(failed.is_empty(), "{quantize:?} {failed:?}");
            let result = lasting(&out);
            fs::remove_dir_all(&out).unwrap();
            match &first {
                None => first = Some(result),
                Some(first) => assert_eq!(difference(first, &result), None),
            }
        }
    }
}

/// The blocks that a box meets, by the boxes of their leaves, and all nodes above them.
fn above_blocks_that_meet(scene: &Scene, [low, high]: [[f64; 3]; 2]) -> BTreeSet<u32> {
    let mut met = BTreeSet::new();
    for node in scene.nodes.iter().filter(|node| node.first_child.is_none()) {
        if (0..3).all(|i| node.bbox_min[i] <= high[i] && low[i] <= node.bbox_max[i]) {
            met.extend(node.block);
        }
    }
    (0..scene.nodes.len() as u32)
        .filter(|&node| !blocks_below(scene, node).is_disjoint(&met))
        .collect()
}

#[test]
fn what_changes_is_what_stands_above_what_changed() {
    let folder = parts();
    let out = folder.path().join("out");
    build_parts(&folder, "out", &small());
    let before = scene(&out);
    let crcs = |scene: &Scene| -> BTreeMap<String, u32> {
        scene.nodes.iter().map(|node| (node.file.clone(), node.file_crc)).collect()
    };
    let changed = folder.path().join("parts/block_0007.obj");
    lift_vertex(&changed);
    let place = bounds(&fs::read_to_string(&changed).unwrap());
    build_parts(&folder, "out", &small());
    let after = scene(&out);
    let (was, is) = (crcs(&before), crcs(&after));
    let meeting = above_blocks_that_meet(&after, place);
    let mut different = 0;
    for (number, node) in (0u32..).zip(&after.nodes) {
        if was.get(&node.file) != is.get(&node.file) {
            different += 1;
            assert!(meeting.contains(&number), "{} has changed", node.file);
        }
    }
    assert!(different > 0 && different < after.nodes.len() / 3, "{different}");
    // The same as if nothing had been there before.
    let mut result = lasting(&out);
    result.remove("build.json");
    build_parts(&folder, "clean", &small());
    let mut clean = lasting(&folder.path().join("clean"));
    clean.remove("build.json");
    assert_eq!(difference(&clean, &result), None);
}

/// Lifts a vertex half way up and nearest to the middle of a model, which stays in its box.
fn lift_vertex(obj: &Path) {
    let text = fs::read_to_string(obj).unwrap();
    let [low, high] = bounds(&text);
    let middle: [f64; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) / 2.0);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let at = |line: &str| -> Option<[f64; 3]> {
        let mut numbers = line.strip_prefix("v ")?.split_whitespace().map(|at| at.parse().ok());
        Some([numbers.next()??, numbers.next()??, numbers.next()??])
    };
    let off = |at: [f64; 3]| (0..3).map(|axis| (at[axis] - middle[axis]).abs()).sum::<f64>();
    let vertices = (0..lines.len()).filter_map(|line| Some((line, at(&lines[line])?)));
    let nearest = vertices.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    let (line, [x, y, z]) = nearest.unwrap();
    lines[line] = format!("v {x} {y} {}", z + 0.05);
    fs::write(obj, lines.join("\n")).unwrap();
}

fn bounds(obj: &str) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::MAX; 3], [f64::MIN; 3]];
    for line in obj.lines().filter_map(|line| line.strip_prefix("v ")) {
        for (axis, number) in line.split_whitespace().take(3).enumerate() {
            let at: f64 = number.parse().unwrap();
            bounds[0][axis] = bounds[0][axis].min(at);
            bounds[1][axis] = bounds[1][axis].max(at);
        }
    }
    bounds
}

fn blocks_below(scene: &Scene, node: u32) -> BTreeSet<u32> {
    match scene.nodes[node as usize].block {
        Some(block) => [block].into(),
        None => scene.children(node).flat_map(|child| blocks_below(scene, child)).collect(),
    }
}

#[test]
fn few_blocks_need_none() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    fs::write(folder.path().join("square.obj"), SQUARE).unwrap();
    for input in ["city.obj", "square.obj"] {
        run_build(folder.path(), &["--desired-tris", "250", input, "on"]);
        let on = scene(&folder.path().join("on"));
        assert!(on.nodes.iter().all(|node| node.block.is_some()));
        fs::remove_dir_all(folder.path().join("on")).unwrap();
    }
}
