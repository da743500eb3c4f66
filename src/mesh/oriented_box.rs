//! Boxes with axes of their own.
//!
//! The triangles of a fan are long and thin, and lie across the axes: many axis-aligned boxes overlap, all of
//! which hold a point near their common corner, and a search would go into each. Boxes along the
//! triangles are as thin as these (Gottschalk, Lin and Manocha 1996, "OBBTree").

use glam::{DVec3, Vec3};

/// By what share of itself a coordinate along an axis may be wrong.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

/// A box in f32, somewhat larger than what it is around.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrientedBox {
    pub origin: Vec3,
    pub axes: [Vec3; 3],
    /// Along the axes, from the origin.
    pub low: Vec3,
    pub high: Vec3,
}

impl OrientedBox {
    /// Infinitely far from everything.
    pub const EMPTY: Self = Self {
        origin: Vec3::ZERO,
        axes: [Vec3::ZERO; 3],
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
    };

    /// Around triangles, along the one with the longest edge.
    pub fn around(triangles: impl Iterator<Item = [Vec3; 3]> + Clone) -> Self {
        let longest = |[a, b, c]: [Vec3; 3]| {
            let squared = |from: Vec3, to: Vec3| from.distance_squared(to);
            squared(a, b).max(squared(b, c)).max(squared(c, a))
        };
        let longer = |one, other| if longest(other) > longest(one) { other } else { one };
        let Some(frame) = triangles.clone().reduce(longer) else { return Self::EMPTY };
        let (origin, axes) = (frame[0], axes_of(frame));
        let along_axes = |way: Vec3| Vec3::from(axes.map(|axis| way.dot(axis)));
        let (mut low, mut high, mut farthest) = (Vec3::ZERO, Vec3::ZERO, 0f32);
        for corner in triangles.flatten() {
            let way = corner - origin;
            let at = along_axes(way);
            (low, high, farthest) = (low.min(at), high.max(at), farthest.max(way.length()));
        }
        let slack = ROUNDING * farthest;
        Self { origin, axes, low: low - slack, high: high + slack }
    }

    /// The squared distance of a point from the box, or somewhat less.
    #[inline(always)]
    pub fn squared_distance(&self, point: Vec3) -> f32 {
        let way = point - self.origin;
        let at = Vec3::from(self.axes.map(|axis| way.dot(axis)));
        let outside = (self.low - at).max(at - self.high).max(Vec3::ZERO);
        outside.length_squared() * Self::LESS
    }

    /// The factor of squared distances, so that rounding makes none too large.
    pub const LESS: f32 = 1.0 - 2.0 * ROUNDING;
}

/// The direction of a triangle's longest edge, across it in the triangle's plane, and the normal.
fn axes_of(corners: [Vec3; 3]) -> [Vec3; 3] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let edges = [b - a, c - b, a - c];
    let longer = |one: DVec3, other: DVec3| {
        if other.length_squared() > one.length_squared() { other } else { one }
    };
    let along = edges.into_iter().fold(DVec3::ZERO, longer).try_normalize().unwrap_or(DVec3::X);
    let normal = edges[0].cross(edges[1]).try_normalize();
    // A needle's normal may be anything.
    let normal = normal.filter(|normal| normal.dot(along).abs() < 1e-9);
    let normal = normal.unwrap_or_else(|| along.any_orthonormal_vector());
    [along, normal.cross(along), normal].map(|axis| axis.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn no_distance_is_larger_than_that_of_the_triangles() {
        let mut random = Random::new(8, 0);
        for round in 0..200 {
            let size = [1e-3, 1.0, 1e3][round % 3];
            let mut point =
                || Vec3::from([(); 3].map(|()| (random.between(-1.0, 1.0) * size) as f32));
            let thin = point() * 1e-4;
            let triangles: Vec<[Vec3; 3]> = (0..4)
                .map(|_| {
                    let [a, b] = [point(), point()];
                    [a, b, a + thin]
                })
                .collect();
            let around = OrientedBox::around(triangles.iter().copied());
            for [a, b, c] in &triangles {
                for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.3], [0.5, 0.5]] {
                    let inside = a + (b - a) * u + (c - a) * v;
                    let beside = inside + point() * 0.01;
                    let distance = f64::from(around.squared_distance(beside)).sqrt();
                    let most = beside.as_dvec3().distance(inside.as_dvec3());
                    assert!(distance <= most + 1e-6 * f64::from(size as f32), "{distance} {most}");
                }
            }
        }
        let none = OrientedBox::around([].into_iter());
        assert_eq!(none.squared_distance(Vec3::ZERO), f32::INFINITY);
    }
}
