//! Nodes above the blocks.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use hlod::builder::BuildOptions;
use hlod::builder::blocks::plan::BlockMode;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::threads::with_threads;
use hlod::city::{self, CityOptions};
use hlod::format::Scene;
use hlod::verify::{Silent, VerifyOptions, verify};
use tempfile::TempDir;

use crate::support::inputs::{SQUARE, small_city, write_city, write_street};
use crate::support::result::{difference, lasting, report};
use crate::support::{build_with, hlod_build, run_build};

const SMALL: [&str; 2] = ["--desired-tris", "250"];

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
    run_build(folder.path(), &[&SMALL, &["--districts", "off", "parts", "off"][..]].concat());
    run_build(folder.path(), &[&SMALL, &["parts", "on"][..]].concat());
    let (off, on) = (scene(&folder.path().join("off")), scene(&folder.path().join("on")));
    assert_eq!(roots(&off), 24);
    assert!(roots(&on) <= 8, "{} roots", roots(&on));
    assert_eq!(on.blocks, off.blocks);
    assert_eq!(on.block_roots().count(), 24);
    let of_blocks = |scene: &Scene| -> BTreeMap<String, (u32, u64, Option<u32>)> {
        let blocks = scene.nodes.iter().filter(|node| node.block.is_some());
        blocks
            .map(|node| {
                (node.file.clone(), (node.file_crc, node.geometric_error.to_bits(), node.block))
            })
            .collect()
    };
    assert_eq!(of_blocks(&on), of_blocks(&off));
    // Every root of a block is below one district, and each has its share of the triangles.
    let districts: Vec<u32> = (0..on.nodes.len() as u32)
        .filter(|&node| on.nodes[node as usize].block.is_none())
        .collect();
    assert!(districts.len() >= 6, "{districts:?}");
    for &district in &districts {
        let children: Vec<u32> = on.children(district).collect();
        assert!(children.len() >= 2, "{children:?}");
        let below: u32 = children.iter().map(|&child| on.nodes[child as usize].triangles).sum();
        let node = &on.nodes[district as usize];
        assert!(f64::from(node.triangles) <= 1.6 * f64::from(below) / 4.0, "{node:?}");
        let worst = children.iter().map(|&child| on.nodes[child as usize].geometric_error);
        assert!(node.geometric_error >= worst.fold(0.0, f64::max));
    }
    let reports = report(&folder.path().join("on"))["districts"].as_array().unwrap().len();
    assert_eq!(reports, districts.len());
}

#[test]
fn they_are_true_to_the_source() {
    let folder = parts();
    run_build(folder.path(), &[&SMALL[..], &["parts", "out"]].concat());
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
    let hierarchy = HierarchyOptions { desired_tris: 250, ..HierarchyOptions::default() };
    let options = BuildOptions { hierarchy, districts: true, ..BuildOptions::default() };
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
fn streets_in_squares_have_districts_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_street(folder.path(), 60);
    for quantize in [None, Some(0.02)] {
        let hierarchy = HierarchyOptions { desired_tris: 100, ..HierarchyOptions::default() };
        let blocks = BlockMode::Grid(8.0);
        let options = BuildOptions {
            hierarchy,
            blocks,
            quantize,
            districts: true,
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
            let failed: Vec<_> = found.checks.iter().filter(|check| !check.passed).collect();
            assert!(failed.is_empty(), "{quantize:?} {failed:?}");
            let result = lasting(&out);
            assert!(!result.contains_key("rims.hlod"), "one input changes as a whole");
            fs::remove_dir_all(&out).unwrap();
            match &first {
                None => first = Some(result),
                Some(first) => assert_eq!(difference(first, &result), None),
            }
        }
    }
}

#[test]
fn what_changes_is_what_stands_above_what_changed() {
    let folder = parts();
    let out = folder.path().join("out");
    let build = || run_build(folder.path(), &[&SMALL[..], &["parts", "out"]].concat());
    build();
    let before = scene(&out);
    let crcs = |scene: &Scene| -> BTreeMap<String, u32> {
        scene.nodes.iter().map(|node| (node.file.clone(), node.file_crc)).collect()
    };
    add_building(&folder.path().join("parts/block_0007.obj"));
    build();
    let after = scene(&out);
    let (was, is) = (crcs(&before), crcs(&after));
    let same: BTreeSet<&String> =
        was.keys().filter(|file| was.get(*file) == is.get(*file)).collect();
    for node in (0..after.nodes.len()).filter(|&node| !same.contains(&after.nodes[node].file)) {
        let blocks = blocks_below(&after, node as u32);
        let part = blocks.iter().any(|&block| after.blocks[block as usize].input.contains("0007"));
        assert!(part, "{} has changed, and is of {blocks:?}", after.nodes[node].file);
    }
    assert!(same.iter().filter(|file| file.starts_with("district")).count() >= 4, "{same:?}");
    // The same as if nothing had been there before.
    let mut result = lasting(&out);
    assert!(result.contains_key("rims.hlod"));
    result.remove("build.json");
    run_build(folder.path(), &[&SMALL[..], &["parts", "clean"]].concat());
    let mut clean = lasting(&folder.path().join("clean"));
    clean.remove("build.json");
    assert_eq!(difference(&clean, &result), None);
}

/// Neither for themselves nor for where they meet what has changed.
#[test]
fn what_stands_apart_from_what_changed_is_not_read_again() {
    let folder = parts();
    let out = folder.path().join("out");
    let build = || run_build(folder.path(), &[&SMALL[..], &["parts", "out"]].concat());
    build();
    let before = scene(&out);
    let is_changed = |&block: &u32| before.blocks[block as usize].input.contains("0007");
    let apart: Vec<u32> = before
        .roots()
        .filter(|&root| !blocks_below(&before, root).iter().any(is_changed))
        .collect();
    assert!(apart.len() + 1 == roots(&before) && apart.len() >= 3, "{apart:?}");
    let mut all = apart.clone();
    while let Some(node) = all.pop() {
        let file = out.join("nodes").join(&before.nodes[node as usize].file);
        fs::write(&file, vec![0; fs::metadata(&file).unwrap().len() as usize]).unwrap();
        all.extend(before.children(node));
    }
    let changed = folder.path().join("parts/block_0007.obj");
    lift_vertex(&changed);
    build();
    let after = scene(&out);
    let is_as_before = |&root: &u32| {
        let was = &before.nodes[root as usize];
        after.nodes.iter().any(|node| (&node.file, node.file_crc) == (&was.file, was.file_crc))
    };
    assert!(apart.iter().all(is_as_before));
    assert_ne!(after.fingerprint, before.fingerprint);
    // Without what is known of where they end, all are.
    fs::remove_file(out.join("rims.hlod")).unwrap();
    lift_vertex(&changed);
    hlod_build().current_dir(folder.path()).args(SMALL).args(["parts", "out"]).assert().failure();
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

/// One more in the middle of a model, at no border.
fn add_building(obj: &Path) {
    let text = fs::read_to_string(obj).unwrap();
    let [low, high] = bounds(&text);
    let at = [0, 1].map(|axis| (low[axis] + high[axis]) / 2.0);
    let corner = |[x, y, z]: [f64; 3]| format!("v {} {} {}\n", at[0] + x, at[1] + y, high[2] + z);
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 9.0]].map(corner);
    let more = format!("{text}\n{}f -4 -3 -2\nf -4 -3 -1\nf -3 -2 -1\n", corners.concat());
    fs::write(obj, more).unwrap();
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
        run_build(folder.path(), &[&SMALL[..], &[input, "on"]].concat());
        let on = scene(&folder.path().join("on"));
        assert!(on.nodes.iter().all(|node| node.block.is_some()));
        fs::remove_dir_all(folder.path().join("on")).unwrap();
    }
}
