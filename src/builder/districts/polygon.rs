//! What skirts cover in a plane.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::builder::districts::cuts::is_strip;

/// What a strip's corners may be off, as a share of its sides.
const ROUNDING: f64 = 1e-3;

/// Where along an edge it has to be in what covers it: its ends may have moved, and one that crosses a
/// strip is not covered by it.
const WITHIN: [f64; 3] = [0.25, 0.5, 0.75];

/// Edges of a chain: its place, and theirs.
pub type Run = (usize, Range<usize>);

/// The coordinates of a point in a plane across `axis`.
pub fn flattened(point: DVec3, axis: usize) -> DVec2 {
    match axis {
        0 => DVec2::new(point.y, point.z),
        1 => DVec2::new(point.x, point.z),
        _ => DVec2::new(point.x, point.y),
    }
}

/// The way back from [`flattened`].
pub fn raised(point: DVec2, axis: usize, coordinate: f32) -> [f32; 3] {
    let [u, v] = point.as_vec2().to_array();
    match axis {
        0 => [coordinate, u, v],
        1 => [u, coordinate, v],
        _ => [u, v, coordinate],
    }
}

/// A convex polygon in a plane, counter-clockwise.
#[derive(PartialEq)]
pub struct Polygon {
    /// In order.
    pub corners: Vec<DVec2>,
    /// Where it has a corner beside the plane: that, and the nearest of those in the plane, to which the
    /// border goes on from there.
    pub joint: Option<[DVec2; 2]>,
}

impl Polygon {
    /// `None` where a skirt is not in the plane, or has no area there.
    pub fn new(skirt: &[DVec3], axis: usize, coordinate: f64) -> Option<Self> {
        if !is_strip(&skirt.iter().map(|at| at.to_array()).collect::<Vec<_>>(), axis, coordinate) {
            return None;
        }
        let mut corners: Vec<DVec2> = skirt.iter().map(|&at| flattened(at, axis)).collect();
        let in_plane = |corner: &usize| skirt[*corner][axis] == coordinate;
        let mut beside = (0..skirt.len()).filter(|corner| !in_plane(corner));
        let joint = match [beside.next(), beside.next()] {
            [Some(end), None] => {
                let from = |corner: &usize| skirt[*corner].distance_squared(skirt[end]);
                let next = (0..skirt.len()).filter(in_plane);
                let next = next.min_by(|a, b| from(a).total_cmp(&from(b)));
                next.map(|next| [corners[end], corners[next]])
            }
            _ => None,
        };
        let next = |at: usize| (at + 1) % corners.len();
        let area: f64 = (0..corners.len()).map(|at| corners[at].perp_dot(corners[next(at)])).sum();
        if area < 0.0 {
            corners.reverse();
        }
        (area != 0.0).then_some(Self { corners, joint })
    }

    /// Whether a point is in it, or beside one of its sides by no more than rounding leaves of being on it.
    fn contains(&self, point: DVec2) -> bool {
        (0..self.corners.len()).all(|at| {
            let (a, b) = (self.corners[at], self.corners[(at + 1) % self.corners.len()]);
            let along = b - a;
            along.perp_dot(point - a) >= -ROUNDING * along.length_squared()
        })
    }

    /// Edges that it covers: those of the district, and of its neighbours alone.
    pub fn runs(&self, chains: &[Vec<DVec2>], is_own: &[Vec<bool>]) -> [Vec<Run>; 2] {
        let mut runs = [Vec::new(), Vec::new()];
        for (chain, (points, is_own)) in chains.iter().zip(is_own).enumerate() {
            let covered = |edge: usize| {
                let at = |share: f64| points[edge].lerp(points[edge + 1], share);
                WITHIN.iter().all(|&share| self.contains(at(share))).then_some(is_own[edge])
            };
            let mut first = 0;
            while first + 1 < points.len() {
                let of_run = covered(first);
                let goes_on = |&edge: &usize| covered(edge) == of_run;
                let end = first + 1 + (first + 1..points.len() - 1).take_while(goes_on).count();
                if let Some(is_own) = of_run {
                    runs[usize::from(!is_own)].push((chain, first..end));
                }
                first = end;
            }
        }
        runs
    }

    /// The chain and edge of the district that its middle is beside and nearest to, no farther than it reaches
    /// itself. What is beyond the ends of an edge is of a border that closed inside of the district.
    pub fn nearest_edge(&self, chains: &[Vec<DVec2>], is_own: &[Vec<bool>]) -> Option<Run> {
        let middle = self.corners.iter().sum::<DVec2>() / self.corners.len() as f64;
        let reach = self.corners.iter().map(|at| at.distance(middle)).fold(0.0, f64::max);
        let edges = chains.iter().enumerate().flat_map(|(chain, points)| {
            points.windows(2).enumerate().map(move |(edge, ends)| (chain, edge, ends))
        });
        let edges = edges.filter(|&(chain, edge, _)| is_own[chain][edge]);
        let off = |ends: &[DVec2]| {
            let along = ends[1] - ends[0];
            let at = (middle - ends[0]).dot(along) / along.length_squared();
            (0.0..=1.0).contains(&at).then(|| middle.distance(ends[0] + along * at))
        };
        let beside = edges.filter_map(|(chain, edge, ends)| Some((off(ends)?, chain, edge)));
        let nearest = beside.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= reach).then_some((nearest.1, nearest.2..nearest.2 + 1))
    }

    /// Divides what of it is in the slab around a polyline among its edges, and adds the corners of each
    /// share to what is beside that edge.
    pub fn share_out(&self, line: &[DVec2], beside: &mut [Vec<DVec2>]) {
        let Slab { along, low, high } = Slab::around(line);
        let mut rest = clip(&clip(&self.corners, along, low), -along, -high);
        let mut from = f64::NEG_INFINITY;
        for (edge, beside) in beside.iter_mut().enumerate() {
            if edge + 2 == line.len() {
                beside.append(&mut rest);
                break;
            }
            // Where the polyline turns back, what was shared out already stays.
            from = from.max(line[edge + 1].dot(along));
            beside.append(&mut clip(&rest, -along, -from));
            rest = clip(&rest, along, from);
        }
    }
}

/// What is beside a polyline or no farther beyond its ends than these are apart: the border that a
/// strip covers farther away is not of the polyline.
pub struct Slab {
    /// From the polyline's first point to the one farthest from that.
    along: DVec2,
    low: f64,
    high: f64,
}

impl Slab {
    /// Around a polyline of two points or more.
    pub fn around(line: &[DVec2]) -> Self {
        let from_first = |at: &DVec2| at.distance_squared(line[0]);
        let farthest = line.iter().max_by(|a, b| from_first(a).total_cmp(&from_first(b)));
        let along = farthest.map_or(DVec2::ZERO, |at| at - line[0]);
        let places = line.iter().map(|at| at.dot(along));
        let (low, high) = places.fold((f64::MAX, f64::MIN), |(a, b), at| (a.min(at), b.max(at)));
        let beyond = high - low;
        Self { along, low: low - beyond, high: high + beyond }
    }

    /// Whether a point is in it.
    pub fn contains(&self, point: DVec2) -> bool {
        (self.low..=self.high).contains(&point.dot(self.along))
    }
}

/// What of a polygon is not before `least` along a direction.
fn clip(corners: &[DVec2], along: DVec2, least: f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(corners.len() + 2);
    for (at, &corner) in corners.iter().enumerate() {
        let next = corners[(at + 1) % corners.len()];
        let (here, there) = (corner.dot(along) - least, next.dot(along) - least);
        if here >= 0.0 {
            kept.push(corner);
        }
        if (here > 0.0) != (there > 0.0) && here != there {
            kept.push(corner + (next - corner) * (here / (here - there)));
        }
    }
    kept
}
