//! Comparing frames with the leaves alone.

use std::fs;

use glam::DVec3;
use hlod::bench::{ReferenceRenderer, Session};
use hlod::camera::{View, read_path, write_path};
use hlod::picture_error::mean_squared_error;
use hlod::render::RenderOptions;
use hlod::render::content::TextureFormat;
use image::DynamicImage;
use serde_json::Value;

use crate::adapter::{or_skip, skip};
use crate::bench_support::{Place, city};
use crate::damage::node_file;

const INPUT: i32 = 3;
const NO_ADAPTER: i32 = 5;

/// The columns that looking at frames fills.
const COLUMNS: [&str; 10] = [
    "flip_mean",
    "flip_p95",
    "psnr_db",
    "ssim",
    "reference_triangles",
    "reference_pixels",
    "gap_pixels",
    "inner_gap_pixels",
    "extra_pixels",
    "pop_flip",
];

/// Runs and expects a code; false where there is no adapter and none is required.
fn ran(place: &Place, arguments: &[&str], code: i32) -> bool {
    let done = place.bench(arguments);
    let found = done.get_output().status.code();
    if found == Some(NO_ADAPTER) {
        let what = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        skip(&what);
        return false;
    }
    assert_eq!(found, Some(code), "{}", String::from_utf8_lossy(&done.get_output().stderr));
    true
}

/// `frames.csv` without what looking at frames adds.
fn plain(place: &Place, result: &str) -> Vec<Vec<String>> {
    let bytes = fs::read(place.path().join(result).join("frames.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let header = reader.headers().unwrap().clone();
    let row = |row: csv::Result<csv::StringRecord>| {
        let row = row.unwrap();
        let fields = header.iter().zip(row.iter()).filter(|(name, _)| !COLUMNS.contains(name));
        fields.map(|(_, field)| field.to_owned()).collect()
    };
    reader.records().map(row).collect()
}

const MODEL: [&str; 10] = [
    "out",
    "fly.csv",
    "--clock",
    "model",
    "--size",
    "320x180",
    "--target-ms",
    "12",
    "-q",
    "--max-memory=700KiB",
];

#[test]
fn a_modelled_run_is_the_same_whether_or_not_it_is_compared_with_the_leaves() {
    let place = Place::new(city());
    let looked = ["--reference-every", "5", "--out", "looked"];
    if !ran(&place, &[&MODEL[..], &looked].concat(), 0) {
        return;
    }
    assert!(ran(&place, &[&MODEL[..], &["--out", "plain"]].concat(), 0));
    assert_eq!(plain(&place, "looked"), plain(&place, "plain"));
    let (mut with, without) = (place.summary("looked"), place.summary("plain"));
    let accuracy = with["accuracy"].take();
    assert_eq!(with, without);
    assert!(without["accuracy"].is_null());
    assert_eq!((&accuracy["every"], &accuracy["frames"]), (&5.into(), &6.into()));
    assert!(accuracy["adapter"].is_object());

    let frames = place.frames("looked");
    for column in COLUMNS {
        let values = frames.column(column);
        for (frame, value) in values.iter().enumerate() {
            let expected = frame % 5 == 0 && column != "pop_flip";
            assert!(value.is_nan() != expected || column == "pop_flip", "{column} {frame}");
        }
    }
    // Something is coarser than the leaves, and the figures agree on that.
    let at = |column: &str| -> Vec<f64> {
        frames.column(column).into_iter().filter(|value| !value.is_nan()).collect()
    };
    let (flip, ssim) = (at("flip_mean"), at("ssim"));
    assert!(flip.iter().all(|flip| (0.0..0.5).contains(flip)), "{flip:?}");
    assert!(flip.iter().any(|&flip| flip > 1e-3), "{flip:?}");
    for (flip, ssim) in flip.iter().zip(&ssim) {
        assert_eq!(*flip == 0.0, *ssim > 1.0 - 1e-9, "{flip} {ssim}");
    }
    assert!(at("reference_pixels").iter().any(|&pixels| pixels > 1000.0));
    let page = fs::read_to_string(place.path().join("looked/report.html")).unwrap();
    assert_eq!(page.matches("<img src=\"data:image/jpeg;base64,").count(), 9);
}

#[test]
fn where_all_leaves_are_drawn_their_picture_is_that_of_the_reference() {
    let place = Place::new(city());
    let path = read_path(&place.path().join("orbit.csv"), place.scene().up).unwrap();
    for place_on_path in [0, 10, 20] {
        let mut still = path.clone();
        let pose = path.frames[place_on_path].pose;
        still.frames.iter_mut().for_each(|frame| frame.pose = pose);
        write_path(&still, &place.path().join("still.csv")).unwrap();
        leaves_look_as_the_reference(&place);
    }
}

/// Everything is affordable, and has arrived before the log begins: a camera that moved would meet
/// nodes whose leaves are still being read. At the pace of the path: frames that follow each other at once may
/// leave the loader no time on a busy machine.
fn leaves_look_as_the_reference(place: &Place) {
    let run = [
        "out",
        "still.csv",
        "-q",
        "--size",
        "320x180",
        "--target-ms",
        "2000",
        "--warm-up-frames",
        "90",
        "--pace",
        "recorded",
        "--reference-every",
        "10",
        "--out",
        "r",
    ];
    if !ran(place, &run, 0) {
        return;
    }
    let frames = place.frames("r");
    let (flip, level) = (frames.column("flip_mean"), frames.column("nodes_level_0"));
    for frame in [0, 10, 20] {
        assert!(level[frame] == 0.0, "frame {frame} has a root");
        assert!(flip[frame] < 1e-6, "frame {frame}: {}", flip[frame]);
    }
    for column in ["gap_pixels", "extra_pixels"] {
        let sum: f64 = frames.column(column).iter().filter(|pixels| !pixels.is_nan()).sum();
        assert_eq!(sum, 0.0, "{column}");
    }
}

#[test]
fn compressed_leaves_look_the_same_in_less_memory() {
    let session = Session::open(city()).unwrap();
    let options = RenderOptions { size: [320, 180], ..RenderOptions::default() };
    let tree = session.tree();
    let leaves: Vec<u32> =
        (0..tree.len() as u32).filter(|&node| tree.children(node).is_empty()).collect();
    let place = Place::new(city());
    let path = read_path(&place.path().join("orbit.csv"), session.scene().up).unwrap();
    let shot = |format| {
        let made = ReferenceRenderer::with_textures(&session, &options, 1 << 30, format);
        let mut renderer = or_skip(made)?;
        let image = renderer.render(&leaves, &path.frames[0].pose).unwrap();
        Some((DynamicImage::from(image).into_rgb8(), renderer.used_bytes() as f64))
    };
    let Some((expected, bytes)) = shot(TextureFormat::Rgba8) else { return };
    let Some((found, compressed_bytes)) = shot(TextureFormat::Bc7) else { return };
    assert!(compressed_bytes < bytes * 0.6, "{compressed_bytes} of {bytes}");
    let error = mean_squared_error(&expected, &found).unwrap();
    assert!(error > 0.0 && error < 255.0f64.powi(2) / 10f64.powf(4.2), "{error}");
}

#[test]
fn a_leaf_that_cannot_be_read_is_told_of() {
    let place = Place::new(city());
    let scene = place.scene();
    let path = read_path(&place.path().join("orbit.csv"), scene.up).unwrap();
    let view = View::new(path.frames[0].pose, DVec3::ZERO, [160, 90]);
    let is_leaf = |&node: &u32| scene.children(node).next().is_none();
    let leaf = (0..scene.nodes.len() as u32).filter(is_leaf).find(|&leaf| {
        let node = &scene.nodes[leaf as usize];
        let middle = (DVec3::from(node.bbox_min) + DVec3::from(node.bbox_max)) / 2.0;
        view.frustum.outside([middle, middle]) <= 0.0
    });
    fs::write(node_file(&place, leaf.unwrap()), b"no").unwrap();
    let run = ["out", "orbit.csv", "--clock", "model", "--size", "160x90", "-q"];
    if !ran(&place, &[&run[..], &["--reference-every", "5", "--out", "r"]].concat(), INPUT) {
        return;
    }
    let broken = &place.summary("r")["broken_files"];
    let Value::Array(broken) = broken else { panic!("{broken}") };
    assert_eq!(broken.len(), 1, "{broken:?}");
    assert!(broken[0].as_str().unwrap().contains("expected"), "{broken:?}");
}

#[test]
fn a_sweep_has_a_run_and_a_line_for_each_target() {
    let place = Place::new(city());
    let run = [
        "sweep",
        "out",
        "fly.csv",
        "--targets",
        "1,40",
        "--clock",
        "model",
        "--size",
        "160x90",
        "--out",
        "s",
    ];
    if !ran(&place, &run, 0) {
        return;
    }
    let csv = fs::read_to_string(place.path().join("s/sweep.csv")).unwrap();
    let targets: Vec<&str> = csv.lines().skip(1).map(|l| l.split(',').next().unwrap()).collect();
    assert_eq!(targets, ["1", "40"]);
    for target in targets {
        let summary = place.summary(&format!("s/target-{target}"));
        assert_eq!(summary["parameters"]["target_ms"].to_string(), format!("{target}.0"));
        assert_eq!(summary["accuracy"]["every"], 10);
    }
    assert!(place.path().join("s/sweep.html").is_file());
    // More time is no worse.
    let flip = |target: &str| {
        place.summary(&format!("s/target-{target}"))["accuracy"]["flip_mean"]["mean"]
            .as_f64()
            .unwrap()
    };
    assert!(flip("40") < flip("1"), "{} {}", flip("40"), flip("1"));
}
