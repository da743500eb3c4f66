//! Tiles that touch without sharing vertices are one surface on coarse levels.

use std::fmt::Write;
use std::path::Path;

use glam::{DVec2, DVec3};
use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::random::Random;

use crate::support::build_with;
use crate::support::inputs::write;
use crate::support::result::{Built, report};

/// Side of a tile, metres.
const SIDE: f64 = 10.0;

/// By how much tiles reach beyond their squares, metres.
const OVERLAP: f64 = 0.03;

/// Where a place of a plan of straight tiles comes to lie: borders are curves, whose chords are off.
fn bent(at: DVec2) -> DVec2 {
    at + 0.4 * DVec2::new((2.0 * at.y).sin(), (1.9 * at.x).sin())
}

/// Two by two tiles of a rolling ground, each of squares of its own size and with noise of its own.
fn tiles() -> String {
    let mut text = String::new();
    let mut random = Random::new(7, 0);
    let mut first = 1;
    for (tile, squares) in [48usize, 40, 44, 52].into_iter().enumerate() {
        let corner = DVec2::new((tile % 2) as f64, (tile / 2) as f64) * SIDE - OVERLAP;
        let side = SIDE + 2.0 * OVERLAP;
        let _ = writeln!(text, "g tile{tile}");
        for y in 0..=squares {
            for x in 0..=squares {
                let at = corner + DVec2::new(x as f64, y as f64) * (side / squares as f64);
                let at = bent(at);
                let z = (0.7 * at.x).sin() + (0.5 * at.y).cos() + random.between(-0.01, 0.01);
                let _ = writeln!(text, "v {} {} {z}", at.x, at.y);
            }
        }
        let at = |x: usize, y: usize| first + y * (squares + 1) + x;
        for (x, y) in (0..squares).flat_map(|y| (0..squares).map(move |x| (x, y))) {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            let _ = writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}");
        }
        first += (squares + 1).pow(2);
    }
    text
}

/// Of points on and beside the lines where tiles touch, how many have nothing below or above them,
/// at each level but the leaves'.
fn uncovered(out: &Path) -> Vec<usize> {
    let built = Built::read(out);
    let levels = built.scene.nodes.iter().map(|node| node.level).max().unwrap();
    let mut random = Random::new(11, 0);
    let mut place = || {
        let along = random.between(1.0, 2.0 * SIDE - 1.0);
        let across = SIDE + random.between(-0.3, 0.3);
        bent(match random.unit() < 0.5 {
            true => DVec2::new(along, across),
            false => DVec2::new(across, along),
        })
    };
    let places: Vec<DVec2> = (0..2000).map(|_| place()).collect();
    let of_level = |level: u32| {
        let front = (0..built.meshes.len()).filter(|&node| {
            let at = built.scene.nodes[node].level;
            at == level || (at < level && built.is_leaf(node))
        });
        let triangles: Vec<[DVec3; 3]> = front.flat_map(|node| built.triangles(node)).collect();
        places.iter().filter(|&&place| !triangles.iter().any(|t| is_over(t, place))).count()
    };
    (0..levels).map(of_level).collect()
}

/// Whether a vertical line through a place meets a triangle.
fn is_over(triangle: &[DVec3; 3], place: DVec2) -> bool {
    let [a, b, c] = triangle.map(|corner| corner.truncate() - place);
    let sides = [a.perp_dot(b), b.perp_dot(c), c.perp_dot(a)];
    sides.iter().all(|side| *side >= -1e-12) || sides.iter().all(|side| *side <= 1e-12)
}

#[test]
fn nothing_is_seen_between_tiles_that_overlap() {
    let folder = tempfile::tempdir().unwrap();
    let input = write(folder.path(), "tiles.obj", tiles());
    let built = |name: &str, resolution: f64| {
        let mut hierarchy = HierarchyOptions { desired_tris: 60, ..HierarchyOptions::default() };
        hierarchy.constants.stitch.resolution = resolution;
        let out = folder.path().join(name);
        build_with(
            std::slice::from_ref(&input),
            &out,
            &BuildOptions { hierarchy, ..BuildOptions::default() },
        );
        out
    };
    let apart = uncovered(&built("apart", 0.0));
    assert!(apart.len() > 1 && apart[0] > 20, "{apart:?}: there is something to be closed");
    let joined = built("joined", HierarchyOptions::default().constants.stitch.resolution);
    let open = uncovered(&joined);
    assert!(open.iter().all(|open| *open == 0), "{open:?}, {apart:?} apart");
    // Two of the four sides of each tile, but for the corner of all four.
    let report = report(&joined);
    let blocks = report["blocks"].as_array().unwrap().iter();
    let edges: u64 = blocks.map(|block| block["stitched_edges"].as_u64().unwrap()).sum();
    assert!((350..=2 * (48 + 40 + 44 + 52)).contains(&edges), "{edges}");
}
