//! Cells: made, made again, damaged, and drawn.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use glam::DVec3;
use hlod::bench::{ReferenceRenderer, Session};
use hlod::builder::BuildOptions;
use hlod::builder::partition::BlockSplit;
use hlod::camera::{
    CameraPath, Ground, PathFrame, PathKind, Pose, from_angles, make_path, write_path,
};
use hlod::city::{CityOptions, TextureSize};
use hlod::format::cells::Cells;
use hlod::format::{NodeId, NodeLabel, NodeMesh, file_crc, read_glb, write_glb};
use hlod::picture_error::{Gaps, mean_squared_error, psnr};
use hlod::render::{RenderOptions, Side};
use image::{DynamicImage, GrayImage, Luma, Rgba, RgbaImage};

use crate::adapter::{or_skip, skip};
use crate::bench_support::{Frames, Place, build_options, city};
use crate::support::build_with;
use crate::support::inputs::write_city;

const INPUT: i32 = 3;
const NO_ADAPTER: i32 = 5;

/// Cells of so many metres, from whose sides it is so far to those of their cull boxes: in a city of two blocks
/// most is outside of that.
const OPTIONS: [&str; 8] = ["--cell", "4", "--cull", "12", "--pixels", "256", "--error", "1"];

/// A walk along the city's edge of 12 m in 30 frames, looking at it.
fn walk(place: &Place) -> CameraPath {
    let [min, max] = place.scene().bounds().unwrap().map(DVec3::from);
    let up = place.scene().up;
    let [min, max] = [up.z_up(min), up.z_up(max)];
    let [a, b] = [min.min(max), min.max(max)];
    let frame = |at: u64| {
        let part = at as f64 / 29.0;
        let eye = DVec3::new((a.x + b.x) / 2.0 - 6.0 + 12.0 * part, a.y - 3.0, a.z + 1.7);
        PathFrame {
            frame: at,
            time_s: part * 8.0,
            pose: Pose {
                position: up.from_z_up(eye),
                rotation: from_angles(up, 60.0 + 60.0 * part, 5.0, 0.0),
                fov_y_deg: 60.0,
            },
        }
    };
    CameraPath { frames: (0..30).map(frame).collect() }
}

fn hlod_build(place: &Place, arguments: &[&str]) -> std::process::Output {
    let mut build = Command::cargo_bin("hlod-build").unwrap();
    build.current_dir(place.path()).args(arguments).output().unwrap()
}

/// A city with `walk.csv`, and cells along it; none where there is no adapter and none is required.
fn with_cells(more: &[&str]) -> Option<Place> {
    let place = Place::new(city());
    write_path(&walk(&place), &place.path().join("walk.csv")).unwrap();
    prepare(&place, more).then_some(place)
}

fn prepare(place: &Place, more: &[&str]) -> bool {
    let what = ["cells", "out", "--along", "walk.csv"];
    let done = hlod_build(place, &[&what[..], &OPTIONS, more].concat());
    let error = String::from_utf8_lossy(&done.stderr);
    if done.status.code() == Some(NO_ADAPTER) {
        skip(&error);
        return false;
    }
    assert!(done.status.success(), "{error}");
    true
}

fn cells(place: &Place) -> Cells {
    Cells::read(&place.out()).unwrap().unwrap()
}

/// The files of cells, with when they were written.
fn files(place: &Place) -> BTreeMap<String, (Vec<u8>, std::time::SystemTime)> {
    let read =
        |path: &Path| (fs::read(path).unwrap(), fs::metadata(path).unwrap().modified().unwrap());
    let faces = fs::read_dir(place.out().join("cells")).unwrap().map(|entry| entry.unwrap().path());
    faces
        .chain([place.out().join("cells.hlod")])
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), read(&path)))
        .collect()
}

fn bytes(place: &Place) -> BTreeMap<String, Vec<u8>> {
    files(place).into_iter().map(|(name, (bytes, _))| (name, bytes)).collect()
}

#[test]
fn cells_are_the_same_bytes_on_any_number_of_threads_and_go_on_where_they_were_stopped() {
    let Some(place) = with_cells(&["-j", "1"]) else { return };
    let made = bytes(&place);
    assert!(made.len() > 8, "{:?}", made.keys());
    let other = with_cells(&["-j", "4"]).unwrap();
    assert_eq!(made, bytes(&other));

    // What is there stays; what is damaged or gone is made again; what is of other options goes.
    let before = files(&place);
    let faces: Vec<&String> = made.keys().filter(|name| name.ends_with(".glb")).collect();
    let (damaged, gone) = (faces[0], faces[faces.len() - 1]);
    let dir = place.out().join("cells");
    fs::write(dir.join(damaged), b"damaged").unwrap();
    fs::remove_file(dir.join(gone)).unwrap();
    assert!(prepare(&place, &[]));
    let after = files(&place);
    assert_eq!(made, bytes(&place));
    for name in faces {
        let is_again = after[name].1 != before[name].1;
        let is_of_these = [damaged, gone].iter().any(|file| cell_of(file) == cell_of(name));
        assert_eq!(is_again, is_of_these, "{name}");
    }
    // With other options all are made again, and none of those before stays.
    fs::write(dir.join("c9_9_9-0.glb"), b"of a cell that is no more").unwrap();
    assert!(prepare(&place, &["--jpeg-quality", "50"]));
    let others = bytes(&place);
    assert_eq!(others.len(), made.len());
    // None has the name of another, which an index of before may know.
    assert!(others.keys().all(|name| name == "cells.hlod" || !made.contains_key(name)));
    assert!(prepare(&place, &[]));
    assert_eq!(made, bytes(&place));
}

/// Names of faces are those of their cells, a direction, and what they were made with.
fn cell_of(file: &str) -> &str {
    file.rsplitn(3, '-').nth(2).unwrap()
}

/// Where surface is.
fn surface(picture: &RgbaImage) -> GrayImage {
    GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
        Luma([picture.get_pixel(x, y).0[3]])
    })
}

/// What faces show beside the leaves, from those corners of cells from which no picture was taken.
#[derive(Debug, Default)]
struct Seen {
    /// Pixels with surface in pictures of the leaves.
    pixels: u64,
    /// Pixels that only faces cover.
    of_faces: u64,
    /// Pixels with background where the leaves have surface, which no outline explains that is off by three
    /// pixels.
    missing: u64,
    /// Mean squared error of all pixels, 0 to 65,025.
    squared_error: f64,
}

fn seen_from_other_corners(place: &Place, yaws: &[f64]) -> Option<Seen> {
    let mut session = Session::open(&place.out()).unwrap();
    session.read_cells().unwrap();
    let options = RenderOptions { size: [320, 240], ..RenderOptions::default() };
    let cut = RenderOptions { cut: Some(Side::Inside), ..options.clone() };
    let mut leaves_alone = or_skip(ReferenceRenderer::new(&session, &options, 1 << 30))?;
    let mut drawn = ReferenceRenderer::new(&session, &cut, 1 << 30).unwrap();
    let tree = session.tree();
    let leaves: Vec<u32> =
        (0..tree.len() as u32).filter(|&node| tree.children(node).is_empty()).collect();
    let cells = cells(place);
    let (mut seen, mut pictures) = (Seen::default(), 0.0);
    for cell in &cells.cells {
        let [min, max] = cells.bounds(cell.place).map(DVec3::from_array);
        let faces = cell.faces.clone().map(|face| tree.len() as u32 + face);
        let all: Vec<u32> = leaves.iter().copied().chain(faces).collect();
        drawn.cut_at(Some(cell.cull_box.map(DVec3::from_array)));
        for corner in [1, 2, 4, 7u32] {
            let side = DVec3::from_array([0, 1, 2].map(|axis| f64::from(corner >> axis & 1)));
            let position = min + (max - min) * (DVec3::splat(0.01) + side * 0.98);
            for &yaw in yaws {
                let rotation = from_angles(session.scene().up, yaw, 0.0, 0.0);
                let pose = Pose { position, rotation, fov_y_deg: 60.0 };
                let expected = leaves_alone.render(&leaves, &pose).unwrap();
                let near = drawn.render(&leaves, &pose).unwrap();
                let found = drawn.render(&all, &pose).unwrap();
                let gaps = Gaps::between(&surface(&expected), &surface(&found)).unwrap();
                seen.pixels += gaps.reference_pixels;
                seen.missing += gaps.inner(|_| 3.0).len() as u64;
                let is_of_face =
                    |(near, all): (&Rgba<u8>, &Rgba<u8>)| near.0[3] == 0 && all.0[3] > 0;
                let both = near.pixels().zip(found.pixels());
                seen.of_faces += both.filter(|&both| is_of_face(both)).count() as u64;
                let [expected, found] =
                    [expected, found].map(|picture| DynamicImage::ImageRgba8(picture).into_rgb8());
                seen.squared_error += mean_squared_error(&expected, &found).unwrap();
                pictures += 1.0;
            }
        }
    }
    seen.squared_error /= pictures;
    Some(seen)
}

#[test]
fn faces_look_like_what_they_show_from_corners_that_no_picture_was_taken_from() {
    let Some(place) = with_cells(&[]) else { return };
    let Some(seen) = seen_from_other_corners(&place, &[30.0, 90.0, 150.0]) else { return };
    assert!(seen.of_faces > 50_000, "{seen:?}");
    let psnr = psnr(seen.squared_error);
    assert!(psnr > 25.0, "{psnr} dB, {seen:?}");
}

/// Slits are left where more than the three pixels are uncovered for which what is behind something goes on, and
/// none of the five pictures saw what is there. Found: 0.1 % of what faces cover.
#[test]
fn no_background_shows_through_a_closed_city_but_for_slits_of_a_pixel() {
    let options = CityOptions {
        blocks: 4,
        triangles: 40_000,
        texture: TextureSize::None,
        watertight: true,
        seed: 3,
        ..CityOptions::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let built = folder.path().join("out");
    let blocks = BlockSplit::Grid(54.0);
    let build = BuildOptions { blocks, upper_levels: false, ..build_options(250) };
    build_with(&[write_city(folder.path(), &options)], &built, &build);
    let place = Place::new(&built);
    let ground = Ground::read(&place.scene(), &place.out()).unwrap();
    let walk = make_path(&ground, PathKind::Walk, 300, 30.0, 0).unwrap();
    write_path(&walk, &place.path().join("walk.csv")).unwrap();
    let faces = ["--cull", "30", "--pixels", "512"];
    let done = hlod_build(&place, &[&["cells", "out", "--along", "walk.csv"][..], &faces].concat());
    if done.status.code() == Some(NO_ADAPTER) {
        return skip(&String::from_utf8_lossy(&done.stderr));
    }
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let yaws = [0.0, 60.0, 120.0, 180.0, 240.0, 300.0];
    let Some(seen) = seen_from_other_corners(&place, &yaws) else { return };
    assert!(seen.of_faces > 100_000, "{seen:?}");
    assert!(500 * seen.missing < seen.of_faces, "{seen:?}");
}

#[test]
fn no_cells_are_made_of_a_scene_whose_files_are_damaged() {
    let place = Place::new(city());
    write_path(&walk(&place), &place.path().join("walk.csv")).unwrap();
    for entry in fs::read_dir(place.out().join("nodes")).unwrap() {
        fs::write(entry.unwrap().path(), b"damaged").unwrap();
    }
    let what = ["cells", "out", "--along", "walk.csv"];
    let done = hlod_build(&place, &[&what[..], &OPTIONS].concat());
    let error = String::from_utf8_lossy(&done.stderr);
    if done.status.code() == Some(NO_ADAPTER) {
        return skip(&error);
    }
    assert_eq!(done.status.code(), Some(INPUT), "{error}");
    assert!(error.contains("build again") && error.contains(".glb"), "{error}");
    assert!(!place.out().join("cells.hlod").exists());
}

#[test]
fn verify_reads_cells_and_names_what_is_wrong_with_them() {
    let Some(place) = with_cells(&[]) else { return };
    let verified = |expected: &str, passes: bool| {
        let done = hlod_build(&place, &["verify", "out", "--samples", "1000", "--cells", "0"]);
        let text = String::from_utf8_lossy(&done.stdout).into_owned();
        let found = if passes { "pass  cells:" } else { "FAIL  cells" };
        assert!(text.contains(found) && text.contains(expected), "{text}");
        assert!(passes || !done.status.success());
    };
    verified("cells with", true);
    let index = place.out().join("cells.hlod");
    let whole = fs::read(&index).unwrap();
    let changed = |change: &dyn Fn(&mut Cells), expected: &str| {
        let mut cells = cells_of(&whole);
        change(&mut cells);
        fs::write(&index, cells.to_bytes().unwrap()).unwrap();
        verified(expected, false);
    };
    changed(&|cells| cells.faces[0].triangles += 1, "vertices, triangles and pictures");
    changed(&|cells| cells.faces[0].bounds[1] = cells.faces[0].bounds[0], "expected to be from");
    changed(&|cells| cells.faces[0].file_crc ^= 1, "CRC-32");
    changed(
        &|cells| cells.faces[0].views[0].projection = [0.0; 4],
        "before the camera of its picture",
    );
    changed(&|cells| cells.scene = [0; 32], "another");
    fs::write(&index, &whole).unwrap();
    fs::remove_dir_all(place.out().join("cells")).unwrap();
    verified("cannot be read", false);
}

/// The index and the files of cells with the meshes of all faces changed.
fn change_faces(place: &Place, change: &dyn Fn(&mut NodeMesh)) {
    let mut cells = cells(place);
    for (face, direction) in cells.faces.iter_mut().zip(0..) {
        let path = place.out().join("cells").join(&face.file);
        let mut mesh = read_glb(&fs::read(&path).unwrap(), &path).unwrap();
        change(&mut mesh);
        let at = |at: &[f32; 3]| DVec3::from(mesh.origin) + DVec3::from(at.map(f64::from));
        let all = || mesh.primitives.iter().flat_map(|part| &part.positions).map(at);
        face.bounds = [
            all().fold(DVec3::INFINITY, DVec3::min).to_array(),
            all().fold(DVec3::NEG_INFINITY, DVec3::max).to_array(),
        ];
        let triangles = mesh.primitives.iter().map(|part| part.indices.len() as u32 / 3);
        face.triangles = triangles.sum();
        let label = NodeLabel { id: NodeId(direction), level: 0 };
        let bytes = write_glb(&mesh, place.scene().up, label).unwrap();
        (face.file_bytes, face.file_crc) = (bytes.len() as u64, file_crc(&bytes));
        fs::write(&path, bytes).unwrap();
    }
    fs::write(place.out().join("cells.hlod"), cells.to_bytes().unwrap()).unwrap();
}

#[test]
fn verify_sees_what_faces_miss_and_what_they_show_wrongly() {
    let verified = |place: &Place, expected: &str| {
        let arguments = ["verify", "out", "--samples", "1000", "--cells", "1000"];
        let done = hlod_build(place, &arguments);
        let text = String::from_utf8_lossy(&done.stdout).into_owned();
        assert!(text.contains(expected), "{expected}: {text}");
    };
    let Some(place) = with_cells(&[]) else { return };
    verified(&place, "pass  cells:");
    // From where the pictures were taken the same is seen of it, and from elsewhere another side.
    change_faces(&place, &|mesh| {
        let farther = |at: &mut [f32; 3]| *at = at.map(|at| at * 1.5);
        mesh.primitives.iter_mut().flat_map(|part| &mut part.positions).for_each(farther);
    });
    verified(&place, "is shown wrongly");
    let place = with_cells(&[]).unwrap();
    change_faces(&place, &|mesh| {
        let part = &mut mesh.primitives[0];
        part.indices.truncate(part.indices.len() / 6 * 3);
    });
    verified(&place, "is missing");
}

const RUN: [&str; 12] = [
    "out",
    "walk.csv",
    "--clock",
    "model",
    "--size",
    "320x180",
    "--target-ms",
    "12",
    "-q",
    "--warm-up-frames",
    "30",
    "--far-field",
];

#[test]
fn what_is_far_is_drawn_from_faces_and_no_frame_is_without() {
    let Some(place) = with_cells(&[]) else { return };
    for (far_field, out) in [("off", "off"), ("cells", "with")] {
        place.bench(&[&RUN[..], &[far_field, "--out", out]].concat()).success();
    }
    let (off, with) = (place.frames("off"), place.frames("with"));
    assert!(with.max("nodes") < off.max("nodes"), "{} {}", with.max("nodes"), off.max("nodes"));
    // All of it is counted as memory.
    assert!(with.max("memory_bytes") > 0.0);
    place.bench(&[&RUN[..], &["cells", "--out", "again"]].concat()).success();
    let csv = |name: &str| fs::read(place.path().join(name).join("frames.csv")).unwrap();
    assert_eq!(csv("with"), csv("again"));
}

/// Two small blocks take a few milliseconds: there is time for their leaves, which no face shows better. While
/// leaves are still read, faces may be drawn.
#[test]
fn no_cell_is_drawn_by_itself_where_none_pays() {
    let Some(place) = with_cells(&[]) else { return };
    let mut run = RUN.to_vec();
    run[7] = "100";
    for far_field in ["off", "cells", "auto"] {
        place.bench(&[&run[..], &[far_field, "--out", far_field]].concat()).success();
    }
    assert!(place.frames("cells").max("faces") > 0.0);
    let [auto, off] = ["auto", "off"].map(|name| place.frames(name));
    let later = |frames: &Frames, column: &str| frames.column(column).split_off(frames.len() / 2);
    assert!(later(&auto, "faces").iter().all(|&faces| faces == 0.0));
    assert_eq!(later(&auto, "triangles"), later(&off, "triangles"));
}

#[test]
fn what_changes_with_the_cell_is_looked_at() {
    let Some(place) = with_cells(&[]) else { return };
    let inspected = ["cells", "--reference-every", "10", "--pops", "--out", "pops"];
    place.bench(&[&RUN[..], &inspected].concat()).success();
    let frames = place.frames("pops");
    let changes: f64 = frames.column("far_changed").iter().sum();
    assert!((2.0..8.0).contains(&changes), "{changes} changes along 12 m");
    let summary = place.summary("pops");
    let number = |at: &str| summary.pointer(at).and_then(serde_json::Value::as_f64).unwrap();
    assert_eq!(number("/far_field/changes"), changes);
    assert_eq!(number("/accuracy/far_pop_frames"), changes);
    // Little changes: what is far is shown by both cells.
    assert!(number("/accuracy/far_pop_flip/max") < 0.05);
    assert_eq!(number("/accuracy/frames"), 3.0, "no others count");
}

#[test]
fn cells_that_are_missing_damaged_or_of_another_build_are_named() {
    let place = Place::new(city());
    write_path(&walk(&place), &place.path().join("walk.csv")).unwrap();
    let refused = |place: &Place, what: &str| {
        let done = place.bench(&[&RUN[..], &["cells", "--out", "refused"]].concat()).code(INPUT);
        let error = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(error.contains("cells.hlod") && error.contains(what), "{error}");
    };
    refused(&place, "there are no cells");
    if !prepare(&place, &[]) {
        return;
    }
    let index = place.out().join("cells.hlod");
    let whole = fs::read(&index).unwrap();
    fs::write(&index, &whole[..whole.len() - 1]).unwrap();
    refused(&place, "truncated");
    let mut other = cells_of(&whole);
    other.scene[0] ^= 1;
    fs::write(&index, other.to_bytes().unwrap()).unwrap();
    refused(&place, "another");
    // Where they are not asked for, the hierarchy is drawn, and what cannot be used is told of.
    let done = place.bench(&[&RUN[..], &["auto", "--out", "auto"]].concat()).success();
    let error = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(error.contains("another") && error.contains("from the hierarchy"), "{error}");
    place.bench(&[&RUN[..], &["off", "--out", "off"]].concat()).success();
}

fn cells_of(bytes: &[u8]) -> Cells {
    Cells::from_bytes(bytes, Path::new("cells.hlod")).unwrap()
}

#[test]
fn a_face_that_is_gone_leaves_the_hierarchy_in_its_place() {
    let Some(place) = with_cells(&[]) else { return };
    let dir = place.out().join("cells");
    for entry in fs::read_dir(&dir).unwrap() {
        fs::remove_file(entry.unwrap().path()).unwrap();
    }
    let mut run = RUN.to_vec();
    run[3] = "wall";
    let done = place.bench(&[&run[..], &["cells", "--out", "gone"]].concat()).code(INPUT);
    let error = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(error.contains("the run went on without") && error.contains(".glb"), "{error}");
    let gone = place.frames("gone");
    assert!(gone.column("nodes").iter().all(|&nodes| nodes > 0.0));
}
