//! Runs that draw, on whatever adapter there is: small pictures, few frames, no times.

use std::collections::BTreeSet;
use std::fs;

use assert_cmd::assert::Assert;
use hlod::format::TEXTURES_DIR;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use crate::adapter::skip;
use crate::bench_support::{Place, city, street};
use crate::damage::{DAMAGES, inner, node_file};

const INPUT: i32 = 3;
const NO_ADAPTER: i32 = 5;

/// Generous: everything affordable is drawn, and loading keeps up with few frames.
const RUN: [&str; 8] = [
    "--size",
    "320x180",
    "--target-ms",
    "2000",
    "--warm-up-frames",
    "200",
    "--pace",
    "unthrottled",
];

/// At the pace of the path: however busy a machine is, the loader has read everything that is wanted before
/// the log begins.
const LOADED: [&str; 8] =
    ["--size", "320x180", "--target-ms", "2000", "--warm-up-frames", "60", "--pace", "recorded"];

/// Runs; `None` where there is no adapter and none is required.
fn wall(place: &Place, path: &str, options: &[&str]) -> Option<Assert> {
    ran(place, &[&["out", path, "-q"], &RUN[..], options].concat())
}

fn ran(place: &Place, arguments: &[&str]) -> Option<Assert> {
    let done = place.bench(arguments);
    if done.get_output().status.code() != Some(NO_ADAPTER) {
        return Some(done);
    }
    let what = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    skip(&what);
    None
}

/// A snapshot as colours, and how many different ones it has.
fn snapshot(place: &Place, result: &str, frame: usize) -> (Vec<u8>, usize) {
    let file = place.path().join(result).join(format!("snapshots/frame-{frame:06}.png"));
    let image = image::open(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let image = image.to_rgb8();
    assert_eq!(image.dimensions(), (320, 180));
    let colours: BTreeSet<[u8; 3]> = image.pixels().map(|pixel| pixel.0).collect();
    (image.into_raw(), colours.len())
}

#[test]
fn a_run_draws_and_stays_below_its_cap() {
    let place = Place::new(city());
    let cap = 6 << 20;
    let cap_text = cap.to_string();
    let options = ["--max-memory", &cap_text, "--snapshots", "10", "--out", "r"];
    let Some(done) = wall(&place, "fly.csv", &options) else { return };
    // Drivers may have a word of their own, but none of a display that there need not be.
    let told = contains("hlod-bench").or(contains("XDG_RUNTIME_DIR"));
    done.success().stdout("").stderr(told.not());
    let frames = place.frames("r");
    assert_eq!(frames.len(), 30);
    assert!(frames.max("memory_bytes") <= cap as f64 && frames.max("process_bytes") > 0.0);
    assert!(frames.column("draw_ms").iter().all(|&ms| ms > 0.0));
    let summary = place.summary("r");
    assert!(summary["memory"]["peak_bytes"].as_u64().unwrap() <= cap);
    assert_eq!(summary["clock"], "wall");
    assert_eq!(summary["broken_files"], serde_json::json!([]));
    assert!(summary["adapter"].is_object());
    let names: Vec<String> = fs::read_dir(place.path().join("r/snapshots"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(names.len(), 3, "{names:?}");
    for frame in [0, 10, 20] {
        let (_, colours) = snapshot(&place, "r", frame);
        assert!(colours > 50, "frame {frame} has {colours} colours");
    }
}

#[test]
fn frames_to_settle_are_not_logged_and_load_what_the_first_frame_needs() {
    let place = Place::new(city());
    let Some(done) = wall(&place, "orbit.csv", &["--out", "settled"]) else { return };
    done.success();
    let options = ["--warm-up-frames", "0", "--out", "fresh"];
    let run = ["out", "orbit.csv", "-q", "--size", "320x180", "--target-ms", "2000"];
    place.bench(&[&run[..], &options].concat()).success();
    let [settled, fresh] = ["settled", "fresh"].map(|result| place.frames(result));
    assert_eq!((settled.len(), fresh.len()), (30, 30));
    assert_eq!(fresh.column("frame"), settled.column("frame"));
    // Nothing but roots can be drawn in a first frame.
    let roots = place.scene().roots().count() as f64;
    assert_eq!(fresh.column("resident")[0], roots);
    assert!(fresh.column("nodes")[0] <= roots);
    assert!(settled.column("resident")[0] > roots && settled.column("nodes")[0] > roots);
}

#[test]
fn runs_draw_with_the_textures_that_were_asked_for() {
    let place = Place::new(city());
    let Some(done) = wall(&place, "orbit.csv", &["--textures", "auto", "--out", "auto"]) else {
        return;
    };
    done.success();
    let auto = place.summary("auto");
    let suits = if auto["adapter"]["is_processor"] == true { "rgba8" } else { "bc7" };
    assert_eq!(auto["parameters"]["textures"], suits);
    let asked =
        place.bench(&[&["out", "orbit.csv", "-q"], &RUN[..], &["--textures", "bc7"]].concat());
    if asked.get_output().status.code() == Some(NO_ADAPTER) {
        asked.stderr(contains("cannot sample BC7"));
        return;
    }
    asked.success();
    assert_eq!(place.summary("bench")["parameters"]["textures"], "bc7");
}

#[test]
fn levels_are_tinted_where_asked_for() {
    let place = Place::new(city());
    let options = ["--snapshots", "30", "--shading", "unlit"];
    let Some(done) = wall(&place, "orbit.csv", &[&options[..], &["--out", "plain"]].concat())
    else {
        return;
    };
    done.success();
    let tinted = [&options[..], &["--show-levels", "--out", "tinted"]].concat();
    wall(&place, "orbit.csv", &tinted).unwrap().success();
    let [plain, tinted] = ["plain", "tinted"].map(|result| snapshot(&place, result, 0).0);
    let differing = plain.chunks(3).zip(tinted.chunks(3)).filter(|(a, b)| a != b).count();
    assert!(differing > 320 * 180 / 50, "{differing} pixels differ");
}

#[test]
fn a_run_goes_on_with_the_parent_of_a_node_that_is_damaged() {
    let policy = ["--out", "r", "--policy", "lakhia", "--set", "all_siblings=1"];
    let run = [&["out", "orbit.csv", "-q"], &LOADED[..], &policy].concat();
    for damage in DAMAGES {
        let place = Place::new(city());
        let scene = place.scene();
        // All children of a root of which others exist: none of its nodes but itself is drawn.
        let root = scene.nodes[inner(&scene) as usize].parent.unwrap();
        let file = node_file(&place, inner(&scene));
        (damage.apply)(&file);
        let Some(done) = ran(&place, &run) else { return };
        let name = file.file_name().unwrap().to_str().unwrap().to_owned();
        done.code(INPUT).stderr(contains(&name).and(contains("went on without 1 file")));
        let summary = place.summary("r");
        let broken = summary["broken_files"].as_array().unwrap();
        assert_eq!(broken.len(), 1, "{}: {broken:?}", damage.name);
        assert!(broken[0].as_str().unwrap().contains(&name));
        let frames = place.frames("r");
        assert_eq!(frames.len(), 30);
        // The orbit looks at the middle of the city: its first frame sees both trees.
        assert_eq!(scene.nodes[root as usize].level, 0);
        assert_eq!(frames.column("nodes_level_0")[0], 1.0, "{}", damage.name);
        assert!(frames.column("nodes")[0] > 1.0, "{}: the other tree is refined", damage.name);
    }
    // It is the damage that keeps the root there.
    let place = Place::new(city());
    ran(&place, &run).unwrap().success();
    assert_eq!(place.frames("r").column("nodes_level_0")[0], 0.0);
}

#[test]
fn a_run_goes_on_without_a_root_that_is_damaged() {
    let place = Place::new(city());
    let scene = place.scene();
    let roots: Vec<u32> = scene.roots().collect();
    assert_eq!(roots.len(), 2);
    fs::remove_file(node_file(&place, roots[0])).unwrap();
    let Some(done) = wall(&place, "orbit.csv", &["--out", "one"]) else { return };
    done.code(INPUT).stderr(contains("went on without 1 file"));
    assert!(place.frames("one").max("nodes") >= 1.0);
    fs::remove_file(node_file(&place, roots[1])).unwrap();
    wall(&place, "orbit.csv", &["--out", "none"])
        .unwrap()
        .code(INPUT)
        .stderr(contains("went on without 2 files"));
    assert_eq!(place.frames("none").max("nodes"), 0.0);
    assert_eq!(place.summary("none")["broken_files"].as_array().unwrap().len(), 2);
}

#[test]
fn a_shared_picture_that_is_damaged_is_told_of_once() {
    for damage in [&DAMAGES[0], &DAMAGES[4]] {
        let place = Place::new(street());
        let scene = place.scene();
        let texture = &scene.shared_textures[0].file_name;
        (damage.apply)(&place.out().join(TEXTURES_DIR).join(texture));
        let Some(done) = wall(&place, "orbit.csv", &["--out", "r"]) else { return };
        done.code(INPUT).stderr(contains(texture).and(contains("went on without 1 file")));
        let broken = place.summary("r")["broken_files"].clone();
        assert_eq!(broken.as_array().unwrap().len(), 1, "{}: {broken}", damage.name);
        assert_eq!(place.frames("r").len(), 30);
    }
}

#[test]
fn a_cap_below_the_roots_is_told_of_before_anything_is_drawn() {
    let place = Place::new(city());
    let Some(done) = wall(&place, "fly.csv", &["--max-memory", "1KiB", "--out", "r"]) else {
        return;
    };
    done.code(2).stderr(contains("--max-memory").and(contains("roots")));
    assert!(!place.path().join("r").exists());
}
