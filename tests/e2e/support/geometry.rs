//! Plain geometry, written without the library's.

use glam::DVec3;

use super::Random;

/// A triangle.
pub type Triangle = [DVec3; 3];

/// Its area.
pub fn area([a, b, c]: Triangle) -> f64 {
    (b - a).cross(c - a).length() / 2.0
}

/// Points drawn evenly from a surface, each with the number of its triangle.
pub fn sample(triangles: &[Triangle], count: usize, random: &mut Random) -> Vec<(usize, DVec3)> {
    let mut sums = Vec::with_capacity(triangles.len());
    let mut sum = 0.0;
    for &triangle in triangles {
        sum += area(triangle);
        sums.push(sum);
    }
    (0..count)
        .map(|_| {
            let at = random.between(0.0, sum);
            let number = sums.partition_point(|&upto| upto < at).min(triangles.len() - 1);
            let [a, b, c] = triangles[number];
            let [x, y, z] = barycentric(random);
            (number, a * x + b * y + c * z)
        })
        .collect()
}

/// Random weights of three corners, evenly over the triangle.
pub fn barycentric(random: &mut Random) -> [f64; 3] {
    let (u, v) = (random.unit(), random.unit());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    [1.0 - u - v, u, v]
}

/// The nearest point of a triangle, as weights of its corners: the projection where it is
/// inside, else the nearest point of the three sides.
pub fn nearest(p: DVec3, [a, b, c]: Triangle) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d00, d01, d11) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
    let (d20, d21) = (ap.dot(ab), ap.dot(ac));
    let determinant = d00 * d11 - d01 * d01;
    if determinant > 0.0 {
        let v = (d11 * d20 - d01 * d21) / determinant;
        let w = (d00 * d21 - d01 * d20) / determinant;
        if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
            return [1.0 - v - w, v, w];
        }
    }
    let on = |from: DVec3, to: DVec3| {
        let length = (to - from).length_squared();
        if length > 0.0 { ((p - from).dot(to - from) / length).clamp(0.0, 1.0) } else { 0.0 }
    };
    let (s, t, u) = (on(a, b), on(b, c), on(c, a));
    [[1.0 - s, s, 0.0], [0.0, 1.0 - t, t], [u, 0.0, 1.0 - u]]
        .into_iter()
        .min_by(|one, other| {
            let distance = |w: &[f64; 3]| p.distance_squared(at([a, b, c], *w));
            distance(one).total_cmp(&distance(other))
        })
        .unwrap()
}

/// The point with these weights.
pub fn at([a, b, c]: Triangle, [x, y, z]: [f64; 3]) -> DVec3 {
    a * x + b * y + c * z
}

/// The triangle nearest to a point: its number, the weights of its corners there, the distance.
pub fn nearest_of(p: DVec3, triangles: &[Triangle]) -> (usize, [f64; 3], f64) {
    let mut best = (0, [1.0, 0.0, 0.0], f64::INFINITY);
    for (number, &triangle) in triangles.iter().enumerate() {
        // No point of the triangle is nearer than its box.
        let low = triangle[0].min(triangle[1]).min(triangle[2]);
        let high = triangle[0].max(triangle[1]).max(triangle[2]);
        if p.distance_squared(p.clamp(low, high)) >= best.2 * best.2 {
            continue;
        }
        let weights = nearest(p, triangle);
        let distance = p.distance(at(triangle, weights));
        if distance < best.2 {
            best = (number, weights, distance);
        }
    }
    best
}
