//! Blocks of odd sizes and shapes, and trees of odd depths.

use glam::DVec3;
use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::{HierarchyOptions, TreeShape};

use crate::chain::{Chain, options};
use crate::figures::Figures;
use crate::shape::{Shape, hill};
use crate::table::{Bounds, Table, Twin};

fn chain(shape: &Shape, options: &BuildOptions) -> Chain {
    let folder = crate::chain::inputs();
    Chain::new(&shape.write(&folder), options).unwrap()
}

fn tree(desired_tris: u32, level_factor: u32) -> BuildOptions {
    let hierarchy = HierarchyOptions { desired_tris, level_factor, ..HierarchyOptions::default() };
    BuildOptions { hierarchy, ..options() }
}

/// 2,000 quads of 0.5 m in one row over hills, 1 km long, or in ten rows of 100 m beside each other
/// that do not touch.
fn row(pieces: usize) -> Shape {
    let mut shape = Shape::default();
    let quads = 2000 / pieces;
    for piece in 0..pieces {
        let first = shape.positions.len();
        for at in 0..=quads {
            let x = (piece * quads + at) as f64 * 0.5;
            for y in [0.0, 0.5] {
                let beside =
                    DVec3::new(-(piece as f64) * quads as f64 * 0.5, piece as f64 * 4.0, 0.0);
                shape.positions.push(DVec3::new(x, y, hill(x, y)) + beside);
            }
        }
        for at in 0..quads {
            let [a, b, c, d] = [0, 2, 3, 1].map(|corner| first + 2 * at + corner);
            shape.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    shape
}

#[test]
fn blocks_of_any_size_and_shape() {
    let mut table = Table::new("7-blocks", "Blocks and trees of odd sizes");
    let default = tree(900, 4);
    let mut check =
        |name: &str, case: &Chain, of: &Chain, twin: &str, bounds: Bounds, why: &str| {
            table.verified(name, case.failures());
            let path = of.path();
            let twin = Twin::one(twin, of.figures(&path, 1.0));
            table.within(name, &case.figures(&path, 1.0), &twin, bounds, why);
        };
    let mut single = Shape::default();
    single.triangle([DVec3::ZERO, DVec3::X, DVec3::Y]);
    let mut pair = single.clone();
    pair.triangle([DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]);
    let half: Bounds = &[("leaf ", 0.5), ("triangles", 0.5)];
    let [single, pair] = [single, pair].map(|shape| chain(&shape, &default));
    check("a single triangle", &single, &pair, "two triangles", half, "half as many");

    // One triangle over the budget gives a tree; one fewer none.
    let square = |more: usize| {
        let lines = |n: usize| (0..=n).map(|i| i as f64).collect::<Vec<_>>();
        let mut shape = Shape::hills_at(&lines(25), &lines(18));
        for n in 0..more {
            let at = |x: f64, y: f64| DVec3::new(x, y + n as f64, hill(x, y + n as f64));
            shape.triangle([at(25.0, 0.0), at(26.0, 0.0), at(25.0, 1.0)]);
        }
        // A balanced tree would make a leaf of twice as many.
        let hierarchy = HierarchyOptions { tree: TreeShape::Thesis, ..default.hierarchy.clone() };
        chain(&shape, &BuildOptions { hierarchy, ..default.clone() })
    };
    assert_eq!(square(0).built.scene.nodes.len(), 1, "900 triangles are one node");
    let [one, two] = [square(1), square(2)];
    assert_eq!(one.built.scene.level_count(), 2);
    // Leaves are cut elsewhere, and what halving the colours of a JPEG leaves depends on where its
    // pictures begin: 1.48 and 1.41 of 255.
    let few: Bounds = &[("RMS", 0.5), ("stored", 0.5), ("leaf colour", 0.02)];
    check("901 triangles", &one, &two, "902 triangles", few, "one edge collapses, or two");

    // An outline is judged by cells as large as its node: that of the chunks, by smaller ones.
    let mut own_budgets = options();
    own_budgets.hierarchy.constants.outline.least_kept = 0.0;
    let [long, apart] = [1, 10].map(|pieces| chain(&row(pieces), &own_budgets));
    let why = "cuts across, not along; seen from far less at a time";
    let bounds: Bounds = &[
        ("leaf triangles", 0.1),
        ("triangles, level", 0.1),
        ("RMS", 0.5),
        ("stored", 1.0),
        ("toggles", f64::INFINITY),
        ("triangles drawn", f64::INFINITY),
        ("nodes", f64::INFINITY),
        ("frame", f64::INFINITY),
        ("expected", f64::INFINITY),
    ];
    check("one triangle wide, 1 km long", &long, &apart, "in ten chunks side by side", bounds, why);
    table.finish();
}

/// Trees of any depth hold to their budgets, and the error falls by what the budget grows.
#[test]
fn trees_of_any_depth() {
    let mut table = Table::new("7-trees", "Trees of other depths");
    let usual = chain(&Shape::hills(), &tree(40, 4));
    let path = usual.path();
    let of_usual = usual.figures(&path, 1.0);
    let levels =
        |desired: f64, factor: f64| ((8192.0 / desired).ln() / factor.ln()).round() as usize + 1;
    // What does not depend on the levels there are.
    let common = |figures: &Figures| {
        let names = ["leaf area", "leaf colour RMS", "widest gap"];
        Figures(figures.0.iter().filter(|f| names.contains(&&*f.name)).cloned().collect())
    };
    let twin = Twin::one("level factor 4, 40 triangles", common(&of_usual));
    for (name, desired, factor) in [
        ("level factor 2, 10 triangles", 10, 2),
        ("level factor 16, 40 triangles", 40, 16),
        ("level factor 64, 40 triangles", 40, 64),
    ] {
        // One block, so that its root has the budget.
        let mut options = tree(desired, factor);
        options.hierarchy.constants.blocks.divided = 1 << 20;
        // Ten triangles are too few to keep the skyline of these hills: such a root is left out.
        options.hierarchy.constants.outline.least_kept = 0.0;
        let found = chain(&Shape::hills(), &options);
        // Nor do ten triangles resolve the pattern of these hills: its colours are elsewhere on them.
        let mut failures = found.failures();
        failures.retain(|failure| desired > 10 || !failure.starts_with("colours of the levels"));
        table.verified(name, failures);
        let figures = found.figures(&path, 1.0);
        assert_eq!(
            found.built.scene.level_count(),
            levels(desired.into(), factor.into()),
            "{name}"
        );
        let bounds: Bounds = &[("leaf colour", 0.04)];
        table.within(name, &common(&figures), &twin, bounds, "leaves of other sizes");
        for pair in found.report.levels.windows(2) {
            let [coarse, fine] = [&pair[0], &pair[1]];
            assert!(fine.two_sided.rms < coarse.two_sided.rms, "{name}: level {}", fine.level);
            assert!(fine.triangles > coarse.triangles, "{name}: level {}", fine.level);
        }
    }
    table.finish();
}
