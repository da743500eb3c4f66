//! Points spread over triangles by area.

use glam::DVec3;

use crate::random::Random;

/// A point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfacePoint {
    /// The triangle's number.
    pub triangle: u32,
    /// Weights of its corners.
    pub weights: [f64; 3],
    /// Source coordinates.
    pub point: DVec3,
}

/// Twice the area of a triangle, as a vector along its normal.
pub(super) fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The area of a triangle, square metres.
pub(super) fn area(corners: [DVec3; 3]) -> f64 {
    cross(corners).length() * 0.5
}

/// Draws points evenly from the triangles that are not left out: `density` a square metre on
/// average. One point is drawn from each of equal shares of the area (stratified), so that no part
/// is missed; equal seeds and streams give equal points.
pub(super) fn spread(
    triangles: impl Iterator<Item = (u32, [DVec3; 3])>,
    density: f64,
    seed: u64,
    stream: u64,
) -> Vec<SurfacePoint> {
    let mut random = Random::new(seed, stream);
    let mut points = Vec::new();
    // The area in units of one point, and where in the present unit its point is.
    let mut covered = 0.0;
    let mut unit = 0.0;
    let mut next = random.between(0.0, 1.0);
    for (triangle, corners) in triangles {
        covered += area(corners) * density;
        while covered >= next {
            let (u, v) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [a, b, c] = corners;
            let point = a + (b - a) * u + (c - a) * v;
            points.push(SurfacePoint { triangle, weights: [1.0 - u - v, u, v], point });
            unit += 1.0;
            next = unit + random.between(0.0, 1.0);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_as_dense_everywhere_and_the_same_each_time() {
        let right = |x: f64, side: f64| {
            [DVec3::new(x, 0.0, 0.0), DVec3::new(x + side, 0.0, 0.0), DVec3::new(x, side, 0.0)]
        };
        let triangles = [right(0.0, 2.0), right(10.0, 4.0), right(20.0, 6.0)];
        let draw = |seed| spread((0..).zip(triangles), 50.0, seed, 3);
        let points = draw(1);
        let count = |triangle| points.iter().filter(|point| point.triangle == triangle).count();
        for (triangle, expected) in [(0, 100), (1, 400), (2, 900)] {
            assert!(count(triangle).abs_diff(expected) <= 2, "{triangle}: {}", count(triangle));
        }
        for point in &points {
            let [a, b, c] = triangles[point.triangle as usize];
            let [x, y, z] = point.weights;
            assert!((a * x + b * y + c * z).distance(point.point) < 1e-12);
        }
        assert_eq!(points, draw(1));
        assert_ne!(points, draw(2));
    }
}
