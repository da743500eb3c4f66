//! The model clock refuses files that a run which draws could not use.

use std::fs;

use hlod::format::{NODES_DIR, TEXTURES_DIR};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::Value;

use crate::bench_support::{Place, city, street};
use crate::damage::{DAMAGES, node_file};

const INPUT: i32 = 3;

fn model(place: &Place, options: &[&str]) -> assert_cmd::assert::Assert {
    let run = ["out", "orbit.csv", "-q", "--clock", "model", "--target-ms", "2000"];
    place.bench(&[&run[..], &["--warm-up-frames", "100", "--out", "r"], options].concat())
}

fn broken(place: &Place) -> Vec<String> {
    let summary = place.summary("r");
    let files = summary["broken_files"].as_array().unwrap();
    files.iter().map(|file| file.as_str().unwrap().to_owned()).collect()
}

#[test]
fn damaged_nodes_are_told_of_with_and_without_culling() {
    for damage in DAMAGES {
        for culling in ["on", "off"] {
            let place = Place::new(city());
            let last = place.scene().nodes.len() as u32 - 1;
            // One that is always needed, and one that may never be: its size and header are looked at.
            for node in [0, last] {
                (damage.apply)(&node_file(&place, node));
            }
            let told = contains("without 2 files").and(contains("build again"));
            model(&place, &["--visibility", culling]).code(INPUT).stderr(told);
            let names = [0, last].map(|node| place.scene().nodes[node as usize].file.clone());
            let found = broken(&place);
            assert_eq!(found.len(), 2, "{}: {found:?}", damage.name);
            for name in names {
                let is_named = found.iter().any(|file| file.contains(&name));
                assert!(is_named, "{}: {name} is not in {found:?}", damage.name);
            }
        }
    }
}

#[test]
fn nodes_of_the_same_size_that_changed_places_are_told_of() {
    let place = Place::new(city());
    let scene = place.scene();
    // Filled up to one size, as compressed files may have by chance.
    let [first, second] = [0, 1].map(|node| node_file(&place, node));
    let bytes = fs::read(&second).unwrap();
    let size = scene.nodes[0].file_bytes as usize;
    let mut swapped = bytes.clone();
    swapped.resize(size, 0);
    swapped[8..12].copy_from_slice(&(size as u32).to_le_bytes());
    fs::write(&first, swapped).unwrap();
    for culling in ["on", "off"] {
        model(&place, &["--visibility", culling]).code(INPUT).stderr(contains("CRC-32"));
    }
    assert_eq!(broken(&place).len(), 1);
}

#[test]
fn nodes_of_another_scene_are_told_of() {
    let place = Place::new(city());
    fs::remove_dir_all(place.out().join(NODES_DIR)).unwrap();
    model(&place, &[]).code(INPUT);
    assert_eq!(broken(&place).len(), place.scene().nodes.len());
    // A run as it would be without them is of no use, and says so.
    let summary: Value = place.summary("r");
    assert_eq!(summary["triangles_mean"], 0.0);
}

#[test]
fn damaged_shared_textures_are_told_of() {
    for damage in DAMAGES {
        let place = Place::new(street());
        let name = place.scene().shared_textures[0].file_name.clone();
        (damage.apply)(&place.out().join(TEXTURES_DIR).join(&name));
        model(&place, &[]).code(INPUT);
        let found = broken(&place);
        assert!(found.len() == 1 && found[0].contains(&name), "{}: {found:?}", damage.name);
    }
}

#[test]
#[cfg(unix)]
fn a_named_pipe_in_the_place_of_a_file_is_refused_and_not_waited_for() {
    for file in ["a node", "the index"] {
        let place = Place::new(city());
        let file = match file {
            "a node" => node_file(&place, 0),
            _ => place.out().join(hlod::format::SCENE_FILE),
        };
        fs::remove_file(&file).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&file).status();
        if !made.is_ok_and(|status| status.success()) {
            println!("skipped: no mkfifo");
            return;
        }
        let run = ["out", "orbit.csv", "-q", "--clock", "model", "--out", "r"];
        place.bench(&run).code(INPUT).stderr(contains("regular file"));
    }
}
