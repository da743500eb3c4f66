//! A triangle of a flat chart, onto which the original is drawn along its own normal.

use glam::{DVec2, DVec3, Vec3A};

use super::chart_plane::ChartPlane;
use crate::mesh::Mesh;

/// The least cosine between a triangle's normal and its chart's: with less it is seen from its edge.
const LEAST_FACING: f64 = 0.1;

/// A triangle's plane over the samples of its chart, and how far from it the original is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Unit length.
    pub normal: DVec3,
    /// From the plane, metres.
    pub reach: f64,
    /// Height over the chart's plane, metres: at sample (0, 0), by column, by row.
    height: [f64; 3],
    /// Where a step of one metre along the normal leads: columns, rows, metres of height.
    step: DVec3,
    /// Its sides as half planes: a sample lies in the triangle, or no farther beside it than is seen,
    /// where `[0] + x * [1] + y * [2]` is at least 0 for each.
    sides: [[f64; 3]; 3],
}

impl Facet {
    /// The plane of a triangle of a mesh; `None` where it has hardly any area or is seen from its
    /// edge. `reach` is in metres; samples up to `beside` beside the triangle are seen.
    pub fn new(
        plane: &ChartPlane,
        mesh: &Mesh,
        triangle: [u32; 3],
        reach: f64,
        beside: f64,
    ) -> Option<Self> {
        let corners = mesh.corners(triangle);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let facing = normal.dot(plane.normal);
        let projected = corners.map(|corner| plane.project(corner));
        let [a, b, c] = projected.map(DVec3::truncate);
        let doubled = (b - a).perp_dot(c - a);
        if facing < LEAST_FACING || doubled.abs() <= 1e-6 {
            return None;
        }
        let step = DVec3::new(
            normal.dot(plane.right) * plane.scale,
            normal.dot(plane.up) * plane.scale,
            facing,
        );
        // Across the normal, whatever rounding did to the corners of a sliver.
        let slopes = step.truncate() / (-facing * plane.scale * plane.scale);
        let middle = projected.into_iter().sum::<DVec3>() / 3.0;
        let height = [middle.z - slopes.dot(middle.truncate()), slopes.x, slopes.y];
        let turn = doubled.signum();
        let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| {
            let inward = (to - from).perp() * turn;
            let beside = beside * (inward.x.abs() + inward.y.abs());
            [beside - inward.dot(from), inward.x, inward.y]
        });
        let finite = height.iter().all(|value| value.is_finite());
        finite.then_some(Self { normal, reach, height, step, sides })
    }

    /// The height of the plane at a sample, metres.
    pub fn height(&self, sample: DVec2) -> f64 {
        let [first, x, y] = self.height;
        first + x * sample.x + y * sample.y
    }

    /// Where the line along the normal through a point, in samples and metres over the chart, meets
    /// the plane, in samples, and how far above the plane the point is, metres.
    #[inline]
    pub fn project(&self, point: DVec3) -> (DVec2, f64) {
        let above = (point.z - self.height(point.truncate())) * self.step.z;
        (point.truncate() - self.step.truncate() * above, above)
    }

    /// True where a triangle with these corners lies beside this one, farther than is seen.
    #[inline]
    pub fn is_beside(&self, corners: [DVec2; 3]) -> bool {
        self.sides
            .iter()
            .any(|&[at, x, y]| corners.iter().all(|corner| at + x * corner.x + y * corner.y < 0.0))
    }

    /// The box, in samples and metres over the chart, of what is within reach of the plane over the
    /// samples from `low` to `high`.
    pub fn bounds(&self, low: DVec2, high: DVec2) -> [Vec3A; 2] {
        let heights = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)]
            .map(|corner| self.height(corner));
        let lowest = heights.into_iter().fold(f64::INFINITY, f64::min);
        let highest = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let grown = self.step.abs() * self.reach;
        [low.extend(lowest) - grown, high.extend(highest) + grown].map(|corner| corner.as_vec3a())
    }
}
