//! Stored errors are upper bounds of what is measured, in small meshes of many kinds.

use std::fmt::Write;
use std::path::Path;

use glam::{DMat3, DVec3};
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::progress::Silent as BuildSilent;
use hlod::builder::{BuildOptions, build};
use hlod::verify::{Silent, VerifyOptions, verify};
use rayon::prelude::*;

use crate::support::Random;
use crate::support::geometry::{Triangle, nearest};
use crate::support::inputs::write;
use crate::support::result::Built;

/// Meshes; fewer where the program is slow.
const SEEDS: u64 = if cfg!(debug_assertions) { 20 } else { 100 };

/// Every so many seeds the distances are also found by trying all pairs of points and triangles.
const NAIVE: u64 = 5;

/// Distances below this share of the extent count as none where no cut made a vertex: a tenth of the
/// rounding of f32.
const NONE: f64 = 2e-8;

/// The same beside cuts. A stored error bounds the distance to the source, and is compared with the
/// leaves here. A cut rounds the vertices that it makes by up to half a step of f32 along each axis, so
/// leaves are off the source by up to √3/2 of a step.
const CUT_ROUNDING: f64 = 1.0 / (1 << 23) as f64;

/// A mesh of quads, to be written as OBJ.
#[derive(Default)]
struct Quads {
    positions: Vec<DVec3>,
    quads: Vec<[usize; 4]>,
}

impl Quads {
    /// A grid of `m` by `n` quads.
    fn grid(&mut self, m: usize, n: usize, mut place: impl FnMut(f64, f64) -> DVec3) {
        let first = self.positions.len();
        for i in 0..=m {
            for j in 0..=n {
                self.positions.push(place(i as f64 / m as f64, j as f64 / n as f64));
            }
        }
        for i in 0..m {
            for j in 0..n {
                let at = |i: usize, j: usize| first + i * (n + 1) + j;
                self.quads.push([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }

    /// The six sides of a box, each a grid.
    fn block(&mut self, low: DVec3, size: DVec3, sides: usize) {
        for axis in 0..3 {
            let [along, across] = [(axis + 1) % 3, (axis + 2) % 3];
            for end in [0.0, 1.0] {
                self.grid(sides, sides, |u, v| {
                    let (u, v) = if end > 0.5 { (u, v) } else { (v, u) };
                    let mut at = DVec3::ZERO;
                    (at[axis], at[along], at[across]) = (end, u, v);
                    low + at * size
                });
            }
        }
    }

    /// A mesh of a few hundred triangles: a box, bumps, terraces, a strip or several bodies.
    fn random(random: &mut Random, kind: u64) -> Self {
        let mut mesh = Self::default();
        match kind {
            0 => {
                let size = DVec3::from([(); 3].map(|()| random.between(2.0, 60.0)));
                mesh.block(DVec3::ZERO, size, 6);
            }
            1 => {
                let bump = random.pick(&[1e-6, 1e-4, 0.01, 1.0]);
                mesh.grid(15, 15, |u, v| DVec3::new(u * 30.0, v * 30.0, random.unit() * bump));
            }
            2 => {
                let height = random.between(0.1, 3.0);
                let steps = random.between(2.0, 5.0).floor();
                mesh.grid(18, 12, |u, v| {
                    DVec3::new(u * 40.0, v * 20.0, (u * steps).floor() * height)
                });
            }
            3 => {
                let (width, bend) = (random.between(0.05, 0.5), random.between(0.0, 0.2));
                mesh.grid(120, 1, |u, v| {
                    DVec3::new(u * 90.0, v * width + (u * 9.0).sin() * bend, (u * 5.0).cos() * bend)
                });
            }
            _ => {
                for _ in 0..4 {
                    let low = DVec3::from([(); 3].map(|()| random.between(0.0, 30.0)));
                    let size = DVec3::from([(); 3].map(|()| random.between(1.0, 12.0)));
                    mesh.block(low, size, 3);
                }
            }
        }
        if random.below(2) == 0 {
            let turn = DMat3::from_rotation_z(random.between(0.0, 6.0))
                * DMat3::from_rotation_x(random.between(-0.5, 0.5));
            mesh.positions.iter_mut().for_each(|at| *at = turn * *at);
        }
        if random.below(4) == 0 {
            let far = DVec3::new(678_016.0, 5_403_456.0, 300.0);
            mesh.positions.iter_mut().for_each(|at| *at += far);
        }
        mesh
    }

    fn obj(&self) -> String {
        let mut text = String::new();
        for DVec3 { x, y, z } in &self.positions {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for [a, b, c, d] in &self.quads {
            let _ = writeln!(text, "f {} {} {} {}", a + 1, b + 1, c + 1, d + 1);
        }
        text
    }
}

/// Whether a skirt lies in a plane across an axis; others count as surface.
fn lies_in_plane([a, b, c]: Triangle) -> bool {
    let normal = (b - a).cross(c - a);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let spread = a.max(b).max(c) - a.min(b).min(c);
    (0..3)
        .any(|axis| normal[axis].abs() >= 0.99 * normal.length() && spread[axis] <= 0.01 * longest)
}

/// The triangles of some nodes in source coordinates, without skirts in cutting planes.
fn triangles(built: &Built, nodes: &[usize]) -> Vec<Triangle> {
    let meshes = nodes.iter().map(|&node| &built.meshes[node]);
    let of_mesh = meshes.flat_map(|mesh| {
        let origin = DVec3::from(mesh.origin);
        mesh.primitives.iter().flat_map(move |primitive| {
            let corners = primitive.indices.as_chunks::<3>().0;
            let surface = corners.len() - primitive.skirt_triangles;
            let corner = move |vertex: u32| {
                origin + DVec3::from(primitive.positions[vertex as usize].map(f64::from))
            };
            let triangles = corners.iter().map(move |triangle| triangle.map(corner)).enumerate();
            let is_surface = move |&(number, triangle): &(usize, Triangle)| {
                number < surface || !lies_in_plane(triangle)
            };
            triangles.filter(is_surface).map(|(_, triangle)| triangle)
        })
    });
    of_mesh.collect()
}

/// The largest distance from corners, edges' middles and centroids to other triangles.
fn farthest(from: &[Triangle], to: &[Triangle]) -> f64 {
    let distance = |point: DVec3| {
        let of = |&[a, b, c]: &Triangle| {
            let [_, y, z] = nearest(point - a, [DVec3::ZERO, b - a, c - a]);
            (point - a).distance((b - a) * y + (c - a) * z)
        };
        to.iter().map(of).fold(f64::INFINITY, f64::min)
    };
    let points = from.iter().flat_map(|&[a, b, c]| {
        [a, b, c, a.midpoint(b), b.midpoint(c), c.midpoint(a), (a + b + c) / 3.0]
    });
    points.map(distance).fold(0.0, f64::max)
}

/// Stored and measured errors of all coarse nodes of one build.
fn errors(out: &Path, seed: u64, rounding: f64, case: &str) -> Vec<[f64; 2]> {
    let options = VerifyOptions { samples: Some(1000), worst: usize::MAX, ..Default::default() };
    let report = verify(out, &[], &options, &Silent).unwrap();
    let mut ratios = Vec::new();
    let extent = report.scene.as_ref().unwrap().diagonal;
    for node in &report.worst_nodes {
        let (stored, measured) = (node.geometric_error, node.measured);
        assert!(
            stored + rounding * extent >= measured,
            "{case}: {} stores {stored:e} m, measured {measured:e} m at {:?}",
            node.file,
            node.farthest
        );
        ratios.push([stored, measured.max(1e-6 * extent)]);
    }
    if seed.is_multiple_of(NAIVE) {
        let built = Built::read(out);
        for (number, node) in built.scene.nodes.iter().enumerate() {
            if built.is_leaf(number) {
                continue;
            }
            let simplified = triangles(&built, &[number]);
            let original = triangles(&built, &built.leaves_below(number));
            let both = farthest(&simplified, &original).max(farthest(&original, &simplified));
            assert!(
                node.geometric_error + rounding * extent >= both,
                "{case}: {} stores {:e} m, a point is {both:e} m away",
                node.file,
                node.geometric_error
            );
        }
    }
    ratios
}

#[test]
fn stored_errors_are_bounds_in_meshes_of_every_kind() {
    let of_seed = |seed: u64| {
        let mut random = Random::new(seed, 0);
        let mesh = Quads::random(&mut random, seed % 5);
        let folder = tempfile::tempdir().unwrap();
        let input = write(folder.path(), "mesh.obj", mesh.obj());
        let mut all = Vec::new();
        for desired_tris in [20, 90] {
            let hierarchy = HierarchyOptions { desired_tris, ..HierarchyOptions::default() };
            let options = BuildOptions { hierarchy, ..BuildOptions::default() };
            let out = folder.path().join(format!("out{desired_tris}"));
            build(std::slice::from_ref(&input), &out, &options, &BuildSilent).unwrap();
            let case = format!("seed {seed}, {desired_tris} triangles");
            all.extend(errors(&out, seed, CUT_ROUNDING, &case));
        }
        all
    };
    let all: Vec<[f64; 2]> = (0..SEEDS).into_par_iter().flat_map_iter(of_seed).collect();
    assert!(all.len() as u64 > 2 * SEEDS, "{} nodes", all.len());
    let mut ratios: Vec<f64> = all
        .iter()
        .map(|&[stored, measured]| stored.max(measured) / measured)
        .filter(|ratio| ratio.is_finite())
        .collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    println!("{} nodes, median of stored / measured {median:.3}", ratios.len());
    assert!(median < 1.3, "{median}");
}

/// A box of sides that are flat, each of many quads.
#[test]
fn the_error_of_a_flat_box_holds() {
    let mut mesh = Quads::default();
    mesh.block(DVec3::ZERO, DVec3::new(40.0, 40.0, 60.0), 24);
    let folder = tempfile::tempdir().unwrap();
    let input = write(folder.path(), "box.obj", mesh.obj());
    let hierarchy = HierarchyOptions { desired_tris: 700, ..HierarchyOptions::default() };
    let options = BuildOptions { hierarchy, ..BuildOptions::default() };
    let out = folder.path().join("out");
    build(std::slice::from_ref(&input), &out, &options, &BuildSilent).unwrap();
    assert!(!errors(&out, 0, NONE, "flat box").is_empty());
    let options = VerifyOptions { samples: Some(1000), ..Default::default() };
    let report = verify(&out, &[input], &options, &Silent).unwrap();
    assert!(report.passed, "{}", hlod::verify::text(&report));
}
