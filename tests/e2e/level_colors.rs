//! `hlod-build verify`: a level that shows another material than the source is found.

use std::fmt::Write;

use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::progress::Silent;
use hlod::builder::{BuildOptions, Outcome, build};
use hlod::format::{Scene, read_glb};
use hlod::texture::BakeReason;

use crate::support::hlod_build;
use crate::support::inputs::write;
use crate::verify::{Broken, failed};

/// A track of asphalt between two strips of grass, `side` by `side` quads of 1 m.
fn write_track(folder: &std::path::Path, side: usize) -> std::path::PathBuf {
    let mtl = "newmtl asphalt\nKd 0.35 0.35 0.37\nnewmtl grass\nKd 0.3 0.75 0.2\n";
    write(folder, "track.mtl", mtl);
    let mut text = String::from("mtllib track.mtl\n");
    for i in 0..=side {
        for j in 0..=side {
            let height = ((i * 7 + j * 13) % 5) as f64 * 0.02;
            let _ = writeln!(text, "v {i} {j} {height}");
        }
    }
    for i in 0..side {
        let is_track = (side / 3..side - side / 3).contains(&i);
        let _ = writeln!(text, "usemtl {}", if is_track { "asphalt" } else { "grass" });
        for j in 0..side {
            let at = |i: usize, j: usize| i * (side + 1) + j + 1;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let _ = writeln!(text, "f {a} {b} {c} {d}");
        }
    }
    write(folder, "track.obj", text)
}

fn track() -> Broken {
    let folder = tempfile::tempdir().unwrap();
    let input = write_track(folder.path(), 30);
    let out = tempfile::tempdir().unwrap();
    let hierarchy = HierarchyOptions { desired_tris: 200, ..HierarchyOptions::default() };
    let options = BuildOptions { hierarchy, ..BuildOptions::default() };
    build(&[input], out.path(), &options, &Silent).unwrap();
    let scene = Scene::read(out.path()).unwrap();
    Broken { out, scene }
}

/// Paints the primitives of the root for which `chosen` holds by the colour of their first vertex.
fn painted(paint: impl Fn([f64; 3]) -> [f64; 3]) -> hlod::verify::VerifyReport {
    let mut broken = track();
    let root = broken.scene.nodes.iter().position(|node| node.parent.is_none()).unwrap();
    broken.rewrite(root, |mesh| {
        for primitive in &mut mesh.primitives {
            let base = primitive.surface.base_color;
            let is_plain = primitive.colors.is_empty();
            let vertices = primitive.positions.len();
            let color = |vertex: usize| {
                let color = primitive.colors.get(vertex).copied().unwrap_or([u16::MAX; 4]);
                paint([0, 1, 2].map(|i| f64::from(base[i]) * f64::from(color[i]) / 65535.0))
            };
            let colors: Vec<[f64; 3]> = (0..vertices).map(color).collect();
            if is_plain {
                let [r, g, b] = colors[0].map(|light| light as f32);
                primitive.surface.base_color = [r, g, b, 1.0];
            } else {
                primitive.surface.base_color = [1.0; 4];
                primitive.colors = colors
                    .iter()
                    .map(|&[r, g, b]| [r, g, b, 1.0].map(|light| (light * 65535.0) as u16))
                    .collect();
            }
        }
    });
    broken.report(false)
}

fn is_grass([red, green, _]: [f64; 3]) -> bool {
    green > 2.0 * red
}

const GRASS: [f64; 3] = [0.073, 0.522, 0.033];
const ASPHALT: [f64; 3] = [0.101, 0.101, 0.113];

#[test]
fn a_level_in_the_right_materials_passes_and_one_in_the_wrong_ones_does_not() {
    let right = painted(|color| color);
    assert!(right.passed, "{}", hlod::verify::text(&right));
    let share = |report: &hlod::verify::VerifyReport| report.levels[0].other_color_share.unwrap();
    assert!(share(&right) < 0.02, "{}", hlod::verify::text(&right));

    let third = painted(|_| GRASS);
    assert_eq!(failed(&third), ["colours of the levels"]);
    assert!((share(&third) - 1.0 / 3.0).abs() < 0.08, "{}", share(&third));

    let swapped = painted(|color| if is_grass(color) { ASPHALT } else { GRASS });
    assert_eq!(failed(&swapped), ["colours of the levels"]);
    assert!(share(&swapped) > 0.9, "{}", share(&swapped));
}

/// A track of asphalt, twelve quads wide, that winds over grass, `side` by `side` quads of 1 m; both textures repeat.
fn write_winding_track(folder: &std::path::Path, side: usize) -> std::path::PathBuf {
    for (name, color) in [("grass", [80u8, 180, 50]), ("asphalt", [60, 60, 65])] {
        let image = image::RgbImage::from_fn(16, 16, |x, y| {
            image::Rgb(color.map(|part| part + ((x * 5 + y * 3) % 7) as u8))
        });
        image.save(folder.join(format!("{name}.png"))).unwrap();
    }
    let mtl = "newmtl grass\nmap_Kd grass.png\nnewmtl asphalt\nmap_Kd asphalt.png\n";
    write(folder, "winding.mtl", mtl);
    let mut text = String::from("mtllib winding.mtl\n");
    for i in 0..=side {
        for j in 0..=side {
            let height = ((i * 7 + j * 13) % 5) as f64 * 0.02;
            let _ = writeln!(text, "v {i} {j} {height}\nvt {i} {j}");
        }
    }
    let middle = |i: usize| side as f64 * (0.5 + 0.4 * (i as f64 * 0.2).sin());
    for i in 0..side {
        for j in 0..side {
            let is_track = (j as f64 + 0.5 - middle(i)).abs() < 6.0;
            let _ = writeln!(text, "usemtl {}", if is_track { "asphalt" } else { "grass" });
            let at = |i: usize, j: usize| i * (side + 1) + j + 1;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c} {d}/{d}");
        }
    }
    write(folder, "winding.obj", text)
}

#[test]
fn nodes_that_would_lose_a_track_show_it_in_textures_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_winding_track(folder.path(), 120);
    let out = tempfile::tempdir().unwrap();
    let hierarchy = HierarchyOptions { desired_tris: 30, ..HierarchyOptions::default() };
    let options = BuildOptions { hierarchy, ..BuildOptions::default() };
    let outcome = build(std::slice::from_ref(&input), out.path(), &options, &Silent).unwrap();
    let Outcome::Built(report) = outcome else { panic!("nothing was there") };
    assert!(report.baked.iter().any(|node| node.reason == BakeReason::Colors));
    let scene = Scene::read(out.path()).unwrap();
    let root = scene.nodes.iter().find(|node| node.parent.is_none()).unwrap();
    let bytes = std::fs::read(out.path().join("nodes").join(&*root.file)).unwrap();
    let mesh = read_glb(&bytes, out.path()).unwrap();
    assert_eq!((mesh.primitives.len(), mesh.images.len()), (1, 1), "one draw");
    assert!(mesh.images[0].repeating().is_none());
    let source = input.to_str().unwrap();
    hlod_build()
        .args(["verify", "--quiet", "--samples", "20000"])
        .args([out.path().to_str().unwrap(), "--source", source])
        .assert()
        .success();
}

/// `side` by `side` red boxes, each inside of a box of glass that is a metre larger on all sides.
fn write_boxes_in_glass(folder: &std::path::Path, side: usize) -> std::path::PathBuf {
    let mtl = "newmtl glass\nKd 0.6 0.8 1\nd 0.3\nnewmtl red\nKd 0.8 0.1 0.1\n";
    write(folder, "glass.mtl", mtl);
    let mut text = String::from("mtllib glass.mtl\n");
    let mut first = 1;
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        let height = 10 + (i * 7 + j * 3) % 9;
        for (material, half, top) in [("glass", 5.0, height), ("red", 4.0, height - 1)] {
            let _ = writeln!(text, "usemtl {material}");
            for z in [0, top] {
                for (x, y) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
                    let [x, y] = [i as f64 * 20.0 + x, j as f64 * 20.0 + y];
                    let _ = writeln!(text, "v {x} {y} {z}");
                }
            }
            let sides = ["3 2 1 0", "4 5 6 7", "0 1 5 4", "1 2 6 5", "2 3 7 6", "3 0 4 7"];
            for side in sides {
                let corners = side.split(' ').map(|at| at.parse::<usize>().unwrap() + first);
                let corners: Vec<String> = corners.map(|at| at.to_string()).collect();
                let _ = writeln!(text, "f {}", corners.join(" "));
            }
            first += 8;
        }
    }
    write(folder, "glass.obj", text)
}

#[test]
fn what_stands_behind_glass_is_not_left_out_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_boxes_in_glass(folder.path(), 20);
    let out = tempfile::tempdir().unwrap();
    let hierarchy = HierarchyOptions { desired_tris: 800, ..HierarchyOptions::default() };
    let options = BuildOptions { hierarchy, ..BuildOptions::default() };
    build(std::slice::from_ref(&input), out.path(), &options, &Silent).unwrap();
    hlod_build()
        .args(["verify", "--quiet", "--samples", "20000"])
        .args([out.path().to_str().unwrap(), "--source", input.to_str().unwrap()])
        .assert()
        .success();
}
