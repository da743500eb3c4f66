//! The fixture city gives the tree that is written down in `fixtures/`. After a change that is
//! meant, `HLOD_BLESS=1 cargo test --release --test e2e golden` writes it down anew.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::support::result::report;
use crate::support::run_build;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

/// What of `inspect --json` is exact by design on every machine: structure, counts and names.
fn structure(inspected: &Value) -> Value {
    let nodes: Vec<Value> = inspected["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|node| {
            json!([
                node["file"],
                node["id"],
                node["parent"],
                node["level"],
                node["block"],
                node["triangles"],
                node["textured_triangles"],
            ])
        })
        .collect();
    let blocks: Vec<&Value> =
        inspected["blocks"].as_array().unwrap().iter().map(|block| &block["name"]).collect();
    json!({
        "up": inspected["up"],
        "textured": inspected["textured"],
        "blocks": blocks,
        "node_columns": "file, id, parent, level, block, triangles, textured_triangles",
        "nodes": nodes,
    })
}

fn check(name: &str, options: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let city = fixtures().join("tiny_city");
    run_build(&city, &[options, &["city.obj", out.to_str().unwrap()]].concat());
    let inspected = run_build(folder.path(), &["inspect", "--json", "out"]);
    let inspected: Value = serde_json::from_str(&inspected).unwrap();
    let report = report(&out);
    let levels: Vec<Value> = report["levels"]
        .as_array()
        .unwrap()
        .iter()
        .map(|level| json!({ "nodes": level["nodes"], "triangles": level["triangles"] }))
        .collect();
    let found = json!({
        "options": options,
        "source_triangles": report["source_triangles"],
        "levels": levels,
        "over_budget": report["over_budget"].as_array().unwrap().len(),
        "warnings": report["warnings"],
        "scene": structure(&inspected),
    });
    // One node a line, so that differences can be read.
    let text = format!("{found:#}\n").replace("\n        ", " ").replace("\n      ]", " ]");
    let path = fixtures().join("golden").join(format!("{name}.json"));
    if std::env::var_os("HLOD_BLESS").is_some_and(|bless| bless == "1") {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        return;
    }
    let expected = fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}; HLOD_BLESS=1 writes it", path.display()));
    let differing = expected.lines().zip(text.lines()).find(|(expected, found)| expected != found);
    assert!(
        expected == text,
        "{} differs, first in (expected, found)\n{differing:#?}\nHLOD_BLESS=1 accepts it",
        path.display()
    );
}

#[test]
fn a_tree_of_the_default_way() {
    check("tiny_city", &["--desired-tris", "150"]);
}

#[test]
fn a_tree_of_the_thesis_way() {
    check(
        "tiny_city_thesis_locked",
        &["--desired-tris", "150", "--tree", "thesis", "--borders", "locked"],
    );
}

#[test]
fn trees_of_a_grid() {
    check(
        "tiny_city_grid",
        &["--desired-tris", "150", "--level-factor", "2", "--blocks", "grid:40"],
    );
}

#[test]
fn trees_by_clustering() {
    check("tiny_city_clustering", &["--desired-tris", "150", "--simplifier", "clustering"]);
}

#[test]
fn the_fixture_is_what_the_generator_makes() {
    let folder = tempfile::tempdir().unwrap();
    let options = hlod::city::CityOptions {
        blocks: 1,
        triangles: 2_600,
        texture: hlod::city::TextureSize::PerTriangle(17.0),
        offset: [678_016.0, 5_403_456.0, 400.0],
        seed: 3,
        ..Default::default()
    };
    hlod::city::write(&options, &folder.path().join("city.obj")).unwrap();
    let made = crate::support::result::contents(folder.path());
    if std::env::var_os("HLOD_BLESS").is_some_and(|bless| bless == "1") {
        for (name, bytes) in &made {
            let path = fixtures().join("tiny_city").join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
    let kept = crate::support::result::contents(&fixtures().join("tiny_city"));
    assert_eq!(crate::support::result::difference(&made, &kept), None);
    assert!(kept.values().map(Vec::len).sum::<usize>() < 200_000);
}
