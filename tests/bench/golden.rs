//! The model clock gives the log that is written down in `fixtures/bench/`, byte for byte.
//!
//! `scene.hlod` and `nodes/` are the fixture city, built without textures to be small, and
//! `path.csv` is a flight over it. After a change of selection, loading or the log that is meant,
//! `HLOD_BLESS=1 cargo test --release --test bench golden` writes the log and the summary down
//! anew, and the scene too, which a new version of its format needs; the path stays.

use std::fs;
use std::path::{Path, PathBuf};

use hlod::format::{NODES_DIR, SCENE_FILE, Scene};

use crate::bench_support::{Frames, build_options, hlod_bench};
use crate::support::build_with;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

fn bless() -> bool {
    std::env::var_os("HLOD_BLESS").is_some_and(|bless| bless == "1")
}

/// Writes the scene down anew: that of the fixture city as it is built now.
fn write_scene(to: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let city = fs::read_to_string(fixtures().join("tiny_city/city.obj")).unwrap();
    let untextured: Vec<&str> = city
        .lines()
        .filter(|line| !(line.starts_with("usemtl") || line.starts_with("mtllib")))
        .collect();
    let input = folder.path().join("city.obj");
    fs::write(&input, untextured.join("\n")).unwrap();
    let out = folder.path().join("out");
    build_with(&[input], &out, &build_options(60));
    let path = out.join(SCENE_FILE);
    let mut scene = Scene::from_bytes(&fs::read(&path).unwrap(), &path).unwrap();
    // Wherever this is run.
    scene.blocks.iter_mut().for_each(|block| block.input = "tiny_city/city.obj".into());
    let nodes = to.join(NODES_DIR);
    let _ = fs::remove_dir_all(&nodes);
    fs::create_dir_all(&nodes).unwrap();
    fs::write(to.join(SCENE_FILE), scene.to_bytes().unwrap()).unwrap();
    for node in &scene.nodes {
        fs::copy(out.join(NODES_DIR).join(&node.file), nodes.join(&node.file)).unwrap();
    }
}

#[test]
fn a_flight_by_the_model_clock_gives_the_golden_log() {
    let kept = fixtures().join("bench");
    if bless() {
        write_scene(&kept);
    }
    let folder = tempfile::tempdir().unwrap();
    // A target and a cap that both bind, and loading slow enough to be waited for.
    hlod_bench()
        .current_dir(folder.path())
        .arg(&kept)
        .arg(kept.join("path.csv"))
        .arg("--constants")
        .arg(kept.join("clock.json"))
        .args(["--clock", "model", "--target-ms", "4", "--max-memory", "150KiB"])
        .args(["--chunk", "4KiB", "--out", "r", "-q"])
        .assert()
        .success();
    let found = fs::read(folder.path().join("r/frames.csv")).unwrap();
    let frames = Frames::parse(&found);
    // What makes it worth keeping: something happens in it.
    assert!(frames.column("toggles_up").iter().sum::<f64>() > 3.0);
    assert!(frames.column("toggles_down").iter().sum::<f64>() > 3.0);
    assert!(frames.column("evictions").iter().sum::<f64>() > 0.0);
    assert!(frames.max("culled") > 0.0 && frames.max("waiting") > 0.0);
    assert!(frames.max("memory_bytes") <= 150.0 * 1024.0);
    assert!(found.len() < 100_000, "{} bytes", found.len());
    let path = kept.join("frames.csv");
    if bless() {
        fs::write(&path, &found).unwrap();
        fs::copy(folder.path().join("r/summary.json"), kept.join("summary.json")).unwrap();
    }
    let expected = fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}; HLOD_BLESS=1 writes it", path.display()));
    let found = String::from_utf8(found).unwrap();
    let differing = expected.lines().zip(found.lines()).find(|(expected, found)| expected != found);
    assert!(
        expected == found,
        "{} differs, first in (expected, found)\n{differing:#?}\nHLOD_BLESS=1 accepts it",
        path.display()
    );
}
