//! How wide the slits are between borders of the source that touch without sharing vertices, as
//! tiles of a scan do, wherever one level is drawn beside another.
//!
//! Borders touch where an open edge of a leaf runs beside another, of the same leaf or not, their
//! surfaces on opposite sides, no farther apart than half of the shorter edge. At the middle of the
//! edge, in the plane across it, the source leaves some width uncovered, or none; this is compared
//! with what the nodes above leave. These are figures: nothing fails by them, since whether two borders
//! belong together is for the builder to say ([`crate::builder::stitch`]), by a rule of its own.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::geometry::NodeGeometry;
use super::lines::Lines;
use super::progress::Progress;
use super::report::SlitFigures;
use super::tree::{apart, is_leaf, line};
use crate::format::Scene;
use crate::mesh::{PositionKey, Surface, key};

/// Edges side by side are no farther apart than this share of the shorter one.
const APART: f64 = 0.5;

/// Cosine of the angle between edges side by side, and between the planes of their triangles.
const SIDE_BY_SIDE: f64 = 0.85;

/// Slits are followed to both sides for so many times the shorter edge; none is wider than twice
/// that.
const FOLLOWED: f64 = 8.0;

/// A slit is no wider than the source's where it exceeds it by no more than this share, which
/// rounding may add.
const CLOSED: f64 = 1.01;

/// A place where two borders touch.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Touch {
    /// Between both borders.
    middle: DVec3,
    /// Across the slit, along it, and out of the surface; unit vectors.
    axes: [DVec3; 3],
    /// How far both borders are from each other, metres.
    apart: f64,
    /// How far across a slit is followed, metres.
    reach: f64,
    /// The leaves on both sides; may be one.
    leaves: [u32; 2],
}

/// An open edge of a leaf and which way its surface ends there.
struct Rim {
    ends: [DVec3; 2],
    leaf: u32,
    /// Third corner of the edge's triangle.
    corner: DVec3,
}

impl Rim {
    fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    fn is_beside(&self, other: &Self) -> bool {
        let along = |rim: &Self| (rim.ends[1] - rim.ends[0]).normalize_or_zero();
        along(self).dot(along(other)).abs() > SIDE_BY_SIDE
            && self.outward().dot(other.outward()) < -SIDE_BY_SIDE
    }

    /// Away from the edge's triangle, in its plane; a unit vector, or 0.
    fn outward(&self) -> DVec3 {
        let along = (self.ends[1] - self.ends[0]).normalize_or_zero();
        let inward = self.corner - self.ends[0];
        -(inward - along * inward.dot(along)).normalize_or_zero()
    }

    /// Whether what lies between two edges is surface: both are sides of a narrow strip.
    fn is_ribbon(&self, other: &Self, across: DVec3) -> bool {
        across.dot(self.outward()) < 0.0
            && (other.ends.contains(&self.corner) || self.ends.contains(&other.corner))
    }
}

/// The slits of each pair of levels; `open` are the edges at which the leaves end.
pub(super) fn slits(
    scene: &Scene,
    geometry: &[NodeGeometry],
    open: &[([DVec3; 2], u32)],
    progress: &dyn Progress,
) -> Vec<SlitFigures> {
    let touches = touches(&rims(geometry, open));
    progress.phase("slits", touches.len() as u64);
    let widths: Vec<BTreeMap<[u32; 2], Vec<[f64; 2]>>> = groups(scene, &touches)
        .par_iter()
        .map(|group| {
            let widths = widths(scene, geometry, group);
            progress.done(group.len() as u64);
            widths
        })
        .collect();
    let mut all: BTreeMap<[u32; 2], Vec<[f64; 2]>> = BTreeMap::new();
    for (levels, mut widths) in widths.into_iter().flatten() {
        all.entry(levels).or_default().append(&mut widths);
    }
    all.into_iter().map(|([a, b], widths)| figures(a, b, widths)).collect()
}

/// `widths` are those of the source and of the nodes.
fn figures(a: u32, b: u32, widths: Vec<[f64; 2]>) -> SlitFigures {
    let closed = widths.iter().filter(|[source, drawn]| *drawn <= CLOSED * source).count() as u64;
    let widest_in_source = widths.iter().map(|[source, _]| *source).fold(0.0, f64::max);
    let points = widths.len() as u64;
    let mut drawn: Vec<f64> = widths.into_iter().map(|[_, drawn]| drawn).collect();
    drawn.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| drawn.get((share * (drawn.len() - 1) as f64) as usize).copied();
    let [p99, widest] = [0.99, 1.0].map(|share| at(share).unwrap_or_default());
    SlitFigures { a, b, points, closed, widest_in_source, p99, widest }
}

/// The open edges with the side that their triangles are on.
fn rims(geometry: &[NodeGeometry], open: &[([DVec3; 2], u32)]) -> Vec<Rim> {
    let keys = |ends: [DVec3; 2]| {
        let [a, b]: [PositionKey<f64>; 2] = ends.map(|end| key(end.to_array()));
        if b < a { [b, a] } else { [a, b] }
    };
    let mut by_leaf: BTreeMap<u32, Vec<[DVec3; 2]>> = BTreeMap::new();
    open.iter().for_each(|&(ends, leaf)| by_leaf.entry(leaf).or_default().push(ends));
    let of_leaf = |(leaf, edges): (u32, Vec<[DVec3; 2]>)| {
        let mut corners: FxHashMap<_, Option<DVec3>> =
            edges.iter().map(|&ends| (keys(ends), None)).collect();
        for (_, [a, b, c]) in geometry[leaf as usize].surface() {
            for (ends, corner) in [([a, b], c), ([b, c], a), ([c, a], b)] {
                if let Some(known) = corners.get_mut(&keys(ends)) {
                    known.get_or_insert(corner);
                }
            }
        }
        let rim = |ends: [DVec3; 2]| {
            let corner = corners[&keys(ends)].unwrap_or_default();
            Rim { ends, leaf, corner }
        };
        edges.into_iter().map(rim).collect::<Vec<_>>()
    };
    let by_leaf: Vec<_> = by_leaf.into_iter().collect();
    by_leaf.into_par_iter().flat_map_iter(of_leaf).collect()
}

/// Where the middle of an edge touches another edge, once for each edge.
fn touches(rims: &[Rim]) -> Vec<Touch> {
    let lines = Lines::new(rims.iter().map(|rim| rim.ends));
    let touch = |rim: &Rim| {
        let middle = rim.ends[0].midpoint(rim.ends[1]);
        let beside = lines.near(middle, APART * rim.length()).into_iter().filter(|&(n, off)| {
            let other = &rims[n as usize];
            off <= APART * other.length()
                && rim.is_beside(other)
                && !rim.is_ribbon(other, nearest_on(other.ends, middle) - middle)
        });
        let (nearest, _) = beside.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))?;
        let other = &rims[nearest as usize];
        let along = (rim.ends[1] - rim.ends[0]).normalize_or_zero();
        let opposite = nearest_on(other.ends, middle);
        let mean = (rim.outward() - other.outward()) * 0.5;
        let across = (mean - along * mean.dot(along)).normalize_or_zero();
        Some(Touch {
            middle: middle.midpoint(opposite),
            apart: middle.distance(opposite),
            axes: [across, along, across.cross(along)],
            reach: FOLLOWED * rim.length().min(other.length()),
            leaves: [rim.leaf, other.leaf],
        })
    };
    rims.par_iter().filter_map(touch).collect()
}

fn nearest_on([from, to]: [DVec3; 2], point: DVec3) -> DVec3 {
    let along = to - from;
    let t = (point - from).dot(along) / along.length_squared();
    from + along * t.clamp(0.0, 1.0)
}

/// Touches by the pair of nodes below the one where both leaves' lines meet, or of roots: what is
/// computed for a group is dropped with it.
fn groups(scene: &Scene, touches: &[Touch]) -> Vec<Vec<Touch>> {
    let mut groups: BTreeMap<[u32; 2], Vec<Touch>> = BTreeMap::new();
    for &touch in touches {
        let [a, b] = touch.leaves;
        let [a, b] = apart(scene, a, b).map(|line| line.last().copied().unwrap_or(touch.leaves[0]));
        groups.entry([a.min(b), a.max(b)]).or_default().push(touch);
    }
    groups.into_values().collect()
}

/// By pair of levels, the widths of the source's slits and of those of the nodes above.
fn widths(
    scene: &Scene,
    geometry: &[NodeGeometry],
    touches: &[Touch],
) -> BTreeMap<[u32; 2], Vec<[f64; 2]>> {
    let mut surfaces: FxHashMap<u32, Surface> = FxHashMap::default();
    let mut widths: BTreeMap<[u32; 2], Vec<[f64; 2]>> = BTreeMap::new();
    for touch in touches {
        let mut width = |nodes: [u32; 2]| {
            for node in nodes {
                surfaces.entry(node).or_insert_with(|| drawn(&geometry[node as usize]));
            }
            let nodes = if nodes[0] == nodes[1] { &nodes[..1] } else { &nodes };
            let error = |node: &u32| scene.nodes[*node as usize].geometric_error;
            let off = nodes.iter().map(error).fold(0.0, f64::max);
            touch.width(nodes.iter().map(|node| &surfaces[node]), off)
        };
        let source = width(touch.leaves);
        let [ones, others] = apart(scene, touch.leaves[0], touch.leaves[1]);
        let common = line(scene, touch.leaves[0]).skip(ones.len());
        let pairs = ones.iter().flat_map(|&a| others.iter().map(move |&b| [a, b]));
        let is_coarse = |nodes: &[u32; 2]| nodes.iter().any(|&node| !is_leaf(scene, node));
        for nodes in pairs.chain(common.map(|node| [node; 2])).filter(is_coarse) {
            let [a, b] = nodes.map(|node| scene.nodes[node as usize].level);
            widths.entry([a.min(b), a.max(b)]).or_default().push([source, width(nodes)]);
        }
    }
    widths
}

impl Touch {
    /// How wide these surfaces leave it open, seen from above the surface: in the plane across, what
    /// lies around the middle that none of them covers. They may be `off` metres above or below.
    fn width<'a>(&self, surfaces: impl Iterator<Item = &'a Surface>, off: f64) -> f64 {
        let off = self.apart + off;
        let around = self.reach.max(off);
        let mut covered: Vec<[f64; 2]> = Vec::new();
        for surface in surfaces {
            surface.in_box(self.middle - around, self.middle + around, |triangle| {
                let corners = surface.corners(triangle).map(|corner| corner - self.middle);
                covered.extend(crossing(corners, self.axes, off));
            });
        }
        covered.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        // Of what is uncovered, the piece around 0; where the middle is covered, none.
        let (mut from, mut to) = (-self.reach, self.reach);
        for [low, high] in covered {
            if low <= 0.0 && high >= 0.0 {
                return 0.0;
            }
            if high < 0.0 {
                from = from.max(high);
            } else {
                to = to.min(low);
            }
        }
        to - from
    }
}

/// Where, across, a triangle passes through the plane that is normal to `along`, as far out as
/// `off`.
fn crossing(corners: [DVec3; 3], [across, along, out]: [DVec3; 3], off: f64) -> Option<[f64; 2]> {
    let mut ends = [DVec2::ZERO; 2];
    let mut count = 0;
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        let (a, b) = (corners[a], corners[b]);
        let (at_a, at_b) = (a.dot(along), b.dot(along));
        if (at_a < 0.0) != (at_b < 0.0) {
            let point = a.lerp(b, at_a / (at_a - at_b));
            ends[count] = DVec2::new(point.dot(across), point.dot(out));
            count += 1;
        }
    }
    if count < 2 {
        return None;
    }
    // The part from `-off` to `off`.
    let [from, to] = ends;
    let at = |height: f64| (height - from.y) / (to.y - from.y);
    let (mut first, mut last): (f64, f64) = (0.0, 1.0);
    if from.y != to.y {
        let (low, high) = (at(-off), at(off));
        first = first.max(low.min(high));
        last = last.min(low.max(high));
    } else if from.y.abs() > off {
        return None;
    }
    let place = |t: f64| from.x + (to.x - from.x) * t;
    let [a, b] = [place(first), place(last)];
    (first <= last).then_some([a.min(b), a.max(b)])
}

/// All that a node draws, skirts too.
fn drawn(node: &NodeGeometry) -> Surface {
    let positions = (0..node.positions.len() as u32).map(|vertex| node.position(vertex)).collect();
    Surface::new(positions, node.triangles.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip along x from 0 to 8, from y to y + 1, of two triangles a metre.
    fn strip(y: f32, from: f32) -> NodeGeometry {
        let mut node = NodeGeometry::default();
        for x in 0..=8u8 {
            let x = f32::from(x) + from;
            node.positions.extend([[x, y, 0.0], [x, y + 1.0, 0.0]]);
        }
        for n in (0..16).step_by(2) {
            node.triangles.extend([[n, n + 2, n + 3], [n, n + 3, n + 1]]);
        }
        node
    }

    fn open_of(nodes: &[NodeGeometry]) -> Vec<([DVec3; 2], u32)> {
        let of = |(leaf, node): (u32, &NodeGeometry)| {
            let positions: Vec<DVec3> =
                (0..node.positions.len() as u32).map(|v| node.position(v)).collect();
            let edges = super::super::seams::open_edges(&positions, node.triangles.iter().copied());
            edges.into_iter().map(move |ends| (ends, leaf)).collect::<Vec<_>>()
        };
        (0..).zip(nodes).flat_map(of).collect()
    }

    #[test]
    fn strips_touch_side_by_side_and_not_back_to_back_or_across_a_street() {
        let touching = |other: NodeGeometry| {
            let nodes = [strip(0.0, 0.0), other];
            touches(&rims(&nodes, &open_of(&nodes)))
        };
        let beside = touching(strip(1.25, 0.3));
        assert_eq!(beside.len(), 16, "{beside:?}");
        let width = |touch: &Touch, nodes: &[NodeGeometry]| {
            let surfaces: Vec<Surface> = nodes.iter().map(drawn).collect();
            touch.width(surfaces.iter(), 4.0)
        };
        // From one end to the other: the last edges are beside a strip that has ended.
        let whole = beside.iter().filter(|touch| (0.4..7.9).contains(&touch.middle.x));
        let all = |nodes: &[NodeGeometry], expected: f64| {
            for touch in whole.clone() {
                assert!((width(touch, nodes) - expected).abs() < 1e-6, "{touch:?}");
            }
        };
        assert!(whole.clone().count() >= 14);
        all(&[strip(0.0, 0.0), strip(1.25, 0.3)], 0.25);
        all(&[strip(-0.5, 0.0), strip(1.5, 0.3)], 1.0);
        all(&[strip(0.0, 0.0), strip(0.9, 0.3)], 0.0);
        all(&[strip(-20.0, 0.0)], 16.0);
        let mut sunk = strip(0.5, 0.0);
        sunk.positions.iter_mut().for_each(|p| p[2] = -3.0);
        all(&[sunk], 0.0);
        assert_eq!(touching(strip(1.75, 0.3)), []);
        // One above the other, their borders in line, both surfaces on the same side.
        let mut above = strip(0.0, 0.0);
        above.positions.iter_mut().for_each(|p| p[2] = 0.25);
        assert_eq!(touching(above), []);
    }

    #[test]
    fn widths_are_told_beside_those_of_the_source() {
        let widths = (0..100).map(|n| [0.25, if n < 98 { 0.25 } else { f64::from(n) }]).collect();
        let SlitFigures { points, closed, widest_in_source, p99, widest, .. } =
            figures(0, 1, widths);
        assert_eq!((points, closed), (100, 98));
        assert_eq!([widest_in_source, p99, widest], [0.25, 98.0, 99.0]);
    }
}
