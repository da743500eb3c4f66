//! Check: nothing shows between two levels that meet at a cut.
//!
//! Leaves meet at edges that are equal in every bit ([`super::seams`]). What stands above the one
//! leaf may be drawn beside what stands above the other, at any two levels. A point of the seam is
//! closed where both sides reach it, with their surface or with a skirt in the plane of the cut:
//! then both are joined there, whatever their levels are. Otherwise the gap at the point is the
//! distance between the places of both sides that are nearest to it.
//!
//! A separate part of the surface that a node leaves out altogether has no border at the seam; what
//! its neighbour still shows of it ends there. That is no gap between borders but an error of the
//! node, which the distances measure, so such points are counted and left out here. A part is left
//! out where the node has no vertex at all on the connected run of seam.
//!
//! Two nodes of one level whose borders were thinned alike meet along a line beside the seam; there
//! their rims are compared too.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::geometry::NodeGeometry;
use super::options::Limits;
use super::progress::Progress;
use super::report::{Check, Failure, GapFigures};
use super::runs::Runs;
use super::seams::{Seam, rim};
use super::surface::Surface;
use super::tree::{apart, is_leaf};
use crate::format::Scene;
use crate::mesh::{PositionKey, key};

/// Where along an edge of the seam is looked.
const PLACES: [f64; 3] = [0.0, 0.5, 1.0];

/// How a side meets the seam at a point.
#[derive(Clone, Copy)]
struct Meets {
    /// The place of the node nearest to the point, skirts included.
    drawn: DVec3,
    /// The same without triangles in cutting planes.
    bare: DVec3,
    /// The nearest place of the node's rim, where `drawn` is not at the point itself.
    rim: DVec3,
    /// The node leaves out the part that the point belongs to.
    left_out: bool,
}

/// Looks at all seams.
pub(super) fn gaps(
    scene: &Scene,
    geometry: &[NodeGeometry],
    seams: &[Seam],
    steps: &[f64],
    limits: &Limits,
    progress: &dyn Progress,
) -> (Vec<GapFigures>, Check) {
    let mut check = Check::new("gaps");
    progress.phase("gaps", seams.len() as u64);
    let groups = groups(scene, seams);
    let found: Vec<(BTreeMap<[u32; 2], GapFigures>, Vec<(f64, Failure)>)> = groups
        .par_iter()
        .map(|group| {
            let found = look_at(scene, geometry, group, steps, limits);
            progress.done(group.len() as u64);
            found
        })
        .collect();
    let mut pairs: BTreeMap<[u32; 2], GapFigures> = BTreeMap::new();
    let mut widest_first: Vec<(f64, Failure)> = Vec::new();
    for (figures, failures) in found {
        widest_first.extend(failures);
        for (levels, figures) in figures {
            let all = pairs.entry(levels).or_default();
            all.points += figures.points;
            all.left_out += figures.left_out;
            all.bare = all.bare.max(figures.bare);
            all.bare_relative = all.bare_relative.max(figures.bare_relative);
            all.open = all.open.max(figures.open);
            all.open_relative = all.open_relative.max(figures.open_relative);
        }
    }
    // Stable, so that equal ones stay in the order of nodes.
    widest_first.sort_by(|a, b| b.0.total_cmp(&a.0));
    check.extend(widest_first.into_iter().map(|(_, failure)| failure));
    let figures: Vec<GapFigures> =
        pairs.into_iter().map(|([a, b], figures)| GapFigures { a, b, ..figures }).collect();
    let (points, left_out) =
        figures.iter().fold((0, 0), |(points, out), gap| (points + gap.points, out + gap.left_out));
    let widest = |of: fn(&GapFigures) -> f64| figures.iter().map(of).fold(0.0, f64::max);
    check.summary = format!(
        "{} edges at cuts, {} pairs of levels, {:.2} % of points on parts left out: widest {:.4} m \
         without skirts ({:.2} of the node's error), {:.2e} m with them",
        seams.len(),
        figures.len(),
        100.0 * left_out as f64 / points.max(1) as f64,
        widest(|gap| gap.bare),
        widest(|gap| gap.bare_relative),
        widest(|gap| gap.open),
    );
    (figures, check)
}

/// Seams by the nodes between whose subtrees they run: below the node where both sides' lines
/// meet, or between two trees. What is computed for a group is dropped with it.
fn groups<'a>(scene: &Scene, seams: &'a [Seam]) -> Vec<Vec<&'a Seam>> {
    let mut groups: BTreeMap<[u32; 2], Vec<&Seam>> = BTreeMap::new();
    for seam in seams {
        let [a, b] = seam.leaves;
        let tops = apart(scene, a, b).map(|line| line.last().copied().unwrap_or(a));
        groups.entry([tops[0].min(tops[1]), tops[0].max(tops[1])]).or_default().push(seam);
    }
    groups.into_values().collect()
}

fn look_at(
    scene: &Scene,
    geometry: &[NodeGeometry],
    seams: &[&Seam],
    steps: &[f64],
    limits: &Limits,
) -> (BTreeMap<[u32; 2], GapFigures>, Vec<(f64, Failure)>) {
    let points = |seam: &Seam| PLACES.map(|at| seam.ends[0].lerp(seam.ends[1], at));
    let sides: Vec<[Vec<u32>; 2]> =
        seams.iter().map(|seam| apart(scene, seam.leaves[0], seam.leaves[1])).collect();
    // The seams that each coarse node bounds, and what it does there.
    let mut of_node: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (number, sides) in (0..).zip(&sides) {
        for &node in sides.iter().flatten().filter(|&&node| !is_leaf(scene, node)) {
            of_node.entry(node).or_default().push(number);
        }
    }
    let meets: BTreeMap<u32, BTreeMap<u32, [Meets; PLACES.len()]>> = of_node
        .into_par_iter()
        .map(|(node, numbers)| {
            let near = NodeNear::new(&geometry[node as usize]);
            let tolerance = limits.gap_steps * steps[node as usize];
            let kept = near.kept(numbers.iter().map(|&number| seams[number as usize]));
            let meets = numbers.into_iter().zip(kept).map(|(number, kept)| {
                let meets = |point| Meets { left_out: !kept, ..near.meets(point, tolerance) };
                (number, points(seams[number as usize]).map(meets))
            });
            (node, meets.collect())
        })
        .collect();

    let mut pairs: BTreeMap<[u32; 2], GapFigures> = BTreeMap::new();
    let mut failures = Worst::default();
    let borders = scene.parameters["borders"].as_str().unwrap_or_default();
    for (number, (seam, [ones, others])) in (0..).zip(seams.iter().zip(&sides)) {
        let points = points(seam);
        for &a in ones {
            for &b in others {
                if is_leaf(scene, a) && is_leaf(scene, b) {
                    continue;
                }
                let level = |node: u32| scene.nodes[node as usize].level;
                let error = |node: u32| scene.nodes[node as usize].geometric_error;
                let tolerance = limits.gap_steps * steps[a as usize].max(steps[b as usize]);
                let same_level = level(a) == level(b);
                let error = error(a).max(error(b));
                let levels = [level(a).min(level(b)), level(a).max(level(b))];
                let figures = pairs.entry(levels).or_default();
                for (place, &point) in points.iter().enumerate() {
                    let at = |node: u32| match meets.get(&node) {
                        Some(meets) => meets[&number][place],
                        None => Meets { drawn: point, bare: point, rim: point, left_out: false },
                    };
                    let (one, other) = (at(a), at(b));
                    if one.left_out || other.left_out {
                        figures.left_out += 1;
                        continue;
                    }
                    let bare = one.bare.distance(other.bare);
                    let mut open = one.drawn.distance(other.drawn);
                    if same_level {
                        open = open.min(one.rim.distance(other.rim));
                    }
                    figures.points += 1;
                    figures.bare = figures.bare.max(bare);
                    figures.open = figures.open.max(open);
                    if error > 0.0 {
                        figures.bare_relative = figures.bare_relative.max(bare / error);
                        figures.open_relative = figures.open_relative.max(open / error);
                    }
                    // Without skirts gaps between levels are what was asked for; they must still
                    // be within the error.
                    let allowed = match borders {
                        "shared" if !same_level => tolerance + 2.0 * error,
                        _ => tolerance,
                    };
                    // Not a number where a node has nothing at all to draw.
                    if open.is_nan() || open > allowed {
                        failures.note(open, [a, b], point);
                    }
                }
            }
        }
    }
    (pairs, failures.into_failures(scene))
}

/// The widest gap of each pair of nodes.
#[derive(Default)]
struct Worst(BTreeMap<[u32; 2], (f64, DVec3)>);

impl Worst {
    fn note(&mut self, open: f64, nodes: [u32; 2], point: DVec3) {
        let worst = self.0.entry(nodes).or_insert((open, point));
        if open > worst.0 {
            *worst = (open, point);
        }
    }

    fn into_failures(self, scene: &Scene) -> Vec<(f64, Failure)> {
        let file = |node: u32| scene.nodes[node as usize].file.as_str();
        self.0
            .into_iter()
            .map(|([a, b], (open, point))| {
                let at = format!("{:.3} {:.3} {:.3}", point.x, point.y, point.z);
                let failure = Failure {
                    place: format!("{} beside {}", file(a), file(b)),
                    what: format!("a gap of {open:.5} m at {at}"),
                    hint: "build with --borders skirts or locked; if it was, report this",
                };
                (open, failure)
            })
            .collect()
    }
}

/// A node's surfaces and rim.
struct NodeNear {
    drawn: Surface,
    bare: Surface,
    rim: Vec<[DVec3; 2]>,
}

impl NodeNear {
    fn new(geometry: &NodeGeometry) -> Self {
        let positions =
            || (0..geometry.positions.len() as u32).map(|v| geometry.position(v)).collect();
        let bare = (0..).zip(&geometry.triangles).filter(|&(n, _)| geometry.is_surface(n));
        Self {
            drawn: Surface::new(positions(), geometry.triangles.clone()),
            bare: Surface::new(positions(), bare.map(|(_, &triangle)| triangle).collect()),
            rim: rim(geometry).into_iter().map(|(_, ends)| ends).collect(),
        }
    }

    /// For each seam, whether the node has a vertex on the connected run that it belongs to.
    fn kept<'a>(&self, seams: impl Iterator<Item = &'a Seam> + Clone) -> Vec<bool> {
        let mut numbers: FxHashMap<PositionKey<f64>, u32> = FxHashMap::default();
        let mut runs = Runs::new(0);
        let ends = |seam: &Seam| seam.ends.map(|end| key(end.to_array()));
        for seam in seams.clone() {
            let [a, b] = ends(seam).map(|end| *numbers.entry(end).or_insert_with(|| runs.push()));
            runs.join(a, b);
        }
        let mut kept = vec![false; numbers.len()];
        for position in self.drawn.positions() {
            if let Some(&number) = numbers.get(&key(position.to_array())) {
                kept[runs.top(number) as usize] = true;
            }
        }
        seams.map(|seam| kept[runs.top(numbers[&ends(seam)[0]]) as usize]).collect()
    }

    fn meets(&self, point: DVec3, tolerance: f64) -> Meets {
        let nearest =
            |surface: &Surface| surface.closest(point).map_or(DVec3::INFINITY, |hit| hit.point);
        let drawn = nearest(&self.drawn);
        if drawn.distance(point) <= tolerance {
            return Meets { drawn, bare: nearest(&self.bare), rim: drawn, left_out: false };
        }
        let on_edge = |&[from, to]: &[DVec3; 2]| {
            let along = to - from;
            let t = (point - from).dot(along) / along.length_squared();
            from + along * t.clamp(0.0, 1.0)
        };
        let rim = self.rim.iter().map(on_edge).fold(DVec3::INFINITY, |best, here| {
            if point.distance(here) < point.distance(best) { here } else { best }
        });
        Meets { drawn, bare: nearest(&self.bare), rim, left_out: false }
    }
}
