use std::path::Path;

use serde_json::{Value, json};

use super::files::files_of;
use super::*;
use crate::format::test_scene::scene;
use crate::format::{NodeId, Scene, TILESET_FILE, TILESETS_DIR};
use crate::place::{Place, Placement};

const UTM: Placement = Placement::Crs { epsg: 25832, height_offset: 0.0 };

/// Writes a scene's tileset with at most so many tiles in a file, and empty nodes beside it.
fn written(scene: &Scene, placement: &Placement, most: usize) -> tempfile::TempDir {
    let out = tempfile::tempdir().unwrap();
    for folder in ["nodes", TILESETS_DIR] {
        std::fs::create_dir(out.path().join(folder)).unwrap();
    }
    for node in &scene.nodes {
        std::fs::write(out.path().join("nodes").join(&node.file), "").unwrap();
    }
    for file in files_of(scene, placement, most).unwrap() {
        std::fs::write(out.path().join(file.path), file.bytes).unwrap();
    }
    out
}

fn faults(out: &Path, scene: &Scene, placement: &Placement) -> Vec<String> {
    let checked = check(out, scene, placement).unwrap();
    checked.faults.into_iter().map(|fault| format!("{}: {}", fault.place, fault.what)).collect()
}

/// A chain of levels of quarters, `depth` deep, on a square of `side` metres.
fn quarters(side: f64, depth: u32) -> Scene {
    let mut scene = scene();
    let mut nodes: Vec<crate::format::Node> = Vec::new();
    let mut level = vec![([0.0, 0.0], side, None)];
    for number in 0..=depth {
        let mut below = Vec::new();
        for (place, (corner, side, parent)) in level.into_iter().enumerate() {
            let [x, y]: [f64; 2] = corner;
            let index = nodes.len() as u32;
            if let Some(parent) = parent {
                let parent: &mut crate::format::Node = &mut nodes[parent as usize];
                parent.first_child.get_or_insert(index);
            }
            nodes.push(crate::format::Node {
                id: NodeId(index.into()),
                parent,
                first_child: None,
                next_sibling: (number > 0 && place % 4 < 3).then_some(index + 1),
                level: number,
                block: Some(0),
                bbox_min: [678_016.0 + x, 5_403_456.0 + y, 360.0],
                bbox_max: [678_016.0 + x + side, 5_403_456.0 + y + side, 390.0],
                geometric_error: f64::from(depth - number) * 1.5,
                file: format!("q{index}.glb"),
                ..scene.nodes[0].clone()
            });
            if number < depth {
                let half = side / 2.0;
                for [i, j] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                    below.push(([x + i * half, y + j * half], half, Some(index)));
                }
            }
        }
        level = below;
    }
    scene.nodes = nodes;
    scene
}

#[test]
fn every_tileset_keeps_the_rules_in_one_file_and_in_many() {
    let origin = Placement::Origin(Place { lon: 11.4, lat: 48.7, height: 370.0 });
    for scene in [scene(), quarters(700.0, 4)] {
        for placement in [Placement::Local, origin, UTM] {
            for most in [1, 2, 5, 50, 5000] {
                let out = written(&scene, &placement, most);
                let checked = check(out.path(), &scene, &placement).unwrap();
                assert_eq!(checked.faults, [], "{placement:?}, {most} tiles in a file");
                assert!(checked.tiles >= scene.nodes.len());
                let files = files_of(&scene, &placement, most).unwrap();
                assert_eq!(files.len(), checked.files);
                for file in files {
                    let tiles = String::from_utf8(file.bytes).unwrap().matches("\"box\"").count();
                    assert!(tiles <= most.max(5), "{} has {tiles} tiles", file.path);
                }
            }
        }
    }
}

#[test]
fn a_wide_city_is_in_its_place_to_a_centimetre() {
    let scene = quarters(6000.0, 4);
    let out = written(&scene, &UTM, MOST_TILES);
    let checked = check(out.path(), &scene, &UTM).unwrap();
    assert_eq!(checked.faults, []);
    let off = checked.placed_within.unwrap();
    assert!(off < 0.01 && off > 0.0, "{off}");
}

#[test]
fn y_up_is_turned_to_z_up() {
    let mut scene = scene();
    scene.up = crate::mesh::UpAxis::Y;
    let out = written(&scene, &Placement::Local, 100);
    assert_eq!(faults(out.path(), &scene, &Placement::Local), [""; 0]);
    let text = std::fs::read(out.path().join(TILESET_FILE)).unwrap();
    let json: Value = serde_json::from_slice(&text).unwrap();
    // Source y is 5,403,456 to 5,403,556 and z −1 to 30.
    let volume = json["root"]["boundingVolume"]["box"].as_array().unwrap();
    assert_eq!((&volume[1], &volume[2]), (&json!(-14.5), &json!(5_403_506.5)));
}

#[test]
fn a_file_says_what_made_it() {
    let files = files(&scene(), &Placement::Local).unwrap();
    let json: Value = serde_json::from_slice(&files[0].bytes).unwrap();
    let extras = &json["asset"]["extras"];
    assert!(extras["generator"].as_str().unwrap().starts_with("hlod "));
    assert_eq!(extras["parameters"], scene().parameters);
    assert_eq!(files[0].path, TILESET_FILE);
}

/// What the check says of `tileset.json` after a change.
fn after(change: impl FnOnce(&mut Value)) -> String {
    let scene = scene();
    let out = written(&scene, &Placement::Local, 100);
    let path = out.path().join(TILESET_FILE);
    let mut json = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    change(&mut json);
    std::fs::write(&path, json.to_string()).unwrap();
    faults(out.path(), &scene, &Placement::Local).join("\n")
}

#[test]
fn what_breaks_a_rule_is_named() {
    let cases: [(&str, fn(&mut Value)); 14] = [
        ("asset.version", |json| json["asset"]["version"] = json!("1.0")),
        ("not below the root's", |json| json["geometricError"] = json!(0.5)),
        ("root: expected a tile", |json| json["root"] = json!([])),
        ("refine", |json| json["root"]["refine"] = json!("replace")),
        ("above its parent's", |json| {
            json["root"]["children"][0]["children"][0]["geometricError"] = json!(7.0);
        }),
        ("0 or more", |json| json["root"]["children"][1]["geometricError"] = json!(-1.0)),
        ("out of its parent's", |json| {
            json["root"]["children"][0]["children"][0]["boundingVolume"]["box"][0] = json!(1.0);
        }),
        ("reaches", |json| json["root"]["children"][1]["boundingVolume"]["box"][5] = json!(1.0)),
        ("12 finite numbers", |json| {
            json["root"]["boundingVolume"]["box"] = json!([1, 2, 3]);
        }),
        ("16 numbers", |json| json["root"]["transform"] = json!([1, 0, 0, 0])),
        ("children: expected tiles", |json| json["root"]["children"][1]["children"] = json!([])),
        ("within the folder", |json| {
            json["root"]["children"][1]["content"]["uri"] = json!("../../etc/passwd");
        }),
        ("expected in one tile, found in 0", |json| {
            json["root"]["children"].as_array_mut().unwrap().pop();
        }),
        ("referred to twice", |json| {
            json["root"]["children"][1]["content"]["uri"] = json!(TILESET_FILE);
        }),
    ];
    for (word, change) in cases {
        let found = after(change);
        assert!(found.contains(word), "expected {word:?} in:\n{found}");
    }
}

#[test]
fn a_missing_content_and_a_missing_region_are_named() {
    let scene = quarters(700.0, 3);
    let out = written(&scene, &Placement::Local, 10);
    std::fs::remove_file(out.path().join("nodes/q7.glb")).unwrap();
    std::fs::remove_file(out.path().join(TILESETS_DIR).join("1.json")).unwrap();
    let found = faults(out.path(), &scene, &Placement::Local).join("\n");
    assert!(found.contains("nodes/q7.glb") || found.contains("q7"), "{found}");
    assert!(found.contains("1.json: cannot be read"), "{found}");
}

#[test]
fn a_city_that_was_moved_is_told() {
    let scene = scene();
    let out = written(&scene, &UTM, 100);
    let path = out.path().join(TILESET_FILE);
    let mut json: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let east = json["root"]["transform"][12].as_f64().unwrap();
    json["root"]["transform"][12] = json!(east + 0.02);
    std::fs::write(&path, json.to_string()).unwrap();
    assert!(faults(out.path(), &scene, &UTM).join("\n").contains("from its place"));
}
