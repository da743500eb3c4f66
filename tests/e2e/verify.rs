//! `hlod-build verify`: a sound scene passes, and each fault fails the check that looks for it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use hlod::builder::threads::with_threads;
use hlod::city::CityOptions;
use hlod::format::attributes::{TEXTURED_WEIGHT, attributes};
use hlod::format::{
    NODES_DIR, NodeImageData, NodeLabel, NodeMesh, SCENE_FILE, Scene, file_crc, read_glb, write_glb,
};
use hlod::place::Placement;
use hlod::verify::{Silent, VerifyOptions, VerifyReport, verify};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use tempfile::TempDir;

use crate::support::hlod_build;
use crate::support::inputs::{small_city, write_city};

/// A city and its scenes, one for each treatment of borders, built once; tests break copies.
pub struct Sound {
    /// Holds them, each named after its treatment.
    pub folder: TempDir,
    source: PathBuf,
}

pub static SOUND: LazyLock<Sound> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let source = write_city(folder.path(), &city());
    for borders in ["locked", "skirts"] {
        hlod_build()
            .current_dir(&folder)
            .args(["--quiet", "--borders", borders, "--desired-tris", "300", "city.obj", borders])
            .assert()
            .success();
    }
    Sound { folder, source }
});

fn city() -> CityOptions {
    CityOptions { triangles: 12_000, ..small_city() }
}

fn options() -> VerifyOptions {
    VerifyOptions { samples: Some(40_000), ..VerifyOptions::default() }
}

pub fn report(out: &Path, with_source: bool) -> VerifyReport {
    let sources: &[PathBuf] = if with_source { std::slice::from_ref(&SOUND.source) } else { &[] };
    verify(out, sources, &options(), &Silent).unwrap()
}

pub fn failed(report: &VerifyReport) -> Vec<&'static str> {
    let checks = report.checks.iter().filter(|check| !check.passed);
    checks.map(|check| check.name).collect()
}

/// A copy of a sound scene to break.
pub struct Broken {
    pub out: TempDir,
    pub scene: Scene,
}

impl Broken {
    pub fn new(of: &str) -> Self {
        let out = tempfile::tempdir().unwrap();
        let from = SOUND.folder.path().join(of);
        fs::create_dir(out.path().join(NODES_DIR)).unwrap();
        fs::copy(from.join(SCENE_FILE), out.path().join(SCENE_FILE)).unwrap();
        for entry in fs::read_dir(from.join(NODES_DIR)).unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), out.path().join(NODES_DIR).join(entry.file_name())).unwrap();
        }
        let scene = Scene::read(out.path()).unwrap();
        Self { out, scene }
    }

    pub fn file(&self, node: usize) -> PathBuf {
        self.out.path().join(NODES_DIR).join(&self.scene.nodes[node].file)
    }

    /// The first node that is a leaf, or is not.
    pub fn node(&self, leaf: bool) -> usize {
        let fits = |node: &hlod::format::Node| node.first_child.is_none() == leaf;
        self.scene.nodes.iter().position(fits).unwrap()
    }

    /// Changes a node's file, and what the scene says of it accordingly.
    pub fn rewrite(&mut self, number: usize, edit: impl FnOnce(&mut NodeMesh)) {
        let path = self.file(number);
        let mut mesh = read_glb(&fs::read(&path).unwrap(), &path).unwrap();
        edit(&mut mesh);
        let up = self.scene.up;
        let node = &mut self.scene.nodes[number];
        let label = NodeLabel { id: node.id, level: node.level };
        let bytes = write_glb(&mesh, up, label).unwrap();
        fs::write(&path, &bytes).unwrap();
        let found = attributes(&mesh, TEXTURED_WEIGHT);
        node.file_bytes = bytes.len() as u64;
        node.file_crc = file_crc(&bytes);
        node.vertices = found.vertices;
        node.triangles = found.triangles;
        node.textured_triangles = found.textured_triangles;
        (node.bbox_min, node.bbox_max) = (found.bbox_min, found.bbox_max);
        (node.cost, node.static_benefit) = (found.cost, found.static_benefit);
        node.average_normal = found.average_normal.map(|c| c as f32);
    }

    pub fn report(&self, with_source: bool) -> VerifyReport {
        fs::write(self.out.path().join(SCENE_FILE), self.scene.to_bytes().unwrap()).unwrap();
        for file in hlod::tileset::files(&self.scene, &Placement::Local).unwrap() {
            fs::write(self.out.path().join(file.path), file.bytes).unwrap();
        }
        report(self.out.path(), with_source)
    }

    pub fn failed(&self) -> Vec<&'static str> {
        failed(&self.report(true))
    }
}

#[test]
fn reports_do_not_depend_on_threads() {
    let out = SOUND.folder.path().join("locked");
    let text = |threads| with_threads(threads, || report(&out, true).to_json().unwrap()).unwrap();
    assert_eq!(text(1), text(5));
}

#[test]
fn figures_do_not_depend_on_where_the_model_lies() {
    let elsewhere = tempfile::tempdir().unwrap();
    let source = write_city(elsewhere.path(), &city());
    let out = elsewhere.path().join("out");
    hlod_build()
        .args(["--quiet", "--borders", "locked", "--desired-tris", "300"])
        .args([&source, &out])
        .assert()
        .success();
    let here = report(&SOUND.folder.path().join("locked"), false);
    let there = report(&out, false);
    assert_eq!(here.worst_nodes[0].id, there.worst_nodes[0].id);
    let figures = |report: &VerifyReport| {
        let VerifyReport { leaves, levels, errors, gaps, .. } = report;
        serde_json::to_string(&(leaves, levels, errors, gaps)).unwrap()
    };
    assert_eq!(figures(&here), figures(&there));
}

#[test]
fn a_missing_file() {
    let broken = Broken::new("locked");
    fs::remove_file(broken.file(broken.node(false))).unwrap();
    assert_eq!(broken.failed(), ["structure"]);
}

#[test]
fn a_changed_byte() {
    let broken = Broken::new("locked");
    let path = broken.file(broken.node(true));
    let mut bytes = fs::read(&path).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&path, bytes).unwrap();
    let report = broken.report(true);
    assert_eq!(failed(&report), ["structure"]);
    assert!(report.checks[0].failures[0].what.contains("CRC-32"));
}

#[test]
fn wrong_attributes() {
    let edits: [fn(&mut hlod::format::Node); 5] = [
        |node| node.cost *= 1.000_001,
        |node| node.static_benefit *= 0.999_999,
        |node| node.bbox_max[2] += 1e-3,
        |node| node.average_normal = [0.0, 0.6, 0.8],
        |node| node.shared_texels += 1,
    ];
    for edit in edits {
        let mut broken = Broken::new("locked");
        edit(&mut broken.scene.nodes[1]);
        assert_eq!(broken.failed(), ["structure"]);
    }
}

#[test]
fn a_scene_whose_errors_grow_towards_the_leaves() {
    let mut broken = Broken::new("locked");
    let leaf = broken.node(true);
    broken.scene.nodes[leaf].geometric_error = 1e9;
    // The writer refuses such a scene; so it is patched into the bytes.
    assert!(broken.scene.to_bytes().is_err());
    let path = broken.out.path().join(SCENE_FILE);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x55;
    fs::write(&path, bytes).unwrap();
    assert_eq!(failed(&report(broken.out.path(), true)), ["structure"]);
}

#[test]
fn an_error_that_is_too_small() {
    let mut broken = Broken::new("locked");
    let parent = broken.scene.nodes[broken.scene.nodes.len() - 1].parent.unwrap() as usize;
    broken.scene.nodes[parent].geometric_error *= 0.2;
    let report = broken.report(true);
    assert_eq!(failed(&report), ["stored errors"]);
    assert_eq!(report.errors.iter().map(|level| level.too_small).sum::<u64>(), 1);
}

#[test]
fn errors_that_are_far_too_large() {
    let mut broken = Broken::new("locked");
    for node in &mut broken.scene.nodes {
        node.geometric_error *= 5.0;
    }
    assert_eq!(broken.failed(), ["stored errors"]);
}

/// Of a node, the first picture, decoded, changed and encoded again.
pub fn repaint(mesh: &mut NodeMesh, paint: impl FnOnce(&mut image::RgbImage)) {
    let image = &mut mesh.images[0];
    let NodeImageData::Embedded { bytes, .. } = &mut image.data else { panic!("not its own") };
    let mut picture = image::load_from_memory(bytes).unwrap().to_rgb8();
    paint(&mut picture);
    let mut encoded = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut encoded, 95)
        .encode_image(&picture)
        .unwrap();
    *bytes = encoded;
}

pub fn textured_leaf(broken: &Broken) -> usize {
    let nodes = &broken.scene.nodes;
    let fits = |n: &hlod::format::Node| n.first_child.is_none() && n.textured_triangles > 100;
    nodes.iter().position(fits).unwrap()
}

#[test]
fn wrong_texels() {
    let mut broken = Broken::new("locked");
    let leaf = textured_leaf(&broken);
    // Black is no tile's colour.
    broken.rewrite(leaf, |mesh| repaint(mesh, |picture| picture.fill(0)));
    assert_eq!(broken.failed(), ["texels of the leaves"]);
}

#[test]
fn the_command_prints_a_table_or_json_and_ends_in_a_code() {
    let out = SOUND.folder.path().join("locked");
    let arguments = |rest: &[&str]| {
        let mut command = hlod_build();
        command.arg("verify").arg(&out).args(["--samples", "20000", "--quiet"]).args(rest);
        command
    };
    let source = SOUND.source.to_str().unwrap();
    arguments(&["--source", source])
        .assert()
        .code(0)
        .stdout(contains("Distance of each level").and(contains("faithful leaves")))
        .stdout(contains("\nPASS\n"))
        .stderr("");
    let done = arguments(&["--json"]).assert().code(0).stderr("");
    let json: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    assert_eq!(json["passed"], true);
    assert_eq!(json["leaves"], serde_json::Value::Null, "no source, no word of the leaves");
    assert!(json["levels"][0]["two_sided"]["rms"].as_f64().unwrap() > 0.0);
    assert_eq!(json["options"]["samples"], 20_000);

    let broken = Broken::new("locked");
    fs::remove_file(broken.file(0)).unwrap();
    hlod_build()
        .args(["verify", "--json"])
        .arg(broken.out.path())
        .assert()
        .code(3)
        .stdout(contains("\"passed\": false"));
    hlod_build().args(["verify", "nowhere"]).assert().code(3).stderr(contains("scene.hlod"));
    arguments(&["--samples", "10"]).assert().code(2).stderr(contains("samples"));
    arguments(&["--source", "nowhere.obj"]).assert().code(3).stderr(contains("nowhere.obj"));
}

#[test]
fn a_level_counts_the_nodes_that_inspect_counts_and_the_leaves_above_it_apart() {
    let report = report(&SOUND.folder.path().join("skirts"), false);
    let scene = Scene::read(&SOUND.folder.path().join("skirts")).unwrap();
    assert!(report.levels.len() >= 2);
    for level in &report.levels {
        let on_level = scene.nodes.iter().filter(|node| node.level == level.level).count() as u64;
        let is_above =
            |node: &&hlod::format::Node| node.level < level.level && node.first_child.is_none();
        let above = scene.nodes.iter().filter(is_above).count() as u64;
        assert_eq!((level.nodes, level.leaves_above), (on_level, above), "{}", level.level);
    }
}

#[test]
fn another_source_than_was_built_is_named_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let other =
        write_city(folder.path(), &CityOptions { triangles: 12_000, seed: 77, ..small_city() });
    let out = SOUND.folder.path().join("skirts");
    let found = verify(&out, std::slice::from_ref(&other), &options(), &Silent).unwrap();
    assert!(!found.passed);
    assert_eq!(found.other_sources, [other.to_string_lossy().into_owned()]);
    let text = hlod::verify::text(&found);
    assert!(text.contains("is not the file that the scene was built from"), "{text}");
    assert!(!text.contains("the builder's bound does not hold"), "{text}");
    assert!(report(&out, true).other_sources.is_empty());
}
