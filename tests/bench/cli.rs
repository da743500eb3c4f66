//! The command line: messages, exit codes, and what is left alone.

use std::fs;
use std::process::{Command as Process, Stdio};

use hlod::bench::ClockConstants;
use hlod::format::{NODES_DIR, SCENE_FILE};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::{contains, is_empty};

use crate::bench_support::{Place, city, hlod_bench};
use crate::support::result::{contents, difference};

const USAGE: i32 = 2;
const INPUT: i32 = 3;
const OUTPUT: i32 = 4;
const NO_ADAPTER: i32 = 5;

/// Runs, expects a failure with this code and a message that holds all of `parts`, and that
/// nothing was written.
fn refused(place: &Place, arguments: &[&str], code: i32, parts: &[&str]) {
    let before = contents(place.path());
    let entries = || fs::read_dir(place.path()).unwrap().count();
    let entries_before = entries();
    let mut done = place.bench(arguments).code(code).stdout(is_empty());
    done = done.stderr(contains("panicked").not());
    for part in parts {
        done = done.stderr(contains(*part));
    }
    assert_eq!(difference(&before, &contents(place.path())), None, "{arguments:?} changed files");
    assert_eq!(entries(), entries_before, "{arguments:?} left a folder");
}

/// The same for a replay by the model clock with some options.
fn run_refused(place: &Place, options: &[&str], code: i32, parts: &[&str]) {
    let run = ["out", "fly.csv", "--clock", "model"];
    refused(place, &[&run, options].concat(), code, parts);
}

#[test]
fn help_names_every_option_with_its_unit_and_range() {
    let help = |arguments: &[&str]| {
        let done = hlod_bench().args(arguments).assert().success().stderr(is_empty());
        let text = String::from_utf8(done.get_output().stdout.clone()).unwrap();
        // Help is wrapped; compare words.
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let run = help(&["--help"]);
    for part in [
        "OUT PATH.csv",
        "make-path",
        "calibrate",
        "milliseconds that a frame may take, above 0 [default: 30]",
        "[default: gain-over-price]",
        "screen-error-loop",
        "best-first",
        "--set <CONSTANT=VALUE>",
        "0 or more [default: 0.1]",
        "KiB, MiB, GiB or TiB [default: 1GiB]",
        "[default: 64KiB]",
        "a quarter of the bytes of `rgba8`, at a PSNR of some 42 dB",
        "in pixels [default: 1280x720]",
        "N 1 or more",
        "--warm-up-frames",
        "--show-levels",
        "--adapter",
        "--quiet",
        "2 usage, 3 input missing or invalid",
        "4 output not written, 5 no graphics adapter",
    ] {
        assert!(run.contains(part), "{part:?} is not in\n{run}");
    }
    let make_path = help(&["make-path", "--help"]);
    for part in ["1.5 and 15 m/s", "Frames, 1 or more", "Frames a second [default: 30]", "- shake:"]
    {
        assert!(make_path.contains(part), "{part:?} is not in\n{make_path}");
    }
    let policies = help(&["policies", "--help"]);
    for part in ["--list", "in milliseconds, above 0", "1 or more", "--pops"] {
        assert!(policies.contains(part), "{part:?} is not in\n{policies}");
    }
    let list = help(&["policies", "--list"]);
    for part in ["gain-over-price (default)", "lakhia", "--set hyst_switch=1500", "0 to 1"] {
        assert!(list.contains(part), "{part:?} is not in\n{list}");
    }
    assert!(help(&["calibrate", "--help"]).contains("--constants"));
    assert!(help(&["--version"]).contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn bad_usage_is_refused_with_the_range() {
    let place = Place::new(city());
    refused(&place, &[], USAGE, &["Usage", "OUT PATH.csv"]);
    refused(&place, &["out"], USAGE, &["PATH.csv"]);
    refused(&place, &["--what", "out", "fly.csv"], USAGE, &["--what"]);
    refused(&place, &["out", "fly.csv", "--clock", "sun"], USAGE, &["--clock", "wall", "model"]);
    let cases: &[(&[&str], &[&str])] = &[
        (&["--target-ms", "0"], &["--target-ms", "above 0", "found 0"]),
        (&["--target-ms", "-5"], &["--target-ms", "above 0", "found -5"]),
        (&["--target-ms", "NaN"], &["--target-ms", "above 0", "NaN"]),
        (&["--target-ms", "inf"], &["--target-ms", "above 0", "inf"]),
        (&["--target-ms", "soon"], &["--target-ms", "soon"]),
        (&["--policy", "latest"], &["--policy", "latest", "lakhia", "best-first"]),
        (&["--policy", "lakhia", "--set", "hyst_switch=0"], &["hyst_switch", "found 0"]),
        (&["--policy", "lakhia", "--set", "fore=1.5"], &["fore", "0 to 1", "1.5"]),
        (&["--policy", "lakhia", "--set", "vis=-1"], &["vis", "found -1"]),
        (&["--policy", "lakhia", "--set", "v_time_gain=2"], &["v_time_gain", "0 to 1"]),
        (&["--set", "vis"], &["--set", "hyst_switch=50"]),
        (&["--set", "vis=NaN"], &["--set", "hyst_switch=50"]),
        (&["--policy", "lakhia", "--set", "colour=1"], &["colour", "lakhia", "hyst_limit"]),
        (&["--policy", "screen-area", "--set", "vis=1"], &["vis", "screen-area", "expand"]),
        (&["--evict-margin", "-0.1"], &["--evict-margin", "at least 0"]),
        (&["--chunk", "0"], &["--chunk", "at least 1 byte"]),
        (&["--max-memory", "lots"], &["--max-memory", "512MiB"]),
        (&["--max-memory", "-1"], &["--max-memory"]),
        (&["--max-memory", "NaN"], &["--max-memory"]),
        (&["--size", "0x10"], &["--size", "1280x720"]),
        (&["--size", "99999x10"], &["--size"]),
        (&["--snapshots", "0"], &["--snapshots"]),
        (&["--reference-every", "0"], &["--reference-every"]),
        (&["--reference-every", "5", "--show-levels"], &["--reference-every", "--show-levels"]),
    ];
    for (options, parts) in cases {
        run_refused(&place, options, USAGE, parts);
    }
}

/// Before the first of its runs.
#[test]
fn a_sweep_with_a_target_that_is_none_is_refused() {
    let place = Place::new(city());
    let sweep = ["sweep", "out", "fly.csv", "--clock", "model", "--targets"];
    for (targets, part) in [("5,-1", "-1"), ("5,0", "0"), ("5,NaN", "NaN"), ("5,inf", "inf")] {
        refused(&place, &[&sweep[..], &[targets]].concat(), USAGE, &["--targets", "above 0", part]);
    }
    let both = ["--target-ms", "3"];
    refused(&place, &[&sweep[..], &["5"], &both].concat(), USAGE, &["--target-ms", "--targets"]);
}

#[test]
fn a_cap_below_the_roots_says_what_they_need() {
    let place = Place::new(city());
    let output = place.bench(&["out", "fly.csv", "--clock", "model", "--max-memory", "1"]);
    let output = output.code(USAGE);
    let message = String::from_utf8(output.get_output().stderr.clone()).unwrap();
    let words: Vec<&str> = message.split_whitespace().collect();
    let needed = words.iter().position(|&word| word == "least").map(|at| words[at + 1]).unwrap();
    let needed: u64 = needed.parse().unwrap();
    // Exactly that: a byte less is refused, and this much runs.
    let less = (needed - 1).to_string();
    run_refused(&place, &["--max-memory", &less], USAGE, &["--max-memory", "roots", &less]);
    let cap = needed.to_string();
    place
        .bench(&["out", "fly.csv", "--clock", "model", "--max-memory", &cap, "--out", "r"])
        .success();
    assert_eq!(place.summary("r")["memory"]["peak_bytes"], needed);
}

#[test]
fn scenes_that_are_none_are_refused() {
    let place = Place::new(city());
    let path = place.path().to_owned();
    fs::create_dir(path.join("foreign")).unwrap();
    fs::write(path.join("foreign/notes.txt"), "mine").unwrap();
    let run = |place: &Place, scene: &str, parts: &[&str]| {
        refused(place, &[scene, "fly.csv", "--clock", "model"], INPUT, parts);
        refused(place, &["make-path", scene, "--kind", "fly", "--out", "p.csv"], INPUT, parts);
    };
    run(&place, "absent", &["absent/scene.hlod"]);
    run(&place, "foreign", &["foreign/scene.hlod"]);
    run(&place, "fly.csv", &["fly.csv/scene.hlod"]);
    fs::write(path.join("foreign").join(SCENE_FILE), "mine too").unwrap();
    run(&place, "foreign", &["foreign/scene.hlod"]);
    let file = place.out().join(SCENE_FILE);
    let good = fs::read(&file).unwrap();
    // The version follows the magic.
    let mut bytes = good.clone();
    bytes[8] = 250;
    fs::write(&file, &bytes).unwrap();
    run(&place, "out", &["out/scene.hlod", "version", "250"]);
    let mut bytes = good.clone();
    bytes[good.len() / 2] ^= 4;
    fs::write(&file, &bytes).unwrap();
    run(&place, "out", &["out/scene.hlod", "CRC-32"]);
    fs::write(&file, &good[..good.len() - 3]).unwrap();
    run(&place, "out", &["out/scene.hlod"]);
}

#[test]
fn paths_that_are_none_are_refused_with_the_line() {
    let place = Place::new(city());
    let header = "frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg\n";
    let cases: &[(&str, &[&str])] = &[
        ("", &["header"]),
        (header, &["row", "none"]),
        ("frame,time_s,x,y\n0,0,1,2\n", &["line 1"]),
        ("a,b,c\n1,2,3\n", &["line 1"]),
        (&format!("{header}0,0,0,0,NaN,0,0,0,1,60\n"), &["line 2", "z", "NaN"]),
        (&format!("{header}0,0,0,0,0,0,0,0,1,60\n1,0.1,0,0,0,0,0,0,0,60\n"), &["line 3"]),
        (&format!("{header}0,0,0,0,0,0,0,0,1,180\n"), &["line 2", "fov_y_deg"]),
        (&format!("{header}0,0,0,0,0,0,0,1,60\n"), &["line 2", "columns"]),
        (&format!("{header}0,1,0,0,0,0,0,0,1,60\n1,0,0,0,0,0,0,0,1,60\n"), &["line 3", "time_s"]),
    ];
    for (text, parts) in cases {
        fs::write(place.path().join("bad.csv"), text).unwrap();
        let parts = [&["bad.csv"], *parts].concat();
        refused(&place, &["out", "bad.csv", "--clock", "model"], INPUT, &parts);
    }
    fs::write(place.path().join("bad.csv"), [0xff, 0xfe, 0, 1]).unwrap();
    refused(&place, &["out", "bad.csv", "--clock", "model"], INPUT, &["bad.csv"]);
    refused(&place, &["out", "absent.csv", "--clock", "model"], INPUT, &["absent.csv"]);
    refused(&place, &["out", "out", "--clock", "model"], INPUT, &["out", "camera path"]);
}

#[test]
fn constants_that_are_none_are_refused() {
    let place = Place::new(city());
    let good: serde_json::Value =
        serde_json::from_str(&ClockConstants::default().to_json()).unwrap();
    let with = |name: &str, value: serde_json::Value| {
        let mut changed = good.clone();
        changed[name] = value;
        changed.to_string()
    };
    let cases: &[(String, &[&str])] = &[
        (String::new(), &["constants"]),
        ("mine".into(), &["constants"]),
        ("{}".into(), &["version"]),
        (with("version", 99.into()), &["version", "99"]),
        (with("version", 2.into()), &["version", "expected 4", "calibrate again"]),
        (with("noise", "loud".into()), &["constants"]),
        (with("noise", (-1).into()), &["noise", "at least 0"]),
        (with("overlap", 2.into()), &["overlap", "0 to 1"]),
        (with("prices", 1.into()), &["constants"]),
        (with("load_bytes_per_ms", 0.into()), &["load_bytes_per_ms", "above 0"]),
        (with("textured_weight", 2.into()), &["textured_weight", "0 to 1"]),
        (with("colour", 2.into()), &["colour"]),
    ];
    for (text, parts) in cases {
        fs::write(place.path().join("clock.json"), text).unwrap();
        let parts = [&["clock.json"], *parts].concat();
        run_refused(&place, &["--constants", "clock.json"], INPUT, &parts);
    }
    run_refused(&place, &["--constants", "absent.json"], INPUT, &["absent.json"]);
    fs::write(place.path().join("clock.json"), good.to_string()).unwrap();
    place
        .bench(&["out", "fly.csv", "--clock", "model", "--constants", "clock.json", "-q"])
        .success();
}

#[test]
fn an_adapter_that_is_not_there_is_named() {
    let place = Place::new(city());
    // Exit code 5 with and without other adapters, and where drawing is not compiled in.
    let named: &[&str] = if cfg!(feature = "render") { &["adapter"] } else { &["model"] };
    refused(&place, &["out", "fly.csv", "--adapter", "abacus"], NO_ADAPTER, named);
    refused(
        &place,
        &["calibrate", "out", "--adapter", "abacus", "--out", "clock.json"],
        NO_ADAPTER,
        named,
    );
}

#[test]
fn places_that_cannot_be_written_are_found_out_before_the_run() {
    let place = Place::new(city());
    fs::write(place.path().join("file"), "mine").unwrap();
    // An adapter that is not there shows that nothing was begun.
    for out in ["file", "file/below/it"] {
        let run = ["out", "fly.csv", "--out", out, "--adapter", "abacus"];
        refused(&place, &run, OUTPUT, &[out, "file"]);
    }
    refused(
        &place,
        &["make-path", "out", "--kind", "fly", "--out", "file/p.csv"],
        OUTPUT,
        &["file/p.csv"],
    );
    if cfg!(target_os = "linux") {
        run_refused(&place, &["--out", "/proc/hlod"], OUTPUT, &["/proc/hlod"]);
    }
}

#[test]
fn results_within_the_built_folder_are_refused_before_the_run() {
    let place = Place::new(city());
    let within = &["lies within the folder of the built scene"];
    for out in ["out", "out/bench", "out/nodes/deep/er", "out/../out/bench"] {
        run_refused(&place, &["--out", out], OUTPUT, within);
        refused(&place, &["sweep", "out", "fly.csv", "--out", out], OUTPUT, within);
        refused(&place, &["policies", "out", "--out", out], OUTPUT, within);
    }
    let make_path = ["make-path", "out", "--kind", "fly", "--out", "out/p.csv"];
    refused(&place, &make_path, OUTPUT, within);
    // A folder beside it with a name that begins alike.
    place.bench(&["out", "fly.csv", "--clock", "model", "-q", "--out", "outer"]).success();
}

#[test]
fn pictures_of_a_run_that_draws_nothing_are_refused() {
    let place = Place::new(city());
    let told = &["--snapshots", "model clock draws nothing", "--clock wall"];
    run_refused(&place, &["--snapshots", "10"], USAGE, told);
}

#[test]
fn caps_above_the_memory_of_the_machine_are_accepted() {
    let place = Place::new(city());
    let run = ["out", "fly.csv", "--clock", "model", "-q", "--max-memory", "1TiB", "--out", "r"];
    place.bench(&run).success();
    assert_eq!(place.summary("r")["memory"]["cap_bytes"], 1u64 << 40);
}

#[test]
fn paths_of_each_kind_are_made_and_replayed() {
    let place = Place::new(city());
    for kind in ["walk", "drive", "fly", "orbit", "still", "shake"] {
        let file = format!("{kind}-made.csv");
        place
            .bench(&["make-path", "out", "--kind", kind, "--frames", "7", "--out", &file])
            .success()
            .stdout(contains("7 frames").and(contains(&file)));
        place.bench(&["out", &file, "--clock", "model", "--out", kind, "-q"]).success();
        assert_eq!(place.frames(kind).len(), 7);
        assert_eq!(place.summary(kind)["frames"], 7);
    }
    let cases: &[(&[&str], &[&str])] = &[
        (&["--kind", "swim", "--out", "p.csv"], &["swim", "walk"]),
        (&["--out", "p.csv"], &["--kind"]),
        (&["--kind", "fly"], &["--out"]),
        (&["--kind", "fly", "--frames", "0", "--out", "p.csv"], &["frames"]),
        (&["--kind", "fly", "--frames", "-3", "--out", "p.csv"], &["-3"]),
        (&["--kind", "fly", "--fps", "0", "--out", "p.csv"], &["fps"]),
        (&["--kind", "fly", "--fps", "NaN", "--out", "p.csv"], &["fps"]),
    ];
    for (options, parts) in cases {
        refused(&place, &[&["make-path", "out"], *options].concat(), USAGE, parts);
    }
}

#[test]
fn paths_are_made_only_over_nodes_that_can_be_read() {
    let place = Place::new(city());
    let scene = place.scene();
    for node in &scene.nodes {
        fs::remove_file(place.out().join(NODES_DIR).join(&node.file)).unwrap();
    }
    refused(&place, &["make-path", "out", "--kind", "walk", "--out", "p.csv"], INPUT, &["nodes/"]);
}

#[test]
fn quiet_prints_nothing_and_otherwise_it_says_where_the_results_are() {
    let place = Place::new(city());
    let run = ["out", "fly.csv", "--clock", "model"];
    place.bench(&[&run[..], &["--quiet"]].concat()).success().stdout("").stderr("");
    assert!(place.path().join("bench/summary.json").exists(), "the default is bench/");
    place
        .bench(&run)
        .success()
        .stderr("")
        .stdout(contains("bench/frames.csv").and(contains("bench/summary.json")));
}

/// `hlod-bench … | true`: the pipe closes before anything is written.
#[test]
fn a_reader_that_stops_reading_is_no_failure() {
    let place = Place::new(city());
    let mut child = Process::new(assert_cmd::cargo::cargo_bin("hlod-bench"))
        .current_dir(place.path())
        .args(["out", "fly.csv", "--clock", "model"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(done.stderr.is_empty());
    assert!(place.path().join("bench/summary.json").exists());
}
