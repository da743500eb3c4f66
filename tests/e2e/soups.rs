//! Random small meshes with every defect, at every place, with every option: no panic, nothing
//! lost, and every node within its budget or excused.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions};
use hlod::builder::partition::BlockSplit;
use hlod::builder::progress::Silent;
use hlod::builder::simplify::ladder::Simplifier;
use hlod::builder::{BuildOptions, build};

use crate::support::Random;
use crate::support::geometry::{Triangle, area};
use crate::support::inputs::write;
use crate::support::result::{Built, report};

const SOUPS: u64 = 200;

/// Where surveyors' coordinates lie: the origin, UTM, the earth's centre, and beyond.
const PLACES: [[f64; 3]; 5] = [
    [0.0; 3],
    [678_016.123_4, 5_403_456.567_8, 412.3],
    [4_075_539.9, 931_735.3, 4_801_629.4],
    [-2.7e6, 1.2e6, -5.5e6],
    [1e8, -1e8, 1e8],
];

/// One soup: corners as text has them, by group.
struct Soup {
    groups: Vec<Vec<[[f64; 3]; 3]>>,
}

impl Soup {
    fn new(random: &mut Random) -> Self {
        let place = random.pick(&PLACES);
        let extent = random.pick(&[0.5, 20.0, 300.0]);
        let groups = 1 + random.below(4);
        let each = 3 + random.below(30);
        let point = |random: &mut Random, size: f64| -> [f64; 3] {
            std::array::from_fn(|axis| place[axis] + random.between(0.0, size))
        };
        let groups = (0..groups)
            .map(|_| {
                let mut triangles: Vec<[[f64; 3]; 3]> = Vec::new();
                // Some groups are flat, or a line.
                let flat = random.below(8);
                for _ in 0..each {
                    let corners: [[f64; 3]; 3] = std::array::from_fn(|_| point(random, extent));
                    let [a, b, c] = corners;
                    let last = triangles.last().copied().unwrap_or(corners);
                    let along = |t: f64| -> [f64; 3] {
                        std::array::from_fn(|axis| a[axis] + t * (b[axis] - a[axis]))
                    };
                    let mut triangle = match random.below(14) {
                        0 => [a, b, a],
                        1 => [a, a, a],
                        2 => last,
                        3 => [last[1], last[2], last[0]],
                        4 => [last[0], last[2], last[1]],
                        // Collinear, and all but.
                        5 => [a, b, along(0.3)],
                        6 => [a, b, along(0.5).map(|x| x + extent * 1e-7)],
                        // A needle, and a speck.
                        7 => [a, b, b.map(|x| x + extent * 1e-5)],
                        8 => [a, a.map(|x| x + extent * 1e-6), c.map(|x| x.min(1e300))],
                        // Joined to the one before.
                        9..12 => [last[2], last[1], a],
                        _ => corners,
                    };
                    for corner in &mut triangle {
                        match flat {
                            0 => corner[2] = place[2],
                            1 => corner[1..].copy_from_slice(&place[1..]),
                            _ => {}
                        }
                    }
                    triangles.push(triangle);
                }
                triangles
            })
            .collect();
        Self { groups }
    }

    fn obj(&self, random: &mut Random) -> String {
        let (textured, colored) = (random.below(3) == 0, random.below(3) == 0);
        let mut text = String::from("mtllib soup.mtl\n");
        let mut vertex = 1;
        for (number, group) in self.groups.iter().enumerate() {
            let material = if textured && number % 2 == 0 { "brick" } else { "plain" };
            let _ = writeln!(text, "g group {number}\nusemtl {material}");
            for [x, y, z] in group.as_flattened() {
                let _ = write!(text, "v {x} {y} {z}");
                if colored {
                    let _ = write!(text, " {} {} 0.5", random.unit(), random.unit());
                }
                let uv: [f64; 2] = std::array::from_fn(|_| match random.below(20) {
                    0 => 1e6,
                    1 => -17.25,
                    _ => random.unit(),
                });
                let _ = writeln!(text, "\nvt {} {}", uv[0], uv[1]);
            }
            for _ in group {
                let [a, b, c] = [vertex, vertex + 1, vertex + 2];
                let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}");
                vertex += 3;
            }
        }
        text
    }

    /// Triangles that are a surface, each once for each group: the same corners in the same
    /// winding, whichever comes first, are one.
    fn surface(&self) -> Vec<Triangle> {
        let mut found = Vec::new();
        for group in &self.groups {
            let mut known = BTreeSet::new();
            for &[a, b, c] in group {
                let first = [[a, b, c], [b, c, a], [c, a, b]]
                    .map(|turned| turned.map(|corner| corner.map(f64::to_bits)))
                    .into_iter()
                    .min();
                if a != b && b != c && c != a && known.insert(first) {
                    found.push([a, b, c].map(DVec3::from));
                }
            }
        }
        found
    }
}

fn random_options(random: &mut Random) -> BuildOptions {
    BuildOptions {
        hierarchy: HierarchyOptions {
            desired_tris: random.pick(&[1, 4, 10, 10, 40, 40, 900]),
            level_factor: random.pick(&[2, 3, 4, 7, 64]),
            simplifier: random.pick(&[Simplifier::Qem, Simplifier::Clustering]),
            borders: random.pick(&[BorderMode::Locked, BorderMode::Skirts]),
            ..HierarchyOptions::default()
        },
        blocks: random.pick(&[
            BlockSplit::Auto,
            BlockSplit::Auto,
            BlockSplit::Auto,
            BlockSplit::Grid(25.0),
            BlockSplit::Grid(1000.0),
        ]),
        max_atlas: random.pick(&[16, 64, 4096]),
        jpeg_quality: random.pick(&[1, 85, 100]),
        ..BuildOptions::default()
    }
}

fn write_materials(folder: &Path) {
    write(folder, "soup.mtl", "newmtl plain\nKd 0.2 0.4 0.8\nnewmtl brick\nmap_Kd brick.png\n");
    let brick = image::RgbImage::from_fn(24, 16, |x, y| image::Rgb([(x * 9) as u8, y as u8, 9]));
    brick.save(folder.join("brick.png")).unwrap();
}

#[test]
fn no_soup_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    write_materials(folder.path());
    let mut tally = Tally::default();
    let mut failures = Vec::new();
    for seed in 0..SOUPS {
        // All failures are told, not the first alone.
        let out = folder.path().join(format!("out{seed}"));
        let once = || check_soup(seed, folder.path(), &out, &mut tally);
        if std::panic::catch_unwind(std::panic::AssertUnwindSafe(once)).is_err() {
            failures.push(seed);
        }
    }
    println!("{tally:?}");
    assert!(failures.is_empty(), "soups {failures:?}");
    assert!(tally.built > SOUPS * 9 / 10);
}

/// What was seen.
#[derive(Debug, Default)]
struct Tally {
    built: u64,
    nodes: usize,
    /// Reasons for more triangles than the budget, numbers left out.
    over_budget: BTreeMap<String, usize>,
}

fn check_soup(seed: u64, folder: &Path, out: &Path, tally: &mut Tally) {
    let mut random = Random::new(seed, 0);
    let soup = Soup::new(&mut random);
    let input = write(folder, "soup.obj", soup.obj(&mut random));
    let options = random_options(&mut random);
    let surface = soup.surface();
    let what = format!("soup {seed}, {:?}, {:?}", options.hierarchy, options.blocks);
    let source_area: f64 = surface.iter().copied().map(area).sum();
    if let Err(error) = build(&[input], out, &options, &Silent) {
        assert_eq!(error.exit_code(), 3, "{what}: {error}");
        assert!(surface.is_empty() || source_area < 1e-9, "{what}: {error}");
        return;
    }
    let built = Built::read(out);
    assert_eq!(built.scene.check(), [], "{what}");
    tally.built += 1;
    tally.nodes += built.scene.nodes.len();
    check_area(&what, &built, &surface, source_area);
    check_budgets(&what, &built, out, &options, &mut tally.over_budget);
}

/// Corners move by half a step of the lattice along each axis at most, and the area with them.
fn check_area(what: &str, built: &Built, surface: &[Triangle], source_area: f64) {
    let corners = || surface.iter().flatten();
    let low = corners().fold(DVec3::INFINITY, |low, &p| low.min(p));
    let high = corners().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
    let extent = (high - low).max_element();
    let magnitude = low.abs().max(high.abs()).max_element();
    let step = (extent * 2f64.powi(-22)).max(magnitude * 2f64.powi(-51));
    let perimeter: f64 =
        surface.iter().map(|[a, b, c]| a.distance(*b) + b.distance(*c) + c.distance(*a)).sum();
    let slack = perimeter * step + source_area * 1e-6;
    let leaves = built.leaf_area();
    assert!(
        (leaves - source_area).abs() <= slack,
        "{what}: the leaves have {leaves} m², the source {source_area} m², allowed {slack}"
    );
}

/// No coarse node without a reason has more triangles than its tree's law allows.
fn check_budgets(
    what: &str,
    built: &Built,
    out: &Path,
    options: &BuildOptions,
    excused: &mut BTreeMap<String, usize>,
) {
    let report = report(out);
    let over = report["over_budget"].as_array().unwrap();
    for entry in over {
        let reason = entry["reason"].as_str().unwrap();
        let kind: String = reason.chars().filter(|c| !c.is_ascii_digit()).collect();
        assert!(!kind.trim().is_empty(), "{what}");
        *excused.entry(kind).or_insert(0) += 1;
    }
    for root in built.scene.roots() {
        let block = built.scene.nodes[root as usize].block;
        let is_of_block = |&other: &u32| built.scene.nodes[other as usize].block == block;
        let has_root = built.scene.roots().filter(is_of_block).count() == 1;
        let mut open = vec![root as usize];
        while let Some(index) = open.pop() {
            open.extend(built.scene.children(index as u32).map(|child| child as usize));
            let node = &built.scene.nodes[index];
            if built.is_leaf(index) || over.iter().any(|entry| entry["id"] == node.id.to_string()) {
                continue;
            }
            let below: u64 = built
                .leaves_below(index)
                .iter()
                .map(|&leaf| u64::from(built.scene.nodes[leaf].triangles))
                .sum();
            // A block's root has the triangles that are desired. Below it a step of simplification divides
            // by the root of the level factor at least, which is what rounding the number of steps
            // leaves of it.
            let hierarchy = &options.hierarchy;
            let budget = match has_root && index == root as usize {
                true => f64::from(hierarchy.desired_tris),
                false => below as f64 / f64::from(hierarchy.level_factor).sqrt(),
            };
            let most = budget.max(8.0);
            assert!(
                f64::from(node.triangles) <= (most * 1.1).ceil() + 1.0,
                "{what}: {} has {} triangles, at most {most} are in its budget, and no reason",
                node.file,
                node.triangles
            );
        }
    }
}
