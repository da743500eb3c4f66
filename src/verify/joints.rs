//! Check: leaves meet edge to edge. Where one leaf's edge ends in the middle of its neighbour's (a
//! T-junction) or has no neighbour at all, light shows through a surface that is whole in the
//! source.
//!
//! Such an edge is used an odd number of times by all leaves together, and so are those at which
//! the source itself ends. Leaves cut edges into pieces and round their ends: an odd edge must lie
//! along one of the source's odd edges, within rounding.

use glam::DVec3;
use rayon::prelude::*;

use super::faithful::rounding;
use super::lines::Lines;
use super::report::{Check, Failure};
use super::seams::Rims;
use super::source::Source;
use super::step::vertex_bounds;
use crate::format::Scene;

/// Checks all edges of the leaves. `steps` are the nodes' lattice steps.
pub(super) fn joints(scene: &Scene, source: &Source, rims: &Rims, steps: &[f64]) -> Check {
    let mut check = Check::new("leaves meet");
    let open = rims.open();
    let bounds = vertex_bounds(scene);
    let of_source = source.open_edges();
    let lines = Lines::new(of_source.iter().copied());
    let torn: Vec<(f64, Failure)> = open
        .par_iter()
        .filter_map(|&(ends, leaf)| {
            let reach = rounding(scene, leaf, steps[leaf as usize], bounds[leaf as usize]);
            if along_one(&lines, ends, reach) {
                return None;
            }
            let [a, b] = ends;
            let failure = Failure {
                place: scene.nodes[leaf as usize].file.clone(),
                what: format!(
                    "its edge from {:.3} {:.3} {:.3} to {:.3} {:.3} {:.3} meets no other, and is none \
                     of the source's borders",
                    a.x, a.y, a.z, b.x, b.y, b.z
                ),
                hint: "build again; if it stays, this is a fault of the builder",
            };
            Some((a.distance(b), failure))
        })
        .collect();
    check.summary = format!(
        "{} edges of leaves are borders of the source ({} edges there), {} are torn",
        open.len() - torn.len(),
        of_source.len(),
        torn.len()
    );
    let mut torn = torn;
    // Stable, so that equal ones stay in order.
    torn.sort_by(|a, b| b.0.total_cmp(&a.0));
    check.extend(torn.into_iter().map(|(_, failure)| failure));
    check
}

/// True where one of the lines passes both ends of an edge within `reach`.
fn along_one(lines: &Lines, ends: [DVec3; 2], reach: f64) -> bool {
    let [first, second] = ends.map(|end| lines.near(end, reach));
    first.iter().any(|(line, _)| second.binary_search_by_key(line, |&(other, _)| other).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_a_line_lie_along_it_and_others_do_not() {
        let at = |x: f64, y: f64| DVec3::new(678_016.0 + x, y, 0.0);
        let corner = [[at(0.0, 0.0), at(8.0, 0.0)], [at(8.0, 0.0), at(8.0, 8.0)]];
        let lines = Lines::new(corner.into_iter());
        let fits = |from, to| along_one(&lines, [from, to], 1e-3);
        assert!(fits(at(2.0, 0.0005), at(3.0, -0.0005)));
        assert!(fits(at(8.0, 0.0), at(8.0, 8.0)));
        assert!(!fits(at(7.0, 0.0), at(8.0, 1.0)), "across the corner");
        assert!(!fits(at(2.0, 0.0), at(2.0, 0.5)));
    }
}
