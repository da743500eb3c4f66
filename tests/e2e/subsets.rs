//! Shares of a build that several machines make, and one result of all of them.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use hlod::city::{self, CityOptions};
use hlod::format::{NODES_DIR, REPORT_FILE, SCENE_FILE, SUBSETS_DIR, TEXTURES_DIR};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use tempfile::TempDir;

use crate::support::inputs::{small_city, write_street};
use crate::support::result::{difference, lasting, report};
use crate::support::{data, hlod_build, run_build};

const SMALL: [&str; 2] = ["--desired-tris", "40"];

/// Twelve models, which are several blocks and nodes above these.
fn parts() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let options = CityOptions { blocks: 12, triangles: 24_000, split: true, ..small_city() };
    city::write(&options, &folder.path().join("parts")).unwrap();
    folder
}

/// Builds one share of what is in `inputs`.
fn subset(folder: &Path, subset: &str, arguments: &[&str]) -> String {
    run_build(folder, &[&SMALL, &["--subset", subset][..], arguments].concat())
}

/// What a merge is refused for.
fn refused(folder: &Path) -> String {
    let done = hlod_build().current_dir(folder).args(["merge", "out"]).assert().code(3);
    String::from_utf8(done.get_output().stderr.clone()).unwrap()
}

#[test]
fn subsets_are_merged_to_what_one_build_makes() {
    let folder = parts();
    let at = folder.path();
    run_build(at, &[&SMALL[..], &["parts", "whole"]].concat());
    for share in ["3/3", "1/3", "2/3"] {
        let said = subset(at, share, &["parts", "out"]);
        assert!(said.starts_with(&format!("out/subsets/{}", share.replace('/', "-of-"))), "{said}");
    }
    assert!(!at.join("out").join(SCENE_FILE).exists());
    run_build(at, &["merge", "out"]);
    assert_eq!(difference(&lasting(&at.join("whole")), &lasting(&at.join("out"))), None);
    assert!(report(&at.join("out"))["above"].as_array().is_some_and(|found| !found.is_empty()));
    assert!(!at.join("out").join(SUBSETS_DIR).exists(), "they are joined");
    let said = run_build(at, &[&SMALL[..], &["parts", "out"]].concat());
    assert!(said.contains("up to date"), "{said}");
}

#[test]
fn textures_that_subsets_share_are_there_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in ["a", "b"] {
        fs::create_dir_all(at.join("streets").join(name)).unwrap();
        write_street(&at.join("streets").join(name), 12);
    }
    let squares = ["--blocks", "grid:4"];
    run_build(at, &[&SMALL[..], &squares, &["streets", "whole"]].concat());
    for share in ["1/2", "2/2"] {
        subset(at, share, &[&squares[..], &["streets", "out"]].concat());
    }
    run_build(at, &["merge", "out"]);
    let [mut whole, mut out] = ["whole", "out"].map(|name| lasting(&at.join(name)));
    assert!(whole.keys().any(|name| name.starts_with(TEXTURES_DIR)), "{:?}", whole.keys());
    let texels = |name: &str| report(&at.join(name))["source_texels"].as_u64().unwrap();
    assert!(texels("whole") > 0 && texels("out") == texels("whole"));
    for files in [&mut whole, &mut out] {
        files.remove(REPORT_FILE);
    }
    assert_eq!(difference(&whole, &out), None);
}

#[test]
fn real_models_in_subsets_are_as_in_one_build() {
    for (set, of) in [("lyon_nasty", 4), ("3dfier", 2)] {
        let tris = ["--desired-tris", "100"];
        let Some(models) = data(set) else { continue };
        let folder = tempfile::tempdir().unwrap();
        let models = models.to_str().unwrap();
        run_build(folder.path(), &[&tris[..], &["--quiet", models, "whole"]].concat());
        for number in 1..=of {
            let share = format!("{number}/{of}");
            let of_share = ["--quiet", "--subset", &share, models, "out"];
            run_build(folder.path(), &[&tris[..], &of_share].concat());
        }
        run_build(folder.path(), &["merge", "--quiet", "out"]);
        let [whole, out] = ["whole", "out"].map(|name| lasting(&folder.path().join(name)));
        assert_eq!(difference(&whole, &out), None, "{set}");
    }
}

#[test]
fn only_shares_with_blocks_that_changed_are_built_again() {
    let folder = parts();
    let at = folder.path();
    for share in ["1/4", "2/4", "3/4", "4/4"] {
        subset(at, share, &["parts", "out"]);
    }
    run_build(at, &["merge", "out"]);
    // Of the same geometry, so that all blocks are where they were.
    let model = at.join("parts/block_0000.obj");
    let text = fs::read_to_string(&model).unwrap();
    fs::write(&model, text.replacen("v ", "v\t", 1)).unwrap();
    run_build(at, &[&SMALL[..], &["parts", "whole"]].concat());
    for share in ["1/4", "2/4", "3/4", "4/4"] {
        subset(at, share, &["parts", "out"]);
        let said = subset(at, share, &["parts", "out"]);
        assert!(said.contains("up to date"), "{said}");
    }
    let built = |share: &str| -> f64 {
        let stages = report(&at.join("out").join(SUBSETS_DIR).join(share));
        let stages = stages["stages"].as_array().unwrap().clone();
        let simplify = stages.iter().find(|stage| stage["stage"] == "simplify").unwrap();
        simplify["seconds"].as_f64().unwrap()
    };
    let worked = ["1-of-4", "2-of-4", "3-of-4", "4-of-4"].map(|share| built(share) > 0.0);
    assert!(worked.contains(&true) && worked.contains(&false), "{worked:?}");
    let said = run_build(at, &["merge", "out"]);
    assert!(!said.contains("triangles/s"), "no triangle was built: {said}");
    assert_eq!(difference(&lasting(&at.join("whole")), &lasting(&at.join("out"))), None);
}

#[test]
fn a_killed_share_costs_itself_alone() {
    let folder = parts();
    let at = folder.path();
    subset(at, "1/2", &["parts", "out"]);
    let mut killed = Command::new(assert_cmd::cargo::cargo_bin("hlod-build"))
        .current_dir(at)
        .args([&SMALL[..], &["--subset", "2/2", "parts", "out"]].concat())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(40));
    killed.kill().unwrap();
    killed.wait().unwrap();
    if !at.join("out/subsets/2-of-2").exists() {
        let what = refused(at);
        assert!(what.contains("missing 2/2"), "{what}");
        subset(at, "2/2", &["parts", "out"]);
    }
    let said = subset(at, "1/2", &["parts", "out"]);
    assert!(said.contains("up to date"), "{said}");
    run_build(at, &["merge", "out"]);
    run_build(at, &[&SMALL[..], &["parts", "whole"]].concat());
    assert_eq!(difference(&lasting(&at.join("whole")), &lasting(&at.join("out"))), None);
}

#[test]
fn subsets_that_do_not_fit_together_are_named() {
    let folder = parts();
    let at = folder.path();
    let is_named = |what: &str, texts: &[&str]| {
        assert!(texts.iter().all(|text| what.contains(text)), "{what}");
    };
    is_named(&refused(at), &["out/subsets", "--subset K/N"]);
    subset(at, "1/2", &["parts", "out"]);
    is_named(&refused(at), &["found 1", "missing 2/2"]);

    subset(at, "2/2", &["--jpeg-quality", "60", "parts", "out"]);
    is_named(&refused(at), &["out/subsets/2-of-2", "jpeg_quality 85", "found 60"]);

    fs::copy(at.join("parts/block_0000.obj"), at.join("parts/more.obj")).unwrap();
    subset(at, "2/2", &["parts", "out"]);
    is_named(&refused(at), &["out/subsets/2-of-2", "parts/more.obj"]);
    fs::remove_file(at.join("parts/more.obj")).unwrap();

    subset(at, "2/2", &["parts", "out"]);
    let report = at.join("out/subsets/2-of-2").join(REPORT_FILE);
    let text = fs::read_to_string(&report).unwrap();
    let version = format!("\"version\": \"{}\"", env!("CARGO_PKG_VERSION"));
    fs::write(&report, text.replace(&version, "\"version\": \"0.0.7\"")).unwrap();
    is_named(&refused(at), &["out/subsets/2-of-2", "0.0.7"]);
    fs::write(&report, &text).unwrap();

    let nodes = at.join("out/subsets/2-of-2").join(NODES_DIR);
    let node = fs::read_dir(&nodes).unwrap().next().unwrap().unwrap().path();
    fs::write(&node, "cut off").unwrap();
    is_named(&refused(at), &["out/subsets/2-of-2", "--subset 2/2 again"]);
    subset(at, "2/2", &["parts", "out"]);

    subset(at, "3/3", &["parts", "out"]);
    is_named(&refused(at), &["1/2", "3/3"]);
    fs::remove_dir_all(at.join("out/subsets/3-of-3")).unwrap();
    run_build(at, &["merge", "out"]);
}

#[test]
fn subsets_are_not_lost_to_a_whole_build_and_there_are_not_more_than_blocks() {
    let folder = parts();
    let at = folder.path();
    subset(at, "1/2", &["parts", "out"]);
    let build = |arguments: &[&str]| hlod_build().current_dir(at).args(arguments).assert();
    build(&["parts", "out"]).code(4).stderr(contains("out/subsets").and(contains("merge")));
    build(&["--subset", "1/13", "parts", "out"]).code(2).stderr(contains("found 1"));
    build(&["--subset", "3/2", "parts", "out"]).code(2).stderr(contains("K from 1 to N"));
    fs::write(at.join("out/subsets/notes.txt"), "mine").unwrap();
    subset(at, "2/2", &["parts", "out"]);
    build(&["merge", "out"]).code(4).stderr(contains("not of an earlier build"));
    assert!(at.join("out/subsets/1-of-2").exists());
}
