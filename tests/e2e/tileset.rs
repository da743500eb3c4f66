//! The result as a 3D Tiles tileset, and its place on the Earth.

use std::fs;
use std::path::Path;

use hlod::city::{self, CityOptions};
use hlod::format::Scene;
use hlod::place::{Placement, wgs84_to_ecef};
use hlod::tileset;
use predicates::str::contains;
use serde_json::Value;

use crate::support::hlod_build;
use crate::support::inputs::small_city;
use crate::support::result::{contents, difference, report};
use crate::support::run_build;

const SMALL_NODES: [&str; 2] = ["--desired-tris", "250"];
const CRS: [&str; 2] = ["--crs", "EPSG:25832"];

/// A city that stands in Ingolstadt.
fn ingolstadt(folder: &Path) {
    let offset = [678_016.0, 5_403_456.0, 370.0];
    city::write(&CityOptions { offset, ..small_city() }, &folder.join("city.obj")).unwrap();
}

fn root_of(out: &Path) -> Value {
    let json: Value = serde_json::from_slice(&fs::read(out.join("tileset.json")).unwrap()).unwrap();
    json["root"].clone()
}

#[test]
fn a_city_of_a_coordinate_system_stands_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    ingolstadt(folder.path());
    let text = run_build(folder.path(), &[&SMALL_NODES[..], &CRS, &["city.obj", "out"]].concat());
    assert!(text.contains("EPSG:25832") && text.contains("Z is up"), "{text}");
    let out = folder.path().join("out");
    let scene = Scene::read(&out).unwrap();
    let placement = Placement::Crs { epsg: 25832, height_offset: 0.0 };
    let checked = tileset::check(&out, &scene, &placement).unwrap();
    assert_eq!(checked.faults, []);
    assert!(checked.placed_within.unwrap() < 0.01);
    // 48.76° N 11.42° E, as any map of the town says.
    let root = root_of(&out);
    let number = |value: &Value| value.as_f64().unwrap();
    let [m, b] = [&root["transform"], &root["boundingVolume"]["box"]];
    let centre: [f64; 3] = std::array::from_fn(|row| {
        number(&m[12 + row])
            + (0..3).map(|column| number(&m[4 * column + row]) * number(&b[column])).sum::<f64>()
    });
    let town = wgs84_to_ecef(11.4236f64.to_radians(), 48.7600f64.to_radians(), 380.0);
    assert!(town.distance(centre.into()) < 500.0, "{centre:?}");
    let text = run_build(folder.path(), &["verify", "out", "--samples", "1000"]);
    assert!(text.contains("of their place on the Earth"), "{text}");
}

#[test]
fn another_place_takes_over_all_nodes() {
    use std::os::unix::fs::MetadataExt;
    let folder = tempfile::tempdir().unwrap();
    ingolstadt(folder.path());
    run_build(folder.path(), &[&SMALL_NODES[..], &["city.obj", "out"]].concat());
    let out = folder.path().join("out");
    let inodes = || -> Vec<u64> {
        let nodes = fs::read_dir(out.join("nodes")).unwrap();
        let files = nodes.map(|node| node.unwrap().metadata().unwrap());
        let mut inodes: Vec<u64> =
            files.filter(|file| file.is_file()).map(|file| file.ino()).collect();
        inodes.sort_unstable();
        inodes
    };
    let before = inodes();
    assert!(root_of(&out).get("transform").is_none());
    let placed = [&SMALL_NODES[..], &CRS, &["city.obj", "out"]].concat();
    let text = run_build(folder.path(), &placed);
    assert!(!text.contains("up to date"), "{text}");
    assert_eq!(inodes(), before);
    assert!(root_of(&out).get("transform").is_some());
    assert!(run_build(folder.path(), &placed).contains("up to date"));
    let clean = [&SMALL_NODES[..], &CRS, &["city.obj", "clean"]].concat();
    run_build(folder.path(), &clean);
    let [mut one, mut other] = [contents(&out), contents(&folder.path().join("clean"))];
    one.remove("build.json");
    other.remove("build.json");
    assert_eq!(difference(&one, &other), None);
}

#[test]
fn a_result_of_an_older_version_is_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    ingolstadt(folder.path());
    let arguments = [&SMALL_NODES[..], &["city.obj", "out"]].concat();
    run_build(folder.path(), &arguments);
    let out = folder.path().join("out");
    let whole = contents(&out);
    // As such versions left it.
    let mut old = report(&out);
    old.as_object_mut().unwrap().remove("tilesets");
    fs::write(out.join("build.json"), old.to_string()).unwrap();
    fs::remove_file(out.join("tileset.json")).unwrap();
    hlod_build()
        .current_dir(&folder)
        .args(["verify", "out", "--samples", "1000"])
        .assert()
        .code(3)
        .stdout(contains("tileset.json").and(contains("older version")));
    let text = run_build(folder.path(), &arguments);
    assert!(text.contains("older version") && text.contains("tileset.json"), "{text}");
    let [mut whole, mut now] = [whole, contents(&out)];
    whole.remove("build.json");
    now.remove("build.json");
    assert_eq!(difference(&whole, &now), None);
    assert!(run_build(folder.path(), &arguments).contains("up to date"));
}

use predicates::prelude::PredicateBooleanExt;

#[test]
fn what_can_be_no_place_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    city::write(&small_city(), &folder.path().join("city.obj")).unwrap();
    let cases: [(&[&str], i32, &str); 10] = [
        (&["--crs", "EPSG:99999"], 2, "EPSG:99999"),
        (&["--crs", "25832"], 2, "EPSG:CODE"),
        (&["--crs", "EPSG:4326"], 2, "add --origin"),
        (&["--crs", "EPSG:25832"], 3, "local metres"),
        (&["--origin", "11.4,95,0"], 2, "latitude"),
        (&["--origin", "11.4,48.7"], 2, "LON,LAT,HEIGHT"),
        (&["--origin", "11.4,nan,0"], 2, "latitude"),
        (&["--origin", "1,2,3", "--crs", "EPSG:25832"], 2, "no --origin beside it"),
        (&["--origin", "1,2,3", "--crs", "EPSG:4326"], 3, "km from --origin"),
        (&["--height-offset", "46"], 2, "--crs"),
    ];
    for (options, code, word) in cases {
        hlod_build()
            .current_dir(&folder)
            .args(options)
            .args(["city.obj", "out"])
            .assert()
            .code(code)
            .stderr(contains(word));
        assert!(!folder.path().join("out").exists(), "{options:?}");
    }
    // Before the input is even looked for.
    hlod_build()
        .current_dir(&folder)
        .args(["--crs", "EPSG:99999", "absent.obj", "out"])
        .assert()
        .code(2);
}

#[test]
fn metres_of_an_origin_stand_there() {
    let folder = tempfile::tempdir().unwrap();
    city::write(&small_city(), &folder.path().join("city.obj")).unwrap();
    let place = ["--origin", "-73.97,40.78,-12.5"];
    run_build(folder.path(), &[&SMALL_NODES[..], &place, &["city.obj", "out"]].concat());
    let root = root_of(&folder.path().join("out"));
    let there = wgs84_to_ecef(-73.97f64.to_radians(), 40.78f64.to_radians(), -12.5);
    for (axis, coordinate) in there.to_array().into_iter().enumerate() {
        assert!((root["transform"][12 + axis].as_f64().unwrap() - coordinate).abs() < 1e-6);
    }
}

#[test]
fn a_city_in_degrees_is_built_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    city::write(&small_city(), &folder.path().join("metres.obj")).unwrap();
    // About so many metres to a degree there; the city is stretched by as much as that is wrong.
    let text = fs::read_to_string(folder.path().join("metres.obj")).unwrap();
    let degrees: Vec<String> = text
        .lines()
        .map(|line| match line.strip_prefix("v ") {
            None => line.to_owned(),
            Some(rest) => {
                let numbers: Vec<f64> =
                    rest.split_whitespace().map(|number| number.parse().unwrap()).collect();
                let (lon, lat) = (11.42 + numbers[0] / 73_500.0, 48.76 + numbers[1] / 111_200.0);
                format!("v {lon:.12} {lat:.12} {}", 370.0 + numbers[2])
            }
        })
        .collect();
    fs::write(folder.path().join("degrees.obj"), degrees.join("\n")).unwrap();
    let place = ["--crs", "EPSG:4326", "--origin", "11.42,48.76,370"];
    let built = |place: &[&str]| {
        run_build(folder.path(), &[&SMALL_NODES[..], place, &["degrees.obj", "out"]].concat())
    };
    let text = built(&place);
    assert!(text.contains("degrees of EPSG:4326, built in metres"), "{text}");
    assert!(text.contains("Z is up (assumed of degrees"), "{text}");
    run_build(folder.path(), &[&SMALL_NODES[..], &["metres.obj", "plain"]].concat());
    let [scene, plain] = ["out", "plain"].map(|out| Scene::read(&folder.path().join(out)).unwrap());
    let size = |scene: &Scene| -> [f64; 3] {
        let fold = |of: fn(f64, f64) -> f64, ends: fn(&hlod::format::Node) -> [f64; 3]| {
            let first = ends(&scene.nodes[0]);
            scene.nodes.iter().map(ends).fold(first, |a, b| std::array::from_fn(|i| of(a[i], b[i])))
        };
        let (low, high) = (fold(f64::min, |n| n.bbox_min), fold(f64::max, |n| n.bbox_max));
        std::array::from_fn(|i| high[i] - low[i])
    };
    for (found, expected) in size(&scene).into_iter().zip(size(&plain)) {
        assert!((found / expected - 1.0).abs() < 0.005, "{found} m, {expected} m");
    }
    let verify = ["verify", "out", "--source", "degrees.obj", "--samples", "1000"];
    run_build(folder.path(), &verify);
    assert!(built(&place).contains("up to date"));
    // From another origin everything lies elsewhere.
    let out = folder.path().join("out");
    let before = contents(&out);
    built(&["--crs", "EPSG:4326", "--origin", "11.421,48.76,370"]);
    assert!(difference(&before, &contents(&out)).is_some());
    run_build(folder.path(), &verify);
}
