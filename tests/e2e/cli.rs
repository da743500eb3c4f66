//! The programs' command lines: help, messages, exit codes, and what is left alone.

use std::fs;
use std::path::Path;
use std::process::{Command as Process, Stdio};

use predicates::prelude::PredicateBooleanExt;
use predicates::str::{contains, is_empty};
use tempfile::TempDir;

use crate::support::hlod_build;
use crate::support::inputs::{SQUARE, small_city, write, write_city};
use crate::support::result::{contents, difference, lasting};

const SUCCESS: i32 = 0;
const USAGE: i32 = 2;
const INPUT: i32 = 3;
const OUTPUT: i32 = 4;

/// A folder with one good model, `good.obj`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "good.obj", SQUARE);
    folder
}

/// Runs in `folder`, expects a failure with this code and a message that holds all of `parts`,
/// and that nothing in the folder changed.
fn refused(folder: &Path, arguments: &[&str], code: i32, parts: &[&str]) {
    let before = contents(folder);
    let mut entries = fs::read_dir(folder).unwrap().count();
    let mut done = hlod_build()
        .current_dir(folder)
        .args(arguments)
        .assert()
        .code(code)
        .stdout(is_empty())
        .stderr(contains("panicked").not());
    for part in parts {
        done = done.stderr(contains(*part));
    }
    assert_eq!(difference(&before, &contents(folder)), None, "{arguments:?} changed files");
    entries -= fs::read_dir(folder).unwrap().count();
    assert_eq!(entries, 0, "{arguments:?} left a folder");
}

#[test]
fn help_names_every_option_with_its_unit_and_range() {
    let parts = [
        "INPUT... OUT",
        ".obj, .gltf, .glb",
        "auto",
        "groups",
        "grid:METRES",
        "2-64",
        "[default: 4]",
        "1 or more",
        "[default: 2000]",
        "qem",
        "clustering",
        "locked",
        "skirts",
        "1-100",
        "[default: 85]",
        "in texels, 16-65535",
        "Threads, 0-1024",
        "--force",
        "--quiet",
        "inspect",
        "verify",
        "0 success, 1 internal error, 2 usage, 3 input missing or invalid, or what verify looked at \
         does not hold, 4 output not written",
    ];
    let mut done = hlod_build().arg("--help").assert().success().stderr(is_empty());
    for part in parts {
        // Help is wrapped; compare words.
        done = done.stdout(predicates::function::function(move |text: &str| {
            text.split_whitespace().collect::<Vec<_>>().join(" ").contains(part)
        }));
    }
    hlod_build().args(["inspect", "--help"]).assert().success().stdout(contains("--json"));
    hlod_build().arg("--version").assert().success().stdout(contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn bad_usage_is_refused_with_the_range() {
    let folder = folder();
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["Usage", "INPUT... OUT"]),
        (&["good.obj"], &["Usage", "INPUT... OUT"]),
        (&["--what", "good.obj", "out"], &["--what"]),
        (&["--blocks", "houses", "good.obj", "out"], &["houses", "auto, or grid:METRES"]),
        (&["--blocks", "grid:0", "good.obj", "out"], &["grid:0", "METRES > 0"]),
        (&["--blocks", "grid:-5", "good.obj", "out"], &["grid:-5"]),
        (&["--blocks", "grid:NaN", "good.obj", "out"], &["grid:NaN"]),
        (&["--blocks", "grid:inf", "good.obj", "out"], &["grid:inf"]),
        (&["--blocks", "grid:", "good.obj", "out"], &["grid:METRES"]),
        (&["--level-factor", "1", "good.obj", "out"], &["level factor is 1", "2 to 64"]),
        (&["--level-factor", "65", "good.obj", "out"], &["level factor is 65", "2 to 64"]),
        (&["--level-factor", "2.5", "good.obj", "out"], &["--level-factor", "2.5"]),
        (&["--desired-tris", "0", "good.obj", "out"], &["desired triangles is 0", "expected 1"]),
        (&["--desired-tris", "-1", "good.obj", "out"], &["-1"]),
        (&["--jpeg-quality", "0", "good.obj", "out"], &["JPEG quality is 0", "1 to 100"]),
        (&["--jpeg-quality", "101", "good.obj", "out"], &["JPEG quality is 101", "1 to 100"]),
        (&["--max-atlas", "15", "good.obj", "out"], &["largest atlas is 15", "16 to 65535"]),
        (&["--simplifier", "magic", "good.obj", "out"], &["magic", "qem, clustering"]),
        (&["--borders", "none", "good.obj", "out"], &["locked, skirts"]),
        (&["--up", "x", "good.obj", "out"], &["y, z"]),
        (&["--threads", "100000", "good.obj", "out"], &["100000 threads", "0 to 1024"]),
        (&["inspect"], &["OUT"]),
    ];
    for (arguments, parts) in cases {
        refused(folder.path(), arguments, USAGE, parts);
    }
}

#[test]
fn bad_inputs_are_refused_by_name() {
    let folder = folder();
    let path = folder.path();
    write(path, "city.fbx", "not a model");
    write(path, "prose.obj", "This is a letter, dear Sir.\nIt holds no mesh at all.\n");
    write(path, "noise.obj", (0u32..2000).map(|n| ((n * n) >> 3) as u8).collect::<Vec<_>>());
    write(path, "empty.obj", "");
    write(path, "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    write(path, "range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\n# a line\nf 1 2 4\n");
    write(path, "below.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n");
    write(path, "zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n");
    write(path, "word.obj", "v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n");
    write(path, "nan.obj", "v nan 0 0\nv 1 inf 0\nv 0 1 -inf\nf 1 2 3\n");
    write(path, "flat.obj", "v 0 0 0\nv 0 0 0\nv 0 1 0\nf 1 2 3\n");
    write(path, "noise.glb", b"glTF and then something else entirely");
    write(path, "broken.gltf", "{\"asset\": {\"version\": \"2.0\"");
    fs::create_dir(path.join("nothing")).unwrap();
    write(&path.join("nothing"), "readme.txt", "no model here");
    let cases: &[(&str, &[&str])] = &[
        ("absent.obj", &["absent.obj", "no such file"]),
        ("absent", &["absent", "no such file"]),
        ("city.fbx", &["city.fbx", ".obj, .gltf or .glb"]),
        ("prose.obj", &["prose.obj", "expected a Wavefront OBJ"]),
        ("noise.obj", &["noise.obj", "expected a Wavefront OBJ"]),
        ("empty.obj", &["empty.obj", "is empty"]),
        ("points.obj", &["points.obj", "no face"]),
        ("range.obj", &["range.obj", "line 6", "4 of 3 vertices"]),
        ("below.obj", &["below.obj", "line 4", "-4 of 3 vertices"]),
        ("zero.obj", &["zero.obj", "line 4", "0"]),
        ("word.obj", &["word.obj", "line 2", "zero"]),
        ("nan.obj", &["nan.obj", "no triangle is left", "not finite"]),
        ("flat.obj", &["flat.obj", "no triangle is left", "degenerate"]),
        ("noise.glb", &["noise.glb"]),
        ("broken.gltf", &["broken.gltf"]),
        ("nothing", &["nothing", "no model in this folder"]),
    ];
    for (input, parts) in cases {
        refused(path, &[input, "out"], INPUT, parts);
        // One bad input among good ones is enough.
        refused(path, &["good.obj", input, "out"], INPUT, parts);
    }
}

#[test]
fn a_truncated_glb_is_refused_wherever_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.glb");
    hlod::city::write(&small_city(), &whole).unwrap();
    let bytes = fs::read(&whole).unwrap();
    for share in [0.0, 0.00001, 0.001, 0.02, 0.5, 0.999] {
        let length = (bytes.len() as f64 * share) as usize;
        write(folder.path(), "cut.glb", &bytes[..length]);
        refused(folder.path(), &["cut.glb", "out"], INPUT, &["cut.glb"]);
    }
    write(folder.path(), "cut.glb", &bytes[..bytes.len() - 1]);
    refused(folder.path(), &["cut.glb", "out"], INPUT, &["cut.glb"]);
}

#[test]
fn what_is_not_ours_is_left_alone() {
    let folder = folder();
    let path = folder.path();
    for name in ["notes", "nodes_too", "scene_only", "texture"] {
        fs::create_dir(path.join(name)).unwrap();
    }
    write(path, "a_file", "of some kind");
    write(&path.join("notes"), "notes.txt", "mine");
    fs::create_dir(path.join("nodes_too/nodes")).unwrap();
    write(&path.join("nodes_too/nodes"), "mine.blend", "mine");
    write(&path.join("scene_only"), "scene.hlod", "mine, by the same name");
    fs::create_dir(path.join("texture/textures")).unwrap();
    write(&path.join("texture/textures"), "mine.psd", "mine");
    let cases: &[(&str, &[&str])] = &[
        ("a_file", &["a_file", "found a file"]),
        ("notes", &["notes", "notes.txt"]),
        ("nodes_too", &["nodes_too", "mine.blend"]),
        ("scene_only", &["scene_only", "scene.hlod"]),
        ("texture", &["texture", "mine.psd"]),
        ("good.obj", &["good.obj"]),
        (".", &["."]),
    ];
    for (out, parts) in cases {
        refused(path, &["good.obj", out], OUTPUT, parts);
        refused(path, &["--force", "good.obj", out], OUTPUT, parts);
    }
    // Within an input folder, and around an input.
    fs::create_dir(path.join("models")).unwrap();
    write(&path.join("models"), "one.obj", SQUARE);
    refused(path, &["models", "models/out"], OUTPUT, &["models/out", "input"]);
    refused(path, &["models/one.obj", "models"], OUTPUT, &["models", "input"]);
}

#[test]
fn an_earlier_result_with_something_added_is_left_alone() {
    let folder = folder();
    hlod_build().current_dir(&folder).args(["good.obj", "out"]).assert().success();
    write(&folder.path().join("out"), "thesis.tex", "years of work");
    refused(folder.path(), &["--force", "good.obj", "out"], OUTPUT, &["thesis.tex"]);
}

#[test]
fn an_output_that_cannot_be_written_is_named() {
    let folder = folder();
    refused(folder.path(), &["good.obj", "good.obj/out"], OUTPUT, &["good.obj/out"]);
    #[cfg(target_os = "linux")]
    refused(folder.path(), &["good.obj", "/proc/hlod/out"], OUTPUT, &["/proc/hlod"]);
    std::os::unix::fs::symlink("nowhere", folder.path().join("dangling")).unwrap();
    let done = hlod_build().current_dir(&folder).args(["good.obj", "dangling"]).assert();
    done.code(OUTPUT).stderr(contains("dangling").and(contains("link")));
}

/// Files may not grow beyond a limit here, which fails as a full disk does.
#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_leaves_the_old_result() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    let out = folder.path().join("out");
    hlod_build().current_dir(&folder).args(["-q", "city.obj", "out"]).assert().success();
    let before = contents(folder.path());
    let program = assert_cmd::cargo::cargo_bin("hlod-build");
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$0\" --jpeg-quality 95 city.obj out";
    let done =
        Process::new("sh").args(["-c", script]).arg(program).current_dir(&folder).output().unwrap();
    let message = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(OUTPUT), "{message}");
    assert!(message.contains("out/") && message.contains("cannot be written"), "{message}");
    assert_eq!(difference(&before, &contents(folder.path())), None);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 4, "nothing unfinished is left");
    assert!(out.is_dir());
}

#[test]
fn a_build_says_what_it_made_and_quiet_says_nothing() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    let built = |arguments: &[&str]| {
        hlod_build().current_dir(&folder).args(arguments).assert().code(SUCCESS)
    };
    built(&["--force", "city.obj", "out"])
        .stdout(contains("out: 5").and(contains("nodes")).and(contains("peak memory")))
        // No progress where nobody watches.
        .stderr(is_empty());
    built(&["city.obj", "out"]).stdout(contains("up to date")).stderr(is_empty());
    built(&["--quiet", "city.obj", "out"]).stdout(is_empty()).stderr(is_empty());
    built(&["-q", "--force", "city.obj", "out"]).stdout(is_empty()).stderr(is_empty());
    // Errors are told even so.
    let done = hlod_build().current_dir(&folder).args(["-q", "absent.obj", "out"]).assert();
    done.code(INPUT).stderr(contains("absent.obj"));
}

#[test]
fn warnings_are_counted_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("mtllib absent.mtl\n{SQUARE}f 1 2 3\nf 1 1 2\nv 9 9 9\n");
    write(folder.path(), "worn.obj", text);
    hlod_build()
        .current_dir(&folder)
        .args(["worn.obj", "out"])
        .assert()
        .success()
        .stdout(contains("absent.mtl"))
        .stdout(contains("duplicate triangle"))
        .stdout(contains("degenerate triangle"))
        .stdout(contains("vertex that no face uses"));
}

#[test]
fn inspect_shows_a_result_to_people_and_to_programs() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    let out = ["--desired-tris", "300", "city.obj", "out"];
    hlod_build().current_dir(&folder).args(out).assert().success();
    let before = lasting(&folder.path().join("out"));
    hlod_build()
        .current_dir(&folder)
        .args(["inspect", "out"])
        .assert()
        .success()
        .stdout(contains("1 trees, 1 blocks").and(contains("block_0000")))
        .stderr(is_empty());
    hlod_build()
        .current_dir(&folder)
        .args(["inspect", "--blocks", "0", "out"])
        .assert()
        .success()
        .stdout(contains("1 trees more"));
    let done = hlod_build().current_dir(&folder).args(["inspect", "--json", "out"]).assert();
    let json: serde_json::Value =
        serde_json::from_slice(&done.success().get_output().stdout).unwrap();
    let nodes = json["nodes"].as_array().unwrap();
    assert!(nodes.len() > 10);
    let promised = [
        "id",
        "parent",
        "level",
        "block",
        "triangles",
        "textured_triangles",
        "bbox_min",
        "bbox_max",
        "cost",
        "static_benefit",
        "average_normal",
        "geometric_error",
        "texels",
        "file",
        "file_bytes",
    ];
    let further = [
        "first_child",
        "next_sibling",
        "mean_error",
        "p95_error",
        "shared_texels",
        "origin",
        "shared_textures",
        "vertices",
        "pictures",
    ];
    let mut expected: Vec<&str> = promised.into_iter().chain(further).collect();
    expected.sort_unstable();
    for node in nodes {
        let mut keys: Vec<&str> = node.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        assert_eq!(keys, expected);
        let parent = nodes.iter().find(|parent| parent["id"] == node["parent"]);
        assert_eq!(parent.is_none(), node["parent"].is_null());
        let level = parent.map_or(0, |parent| parent["level"].as_u64().unwrap() + 1);
        assert_eq!(node["level"], level);
    }
    assert_eq!(difference(&before, &lasting(&folder.path().join("out"))), None);
}

#[test]
fn inspect_refuses_what_is_no_result() {
    let folder = folder();
    let path = folder.path();
    fs::create_dir(path.join("foreign")).unwrap();
    write(&path.join("foreign"), "notes.txt", "mine");
    refused(path, &["inspect", "foreign"], INPUT, &["foreign/scene.hlod"]);
    refused(path, &["inspect", "absent"], INPUT, &["absent/scene.hlod"]);
    write(&path.join("foreign"), "scene.hlod", "mine too");
    refused(path, &["inspect", "--json", "foreign"], INPUT, &["foreign/scene.hlod"]);
    hlod_build().current_dir(path).args(["good.obj", "out"]).assert().success();
    let scene = path.join("out/scene.hlod");
    let mut bytes = fs::read(&scene).unwrap();
    fs::write(&scene, &bytes[..bytes.len() - 3]).unwrap();
    refused(path, &["inspect", "out"], INPUT, &["out/scene.hlod"]);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&scene, &bytes).unwrap();
    refused(path, &["inspect", "out"], INPUT, &["out/scene.hlod", "CRC-32"]);
}

/// `hlod-build inspect --json out | head -1`: the pipe closes before all is written.
#[test]
fn a_reader_that_stops_reading_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    hlod_build()
        .current_dir(&folder)
        .args(["--desired-tris", "20", "-q", "city.obj", "out"])
        .assert()
        .success();
    let mut child = Process::new(assert_cmd::cargo::cargo_bin("hlod-build"))
        .current_dir(&folder)
        .args(["inspect", "--json", "out"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // More than a pipe holds is still to come when its other end closes.
    drop(child.stdout.take());
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(SUCCESS), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(done.stderr.is_empty());
}
