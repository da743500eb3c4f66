//! Builds that keep to a cap of memory, and builds that go on where others were stopped.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use hlod::city::{self, CityOptions};
use hlod::format::{NODES_DIR, SCENE_FILE};
use tempfile::TempDir;

use crate::support::inputs::small_city;
use crate::support::result::{difference, lasting, report};
use crate::support::{hlod_build, run_build};

/// A model of more than 16 MiB.
fn large_city() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let options = CityOptions { blocks: 9, triangles: 320_000, ..small_city() };
    city::write(&options, &folder.path().join("city.obj")).unwrap();
    assert!(fs::metadata(folder.path().join("city.obj")).unwrap().len() > 16 << 20);
    folder
}

/// What is beside inputs and output that no build should leave.
fn leftovers(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let mut hidden: Vec<String> = names
        .map(|name| name.into_string().unwrap())
        .filter(|name| name.starts_with('.'))
        .collect();
    hidden.sort();
    hidden
}

#[test]
fn a_large_file_is_built_in_tiles_the_same_for_every_cap() {
    let folder = large_city();
    let at = folder.path();
    run_build(at, &["--max-memory", "150MiB", "-j", "1", "city.obj", "small"]);
    run_build(at, &["--max-memory", "2GiB", "city.obj", "out"]);
    assert_eq!(difference(&lasting(&at.join("small")), &lasting(&at.join("out"))), None);
    let inputs = report(&at.join("out"))["inputs"].as_array().unwrap().clone();
    assert!(inputs.len() >= 2, "{inputs:?}");
    let triangles: u64 = inputs.iter().map(|input| input["triangles"].as_u64().unwrap()).sum();
    // Some are cut, by the planes between tiles.
    assert!((320_000..340_000).contains(&triangles), "{triangles}");
    for input in &inputs {
        assert!(input["path"].as_str().unwrap().starts_with("city.obj/city-0"), "{input}");
        let files = input["files"].as_array().unwrap();
        assert!(files.iter().any(|file| file["path"] == "city.obj"), "{input}");
    }
    assert_eq!(leftovers(at), [""; 0]);
    hlod_build().current_dir(at).args(["verify", "out", "--source", "city.obj"]).assert().success();

    // Tiles are shared out as files are.
    for share in ["2/2", "1/2"] {
        run_build(at, &["--max-memory", "1GiB", "--subset", share, "city.obj", "shares"]);
    }
    run_build(at, &["merge", "shares"]);
    assert_eq!(difference(&lasting(&at.join("shares")), &lasting(&at.join("out"))), None);

    // Nothing is divided to find out that nothing has changed.
    let said = run_build(at, &["--max-memory", "1GiB", "city.obj", "out"]);
    assert!(said.contains("up to date"), "{said}");
    let said = run_build(at, &["city.obj", "out"]);
    assert!(!said.contains("up to date"), "{said}");
    assert_eq!(report(&at.join("out"))["inputs"].as_array().unwrap().len(), 1);
}

#[test]
fn what_a_killed_build_had_finished_is_not_built_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let options = CityOptions { blocks: 12, triangles: 240_000, split: true, ..small_city() };
    city::write(&options, &at.join("parts")).unwrap();
    let small = ["--desired-tris", "100"];
    run_build(at, &[&small[..], &["parts", "whole"]].concat());
    let start = || {
        std::process::Command::new(assert_cmd::cargo::cargo_bin("hlod-build"))
            .current_dir(at)
            .args(small)
            .args(["--resume", "-j", "1", "parts", "out"])
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap()
    };
    let scene = || {
        let dir = leftovers(at).into_iter().next()?;
        Some(at.join(dir)).filter(|dir| dir.join(SCENE_FILE).exists())
    };
    let mut child = start();
    while scene().is_none() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let unfinished = scene().expect("it was killed before its end");
    assert!(!at.join("out").exists());
    // Nodes by their places on disk: linked, not made again.
    let nodes = |out: &Path| -> std::collections::BTreeMap<String, u64> {
        let entries = fs::read_dir(out.join(NODES_DIR)).unwrap().map(Result::unwrap);
        let number = |entry: fs::DirEntry| {
            (entry.file_name().into_string().unwrap(), entry.metadata().unwrap().ino())
        };
        entries.map(number).collect()
    };
    let before = nodes(&unfinished);
    run_build(at, &[&small[..], &["--resume", "parts", "out"]].concat());
    let after = nodes(&at.join("out"));
    let kept = before.iter().filter(|(name, place)| after.get(*name) == Some(place)).count();
    assert!(kept > 0 && kept < after.len(), "{kept} of {} and {}", before.len(), after.len());
    assert_eq!(difference(&lasting(&at.join("whole")), &lasting(&at.join("out"))), None);
    assert_eq!(leftovers(at), [""; 0]);

    // Whoever does not ask for it gets a build from the beginning.
    fs::remove_dir_all(at.join("out")).unwrap();
    let mut child = start();
    while scene().is_none() && child.try_wait().unwrap().is_none() {}
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(scene().is_some());
    run_build(at, &["parts", "out"]);
    assert_eq!(leftovers(at), [""; 0]);
}

#[test]
fn caps_that_cannot_be_kept_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let refused = |arguments: &[&str]| {
        let done = hlod_build().current_dir(at).args(arguments).assert().code(2);
        String::from_utf8(done.get_output().stderr.clone()).unwrap()
    };
    let said = refused(&["--max-memory", "1MiB", "a.obj", "out"]);
    assert!(said.contains("1MiB") && said.contains("128MiB or more"), "{said}");
    let said = refused(&["--max-memory", "much", "a.obj", "out"]);
    assert!(said.contains("512MiB"), "{said}");
    let said = refused(&["--resume", "--force", "a.obj", "out"]);
    assert!(said.contains("--resume") && said.contains("--force"), "{said}");
}
