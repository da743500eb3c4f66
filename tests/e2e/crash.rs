//! A build that is killed leaves the old result or the new one, whole.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use hlod::format::{NODES_DIR, REPORT_FILE, SCENE_FILE, file_crc};

use crate::support::Random;
use crate::support::inputs::{small_city, write_city};
use crate::support::result::{Built, contents, difference, lasting};

const KILLS: usize = 40;

/// A result that reads well: the scene by its own checksum, each node by the scene's.
fn check_whole(out: &Path) {
    let built = Built::read(out);
    for (node, bytes) in built.scene.nodes.iter().zip(&built.files) {
        assert_eq!((node.file_bytes, node.file_crc), (bytes.len() as u64, file_crc(bytes)));
    }
    assert_eq!(fs::read_dir(out.join(NODES_DIR)).unwrap().count(), built.files.len());
}

/// Names in a folder other than those of inputs and output.
fn leftovers(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with('.'))
        .collect();
    names.sort();
    names
}

/// True where an unfinished output has all its files.
fn is_report_written(folder: &Path) -> bool {
    leftovers(folder).iter().any(|name| folder.join(name).join(REPORT_FILE).exists())
}

/// Which file the scene is: another one once a new result is in place.
fn identity(out: &Path) -> Option<u64> {
    fs::metadata(out.join(SCENE_FILE)).ok().map(|file| file.ino())
}

#[test]
fn a_killed_build_leaves_a_whole_result() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &hlod::city::CityOptions { triangles: 12_000, ..small_city() });
    let out = folder.path().join("out");
    let sizes = ["200", "350"];
    let start = |size: &str| {
        Command::new(assert_cmd::cargo::cargo_bin("hlod-build"))
            .current_dir(&folder)
            .args(["--desired-tris", size, "city.obj", "out"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let mut results: Vec<BTreeMap<String, Vec<u8>>> = Vec::new();
    let mut longest = Duration::ZERO;
    for size in sizes {
        let begin = Instant::now();
        assert!(start(size).wait().unwrap().success());
        longest = longest.max(begin.elapsed());
        results.push(lasting(&out));
    }
    assert!(difference(&results[0], &results[1]).is_some());
    let inputs_before = contents(folder.path());

    let mut random = Random::new(20, 0);
    let mut now = 1;
    let (mut old, mut new, mut unfinished) = (0, 0, 0);
    for kill in 0..KILLS {
        let mut child = start(sizes[1 - now]);
        let begin = Instant::now();
        if kill % 2 == 0 {
            // Evenly from 1 ms to the end, each a little off.
            let share = (kill as f64 + random.unit()) / KILLS as f64;
            std::thread::sleep(Duration::from_millis(1) + longest.mul_f64(share));
        } else {
            // Where the new result is complete and takes the old one's place; each second time
            // when it has, however long this machine takes over it.
            let before = identity(&out);
            let is_running = |child: &mut Child| child.try_wait().unwrap().is_none();
            while is_running(&mut child) && !is_report_written(folder.path()) {}
            while kill % 4 == 3 && is_running(&mut child) && identity(&out) == before {}
            std::thread::sleep(Duration::from_micros(random.below(3_000) as u64));
        }
        let wait = begin.elapsed();
        child.kill().unwrap();
        child.wait().unwrap();
        check_whole(&out);
        let found = lasting(&out);
        match results.iter().position(|result| difference(result, &found).is_none()) {
            None => panic!("killed after {wait:?}: neither the old result nor the new one"),
            Some(index) if index == now => old += 1,
            Some(index) => {
                now = index;
                new += 1;
            }
        }
        unfinished += usize::from(!leftovers(folder.path()).is_empty());
    }
    println!(
        "{old} kills left the old result, {new} the new; {unfinished} left something unfinished"
    );
    assert!(old > 0 && unfinished > 0, "no kill met a running build");
    assert!(new > 0, "no kill came after the new result");

    let mut last = start(sizes[1 - now]);
    assert!(last.wait().unwrap().success());
    assert_eq!(leftovers(folder.path()), [""; 0], "the next build cleans up");
    assert_eq!(difference(&results[1 - now], &lasting(&out)), None);
    let inputs = |files: BTreeMap<String, Vec<u8>>| -> BTreeMap<String, Vec<u8>> {
        files.into_iter().filter(|(name, _)| name.starts_with("city")).collect()
    };
    assert_eq!(difference(&inputs(inputs_before), &inputs(contents(folder.path()))), None);
}
