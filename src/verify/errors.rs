//! Check: the stored error of a node is honest, not below the measured one, and of use, not far
//! above it.

use super::distance::NodeDistances;
use super::faithful::rounding;
use super::options::Limits;
use super::report::{Check, ErrorFigures};
use crate::build::quantize::Quantization;
use crate::format::Scene;

/// Compares stored and measured errors of all coarse nodes. What leaves may be off by rounding is
/// room for both, and the least that is counted as measured; `steps` are the lattice's.
pub(super) fn errors(
    scene: &Scene,
    nodes: &[NodeDistances],
    steps: &[f64],
    limits: &Limits,
) -> (Option<ErrorFigures>, Check) {
    let mut check = Check::new("stored errors");
    let mut ratios: Vec<f64> = Vec::with_capacity(nodes.len());
    let lattice = Quantization::of(&scene.parameters);
    let mut too_small: Vec<(f64, String, String)> = Vec::new();
    for measured in nodes {
        let node = &scene.nodes[measured.node as usize];
        let rounding = rounding(scene, measured.node, steps[measured.node as usize]);
        let (stored, max) = (node.geometric_error, measured.max());
        let least = lattice.map_or(rounding, |lattice| lattice.bound());
        ratios.push(stored.max(least) / max.max(least));
        if stored + rounding < max {
            let at = if measured.to_front.max() >= measured.to_source.max() {
                (measured.to_front.farthest(), "the source is", "the front")
            } else {
                (measured.to_source.farthest(), "the node is", "the source")
            };
            let (place, from, to) = at;
            let what = format!(
                "stores {stored:.4} m, but {from} {max:.4} m from {to} at {:.3} {:.3} {:.3}",
                place.x, place.y, place.z
            );
            too_small.push((stored / max, node.file.clone(), what));
        }
    }
    let count = too_small.len() as u64;
    too_small.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    for (_, file, what) in too_small {
        check.fail(
            file,
            what,
            "use the measured figure, and report this: the builder's bound does not hold",
        );
    }
    ratios.sort_by(f64::total_cmp);
    let Some(&least_ratio) = ratios.first() else {
        check.summary = "all nodes are leaves".into();
        return (None, check);
    };
    let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
    let figures = ErrorFigures {
        nodes: ratios.len() as u64,
        too_small: count,
        least_ratio,
        median_ratio: at(0.5),
        high_ratio: at(0.95),
    };
    let limit = limits.error_ratio * adding_up(scene);
    if figures.median_ratio > limit {
        check.fail(
            "all nodes",
            format!(
                "stored errors are {:.2} times the measured ones in the median, limit {limit}",
                figures.median_ratio
            ),
            "detail is loaded that nobody needs; report this: the builder's bound is too loose",
        );
    }
    check.summary = format!(
        "stored over measured in {} nodes: least {:.2}, median {:.2}, 95 of 100 below {:.2}; {} too small",
        figures.nodes, figures.least_ratio, figures.median_ratio, figures.high_ratio, count
    );
    (Some(figures), check)
}

/// Bounds add up from level to level, each about as many times that of the level below as the
/// level factor says: with 2 the sum is 2 of the last one's own, with 4 it is 4/3, with more less.
/// Returns it as a multiple of that with 4, which the limit is for; never below 1.
fn adding_up(scene: &Scene) -> f64 {
    let factor = scene.parameters["level_factor"].as_u64().unwrap_or(4).clamp(2, 64) as f64;
    let sum = |factor: f64| factor / (factor - 1.0);
    (sum(factor) / sum(4.0)).max(1.0)
}
