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

/// How many edges between inputs were checked, and the widest gap there.
fn between_inputs(found: &VerifyReport) -> (usize, f64) {
    let gaps = found.checks.iter().find(|check| check.name == "gaps").unwrap();
    let (_, between) = gaps.summary.split_once("of these ").expect(&gaps.summary);
    let mut words = between.split(' ');
    let edges = words.next().unwrap().parse().unwrap();
    (edges, words.nth(3).unwrap().parse().unwrap())
}

#[test]
fn tiles_meet_on_all_levels() {
    let folder = tiles(3, in_place);
    run_build(folder.path(), &[&SMALL[..], &["tiles", "out"]].concat());
    let (edges, widest) = between_inputs(&verified(folder.path(), "out", "tiles"));
    assert!(edges > 400 && widest < 1e-3, "{edges} edges, {widest} m");
}

/// Lines that run in walls leave slivers on either side, which close up where they are thinned.
#[test]
fn tiles_cut_along_walls_meet_and_keep_to_their_errors() {
    let options = CityOptions { blocks: 9, triangles: 60_000, seed: 2, ..small_city() };
    for n in [2, 5] {
        let folder = tiles_of(&options, n, in_place);
        run_build(folder.path(), &["--quiet", "tiles", "out"]);
        let (edges, widest) = between_inputs(&verified(folder.path(), "out", "tiles"));
        assert!(edges > 150 && widest < 0.005, "{n}: {edges} edges, {widest} m");
    }
}

/// Coordinates of planes are rounded on each level of districts, as those of vertices are.
#[test]
fn districts_above_districts_meet_at_planes_between_lattice_points() {
    let options = CityOptions { blocks: 9, triangles: 320_000, seed: 1, ..small_city() };
    let folder = tiles_of(&options, 11, in_place);
    run_build(folder.path(), &["--quiet", "tiles", "out"]);
    let (edges, widest) = between_inputs(&verified(folder.path(), "out", "tiles"));
    assert!(edges > 10_000 && widest < 0.005, "{edges} edges, {widest} m");
}

#[test]
fn tiles_that_agree_to_a_millimetre_meet_as_nearly() {
    let folder = tiles(2, nearly);
    run_build(folder.path(), &[&SMALL[..], &["tiles", "out"]].concat());
    let (edges, widest) = between_inputs(&verified(folder.path(), "out", "tiles"));
    assert!(edges > 150 && widest < 0.007, "{edges} edges, {widest} m");
}

#[test]
fn tiles_that_keep_all_of_their_borders_meet_too() {
    let folder = tiles(2, in_place);
    run_build(folder.path(), &[&SMALL[..], &["--borders", "locked", "tiles", "out"]].concat());
    let (edges, widest) = between_inputs(&verified(folder.path(), "out", "tiles"));
    assert!(edges > 150 && widest < 1e-3, "{edges} edges, {widest} m");
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
    run_build(folder.path(), &["--quiet", "tiles", "out"]);
    let (edges, widest) = between_inputs(&verified(folder.path(), "out", "tiles"));
    assert!(edges > 1000 && widest < 1e-3, "{edges} edges, {widest} m");
}

/// Inodes of the nodes of each tile.
fn nodes(out: &Path) -> BTreeMap<String, Vec<(PathBuf, u64)>> {
    let mut nodes: BTreeMap<String, Vec<(PathBuf, u64)>> = BTreeMap::new();
    let mut files: Vec<PathBuf> =
        fs::read_dir(out.join("nodes")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    for file in files {
        let name = file.file_name().unwrap().to_str().unwrap().to_owned();
        let inode = fs::metadata(&file).unwrap().ino();
        nodes.entry(name[..14].to_owned()).or_default().push((file, inode));
    }
    nodes
}

/// Tiles whose nodes were written anew.
fn built_again(out: &Path, before: &BTreeMap<String, Vec<(PathBuf, u64)>>) -> Vec<String> {
    let after = nodes(out);
    let is_tile = |name: &&String| name.starts_with("tile");
    let changed = after.keys().filter(is_tile).filter(|&name| before.get(name) != after.get(name));
    changed.cloned().collect()
}

fn is_as_built_at_once(folder: &Path) {
    run_build(folder, &[&SMALL[..], &["tiles", "clean"]].concat());
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
fn a_changed_tile_is_built_again_and_those_whose_border_changed() {
    let folder = tiles(3, in_place);
    let (at, out) = (folder.path(), folder.path().join("out"));
    run_build(at, &[&SMALL[..], &["tiles", "out"]].concat());
    let said = run_build(at, &[&SMALL[..], &["tiles", "out"]].concat());
    assert!(said.contains("up to date"), "{said}");

    // A vertex within the first tile.
    let file = at.join("tiles/Tile_+000_+000.obj");
    let text = fs::read_to_string(&file).unwrap();
    let [low, high] = hlod::import::bounds(&file).unwrap();
    let within = |at: [f64; 3]| (0..2).all(|i| low[i] + 9.0 < at[i] && at[i] < high[i] - 9.0);
    let (line, [x, y, z]) = vertex(&text, within);
    let text = text.replacen(&line, &format!("v {x} {y} {}", z + 0.01), 1);
    fs::write(&file, &text).unwrap();
    let before = nodes(&out);
    run_build(at, &[&SMALL[..], &["tiles", "out"]].concat());
    assert_eq!(built_again(&out, &before), ["tile__000__000"]);
    is_as_built_at_once(at);

    // One on its border with the tile beside it: that tile's border is another one, too.
    let on_border = |at: [f64; 3]| at[0] == high[0] && at[1] < high[1] - 9.0 && at[2] > 1.0;
    let (line, [x, y, z]) = vertex(&text, on_border);
    fs::write(&file, text.replacen(&line, &format!("v {x} {} {z}", y + 0.3), 1)).unwrap();
    let before = nodes(&out);
    run_build(at, &[&SMALL[..], &["tiles", "out"]].concat());
    assert_eq!(built_again(&out, &before), ["tile__000__000", "tile__001__000"]);
    is_as_built_at_once(at);

    // One that goes leaves those around it with an end of their own.
    fs::remove_file(at.join("tiles/Tile_+002_+002.obj")).unwrap();
    let before = nodes(&out);
    run_build(at, &[&SMALL[..], &["tiles", "out"]].concat());
    let again = built_again(&out, &before);
    assert!(again.contains(&"tile__002__001".into()) && again.contains(&"tile__001__002".into()));
    assert!(!again.contains(&"tile__000__000".into()), "{again:?}");
    is_as_built_at_once(at);
}

#[test]
fn tiles_in_subsets_are_as_in_one_build() {
    let folder = tiles(3, in_place);
    let at = folder.path();
    run_build(at, &[&SMALL[..], &["tiles", "whole"]].concat());
    for share in ["2/3", "1/3", "3/3"] {
        run_build(at, &[&SMALL[..], &["--subset", share, "tiles", "out"]].concat());
    }
    run_build(at, &["merge", "out"]);
    assert_eq!(difference(&lasting(&at.join("whole")), &lasting(&at.join("out"))), None);
}
