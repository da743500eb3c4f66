//! Check: the stored error of a node holds, so is not below the measured one, and is tight, so not
//! far above the largest of its own and those of the nodes below it: stored errors never grow
//! towards the leaves, since viewers refine by them.

use std::collections::BTreeMap;

use super::faithful::rounding;
use super::node_errors::NodeError;
use super::options::Limits;
use super::report::{Check, ErrorFigures};
use super::step::vertex_bounds;
use super::tree::line;
use crate::format::Scene;
use crate::lattice::Quantization;

/// Compares stored and measured errors of all coarse nodes. What leaves may be off by rounding is
/// room for both, and the least that is counted as measured; `steps` are the lattice's.
/// `same_source` says that the scene was built from what it is compared with, as far as is known.
pub(super) fn errors(
    scene: &Scene,
    nodes: &[NodeError],
    steps: &[f64],
    limits: &Limits,
    same_source: bool,
) -> (Vec<ErrorFigures>, Check) {
    let mut check = Check::new("stored errors");
    let [hint_too_small, hint_too_large] = match same_source {
        true => [
            "use the measured figure, and report this: the builder's bound does not hold",
            "detail is loaded that nobody needs; report this: the builder's bound is too loose",
        ],
        false => ["name the files that the scene was built from, or build it again"; 2],
    };
    let bounds = vertex_bounds(scene);
    let mut ratios: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    let lattice = Quantization::of(&scene.parameters);
    let mut largest: BTreeMap<u32, f64> = BTreeMap::new();
    for measured in nodes {
        for node in line(scene, measured.node) {
            let largest = largest.entry(node).or_default();
            *largest = largest.max(measured.max());
        }
    }
    let mut too_small: Vec<(f64, String, String)> = Vec::new();
    let mut count_too_small: BTreeMap<u32, u64> = BTreeMap::new();
    for measured in nodes {
        let node = &scene.nodes[measured.node as usize];
        let number = measured.node as usize;
        let rounding = rounding(scene, measured.node, steps[number], bounds[number]);
        let (stored, max) = (node.geometric_error, measured.max());
        // The lattice of a quantised build moves leaves and nodes alike, and a bound has room for
        // both; it cannot be seen between them.
        let moved = lattice.map_or(0.0, |lattice| 2.0 * lattice.bound());
        let least = rounding.max(moved);
        let largest = largest.get(&measured.node).copied().unwrap_or(max);
        ratios
            .entry(node.level)
            .or_default()
            .push((stored - moved).max(least) / largest.max(least));
        if stored + rounding < max {
            *count_too_small.entry(node.level).or_default() += 1;
            let (position, from, to) = if measured.to_node.0 >= measured.to_original.0 {
                (measured.to_node.1, "the original is", "the node")
            } else {
                (measured.to_original.1, "the node is", "the original")
            };
            let what = format!(
                "stores {stored:.4} m, but {from} {max:.4} m from {to} at {:.3} {:.3} {:.3}",
                position.x, position.y, position.z
            );
            too_small.push((stored / max, node.file.clone(), what));
        }
    }
    let count = too_small.len() as u64;
    too_small.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    for (_, file, what) in too_small {
        check.fail(file, what, hint_too_small);
    }
    let mut figures = Vec::with_capacity(ratios.len());
    for (level, mut ratios) in ratios {
        ratios.sort_by(f64::total_cmp);
        let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
        let found = ErrorFigures {
            level,
            nodes: ratios.len() as u64,
            too_small: count_too_small.get(&level).copied().unwrap_or(0),
            least_ratio: at(0.0),
            median_ratio: at(0.5),
            high_ratio: at(0.95),
        };
        for (figure, what, limit) in [
            (found.median_ratio, "in the median", limits.median_error_ratio),
            (found.high_ratio, "for 5 of 100 nodes", limits.high_error_ratio),
        ] {
            if figure > limit {
                check.fail(
                    format!("level {level}"),
                    format!("stored errors are {figure:.2} times the measured ones {what}, limit {limit}"),
                    hint_too_large,
                );
            }
        }
        figures.push(found);
    }
    check.summary = match &figures[..] {
        [] => "all nodes are leaves".into(),
        figures => {
            let of = |figure: fn(&ErrorFigures) -> f64| {
                let all: Vec<String> =
                    figures.iter().map(|level| format!("{:.2}", figure(level))).collect();
                all.join(", ")
            };
            format!(
                "stored over measured in {} nodes, by level: least {}; median {}; 95 of 100 below {}; {count} too small",
                nodes.len(),
                of(|level| level.least_ratio),
                of(|level| level.median_ratio),
                of(|level| level.high_ratio),
            )
        }
    };
    (figures, check)
}
