//! Places where planes across axes meet a triangle, the same wherever they are computed.
//!
//! A place on an edge is a function of the edge's ends and one plane, a place within a triangle of its
//! corners and two planes. So whoever cuts the triangle, or another one with that edge, finds the same
//! coordinates in every bit: blocks that have a side in common need not know of each other.

use glam::DVec3;

use crate::lattice::Lattice;
use crate::mesh::{key, wide};

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPlane {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Coordinate on that axis.
    pub at: f64,
}

/// A place of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Source coordinates, on the lattice.
    pub position: [f64; 3],
    /// Shares of the three corners, which sum up to 1.
    pub weights: [f64; 3],
}

/// A straight line across a triangle: one of its edges, or the intersection with a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// The edge from this corner to the next.
    Edge(usize),
    /// The section with a plane.
    Section(AxisPlane),
}

/// A triangle whose corners are on a lattice.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Source coordinates.
    pub corners: [[f64; 3]; 3],
    /// Intersections are rounded to this lattice.
    pub lattice: Lattice,
}

impl Triangle {
    /// A corner.
    pub fn corner(&self, number: usize) -> Place {
        let mut weights = [0.0; 3];
        weights[number] = 1.0;
        Place { position: self.corners[number], weights }
    }

    /// Returns the intersection of a line with a plane that separates its ends.
    pub fn crossing(&self, line: Line, plane: AxisPlane) -> Place {
        match line {
            Line::Edge(from) => self.on_edge(from, plane),
            Line::Section(other) => self.within(other, plane),
        }
    }

    /// Returns the intersection of the edge from a corner to the next with a plane.
    fn on_edge(&self, from: usize, plane: AxisPlane) -> Place {
        let to = (from + 1) % 3;
        let is_first = key(self.corners[from]) <= key(self.corners[to]);
        let [low, high] = if is_first { [from, to] } else { [to, from] };
        self.between(self.corner(low), self.corner(high), &[plane])
    }

    /// Returns the intersection of the triangle with two planes across different axes.
    fn within(&self, one: AxisPlane, other: AxisPlane) -> Place {
        let [first, second] = if one.axis < other.axis { [one, other] } else { [other, one] };
        let along = |[from, to]: [Place; 2], planes: &[AxisPlane]| {
            let is_first = key(from.position) <= key(to.position);
            let [low, high] = if is_first { [from, to] } else { [to, from] };
            self.between(low, high, planes)
        };
        match (self.section(first), self.section(second)) {
            (Some(ends), _) => along(ends, &[second, first]),
            (None, Some(ends)) => along(ends, &[first, second]),
            // Rounding put it there: a corner is in both planes.
            (None, None) => self.corner(0),
        }
    }

    /// The place between two where the first of some planes is, put into all of them.
    fn between(&self, low: Place, high: Place, planes: &[AxisPlane]) -> Place {
        let AxisPlane { axis, at } = planes[0];
        let (start, end) = (low.position[axis], high.position[axis]);
        let t = if end == start { 0.5 } else { ((at - start) / (end - start)).clamp(0.0, 1.0) };
        let mut position: [f64; 3] = std::array::from_fn(|i| {
            let exact = low.position[i] + (high.position[i] - low.position[i]) * t;
            // Adding 0 turns -0 into 0.
            self.lattice.round(exact) + 0.0
        });
        planes.iter().for_each(|plane| position[plane.axis] = plane.at);
        let weights = std::array::from_fn(|i| low.weights[i] * (1.0 - t) + high.weights[i] * t);
        Place { position, weights }
    }

    /// The ends of the section with a plane; `None` where no corner is beyond it on one of its sides.
    pub fn section(&self, plane: AxisPlane) -> Option<[Place; 2]> {
        let side = self.sides(plane);
        if !(side.contains(&-1) && side.contains(&1)) {
            return None;
        }
        let on = (0..3).filter(|&corner| side[corner] == 0).map(|corner| self.corner(corner));
        let across = (0..3)
            .filter(|&from| side[from] * side[(from + 1) % 3] < 0)
            .map(|from| self.on_edge(from, plane));
        let mut ends = on.chain(across);
        Some([ends.next()?, ends.next()?])
    }

    /// Returns for each corner -1 below a plane, 0 on it, 1 above it.
    pub fn sides(&self, plane: AxisPlane) -> [i8; 3] {
        self.corners.map(|corner| side(corner[plane.axis], plane.at))
    }

    /// Returns the corners.
    pub fn wide(&self) -> [DVec3; 3] {
        self.corners.map(wide)
    }
}

/// Returns -1 below a plane's coordinate, 0 on it, 1 above it.
pub fn side(coordinate: f64, at: f64) -> i8 {
    i8::from(coordinate > at) - i8::from(coordinate < at)
}
