//! Inputs that are one surface: they meet on all levels as blocks of one file do.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use hlod::city::CityOptions;
use hlod::verify::{Silent, VerifyOptions, VerifyReport, verify};
use tempfile::TempDir;

use crate::cut_into_tiles::cut_into_tiles;
use crate::support::inputs::{small_city, write_city};
use crate::support::result::{difference, lasting, report};
use crate::support::{data, run_build};

const SMALL: [&str; 2] = ["--desired-tris", "250"];

/// A city of nine blocks cut into `n` by `n` files in `tiles`, each moved by what `shift` says.
fn tiles(n: usize, shift: impl Fn([usize; 2]) -> [f64; 3]) -> TempDir {
    tiles_of(&CityOptions { blocks: 9, triangles: 30_000, ..small_city() }, n, shift)
}

fn tiles_of(options: &CityOptions, n: usize, shift: impl Fn([usize; 2]) -> [f64; 3]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let city = hlod::import::load(&write_city(folder.path(), options)).unwrap();
    cut_into_tiles(&city, n, [0, 1], &folder.path().join("tiles"), shift).unwrap();
    folder
}

fn in_place(_: [usize; 2]) -> [f64; 3] {
    [0.0; 3]
}

/// Each tile elsewhere by a millimetre or so.
fn nearly([x, y]: [usize; 2]) -> [f64; 3] {
    let off = |n: usize| ((x * 7 + y * 13 + n * 5) % 11) as f64 * 1e-4 - 5e-4;
    [off(1), off(2), off(3)]
}

fn verified(folder: &Path, out: &str, tiles: &str) -> VerifyReport {
    let options =
        VerifyOptions { samples: Some(40_000), front: Some(0.2), ..VerifyOptions::default() };
    let found = verify(&folder.join(out), &[folder.join(tiles)], &options, &Silent).unwrap();
    let failed: Vec<_> = found.checks.iter().filter(|check| !check.passed).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    found
}

/// Builds `tiles` into `out`, verifies it, and says how many edges at cuts were compared.
fn edges_at_cuts(folder: &Path, arguments: &[&str]) -> usize {
    run_build(folder, &[&["--quiet"], arguments, &["tiles", "out"]].concat());
    let found = verified(folder, "out", "tiles");
    let gaps = found.checks.iter().find(|check| check.name == "gaps").unwrap();
    gaps.summary.split(' ').next().unwrap().parse().unwrap()
}

/// So that nine blocks of a city are divided.
const SMALL_BLOCKS: [&str; 2] = ["--desired-tris", "60"];

#[test]
fn tiles_meet_on_all_levels() {
    let folder = tiles(3, in_place);
    let edges = edges_at_cuts(folder.path(), &SMALL_BLOCKS);
    assert!(edges > 400, "{edges}");
}

/// Lines that run in walls leave slivers on either side, which close up where they are thinned.
#[test]
fn tiles_cut_along_walls_meet_and_keep_to_their_errors() {
    let options = CityOptions { blocks: 9, triangles: 60_000, seed: 2, ..small_city() };
    for n in [2, 5] {
        let folder = tiles_of(&options, n, in_place);
        let edges = edges_at_cuts(folder.path(), &["--desired-tris", "100"]);
        assert!(edges > 150, "{n}: {edges}");
    }
}

/// Coordinates of planes are rounded on each level above blocks, as those of vertices are.
#[test]
fn nodes_above_nodes_meet_at_planes_between_lattice_points() {
    let options = CityOptions { blocks: 9, triangles: 320_000, seed: 1, ..small_city() };
    let folder = tiles_of(&options, 11, in_place);
    let edges = edges_at_cuts(folder.path(), &["--desired-tris", "250"]);
    assert!(edges > 10_000, "{edges}");
}

#[test]
fn tiles_that_agree_to_a_millimetre_meet_as_nearly() {
    let folder = tiles(2, nearly);
    let edges = edges_at_cuts(folder.path(), &SMALL_BLOCKS);
    assert!(edges > 150, "{edges}");
}

#[test]
fn tiles_that_keep_all_of_their_borders_meet_too() {
    let folder = tiles(2, in_place);
    let edges = edges_at_cuts(folder.path(), &["--desired-tris", "60", "--borders", "locked"]);
    assert!(edges > 150, "{edges}");
}

/// What cutting costs: triangles at the cuts, and skirts along them.
#[test]
fn tiles_are_as_large_and_as_true_as_one_file() {
    let folder = tiles(2, in_place);
    let at = folder.path();
    run_build(at, &[&SMALL[..], &["tiles", "out"]].concat());
    run_build(at, &[&SMALL[..], &["city.obj", "whole"]].concat());
    let bytes = |out: &str| -> f64 {
        let levels = report(&at.join(out))["levels"].as_array().unwrap().clone();
        levels.iter().map(|level| level["bytes"].as_f64().unwrap()).sum()
    };
    let ratio = bytes("out") / bytes("whole");
    assert!((0.9..1.15).contains(&ratio), "{ratio} times the bytes");
    let front = |out: &str, source: &str| {
        let front = verified(at, out, source).front.unwrap();
        let rms = front.to_front.rms.max(front.to_source.rms);
        // Of surfaces, errors are as triangles are large.
        rms * front.triangles as f64
    };
    let ratio = front("out", "tiles") / front("whole", "city.obj");
    assert!(ratio < 1.3, "{ratio} times the error of a front of as many triangles");
}

#[test]
fn real_tiles_meet_on_all_levels() {
    let Some(set) = data("oblique_a") else { return };
    let folder = tempfile::tempdir().unwrap();
    let model = hlod::import::load(&set.join("oblique_a.obj")).unwrap();
    cut_into_tiles(&model, 5, [0, 1], &folder.path().join("tiles"), in_place).unwrap();
    let edges = edges_at_cuts(folder.path(), &["--desired-tris", "500"]);
    assert!(edges > 1000, "{edges}");
}

/// Inodes of the nodes of blocks.
fn nodes(out: &Path) -> BTreeMap<PathBuf, u64> {
    let files = fs::read_dir(out.join("nodes")).unwrap().map(|entry| entry.unwrap().path());
    let of_block =
        |file: &PathBuf| !file.file_name().unwrap().to_str().unwrap().starts_with("above");
    files.filter(of_block).map(|file| (file.clone(), fs::metadata(file).unwrap().ino())).collect()
}

/// The share of all nodes of blocks that were written anew.
fn built_again(out: &Path, before: &BTreeMap<PathBuf, u64>) -> f64 {
    let after = nodes(out);
    let changed = after.iter().filter(|(file, inode)| before.get(*file) != Some(inode)).count();
    changed as f64 / after.len() as f64
}

fn is_as_built_at_once(folder: &Path) {
    run_build(folder, &[&SMALL_BLOCKS[..], &["tiles", "clean"]].concat());
    let [mut out, mut clean] = ["out", "clean"].map(|name| lasting(&folder.join(name)));
    out.remove("build.json");
    clean.remove("build.json");
    assert_eq!(difference(&clean, &out), None);
    fs::remove_dir_all(folder.join("clean")).unwrap();
}

/// The line of the first vertex of a file that is there, with its place.
fn vertex(text: &str, is_there: impl Fn([f64; 3]) -> bool) -> (String, [f64; 3]) {
    let place = |line: &str| -> Option<[f64; 3]> {
        let numbers = line.strip_prefix("v ")?.split(' ').map(|word| word.parse().unwrap());
        numbers.collect::<Vec<f64>>().try_into().ok()
    };
    let lines = text.lines().filter_map(|line| Some((line.to_owned(), place(line)?)));
    lines.into_iter().find(|(_, place)| is_there(*place)).unwrap()
}

#[test]
fn only_blocks_that_a_changed_tile_meets_are_built_again() {
    let folder = tiles(5, in_place);
    let (at, out) = (folder.path(), folder.path().join("out"));
    let build = || run_build(at, &[&SMALL_BLOCKS[..], &["tiles", "out"]].concat());
    build();
    let said = build();
    assert!(said.contains("up to date"), "{said}");

    // A vertex within the first tile.
    let file = at.join("tiles/Tile_+000_+000.obj");
    let text = fs::read_to_string(&file).unwrap();
    let [low, high] = hlod::import::bounds(&file).unwrap();
    let within = |at: [f64; 3]| (0..2).all(|i| low[i] + 5.0 < at[i] && at[i] < high[i] - 5.0);
    let (line, [x, y, z]) = vertex(&text, within);
    let text = text.replacen(&line, &format!("v {x} {y} {}", z + 0.01), 1);
    fs::write(&file, &text).unwrap();
    let before = nodes(&out);
    build();
    let share = built_again(&out, &before);
    assert!(share > 0.0 && share < 0.5, "{share}");
    is_as_built_at_once(at);

    // One on its border with the tile beside it.
    let on_border = |at: [f64; 3]| at[0] == high[0] && at[1] < high[1] - 5.0 && at[2] > 1.0;
    let (line, [x, y, z]) = vertex(&text, on_border);
    fs::write(&file, text.replacen(&line, &format!("v {x} {} {z}", y + 0.3), 1)).unwrap();
    let before = nodes(&out);
    build();
    let share = built_again(&out, &before);
    assert!(share > 0.0 && share < 0.5, "{share}");
    is_as_built_at_once(at);

    // One that goes.
    fs::remove_file(at.join("tiles/Tile_+004_+004.obj")).unwrap();
    build();
    is_as_built_at_once(at);
}

#[test]
fn tiles_in_subsets_are_as_in_one_build() {
    let folder = tiles(3, in_place);
    let at = folder.path();
    run_build(at, &[&SMALL_BLOCKS[..], &["tiles", "whole"]].concat());
    for share in ["2/3", "1/3", "3/3"] {
        run_build(at, &[&SMALL_BLOCKS[..], &["--subset", share, "tiles", "out"]].concat());
    }
    run_build(at, &["merge", "out"]);
    assert_eq!(difference(&lasting(&at.join("whole")), &lasting(&at.join("out"))), None);
}
