//! Sources whose texture is in more charts than coarse nodes have triangles for.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::threads::with_threads;

use crate::support::result::{difference, lasting};
use crate::support::{build_with, hlod_build};

/// Squares along a side of the ground.
const SQUARES: usize = 64;

/// Hills of 64 by 64 squares, each a chart of its own somewhere in the picture.
fn write_torn_hills(folder: &Path) -> PathBuf {
    let mut obj = String::from("mtllib hills.mtl\nusemtl ground\n");
    let height = |x: usize, y: usize| ((x * 7 + y * 3) % 11) as f64 * 0.05 + (x as f64 * 0.2).sin();
    for (y, x) in (0..=SQUARES).flat_map(|y| (0..=SQUARES).map(move |x| (y, x))) {
        writeln!(obj, "v {x} {y} {:.4}", height(x, y)).unwrap();
    }
    for square in 0..SQUARES * SQUARES {
        let place = square * 1231 % (SQUARES * SQUARES);
        let [column, row] = [place % SQUARES, place / SQUARES].map(|at| at as f64);
        for [u, v] in [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]] {
            let [u, v] = [column + u, row + v].map(|at| at / SQUARES as f64);
            writeln!(obj, "vt {u:.6} {:.6}", 1.0 - v).unwrap();
        }
        let first = square / SQUARES * (SQUARES + 1) + square % SQUARES + 1;
        let corners = [first, first + 1, first + SQUARES + 2, first + SQUARES + 1];
        write!(obj, "f").unwrap();
        for (corner, vertex) in corners.iter().enumerate() {
            write!(obj, " {vertex}/{}", square * 4 + corner + 1).unwrap();
        }
        obj.push('\n');
    }
    let side = (SQUARES * 8) as u32;
    let picture = image::RgbImage::from_fn(side, side, |x, y| {
        image::Rgb([(x / 8 * 3) as u8, (y / 8 * 3) as u8, 90])
    });
    picture.save(folder.join("hills.png")).unwrap();
    fs::write(folder.join("hills.mtl"), "newmtl ground\nmap_Kd hills.png\n").unwrap();
    let path = folder.join("hills.obj");
    fs::write(&path, obj).unwrap();
    path
}

fn built(folder: &Path, input: &Path, threads: usize) -> (PathBuf, serde_json::Value) {
    let hierarchy = HierarchyOptions { desired_tris: 300, ..HierarchyOptions::default() };
    let options = BuildOptions { hierarchy, ..BuildOptions::default() };
    let out = folder.join(format!("out-{threads}"));
    with_threads(threads, || build_with(&[input.into()], &out, &options)).unwrap();
    let report = serde_json::from_slice(&fs::read(out.join("build.json")).unwrap()).unwrap();
    (out, report)
}

#[test]
fn nodes_of_a_torn_texture_reach_their_budget_with_few_texels_and_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_torn_hills(folder.path());
    let (out, report) = built(folder.path(), &input, 2);
    let (leaves, coarse) = report["levels"].as_array().unwrap().split_last().unwrap();
    let sum = |name: &str| coarse.iter().map(|level| level[name].as_u64().unwrap()).sum::<u64>();
    let baked = report["baked"].as_array().unwrap();
    assert_eq!(baked.len() as u64, sum("nodes"), "all but the leaves");
    assert!(baked.iter().all(|node| node["reason"] == "torn"));
    assert_eq!(report["over_budget"].as_array().unwrap().len(), 0);
    let texels = leaves["texels"].as_u64().unwrap();
    assert!(sum("texels") < texels / 2, "{} of {texels}", sum("texels"));

    let source = input.to_str().unwrap();
    hlod_build()
        .args(["verify", "--quiet", "--samples", "20000"])
        .args([out.to_str().unwrap(), "--source", source])
        .assert()
        .success();
}

#[test]
fn baked_textures_are_the_same_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_torn_hills(folder.path());
    let results = [1, 4].map(|threads| lasting(&built(folder.path(), &input, threads).0));
    assert_eq!(difference(&results[0], &results[1]), None);
}
