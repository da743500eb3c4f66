//! In which order the vertices of a border may go: by what their removal does to the surfaces that
//! meet there.
//!
//! Garland and Heckbert's quadrics ("Surface simplification using quadric error metrics", 1997) on
//! polylines. All triangles around a vertex pass through it, so the quadric of their planes is a
//! symmetric form of the offset from it. A removed vertex stays with its chord, as what is left of
//! the surface follows that: a removal costs what it adds to the sum over all vertices that are
//! gone of their quadrics at the nearest point of their chord. Errors of the surface across the
//! border count so with the area that they move, and those along the surface hardly at all, however
//! far the polyline bends in the cutting plane.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::builder::constants::BorderConstants;

/// The summed squared distances, weighted by area, of a point from planes through one vertex; a
/// function of its offset from the vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceQuadric {
    /// xx, yy, zz, xy, xz, yz.
    terms: [f64; 6],
}

impl SurfaceQuadric {
    /// Returns the coefficients in the order xx, yy, zz, xy, xz, yz.
    pub fn terms(&self) -> [f64; 6] {
        self.terms
    }

    /// Makes one of these coefficients.
    pub fn from_terms(terms: [f64; 6]) -> Self {
        Self { terms }
    }

    /// Adds the plane of a triangle that has the vertex.
    pub fn add_triangle(&mut self, [a, b, c]: [DVec3; 3]) {
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        if length <= 0.0 {
            return;
        }
        // The outer product of the unit normal, by the area.
        let scaled = normal * (0.5 / length);
        let add = [
            normal.x * scaled.x,
            normal.y * scaled.y,
            normal.z * scaled.z,
            normal.x * scaled.y,
            normal.x * scaled.z,
            normal.y * scaled.z,
        ];
        self.terms.iter_mut().zip(add).for_each(|(term, add)| *term += add);
    }

    /// Its value at an offset from the vertex.
    fn at(&self, offset: DVec3) -> f64 {
        let [xx, yy, zz, xy, xz, yz] = self.terms;
        let DVec3 { x, y, z } = offset;
        x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z
    }
}

/// A polyline whose ends stay; a loop has its first vertex again at its end.
#[derive(Clone, Debug)]
pub struct Polyline {
    /// Positions along it.
    pub points: Vec<DVec3>,
    /// Of each, the planes around it.
    pub surfaces: Vec<SurfaceQuadric>,
}

/// A vertex on its way out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Removal {
    /// The polyline's number.
    pub line: u32,
    /// Its index there.
    pub index: u32,
    /// No vertex between the neighbours that it leaves is farther from their chord, metres.
    pub deviation: f64,
}

/// All inner vertices of polylines in the order in which they go; those that never may, because a
/// loop would fold flat without them, are left out.
pub fn removals(lines: &[Polyline], constants: &BorderConstants) -> Vec<Removal> {
    let mut chains: Vec<Thinning> =
        lines.iter().map(|line| Thinning::new(line, constants)).collect();
    let mut heap = BinaryHeap::new();
    for (number, chain) in (0..).zip(&chains) {
        for index in 1..chain.line.points.len().saturating_sub(1) {
            heap.push(Reverse(chain.candidate(number, index)));
        }
    }
    let mut order = Vec::with_capacity(heap.len());
    while let Some(Reverse(candidate)) = heap.pop() {
        let Candidate { line, index, ends, deviation, .. } = candidate;
        let chain = &mut chains[line as usize];
        let at = index as usize;
        if chain.ends(at) != ends || chain.left <= chain.least {
            continue;
        }
        chain.remove(at);
        order.push(Removal { line, index, deviation });
        for end in ends.map(|end| end as usize) {
            if end != 0 && end != chain.line.points.len() - 1 {
                heap.push(Reverse(chain.candidate(line, end)));
            }
        }
    }
    order
}

/// A removal that was worth so much when its neighbours were these.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    cost: f64,
    line: u32,
    index: u32,
    ends: [u32; 2],
    deviation: f64,
}

impl Candidate {
    /// By cost; of equals the shortest chord, so that straight lines thin evenly.
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let length = |of: &Self| of.ends[1] - of.ends[0];
        self.cost.total_cmp(&other.cost).then_with(|| length(self).cmp(&length(other))).then_with(
            || (self.line, self.index, self.ends).cmp(&(other.line, other.index, other.ends)),
        )
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.order(other).is_eq()
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order(other)
    }
}

/// Vertices at which a longer chord is measured: time stays proportional to vertices.
const CHORD_SAMPLES: usize = 64;

/// A polyline that becomes shorter.
struct Thinning<'a> {
    line: &'a Polyline,
    /// Of each vertex, the weight of its distance from the chord.
    weights: Vec<f64>,
    previous: Vec<u32>,
    next: Vec<u32>,
    /// Of each vertex that is left, the cost of what is gone between it and the next.
    costs: Vec<f64>,
    /// Inner vertices that are left.
    left: usize,
    /// As few may be.
    least: usize,
}

impl<'a> Thinning<'a> {
    fn new(line: &'a Polyline, constants: &BorderConstants) -> Self {
        let count = line.points.len();
        let length = |at: usize| line.points[at].distance(line.points[at + 1]);
        let weight = |at: usize| match at {
            0 => 0.0,
            _ if at + 1 == count => 0.0,
            _ => constants.line_weight * (0.5 * (length(at - 1) + length(at))).powi(2),
        };
        // A loop that keeps fewer than three of its vertices would fold flat.
        let is_loop = count > 3 && line.points[0] == line.points[count - 1];
        Self {
            line,
            weights: (0..count).map(weight).collect(),
            previous: (0..count as u32).map(|at| at.saturating_sub(1)).collect(),
            next: (1..=count as u32).collect(),
            costs: vec![0.0; count],
            left: count.saturating_sub(2),
            least: if is_loop { 2 } else { 0 },
        }
    }

    fn ends(&self, at: usize) -> [u32; 2] {
        [self.previous[at], self.next[at]]
    }

    fn candidate(&self, line: u32, at: usize) -> Candidate {
        let ends = self.ends(at);
        let (cost, deviation) = self.chord(ends);
        let before = self.costs[ends[0] as usize] + self.costs[at];
        // Never less than nothing: the order must not depend on what rounding makes of equals.
        Candidate { cost: (cost - before).max(0.0), line, index: at as u32, ends, deviation }
    }

    /// What a chord costs and how far its vertices are from it.
    fn chord(&self, [from, to]: [u32; 2]) -> (f64, f64) {
        let [from, to] = [from as usize, to as usize];
        let (start, along) =
            (self.line.points[from], self.line.points[to] - self.line.points[from]);
        let squared = along.length_squared();
        let inner = to - from - 1;
        let samples = inner.min(CHORD_SAMPLES);
        let (mut cost, mut farthest) = (0.0, 0f64);
        for sample in 0..samples {
            let at = from + 1 + sample * inner / samples;
            let offset = self.line.points[at] - start;
            let t = if squared > 0.0 { (offset.dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
            let beside = along * t - offset;
            let distance = beside.length_squared();
            cost += self.line.surfaces[at].at(beside).max(0.0) + self.weights[at] * distance;
            farthest = farthest.max(distance);
        }
        (cost * inner as f64 / samples.max(1) as f64, farthest.sqrt())
    }

    fn remove(&mut self, at: usize) {
        let [previous, next] = self.ends(at);
        self.next[previous as usize] = next;
        self.previous[next as usize] = previous;
        self.costs[previous as usize] = self.chord([previous, next]).0;
        // What is gone has no neighbours, and candidates for it are void.
        (self.previous[at], self.next[at]) = (u32::MAX, u32::MAX);
        self.left -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polyline along y, its quadrics those of upright strips to both sides of the plane x = 0
    /// whose slope across it is `slope`.
    fn line(heights: &[f64], slope: f64) -> Polyline {
        let points: Vec<DVec3> =
            (0..).zip(heights).map(|(y, &z)| DVec3::new(0.0, f64::from(y), z)).collect();
        let mut surfaces = vec![SurfaceQuadric::default(); points.len()];
        for at in 1..points.len() {
            let ends = [points[at - 1], points[at]];
            for side in [-1.0, 1.0] {
                let beyond = ends[0] + DVec3::new(side, 0.0, side * slope);
                surfaces[at - 1].add_triangle([ends[0], ends[1], beyond]);
                surfaces[at].add_triangle([ends[0], ends[1], beyond]);
            }
        }
        Polyline { points, surfaces }
    }

    fn order(lines: &[Polyline]) -> Vec<(u32, u32)> {
        removals(lines, &BorderConstants::default())
            .iter()
            .map(|removal| (removal.line, removal.index))
            .collect()
    }

    #[test]
    fn a_quadric_is_the_squared_distance_from_the_planes_by_area() {
        let mut quadric = SurfaceQuadric::default();
        quadric.add_triangle([DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 3.0]);
        assert_eq!(quadric.at(DVec3::new(7.0, -5.0, 2.0)), 3.0 * 4.0);
        quadric.add_triangle([DVec3::ZERO, DVec3::Y, DVec3::Z * 2.0]);
        quadric.add_triangle([DVec3::ZERO, DVec3::X, DVec3::X * 2.0]);
        assert_eq!(quadric.at(DVec3::new(-7.0, -5.0, 2.0)), 12.0 + 49.0);
        // Of slanted planes alike.
        let corners = [[1.0, 2.0, 0.5], [0.0, 1.0, 3.0], [2.0, -1.0, 1.0]].map(DVec3::from);
        let mut slanted = SurfaceQuadric::default();
        slanted.add_triangle(corners);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let offset = DVec3::new(0.3, -0.7, 1.1);
        let expected = 0.5 * normal.dot(offset).powi(2) / normal.length();
        assert!((slanted.at(offset) - expected).abs() < 1e-12);
    }

    #[test]
    fn what_bends_along_the_surface_goes_before_what_bends_across_it() {
        // Along an almost upright wall in the plane a bump is hardly off the wall.
        let bump = [0.0, 0.0, 0.5, 0.0, 0.0];
        let lines = [line(&bump, 0.0), line(&bump, 100.0)];
        let order = order(&lines);
        let place = |vertex| order.iter().position(|&at| at == vertex).unwrap();
        assert!(place((1, 2)) < place((0, 2)), "{order:?}");
    }

    #[test]
    fn flat_parts_go_first_and_evenly() {
        let mut heights = [0.0; 65];
        heights[40] = 1.0;
        let order = order(&[line(&heights, 0.0)]);
        assert_eq!(order.len(), 63);
        let mut last: Vec<u32> = order[60..].iter().map(|&(_, at)| at).collect();
        last.sort_unstable();
        assert_eq!(last, [39, 40, 41], "the peak and its feet are last");
        // Every second one of the straight part before any chord is longer.
        assert!(order[..8].iter().all(|&(_, at)| at % 2 == 1), "{:?}", &order[..8]);
    }

    #[test]
    fn the_farthest_vertex_from_the_chord_is_known_and_loops_stay_open() {
        let zigzag = [0.0, 0.25, 0.0, 0.25, 0.0];
        let last = *removals(&[line(&zigzag, 0.0)], &BorderConstants::default()).last().unwrap();
        assert_eq!(last.deviation, 0.25);
        let round: Vec<DVec3> = (0..=12)
            .map(|at| {
                DVec3::new(0.0, (f64::from(at % 12) * 0.5).cos(), (f64::from(at % 12) * 0.5).sin())
            })
            .collect();
        let surfaces = vec![SurfaceQuadric::default(); round.len()];
        assert_eq!(
            removals(&[Polyline { points: round, surfaces }], &BorderConstants::default()).len(),
            11 - 2
        );
        assert!(
            removals(&[line(&[0.0, 1.0], 0.0), line(&[], 0.0)], &BorderConstants::default())
                .is_empty()
        );
    }
}
