//! Check: nothing shows between two levels that meet at a cut.
//!
//! Leaves meet at edges that are equal in every bit ([`super::seams`]). What stands above the one
//! leaf may be drawn beside what stands above the other, at any two levels. A point of the seam is
//! closed where both sides reach it, with their surface or with a skirt in the plane of the cut:
//! then both are joined there, whatever their levels are. Otherwise the gap at the point is the
//! distance between the points of both sides that are nearest to it.
//!
//! Where the source ends near the seam, a node may leave out the strip up to there, and with it its
//! border ([`super::border`]): then the hole beside it has grown by no more than the node's error,
//! which the distances measure. Such points are counted and left out here. A surface that goes on
//! may not be left out.
//!
//! Two nodes of one level whose borders were thinned alike meet along a line beside the seam; there
//! their rims are compared too.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::border::kept;
use super::geometry::NodeGeometry;
use super::lines::Lines;
use super::options::Limits;
use super::progress::Progress;
use super::report::{Check, Failure, GapFigures};
use super::seams::{Seam, rim};
use super::tree::{apart, is_leaf, line};
use crate::format::Scene;
use crate::mesh::Surface;

/// Where along an edge of the seam gaps are measured.
const PLACES: [f64; 3] = [0.0, 0.5, 1.0];

/// How a side meets the seam at a point.
#[derive(Clone, Copy)]
struct Meets {
    /// The point of the node nearest to the point, skirts included.
    drawn: DVec3,
    /// The same without triangles in cutting planes.
    bare: DVec3,
    /// The node has the border there.
    kept: bool,
}

/// What all groups of seams are checked with.
struct SeamCheck<'a> {
    scene: &'a Scene,
    geometry: &'a [NodeGeometry],
    /// Where the source ends, and the leaf that has each edge.
    open: &'a [([DVec3; 2], u32)],
    lines: Lines,
    steps: &'a [f64],
    limits: &'a Limits,
}

impl SeamCheck<'_> {
    /// True where the source ends within the node's error of a point, in a leaf below the node.
    fn ends_near(&self, node: u32, point: DVec3) -> bool {
        let reach = self.scene.nodes[node as usize].geometric_error;
        self.lines.near(point, reach).iter().any(|&(number, _)| {
            line(self.scene, self.open[number as usize].1).any(|above| above == node)
        })
    }
}

/// What was found at a group of seams.
#[derive(Default)]
struct Found {
    pairs: BTreeMap<[u32; 2], GapFigures>,
    failures: Vec<(f64, Failure)>,
}

/// Checks all seams; `open` are the edges at which the leaves end.
pub(super) fn gaps(
    scene: &Scene,
    geometry: &[NodeGeometry],
    seams: &[Seam],
    open: &[([DVec3; 2], u32)],
    steps: &[f64],
    limits: &Limits,
    progress: &dyn Progress,
) -> (Vec<GapFigures>, Check) {
    let mut check = Check::new("gaps");
    progress.phase("gaps", seams.len() as u64);
    let lines = Lines::new(open.iter().map(|&(ends, _)| ends));
    let checker = SeamCheck { scene, geometry, open, lines, steps, limits };
    let found: Vec<Found> = groups(scene, seams)
        .par_iter()
        .map(|group| {
            let found = checker.check(group);
            progress.done(group.len() as u64);
            found
        })
        .collect();
    let mut all = Found::default();
    for found in found {
        all.failures.extend(found.failures);
        for (levels, figures) in found.pairs {
            let all = all.pairs.entry(levels).or_default();
            all.points += figures.points;
            all.left_out += figures.left_out;
            all.bare = all.bare.max(figures.bare);
            all.bare_relative = all.bare_relative.max(figures.bare_relative);
            all.open = all.open.max(figures.open);
            all.open_relative = all.open_relative.max(figures.open_relative);
        }
    }
    // Stable, so that equal ones stay in the order of nodes.
    all.failures.sort_by(|a, b| b.0.total_cmp(&a.0));
    check.extend(all.failures.into_iter().map(|(_, failure)| failure));
    let figures: Vec<GapFigures> =
        all.pairs.into_iter().map(|([a, b], figures)| GapFigures { a, b, ..figures }).collect();
    let (points, left_out) =
        figures.iter().fold((0, 0), |(points, out), gap| (points + gap.points, out + gap.left_out));
    let widest = |of: fn(&GapFigures) -> f64| figures.iter().map(of).fold(0.0, f64::max);
    check.summary = format!(
        "{} edges at cuts, {} pairs of levels, {:.2} % of points where the source ends and is left \
         out: widest {:.4} m without skirts ({:.2} of the node's error), {:.2e} m with them",
        seams.len(),
        figures.len(),
        100.0 * left_out as f64 / (points + left_out).max(1) as f64,
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

impl SeamCheck<'_> {
    fn check(&self, seams: &[&Seam]) -> Found {
        let Self { scene, geometry, steps, limits, .. } = *self;
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
        let meets: BTreeMap<u32, NodeAtSeams> = of_node
            .into_par_iter()
            .map(|(node, numbers)| {
                let near = NodeNear::new(&geometry[node as usize]);
                let own: Vec<&Seam> = numbers.iter().map(|&n| seams[n as usize]).collect();
                let kept = kept(&geometry[node as usize], &own);
                let meets = numbers.into_iter().zip(own).zip(kept).map(|((number, seam), kept)| {
                    (number, points(seam).map(|point| near.meets(point, kept)))
                });
                (node, NodeAtSeams { meets: meets.collect(), rim: near.rim })
            })
            .collect();

        let mut found = Found::default();
        let mut failures = Worst::default();
        for (number, (seam, [ones, others])) in (0..).zip(seams.iter().zip(&sides)) {
            let points = points(seam);
            for (&a, &b) in ones.iter().flat_map(|a| others.iter().map(move |b| (a, b))) {
                if is_leaf(scene, a) && is_leaf(scene, b) {
                    continue;
                }
                let level = |node: u32| scene.nodes[node as usize].level;
                let error = |node: u32| scene.nodes[node as usize].geometric_error;
                let allowed = limits.gap_steps * steps[a as usize].max(steps[b as usize]);
                let same_level = level(a) == level(b);
                let error = error(a).max(error(b));
                let levels = [level(a).min(level(b)), level(a).max(level(b))];
                for (index, &point) in points.iter().enumerate() {
                    let at = |node: u32| match meets.get(&node) {
                        Some(node) => node.meets[&number][index],
                        None => Meets { drawn: point, bare: point, kept: true },
                    };
                    let (one, other) = (at(a), at(b));
                    let mut open = one.drawn.distance(other.drawn);
                    if same_level && open > allowed {
                        let rim = |node: u32| meets.get(&node).map_or(point, |at| at.rim(point));
                        open = open.min(rim(a).distance(rim(b)));
                    }
                    let figures = found.pairs.entry(levels).or_default();
                    let left_out =
                        |meets: Meets, node: u32| !meets.kept && self.ends_near(node, point);
                    // Not a number where a node has nothing at all to draw.
                    let too_wide = open.is_nan() || open > allowed;
                    if too_wide && (left_out(one, a) || left_out(other, b)) {
                        figures.left_out += 1;
                        continue;
                    }
                    figures.points += 1;
                    figures.open = figures.open.max(open);
                    let bare = match one.kept && other.kept {
                        true => one.bare.distance(other.bare),
                        false => open,
                    };
                    figures.bare = figures.bare.max(bare);
                    if error > 0.0 {
                        figures.bare_relative = figures.bare_relative.max(bare / error);
                        figures.open_relative = figures.open_relative.max(open / error);
                    }
                    if too_wide {
                        failures.note(open, [a, b], point);
                    }
                }
            }
        }
        found.failures = failures.into_failures(scene);
        found
    }
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
                    hint: "build again; if it stays, this is a fault of the builder",
                };
                (open, failure)
            })
            .collect()
    }
}

/// What a node does at the seams that it bounds.
struct NodeAtSeams {
    /// By number of the seam.
    meets: BTreeMap<u32, [Meets; PLACES.len()]>,
    rim: Vec<[DVec3; 2]>,
}

impl NodeAtSeams {
    /// The point of the node's rim nearest to a point.
    fn rim(&self, point: DVec3) -> DVec3 {
        let on_edge = |&[from, to]: &[DVec3; 2]| {
            let along = to - from;
            let t = (point - from).dot(along) / along.length_squared();
            from + along * t.clamp(0.0, 1.0)
        };
        self.rim.iter().map(on_edge).fold(DVec3::INFINITY, |best, here| {
            if point.distance(here) < point.distance(best) { here } else { best }
        })
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
            rim: rim(geometry).into_iter().map(|edge| edge.ends).collect(),
        }
    }

    fn meets(&self, point: DVec3, kept: bool) -> Meets {
        let nearest =
            |surface: &Surface| surface.closest(point).map_or(DVec3::INFINITY, |hit| hit.point);
        Meets { drawn: nearest(&self.drawn), bare: nearest(&self.bare), kept }
    }
}
