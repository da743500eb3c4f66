//! Separate houses in one group, which planes would run through by the hundred.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use hlod::format::Scene;
use hlod::verify::{Silent, VerifyOptions, verify};
use tempfile::TempDir;

use crate::support::inputs::write;
use crate::support::result::Built;
use crate::support::{Random, run_build};

/// A town without groups: 1,500 closed shells with gables, of 16 triangles, at odd angles; each of
/// `halls` in a hundred of them fifteen times as large.
pub fn town(folder: &Path, halls: usize) {
    let mut random = Random::new(5, 0);
    let mut text = String::new();
    for house in 0..1500 {
        let size = if random.below(100) < halls { 15.0 } else { 1.0 };
        let (x, y) = (random.between(0.0, 1600.0), random.between(0.0, 700.0));
        let [width, depth] = [(6.0, 12.0), (8.0, 16.0)].map(|(a, b)| size * random.between(a, b));
        let height = random.between(3.0, 12.0);
        let (sine, cosine) = random.between(0.0, 3.0).sin_cos();
        let mut corner = |i: f64, j: f64, z: f64| {
            let (i, j) = ((i - 0.5) * width, (j - 0.5) * depth);
            let [x, y] = [x + cosine * i - sine * j, y + sine * i + cosine * j];
            writeln!(text, "v {x:.3} {y:.3} {z:.3}").unwrap();
        };
        for z in [0.0, height] {
            for (i, j) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                corner(i, j, z);
            }
        }
        corner(0.5, 0.0, height + 3.0);
        corner(0.5, 1.0, height + 3.0);
        let faces: [&[usize]; 7] = [
            &[1, 4, 3, 2],
            &[1, 2, 6, 9, 5],
            &[2, 3, 7, 6],
            &[3, 4, 8, 10, 7],
            &[4, 1, 5, 8],
            &[5, 9, 10, 8],
            &[9, 6, 7, 10],
        ];
        for face in faces {
            let corners = face.iter().map(|corner| (house * 10 + corner).to_string());
            writeln!(text, "f {}", corners.collect::<Vec<_>>().join(" ")).unwrap();
        }
    }
    write(folder, "town.obj", text);
}

/// Builds the town in a folder as one block.
fn build_as_one(folder: &Path) {
    let options = ["--quiet", "--desired-tris", "300", "--blocks", "grid:10000"];
    run_build(folder, &[&options[..], &["town.obj", "out"]].concat());
}

fn built(halls: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    town(folder.path(), halls);
    build_as_one(folder.path());
    folder
}

#[test]
fn small_houses_are_not_cut() {
    let folder = built(0);
    let scene = Scene::read(&folder.path().join("out")).unwrap();
    let leaves = || scene.nodes.iter().filter(|node| node.first_child.is_none());
    let triangles = leaves().map(|node| u64::from(node.triangles)).sum::<u64>();
    // Where houses crowd, one may be wider than half of what is cut: so in half of the towns tried.
    let added = triangles.checked_sub(1500 * 16).expect("all houses are there");
    assert!(added * 100 < 1500 * 16, "{added} triangles more");
    assert!(leaves().count() > 50);
}

#[test]
fn a_half_that_goes_leaves_the_other_half_closed() {
    // Halls are wider than half of what a node is cut into, and so are cut.
    let folder = built(15);
    let out = folder.path().join("out");
    let options = VerifyOptions { samples: Some(40_000), ..VerifyOptions::default() };
    let report = verify(&out, &[folder.path().join("town.obj")], &options, &Silent).unwrap();
    let failed: Vec<_> = report.checks.iter().filter(|check| !check.passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
    let open = report.gaps.iter().map(|gap| gap.open).fold(0.0, f64::max);
    let without_skirts = report.gaps.iter().map(|gap| gap.bare).fold(0.0, f64::max);
    assert!(open < 1e-3 && without_skirts > 1.0, "{open} {without_skirts}");
}

/// The same with red roofs and white walls, each of a plain material.
fn painted(folder: &Path) {
    town(folder, 5);
    let text = std::fs::read_to_string(folder.join("town.obj")).unwrap();
    let mut lines = vec!["mtllib town.mtl".to_owned()];
    let mut face = 0;
    for line in text.lines() {
        if line.starts_with('f') {
            let material = if face % 7 < 5 { "wall" } else { "roof" };
            lines.push(format!("usemtl {material}"));
            face += 1;
        }
        lines.push(line.to_owned());
    }
    write(folder, "town.obj", lines.join("\n"));
    write(folder, "town.mtl", "newmtl wall\nKd 0.9 0.9 0.9\nnewmtl roof\nKd 0.7 0.2 0.1\n");
}

#[test]
fn no_triangle_goes_from_one_material_to_another() {
    let folder = tempfile::tempdir().unwrap();
    painted(folder.path());
    build_as_one(folder.path());
    let built = Built::read(&folder.path().join("out"));
    let colors = |node: usize| -> BTreeSet<BTreeSet<[u16; 4]>> {
        let of_primitive = |primitive: &hlod::format::Primitive| {
            let corners = primitive.indices.as_chunks::<3>().0.iter();
            let look = |t: &[u32; 3]| t.iter().map(|&v| primitive.colors[v as usize]).collect();
            corners.map(look).collect::<Vec<BTreeSet<[u16; 4]>>>()
        };
        built.meshes[node].primitives.iter().flat_map(of_primitive).collect()
    };
    let leaf = (0..built.meshes.len()).find(|&node| built.is_leaf(node)).unwrap();
    let palette = colors(leaf);
    assert_eq!(palette.len(), 2, "{palette:?}");
    let coarse: Vec<usize> = (0..built.meshes.len()).filter(|&node| !built.is_leaf(node)).collect();
    // Those that would lose too many houses are left out.
    assert!(coarse.len() > 10);
    for node in coarse {
        let found = colors(node);
        assert!(found.is_subset(&palette), "node {node}: {found:?}");
        assert_eq!(found.len(), 2, "node {node} has roofs and walls");
    }
}

/// The same with a patch of one picture for each face.
fn textured(folder: &Path) {
    town(folder, 0);
    let text = std::fs::read_to_string(folder.join("town.obj")).unwrap();
    let mut lines = vec!["mtllib town.mtl".to_owned()];
    let mut face = 0;
    for line in text.lines() {
        let Some(corners) = line.strip_prefix("f ") else {
            lines.push(line.to_owned());
            continue;
        };
        let mut textured = "f".to_owned();
        for (number, corner) in corners.split(' ').enumerate() {
            let (column, row) = (face % 105, face / 105);
            let [u, v] = [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.5, 0.9], [0.1, 0.9]][number];
            let [u, v] = [(f64::from(column) + u) / 105.0, 1.0 - (f64::from(row) + v) / 105.0];
            lines.push(format!("vt {u:.5} {v:.5}"));
            write!(textured, " {corner}/-{}", corners.split(' ').count() - number).unwrap();
        }
        lines.push(textured);
        face += 1;
    }
    // All corners of a face come before it.
    lines.insert(1, "usemtl town".to_owned());
    write(folder, "town.obj", lines.join("\n"));
    write(folder, "town.mtl", "newmtl town\nmap_Kd town.png\n");
    let color = |x, y| image::Rgb([(x / 8 * 2) as u8, (y / 8 * 2) as u8, 90]);
    image::RgbImage::from_fn(840, 840, color).save(folder.join("town.png")).unwrap();
}

/// However many houses a block has: none is cut, and its nodes keep what they should of them.
#[test]
fn blocks_of_many_houses_are_true_to_them() {
    for write_town in [|folder: &Path| town(folder, 0), textured] {
        let folder = tempfile::tempdir().unwrap();
        write_town(folder.path());
        let options = ["--quiet", "--desired-tris", "300", "--blocks", "grid:200"];
        let options = [&options[..], &["--upper-levels", "off"]].concat();
        run_build(folder.path(), &[&options[..], &["town.obj", "out"]].concat());
        let out = folder.path().join("out");
        let built = Built::read(&out);
        assert!(built.scene.blocks.len() > 3);
        let leaves = built.scene.nodes.iter().filter(|node| node.first_child.is_none());
        let triangles: u32 = leaves.map(|node| node.triangles).sum();
        assert_eq!(triangles, 1500 * 16, "none is cut");
        let options = VerifyOptions { samples: Some(20_000), ..VerifyOptions::default() };
        let report = verify(&out, &[folder.path().join("town.obj")], &options, &Silent).unwrap();
        let failed: Vec<_> = report.checks.iter().filter(|check| !check.passed).collect();
        assert!(failed.is_empty(), "{failed:?}");
        let kept = &report.levels[0].kept;
        assert!(kept.area.unwrap() > 0.9 && kept.skyline.unwrap() > 0.9, "{kept:?}");
    }
}
