//! Output folders: whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use super::output_dir::{OutputDir, check_apart};
use super::{SCENE_FILE, SCENE_MAGIC, TEXTURES_DIR};

fn message<T: std::fmt::Debug>(result: crate::Result<T>) -> String {
    let error = result.unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
    error.to_string()
}

/// Builds a result of which `nodes/a.glb` says `text`.
fn build(path: &Path, text: &str) {
    let output = OutputDir::create(path).unwrap();
    output.write("nodes/a.glb", text.as_bytes()).unwrap();
    output.write(SCENE_FILE, &SCENE_MAGIC).unwrap();
    output.commit().unwrap();
}

fn content(path: &Path) -> String {
    fs::read_to_string(path.join("nodes/a.glb")).unwrap()
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_result_appears_whole_and_replaces_the_earlier_one() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let output = OutputDir::create(&out).unwrap();
    output.write("nodes/a.glb", b"one").unwrap();
    output.write(SCENE_FILE, &SCENE_MAGIC).unwrap();
    assert!(!out.exists(), "nothing before the end");
    output.commit().unwrap();
    assert_eq!(content(&out), "one");
    build(&out, "two");
    assert_eq!(content(&out), "two");
    assert_eq!(names(dir.path()), ["out"], "nothing left beside it");
}

#[test]
fn whoever_stops_half_way_leaves_the_old_result() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    build(&out, "old");
    let output = OutputDir::create(&out).unwrap();
    output.write("nodes/a.glb", b"half").unwrap();
    drop(output);
    assert_eq!(content(&out), "old");
    assert_eq!(names(dir.path()), ["out"]);
}

#[test]
fn leavings_of_a_killed_build_are_swept_away_and_those_of_a_live_one_are_not() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let dead = dir.path().join(".out.hlod-partial-1-0");
    fs::create_dir_all(dead.join("nodes")).unwrap();
    let other = dir.path().join(".other.hlod-partial-1-0");
    fs::create_dir(&other).unwrap();
    let live = OutputDir::create(&out).unwrap();
    assert!(!dead.exists());
    let second = OutputDir::create(&out).unwrap();
    assert!(live.path().exists() && second.path().exists() && other.exists());
    assert_ne!(live.path(), second.path());
}

#[test]
fn a_stop_between_the_renames_is_healed() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    build(&out, "old");
    fs::rename(&out, dir.path().join(".out.hlod-old")).unwrap();
    drop(OutputDir::create(&out).unwrap());
    assert_eq!(content(&out), "old");
}

#[test]
fn an_empty_folder_is_taken_and_missing_ones_are_made() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path(), "here");
    assert_eq!(content(dir.path()), "here");
    let deep = dir
        .path()
        .parent()
        .unwrap()
        .join(format!("{}-deep/a/b", dir.path().file_name().unwrap().to_str().unwrap()));
    let top = deep.parent().unwrap().parent().unwrap().to_owned();
    drop(OutputDir::create(&deep).unwrap());
    assert!(!top.exists(), "folders made for nothing are removed");
    build(&deep, "deep");
    assert_eq!(content(&deep), "deep");
    fs::remove_dir_all(top).unwrap();
}

#[test]
fn what_is_not_ours_is_refused_and_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    fs::write(&file, "precious").unwrap();
    assert!(message(OutputDir::create(&file)).contains("found a file"));
    assert!(message(OutputDir::create(&file.join("below"))).contains("cannot be"));
    assert!(message(OutputDir::create(dir.path())).contains("holds file"));

    let out = dir.path().join("out");
    build(&out, "old");
    fs::write(out.join("notes.txt"), "precious").unwrap();
    assert!(message(OutputDir::create(&out)).contains("holds notes.txt"));
    fs::remove_file(out.join("notes.txt")).unwrap();
    fs::write(out.join("nodes/tower.blend"), "precious").unwrap();
    assert!(message(OutputDir::create(&out)).contains("holds nodes/tower.blend"));
    fs::remove_file(out.join("nodes/tower.blend")).unwrap();
    for folder in [TEXTURES_DIR, "textures"] {
        // The second one is where earlier versions had them.
        fs::create_dir(out.join(folder)).unwrap();
        fs::write(out.join(folder).join("brick.jpg"), "ours").unwrap();
        drop(OutputDir::create(&out).unwrap());
        fs::write(out.join(folder).join("brick.psd"), "precious").unwrap();
        let holds = format!("holds {folder}/brick.psd");
        assert!(message(OutputDir::create(&out)).contains(&holds));
        fs::remove_dir_all(out.join(folder)).unwrap();
    }
    fs::write(out.join(SCENE_FILE), "something else").unwrap();
    assert!(message(OutputDir::create(&out)).contains("not of an earlier build"));
    fs::remove_file(out.join(SCENE_FILE)).unwrap();
    assert!(message(OutputDir::create(&out)).contains("not of an earlier build"));
    assert_eq!(content(&out), "old");
    assert_eq!(fs::read_to_string(&file).unwrap(), "precious");
    assert_eq!(names(dir.path()), ["file", "out"]);
}

#[test]
fn a_file_put_there_during_the_build_is_not_lost() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    build(&out, "old");
    let output = OutputDir::create(&out).unwrap();
    fs::write(out.join("notes.txt"), "precious").unwrap();
    assert!(message(output.commit()).contains("holds notes.txt"));
    assert_eq!(names(dir.path()), ["out"]);
    assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "precious");
}

#[test]
#[cfg(unix)]
fn links_are_followed_and_dangling_ones_refused() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().unwrap();
    let (real, link) = (dir.path().join("real"), dir.path().join("link"));
    build(&real, "old");
    symlink(&real, &link).unwrap();
    build(&link, "new");
    assert_eq!(content(&real), "new");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    let dangling = dir.path().join("dangling");
    symlink(dir.path().join("nowhere"), &dangling).unwrap();
    assert!(message(OutputDir::create(&dangling)).contains("link to something"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_and_a_closed_folder_say_what_to_do() {
    assert!(message(OutputDir::create(Path::new("/proc/out"))).contains("/proc"));
    assert!(message(OutputDir::create(Path::new("/dev"))).contains("/dev: "));
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let error = std::io::Write::write_all(&mut &full, b"x").unwrap_err();
    let text = super::output_dir::cannot(Path::new("out"), "be written", &error).to_string();
    assert!(text.contains("the disk is full; make room"), "{text}");
}

#[test]
fn files_are_written_once_and_inside() {
    let dir = tempfile::tempdir().unwrap();
    let output = OutputDir::create(&dir.path().join("out")).unwrap();
    output.write("build.json", b"{}").unwrap();
    assert!(output.write("build.json", b"{}").is_err());
    for name in ["", "../x", "/x", "nodes/../../x", "."] {
        assert!(output.write(name, b"").is_err(), "{name}");
    }
}

#[test]
fn many_threads_may_write() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let output = OutputDir::create(&out).unwrap();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let output = &output;
            scope.spawn(move || {
                for file in 0..50 {
                    output.write(format!("nodes/{thread}-{file}.glb"), b"x").unwrap();
                }
            });
        }
    });
    output.commit().unwrap();
    assert_eq!(names(&out.join("nodes")).len(), 200);
}

#[test]
fn unchanged_files_are_taken_over_without_copying() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    build(&out, "kept");
    let output = OutputDir::create(&out).unwrap();
    let earlier: PathBuf = output.target().to_owned();
    output.reuse(&earlier, "nodes/a.glb").unwrap();
    assert!(message(output.reuse(&earlier, "nodes/none.glb")).contains("none.glb"));
    assert!(output.write("nodes/a.glb", b"changed").is_err(), "would change the earlier result");
    output.write(SCENE_FILE, &SCENE_MAGIC).unwrap();
    output.commit().unwrap();
    assert_eq!(content(&out), "kept");
}

#[test]
fn inputs_and_output_lie_apart() {
    let dir = tempfile::tempdir().unwrap();
    let city = dir.path().join("city");
    fs::create_dir(&city).unwrap();
    let obj = city.join("city.obj");
    fs::write(&obj, "").unwrap();
    let refused = |output: &Path, input: &Path| message(check_apart(output, [input]));
    assert!(refused(&obj, &obj).contains("is an input"));
    assert!(refused(&city.join("out"), &city).contains("lies within the input"));
    assert!(refused(&city, &obj).contains("with an input in it"));
    assert!(refused(&city.join("../city"), &city).contains("is an input"));
    check_apart(&dir.path().join("out"), [&city, &obj, &dir.path().join("missing")]).unwrap();
    check_apart(&city.join("out"), [&obj]).unwrap();
    check_apart(&dir.path().join("city2"), [&city]).unwrap();
}
