//! Detached houses, of which there are more than a coarse node has triangles.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::verify::{Silent, VerifyOptions, verify};

use crate::support::inputs::write;
use crate::support::result::Built;
use crate::support::{Random, build_with};

/// Writes `side` by `side` boxes about 10 m wide, 25 m apart, and nothing else.
fn write_suburb(folder: &Path, side: usize) -> PathBuf {
    let mut random = Random::new(3, 0);
    let mut text = String::from("mtllib suburb.mtl\n");
    for house in 0..side * side {
        let [x, y] =
            [house % side, house / side].map(|n| n as f64 * 25.0 + random.between(-4.0, 4.0));
        let [width, depth, height] =
            [[8.0, 13.0], [8.0, 13.0], [4.0, 9.0]].map(|[low, high]| random.between(low, high));
        let _ = writeln!(text, "usemtl m{}", house % 3);
        for z in [0.0, height] {
            for [i, j] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let _ = writeln!(text, "v {:.3} {:.3} {z:.3}", x + i * width, y + j * depth);
            }
        }
        text.push_str("f -8 -5 -6 -7\nf -4 -3 -2 -1\n");
        text.push_str("f -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n");
    }
    write(
        folder,
        "suburb.mtl",
        "newmtl m0\nKd 0.8 0.3 0.2\nnewmtl m1\nKd 0.7 0.6 0.5\nnewmtl m2\n",
    );
    write(folder, "suburb.obj", text)
}

#[test]
fn a_suburb_has_one_light_root() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_suburb(folder.path(), 40);
    let out = folder.path().join("out");
    let hierarchy = HierarchyOptions { desired_tris: 300, ..HierarchyOptions::default() };
    build_with(
        std::slice::from_ref(&input),
        &out,
        &BuildOptions { hierarchy, ..BuildOptions::default() },
    );
    let built = Built::read(&out);
    let roots: Vec<u32> = built.scene.roots().collect();
    let triangles: usize = roots
        .iter()
        .flat_map(|&root| &built.meshes[root as usize].primitives)
        .map(|primitive| primitive.indices.len() / 3)
        .sum();
    assert!(triangles < 700, "{} roots with {triangles} of 19200 triangles", roots.len());
    let report = verify(&out, &[input], &VerifyOptions::default(), &Silent).unwrap();
    assert!(report.passed, "{:?}", report.checks);
}
