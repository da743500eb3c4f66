//! Trees of cards on coarse levels.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::mesh::AlphaMode;
use hlod::verify::{Silent, VerifyOptions, verify};

use crate::support::geometry::area;
use crate::support::inputs::write;
use crate::support::result::Built;
use crate::support::{Random, build_with};

/// A square of ground with `side` by `side` trees of two crossed cards, each 6 m wide and 9 m high.
fn write_forest(folder: &Path, side: usize) -> PathBuf {
    let mut random = Random::new(5, 0);
    let mut text = String::from("mtllib forest.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n");
    let size = side as f64 * 5.0;
    let _ = writeln!(
        text,
        "usemtl ground\nv 0 0 0\nv {size} 0 0\nv {size} {size} 0\nv 0 {size} 0\nf 1 2 3 4"
    );
    text.push_str("usemtl tree\n");
    for tree in 0..side * side {
        let [x, y] = [tree % side, tree / side].map(|n| n as f64 * 5.0 + random.between(1.0, 4.0));
        for [dx, dy] in [[3.0, 0.0], [0.0, 3.0]] {
            for (sign, z) in [(-1.0, 0), (1.0, 0), (1.0, 9), (-1.0, 9)] {
                let _ = writeln!(text, "v {:.3} {:.3} {z}", x + sign * dx, y + sign * dy);
            }
            text.push_str("f -4/1 -3/2 -2/3 -1/4\n");
        }
    }
    let materials = "newmtl ground\nKd 0.5 0.4 0.3\nnewmtl tree\nmap_Kd tree.png\nmap_d tree.png\n";
    write(folder, "forest.mtl", materials);
    let tree = image::RgbaImage::from_fn(32, 32, |x, y| {
        let is_leaf = (f64::from(x) - 15.5).hypot(f64::from(y) - 15.5) < 12.0;
        image::Rgba([30, 120, 30, if is_leaf { 255 } else { 0 }])
    });
    tree.save(folder.join("tree.png")).unwrap();
    write(folder, "forest.obj", text)
}

#[test]
fn trees_keep_their_area_on_all_levels() {
    let folder = tempfile::tempdir().unwrap();
    let input = write_forest(folder.path(), 40);
    let out = folder.path().join("out");
    let hierarchy = HierarchyOptions { desired_tris: 300, ..HierarchyOptions::default() };
    build_with(&[input], &out, &BuildOptions { hierarchy, ..BuildOptions::default() });
    let built = Built::read(&out);
    let cards = |node: usize| {
        let trees = built.meshes[node].primitives.iter();
        let trees = trees.filter(|p| matches!(p.surface.alpha, AlphaMode::Mask { .. }));
        let corners = |primitive: &hlod::format::Primitive| {
            let at = |&vertex: &u32| {
                glam::DVec3::from(primitive.positions[vertex as usize].map(f64::from))
            };
            let of_triangle = |t: &[u32]| -> [glam::DVec3; 3] { [at(&t[0]), at(&t[1]), at(&t[2])] };
            primitive.indices.chunks_exact(3).map(of_triangle).collect::<Vec<_>>()
        };
        trees.flat_map(corners).collect::<Vec<[glam::DVec3; 3]>>()
    };
    let source = 1600.0 * 2.0 * 54.0;
    let mut coarse = 0;
    for node in 0..built.meshes.len() {
        let of_leaves: f64 = built.leaves_below(node).into_iter().flat_map(cards).map(area).sum();
        let own: f64 = cards(node).into_iter().map(area).sum();
        assert!((own - of_leaves).abs() < 0.1 * of_leaves, "{node}: {own} of {of_leaves} m²");
        if !built.is_leaf(node) {
            coarse += 1;
            let highest = cards(node).into_iter().flatten().map(|p| p.z).fold(0.0, f64::max);
            let highest = highest + built.meshes[node].origin[2];
            assert!(highest < 9.01, "{node}: rows of trees, not higher ones: {highest} m");
        }
    }
    assert!(coarse > 4);
    let root = built.scene.roots().next().unwrap() as usize;
    let of_root: f64 = cards(root).into_iter().map(area).sum();
    assert!((of_root - source).abs() < 0.1 * source, "{of_root}");
    assert!(cards(root).len() < 400, "{}", cards(root).len());
    // By texels that are not see-through, too.
    let report = verify(&out, &[], &VerifyOptions::default(), &Silent).unwrap();
    assert!(report.passed, "{:?}", report.checks);
    for level in &report.levels {
        let kept = level.cut_outs_kept.unwrap();
        assert!((0.9..1.1).contains(&kept), "level {}: {kept}", level.level);
    }
}
