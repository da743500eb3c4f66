//! `--quantize`: one lattice for the whole city, from the source to the files.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use hlod::city::{self, CityOptions, TextureSize};
use hlod::format::{NODES_DIR, NodeMesh, Scene, read_glb};
use predicates::str::contains;
use tempfile::TempDir;

use crate::support::inputs::{SQUARE, small_city, write, write_soup};
use crate::support::result::{difference, lasting, report};
use crate::support::{hlod_build, run_build};

/// The largest power of two not above 0.01.
const STEP: f64 = 1.0 / 128.0;

const QUANTIZED: [&str; 4] = ["--quantize", "0.01", "--desired-tris", "250"];

/// A city in UTM coordinates, built with positions in steps.
fn built(options: &CityOptions, arguments: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let options = CityOptions { offset: [678_016.3, 5_403_456.7, 370.1], ..options.clone() };
    city::write(&options, &folder.path().join("city.obj")).unwrap();
    build(folder.path(), arguments);
    folder
}

fn build(folder: &Path, arguments: &[&str]) -> String {
    run_build(folder, &[&QUANTIZED[..], arguments, &["city.obj", "out"]].concat())
}

fn verified(folder: &Path, source: &str) {
    run_build(folder, &["verify", "out", "--source", source, "--samples", "20000"]);
}

fn meshes(out: &Path) -> (Scene, Vec<NodeMesh>) {
    let scene = Scene::read(out).unwrap();
    let read = |file: &str| {
        let path = out.join(NODES_DIR).join(file);
        read_glb(&fs::read(&path).unwrap(), &path).unwrap()
    };
    let meshes = scene.nodes.iter().map(|node| read(&node.file)).collect();
    (scene, meshes)
}

fn places(mesh: &NodeMesh) -> impl Iterator<Item = [f64; 3]> {
    let positions = mesh.primitives.iter().flat_map(|primitive| &primitive.positions);
    positions.map(|p| std::array::from_fn(|axis| mesh.origin[axis] + f64::from(p[axis])))
}

#[test]
fn a_scanned_city_is_verified_with_and_without_compression() {
    for more in [&[][..], &["--compress", "meshopt"], &["--borders", "locked"]] {
        let folder = built(&CityOptions { triangles: 8_000, ..small_city() }, more);
        verified(folder.path(), "city.obj");
        let facts = &report(&folder.path().join("out"))["quantized"];
        assert_eq!(facts["step_metres"], STEP);
        assert_eq!(facts["bound_metres"], STEP * 0.5 * 3f64.sqrt());
        assert_eq!(facts["large_nodes"], 0);
        let tileset = fs::read(folder.path().join("out/tileset.json")).unwrap();
        let tileset: serde_json::Value = serde_json::from_slice(&tileset).unwrap();
        assert_eq!(tileset["asset"]["extras"]["quantized"]["step_metres"], STEP);
    }
}

#[test]
fn clustering_puts_its_vertices_on_the_lattice_too() {
    let city = CityOptions { triangles: 6_000, ..small_city() };
    let folder = built(&city, &["--simplifier", "clustering"]);
    verified(folder.path(), "city.obj");
    let (_, meshes) = meshes(&folder.path().join("out"));
    for coordinate in meshes.iter().flat_map(places).flatten() {
        assert_eq!((coordinate / STEP).fract(), 0.0, "{coordinate}");
    }
}

/// Blocks that a grid cut out of one meet as pieces of one block do.
#[test]
fn a_city_divided_by_a_grid_is_verified() {
    let options = CityOptions { blocks: 1, triangles: 8_000, ..small_city() };
    let folder = built(&options, &["--blocks", "grid:25"]);
    assert!(Scene::read(&folder.path().join("out")).unwrap().blocks.len() > 1);
    verified(folder.path(), "city.obj");
}

/// In a closed surface each edge has two triangles, whichever leaves they are in: equal ends are
/// equal in every bit. All positions of all nodes are on the lattice, and no triangle has collapsed.
#[test]
fn leaves_of_a_closed_city_meet_bit_for_bit() {
    let options = CityOptions {
        triangles: 9_000,
        watertight: true,
        texture: TextureSize::None,
        ..small_city()
    };
    let folder = built(&options, &[]);
    verified(folder.path(), "city.obj");
    let (scene, meshes) = meshes(&folder.path().join("out"));
    let mut uses: BTreeMap<[[u64; 3]; 2], u32> = BTreeMap::new();
    for (node, mesh) in scene.nodes.iter().zip(&meshes) {
        for coordinate in places(mesh).flatten() {
            assert_eq!((coordinate / STEP).fract(), 0.0, "{coordinate} in {}", node.file);
        }
        for primitive in &mesh.primitives {
            for corners in primitive.indices.as_chunks::<3>().0 {
                let at = corners.map(|corner| {
                    let position = primitive.positions[corner as usize];
                    let place = |axis: usize| mesh.origin[axis] + f64::from(position[axis]) + 0.0;
                    [0, 1, 2].map(|axis| place(axis).to_bits())
                });
                let [a, b, c] = at;
                assert!(a != b && b != c && c != a, "a collapsed triangle in {}", node.file);
                if node.first_child.is_none() {
                    for (from, to) in [(a, b), (b, c), (c, a)] {
                        *uses.entry([from.min(to), from.max(to)]).or_default() += 1;
                    }
                }
            }
        }
    }
    assert!(uses.len() > 12_000 && scene.nodes.len() > 20);
    assert_eq!(uses.values().filter(|&&uses| uses % 2 == 1).count(), 0);
}

/// Stored errors contain the rounding: those of leaves too, and no parent's is less.
#[test]
fn errors_contain_the_rounding() {
    let folder = built(&small_city(), &[]);
    let (scene, _) = meshes(&folder.path().join("out"));
    let bound = STEP * 0.5 * 3f64.sqrt();
    for node in &scene.nodes {
        assert!(node.geometric_error >= bound, "{}", node.geometric_error);
        if node.first_child.is_none() {
            assert!(node.geometric_error < 4.0 * bound, "{}", node.geometric_error);
        }
    }
}

/// Triangles of all sizes, many far below the step, of which some collapse to nothing.
#[test]
fn a_soup_is_verified_on_a_coarse_lattice() {
    let folder = tempfile::tempdir().unwrap();
    write_soup(folder.path(), 4_000, 5);
    run_build(
        folder.path(),
        &["--quantize", "0.04", "--desired-tris", "200", "--up", "z", "soup.obj", "out"],
    );
    verified(folder.path(), "soup.obj");
}

#[test]
fn nodes_of_too_many_steps_keep_32_bits_and_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    city::write(&small_city(), &folder.path().join("city.obj")).unwrap();
    let text = run_build(
        folder.path(),
        &["--quantize", "0.0005", "--desired-tris", "250", "city.obj", "out"],
    );
    assert!(text.contains("too large for 16 bits"), "{text}");
    verified(folder.path(), "city.obj");
    let out = folder.path().join("out");
    let large = report(&out)["quantized"]["large_nodes"].as_u64().unwrap();
    let (scene, meshes) = meshes(&out);
    let in_steps = |file: &str| {
        let bytes = fs::read(out.join(NODES_DIR).join(file)).unwrap();
        bytes.windows(21).any(|window| window == b"KHR_mesh_quantization")
    };
    let wide = scene.nodes.iter().filter(|node| !in_steps(&node.file)).count() as u64;
    assert_eq!(wide, large);
    assert!(large > 0 && large < meshes.len() as u64);
}

#[test]
fn the_same_at_any_number_of_threads() {
    let folder = built(&small_city(), &["--compress", "meshopt", "--threads", "1"]);
    let result = || lasting(&folder.path().join("out"));
    let one = result();
    build(folder.path(), &["--compress", "meshopt", "--threads", "2", "--force"]);
    assert_eq!(difference(&one, &result()), None);
}

#[test]
fn another_step_is_built_again_and_another_word_for_it_is_not() {
    let folder = built(&small_city(), &[]);
    let again = |quantize: &str| {
        let arguments = ["--quantize", quantize, "--desired-tris", "250", "city.obj", "out"];
        run_build(folder.path(), &arguments).contains("up to date")
    };
    assert!(again("0.01"));
    assert!(again("0.0079"), "the same power of two");
    assert!(!again("0.02"));
    assert!(
        !run_build(folder.path(), &["--desired-tris", "250", "city.obj", "out"])
            .contains("up to date")
    );
}

#[test]
fn steps_that_make_no_sense_are_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    city::write(&small_city(), &folder.path().join("city.obj")).unwrap();
    for (step, words) in [
        ("0", "expected 0.000001 to 1000"),
        ("nan", "expected 0.000001 to 1000"),
        ("-1", "expected 0.000001 to 1000"),
        ("1", "steps across a city"),
    ] {
        hlod_build()
            .current_dir(&folder)
            .args([&format!("--quantize={step}"), "city.obj", "out"])
            .assert()
            .code(2)
            .stderr(contains(words));
        assert!(!folder.path().join("out").exists());
    }
    write(folder.path(), "far.obj", SQUARE.replace("v 1 ", "v 1e10 "));
    hlod_build()
        .current_dir(&folder)
        .args(["--quantize", "0.000001", "far.obj", "out"])
        .assert()
        .code(3)
        .stderr(contains("cannot be rounded to steps"));
}

/// The replay reads such files as it reads others.
#[test]
fn a_path_is_replayed_over_it() {
    let folder = built(&small_city(), &["--compress", "meshopt"]);
    let bench = |arguments: &[&str]| {
        let mut program = Command::cargo_bin("hlod-bench").unwrap();
        program.current_dir(&folder).args(arguments).assert().success();
    };
    bench(&["make-path", "out", "--kind", "orbit", "--out", "orbit.csv"]);
    bench(&["out", "orbit.csv", "--clock", "model", "--quiet", "--out", "bench"]);
    let summary = fs::read(folder.path().join("bench/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    assert!(summary.is_object());
    let frames = fs::read_to_string(folder.path().join("bench/frames.csv")).unwrap();
    assert!(frames.lines().count() > 30);
}
