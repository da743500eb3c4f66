//! Building again: nothing where nothing changed, and only what changed where something did.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use hlod::builder::BuildOptions;
use hlod::builder::partition::BlockSplit;
use hlod::builder::progress::Progress;
use hlod::city::{self, CityOptions};
use hlod::format::{Scene, TEXTURES_DIR};
use hlod::mesh::UpAxis;
use tempfile::TempDir;

use crate::support::inputs::{SQUARE, small_city, write, write_city, write_street};
use crate::support::result::{contents, difference, lasting, report};
use crate::support::{hlod_build, run_build};

/// Three models far from each other, `parts/block_0000.obj` and so on, each with its material file and
/// picture.
fn three_parts() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for number in 0..3 {
        let offset = [1000.0 * f64::from(number), 0.0, 0.0];
        let options = CityOptions { blocks: 1, triangles: 2_500, offset, ..small_city() };
        let path = folder.path().join(format!("parts/block_000{number}.obj"));
        city::write(&options, &path).unwrap();
    }
    folder
}

/// So that each model is several blocks.
const SMALL_NODES: [&str; 2] = ["--desired-tris", "15"];

/// Builds the parts, or what `arguments` say, into `out`.
fn build(folder: &Path, arguments: &[&str]) -> String {
    run_build(folder, &[&SMALL_NODES[..], arguments].concat())
}

fn is_up_to_date(text: &str) -> bool {
    text.contains("up to date")
}

/// What a file is, beyond its bytes: which one, and when written.
fn identities(out: &Path) -> BTreeMap<PathBuf, (u64, i64, i64)> {
    contents(out)
        .into_keys()
        .map(|name| {
            let facts = fs::metadata(out.join(&name)).unwrap();
            (name.into(), (facts.ino(), facts.mtime(), facts.mtime_nsec()))
        })
        .collect()
}

/// Node files of one part by inode.
fn nodes_of(out: &Path, part: &str) -> BTreeMap<PathBuf, u64> {
    let nodes: BTreeMap<PathBuf, u64> = identities(out)
        .into_iter()
        .filter(|(name, _)| name.to_str().unwrap().contains(part))
        .map(|(name, (inode, _, _))| (name, inode))
        .collect();
    assert!(nodes.len() > 3, "{part} has {} nodes", nodes.len());
    nodes
}

/// What a build of the same arguments makes where nothing was before. Only `build.json` may tell
/// the two apart.
fn clean_build(folder: &Path, arguments: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let arguments: Vec<&str> = arguments
        .iter()
        .map(|&argument| if argument == "out" { "clean" } else { argument })
        .collect();
    build(folder, &arguments);
    let mut result = lasting(&folder.join("clean"));
    fs::remove_dir_all(folder.join("clean")).unwrap();
    result.remove("build.json");
    result
}

fn without_report(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut result = lasting(out);
    result.remove("build.json");
    result
}

#[test]
fn the_same_again_touches_nothing() {
    let folder = three_parts();
    let out = folder.path().join("out");
    assert!(!is_up_to_date(&build(folder.path(), &["parts", "out"])));
    let (before, bytes) = (identities(&out), contents(&out));
    let folder_before = fs::metadata(&out).unwrap();
    for arguments in [
        &["parts", "out"][..],
        &["parts/block_0002.obj", "parts/block_0000.obj", "parts/block_0001.obj", "out"],
        &["parts", "parts/block_0001.obj", "out/"],
        &["--threads", "1", "parts", "out"],
    ] {
        let text = build(folder.path(), arguments);
        assert!(is_up_to_date(&text), "{arguments:?}: {text}");
        assert_eq!(identities(&out), before, "{arguments:?}");
    }
    assert_eq!(difference(&bytes, &contents(&out)), None);
    let folder_after = fs::metadata(&out).unwrap();
    assert_eq!(folder_before.ino(), folder_after.ino());
    assert_eq!(folder_before.mtime_nsec(), folder_after.mtime_nsec());
}

#[test]
fn a_touched_but_unchanged_input_is_unchanged() {
    let folder = three_parts();
    build(folder.path(), &["parts", "out"]);
    let input = folder.path().join("parts/block_0001.obj");
    fs::write(&input, fs::read(&input).unwrap()).unwrap();
    assert!(is_up_to_date(&build(folder.path(), &["parts", "out"])));
}

/// One block has a side of a small box alone, and the box is kept whole in the next block.
#[test]
fn inputs_of_an_empty_block_are_not_read_again() {
    struct Read(Mutex<Vec<String>>);
    impl Progress for Read {
        fn reading(&self, input: &Path, _: usize, _: usize) {
            let name = input.file_name().unwrap().to_string_lossy().into_owned();
            self.0.lock().unwrap().push(name);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let ground = |x: f64, size: f64| {
        let square = |number: u32| {
            let low = [x + f64::from(number % 40) * size, f64::from(number / 40) * size];
            let corners = [[0.0, 0.0], [size, 0.0], [size, size], [0.0, size]];
            let corners = corners.map(|[i, j]| format!("v {} {} 0\n", low[0] + i, low[1] + j));
            format!("{}f -4 -3 -2 -1\n", corners.concat())
        };
        (0..1600).map(square).collect::<String>()
    };
    let corners = (0..8).map(|number| {
        let at = |bit: usize, low: f64| if number >> bit & 1 == 0 { low } else { low + 0.8 };
        format!("v {} {} {}\n", at(0, 9.7), at(1, 4.0), at(2, 2.0))
    });
    let sides = "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
    let near = format!("{}{sides}{}", corners.collect::<String>(), ground(11.0, 0.2));
    write(folder.path(), "near.obj", near);
    write(folder.path(), "far.obj", ground(91.0, 0.21));
    let options = BuildOptions { blocks: BlockSplit::Grid(10.0), ..BuildOptions::default() };
    let inputs = [folder.path().join("near.obj"), folder.path().join("far.obj")];
    let out = folder.path().join("out");
    let build = || {
        let read = Read(Mutex::default());
        hlod::builder::build(&inputs, &out, &options, &read).unwrap();
        read.0.into_inner().unwrap()
    };
    assert_eq!(build(), ["far.obj", "near.obj"]);
    assert_eq!(report(&out)["empty_blocks"].as_array().map(Vec::len), Some(1));
    write(folder.path(), "far.obj", ground(91.0, 0.22));
    assert_eq!(build(), ["far.obj"]);
    assert_eq!(report(&out)["empty_blocks"].as_array().map(Vec::len), Some(1));
}

#[test]
fn force_builds_all_the_same() {
    let folder = three_parts();
    let out = folder.path().join("out");
    build(folder.path(), &["parts", "out"]);
    let (before, result) = (identities(&out), lasting(&out));
    assert!(!is_up_to_date(&build(folder.path(), &["--force", "parts", "out"])));
    let after = identities(&out);
    assert!(after.iter().all(|(name, (inode, _, _))| before[name].0 != *inode), "a file was kept");
    assert_eq!(difference(&result, &lasting(&out)), None);
}

#[test]
fn every_parameter_counts() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    let out = folder.path().join("out");
    run_build(folder.path(), &["city.obj", "out"]);
    for option in [
        ["--desired-tris", "600"],
        ["--level-factor", "2"],
        ["--blocks", "grid:40"],
        ["--simplifier", "clustering"],
        ["--borders", "locked"],
        ["--jpeg-quality", "70"],
        ["--max-atlas", "64"],
        ["--up", "y"],
    ] {
        let arguments = [&option[..], &["city.obj", "out"]].concat();
        let text = run_build(folder.path(), &arguments);
        assert!(!is_up_to_date(&text), "{option:?}");
        assert!(is_up_to_date(&run_build(folder.path(), &arguments)), "{option:?}");
        let again = [&option[..], &["city.obj", "clean"]].concat();
        run_build(folder.path(), &again);
        assert_eq!(
            difference(&lasting(&out), &lasting(&folder.path().join("clean"))),
            None,
            "{option:?}"
        );
    }
}

/// Changes each kind of file that the second of three models is made of.
#[test]
fn only_a_changed_input_is_built_again() {
    for (file, change) in [
        ("block_0001.obj", "model"),
        ("block_0001.mtl", "material"),
        ("block_0001_textures", "picture"),
    ] {
        let folder = three_parts();
        let out = folder.path().join("out");
        build(folder.path(), &["parts", "out"]);
        let others = [nodes_of(&out, "block_0000"), nodes_of(&out, "block_0002")];
        let changed = nodes_of(&out, "block_0001");
        let before = without_report(&out);
        let path = folder.path().join("parts").join(file);
        match change {
            "picture" => {
                let path = fs::read_dir(&path).unwrap().next().unwrap().unwrap().path();
                let image = image::open(&path).unwrap();
                image.rotate180().to_rgb8().save(&path).unwrap();
            }
            "model" => {
                let text = fs::read_to_string(&path).unwrap();
                let shorter: Vec<&str> = text.lines().collect();
                let last = shorter.iter().rposition(|line| line.starts_with("f ")).unwrap();
                let kept = [&shorter[..last], &shorter[last + 1..]].concat().join("\n");
                fs::write(&path, kept).unwrap();
            }
            _ => {
                let text = fs::read_to_string(&path).unwrap();
                fs::write(&path, text.replace("Kd ", "Kd 0.9 0.1 0.1\n# was ")).unwrap();
            }
        }
        assert!(!is_up_to_date(&build(folder.path(), &["parts", "out"])), "{change}");
        assert_eq!(nodes_of(&out, "block_0000"), others[0], "{change}: the same files");
        assert_eq!(nodes_of(&out, "block_0002"), others[1], "{change}: the same files");
        let rebuilt = nodes_of(&out, "block_0001");
        assert!(rebuilt.values().all(|inode| !changed.values().any(|old| old == inode)));
        let after = without_report(&out);
        assert!(difference(&before, &after).is_some(), "{change} has no effect");
        let clean = clean_build(folder.path(), &["parts", "out"]);
        assert_eq!(difference(&clean, &after), None, "{change}");
        assert!(is_up_to_date(&build(folder.path(), &["parts", "out"])), "{change}");
    }
}

#[test]
fn inputs_come_and_go() {
    let folder = three_parts();
    let out = folder.path().join("out");
    let elsewhere =
        CityOptions { blocks: 4, triangles: 10_000, split: true, offset: [5e3; 3], ..small_city() };
    city::write(&elsewhere, &folder.path().join("far")).unwrap();
    let (a, b, c) = ("parts/block_0000.obj", "parts/block_0001.obj", "parts/block_0002.obj");
    let (far, farther) = ("far/block_0002.obj", "far/block_0003.obj");
    build(folder.path(), &[a, b, far, "out"]);
    for arguments in [
        &[a, b, farther, "out"][..],
        &[a, b, far, farther, "out"],
        &[a, b, "out"],
        &[b, far, "out"],
        &[b, "out"],
        &[a, b, c, "out"],
        &["parts", "far", "out"],
    ] {
        assert!(!is_up_to_date(&build(folder.path(), arguments)), "{arguments:?}");
        let clean = clean_build(folder.path(), arguments);
        assert_eq!(difference(&clean, &without_report(&out)), None, "{arguments:?}");
    }
}

/// A report of a build that took inputs over says what that of a clean build says.
#[test]
fn the_report_covers_what_was_taken_over() {
    let folder = three_parts();
    let out = folder.path().join("out");
    let path = folder.path().join("parts/block_0002.obj");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, format!("{text}v 1 2 3\n")).unwrap();
    build(folder.path(), &["parts", "out"]);
    let first = folder.path().join("parts/block_0000.obj");
    fs::write(&first, fs::read_to_string(&first).unwrap() + "# a remark\n").unwrap();
    build(folder.path(), &["parts", "out"]);
    let partly = report(&out);
    build(folder.path(), &["--force", "parts", "out"]);
    let whole = report(&out);
    for part in [
        "version",
        "parameters",
        "inputs",
        "blocks",
        "source_triangles",
        "source_texels",
        "levels",
        "outcomes",
        "over_budget",
        "baked",
        "warnings",
    ] {
        assert_eq!(partly[part], whole[part], "{part}");
    }
}

/// Two models share a repeating picture; one of them changes.
#[test]
fn shared_pictures_stay_while_anyone_uses_them() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    write_street(folder.path(), 24);
    let text = fs::read_to_string(folder.path().join("street.obj")).unwrap();
    write(folder.path(), "avenue.obj", &text);
    build(folder.path(), &["street.obj", "avenue.obj", "out"]);
    let textures = |out: &Path| {
        contents(out).into_keys().filter(|name| name.starts_with(TEXTURES_DIR)).count()
    };
    assert!(textures(&out) > 0, "the street's pictures repeat");
    write(folder.path(), "avenue.obj", format!("{text}\n# changed"));
    for arguments in [
        &["street.obj", "avenue.obj", "out"][..],
        &["avenue.obj", "out"],
        &["street.obj", "avenue.obj", "out"],
    ] {
        build(folder.path(), arguments);
        let clean = clean_build(folder.path(), arguments);
        assert_eq!(difference(&clean, &without_report(&out)), None, "{arguments:?}");
    }
    // When the picture itself changes, everything that shows it does.
    image::RgbImage::from_pixel(64, 32, image::Rgb([9, 200, 9]))
        .save(folder.path().join("brick.png"))
        .unwrap();
    build(folder.path(), &["street.obj", "avenue.obj", "out"]);
    let clean = clean_build(folder.path(), &["street.obj", "avenue.obj", "out"]);
    assert_eq!(difference(&clean, &without_report(&out)), None);
    // Without its user, a picture goes.
    write(folder.path(), "bare.obj", SQUARE);
    build(folder.path(), &["bare.obj", "out"]);
    assert_eq!(textures(&out), 0);
}

#[test]
fn a_picture_that_was_missing_is_used_once_it_is_there() {
    let folder = tempfile::tempdir().unwrap();
    write_street(folder.path(), 10);
    let picture = folder.path().join("brick.png");
    let bytes = fs::read(&picture).unwrap();
    fs::remove_file(&picture).unwrap();
    let text = build(folder.path(), &["street.obj", "out"]);
    assert!(text.contains("brick.png"), "a warning: {text}");
    fs::write(&picture, bytes).unwrap();
    assert!(!is_up_to_date(&build(folder.path(), &["street.obj", "out"])));
    let clean = clean_build(folder.path(), &["street.obj", "out"]);
    assert_eq!(difference(&clean, &without_report(&folder.path().join("out"))), None);
    // And the other way round.
    fs::remove_file(&picture).unwrap();
    assert!(!is_up_to_date(&build(folder.path(), &["street.obj", "out"])));
    let clean = clean_build(folder.path(), &["street.obj", "out"]);
    assert_eq!(difference(&clean, &without_report(&folder.path().join("out"))), None);
}

#[test]
fn a_damaged_result_is_built_again() {
    let folder = tempfile::tempdir().unwrap();
    write_street(folder.path(), 24);
    let out = folder.path().join("out");
    build(folder.path(), &["street.obj", "out"]);
    let whole = lasting(&out);
    let some = |start: &str| out.join(whole.keys().find(|name| name.starts_with(start)).unwrap());
    let damage: [(&str, &dyn Fn()); 12] = [
        ("a node is missing", &|| fs::remove_file(some("nodes/")).unwrap()),
        ("a node is shorter", &|| {
            let path = some("nodes/");
            let bytes = fs::read(&path).unwrap();
            fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        }),
        ("a picture is missing", &|| fs::remove_file(some(TEXTURES_DIR)).unwrap()),
        ("a picture is empty", &|| fs::write(some(TEXTURES_DIR), "").unwrap()),
        ("the scene is cut", &|| {
            let bytes = fs::read(out.join("scene.hlod")).unwrap();
            fs::write(out.join("scene.hlod"), &bytes[..bytes.len() / 2]).unwrap();
        }),
        ("a bit of the scene is wrong", &|| {
            let mut bytes = fs::read(out.join("scene.hlod")).unwrap();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            fs::write(out.join("scene.hlod"), bytes).unwrap();
        }),
        ("the tileset is missing", &|| fs::remove_file(out.join("tileset.json")).unwrap()),
        ("the tileset was edited", &|| fs::write(out.join("tileset.json"), "{}").unwrap()),
        ("the scans are missing", &|| fs::remove_file(out.join("scans.hlod")).unwrap()),
        ("borders are missing", &|| fs::remove_file(some("borders/")).unwrap()),
        ("the report is missing", &|| fs::remove_file(out.join("build.json")).unwrap()),
        ("the report is no JSON", &|| fs::write(out.join("build.json"), "{").unwrap()),
    ];
    for (what, damage) in damage {
        damage();
        let text = build(folder.path(), &["street.obj", "out"]);
        assert!(!is_up_to_date(&text), "{what}");
        let mut differ = difference(&whole, &lasting(&out)).unwrap_or_default();
        if what.contains("tileset") {
            // Its nodes are taken over, which the report says.
            differ.retain(|file| file != "build.json");
        }
        assert_eq!(differ, [""; 0], "{what}");
    }
}

/// An input that was there and is gone is an error, and the result stays.
#[test]
fn a_lost_input_leaves_the_result() {
    let folder = three_parts();
    build(folder.path(), &["parts/block_0000.obj", "parts/block_0001.obj", "out"]);
    let before = contents(&folder.path().join("out"));
    fs::remove_file(folder.path().join("parts/block_0001.obj")).unwrap();
    hlod_build()
        .current_dir(&folder)
        .args(SMALL_NODES)
        .args(["parts/block_0000.obj", "parts/block_0001.obj", "out"])
        .assert()
        .code(3);
    assert_eq!(difference(&before, &contents(&folder.path().join("out"))), None);
}

/// An OBJ with z up and a GLB with y up, of which one goes.
#[test]
fn the_up_axis_is_that_of_the_inputs_that_are_left() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    write_street(folder.path(), 10);
    city::write(&small_city(), &folder.path().join("zoo.glb")).unwrap();
    build(folder.path(), &["street.obj", "zoo.glb", "out"]);
    assert_eq!(Scene::read(&out).unwrap().up, UpAxis::Z, "the first input's");
    build(folder.path(), &["zoo.glb", "out"]);
    assert_eq!(Scene::read(&out).unwrap().up, UpAxis::Y);
    let clean = clean_build(folder.path(), &["zoo.glb", "out"]);
    assert_eq!(difference(&clean, &without_report(&out)), None);
}
