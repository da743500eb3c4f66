//! The distance from a point to a triangle.

use glam::Vec3;

/// A triangle in a frame of its own, in which its longest side lies on the first axis, from the
/// origin on, and its apex above it. Needles, lines and points have such a frame too, though they
/// have no normal to speak of.
///
/// The distance takes no branch that could be foretold wrongly: it is asked for tens of times for
/// each triangle of a node.
pub(super) struct Triangle {
    origin: Vec3,
    along: Vec3,
    up: Vec3,
    normal: Vec3,
    /// Of the longest side.
    length: f32,
    apex: [f32; 2],
    /// One over the squared lengths of the sides from the apex to the origin and to the end of the
    /// longest side; 0 where they have none.
    per_squared: [f32; 2],
}

/// The corners in the same order round, so that the longest side lies between the first two.
pub(super) fn from_longest_side<T: Copy>([a, b, c]: [T; 3], at: impl Fn(T) -> Vec3) -> [T; 3] {
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| at(a).distance_squared(at(b)));
    if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Square of the height of a triangle over its longest side, below which it is a needle.
const NEEDLE_SQUARED: f32 = 1e-4;

/// Square of what a direction has aside of a needle, at least, to tell where its apex is.
const MOSTLY_ASIDE_SQUARED: f32 = 0.25;

impl Triangle {
    pub(super) fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = from_longest_side(corners, |corner| corner);
        let along = (b - a).try_normalize().unwrap_or(Vec3::X);
        let aside = |way: Vec3| way - along * way.dot(along);
        let mut up = aside(c - a);
        if up.length_squared() < NEEDLE_SQUARED * a.distance_squared(b) {
            // What is left of a needle's apex is rounding, which need not be square to its side.
            up = up.try_normalize().map_or(Vec3::ZERO, aside);
            // Of rounding that points along the side there is nothing left but rounding again.
            if up.length_squared() < MOSTLY_ASIDE_SQUARED {
                up = Vec3::ZERO;
            }
        }
        let up = up.try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
        let length = (b - a).dot(along);
        let [x, y] = [(c - a).dot(along), (c - a).dot(up)];
        let per = |squared: f32| if squared > 0.0 { 1.0 / squared } else { 0.0 };
        Self {
            origin: a,
            along,
            up,
            normal: along.cross(up),
            length,
            apex: [x, y],
            per_squared: [per(x * x + y * y), per((x - length) * (x - length) + y * y)],
        }
    }

    /// Squared distance of a point to the triangle's plane, which is never above that to the
    /// triangle.
    #[inline]
    pub(super) fn squared_height(&self, point: Vec3) -> f32 {
        self.normal.dot(point - self.origin).powi(2)
    }

    /// Squared distance of a point to the triangle.
    #[inline]
    pub(super) fn squared_distance(&self, point: Vec3) -> f32 {
        let way = point - self.origin;
        let (x, y) = (self.along.dot(way), self.up.dot(way));
        let height = self.normal.dot(way);
        let [apex_x, apex_y] = self.apex;
        // From the end of the longest side.
        let (x_end, apex_x_end) = (x - self.length, apex_x - self.length);
        // `clamp` would panic where coordinates overflow and the length is no number.
        #[allow(clippy::manual_clamp)]
        let to_longest = (x - x.max(0.0).min(self.length)).powi(2) + y * y;
        let to_side = |x: f32, apex_x: f32, per_squared: f32| {
            let share = ((x * apex_x + y * apex_y) * per_squared).clamp(0.0, 1.0);
            (x - share * apex_x).powi(2) + (y - share * apex_y).powi(2)
        };
        let to_sides = to_side(x, apex_x, self.per_squared[0]).min(to_side(
            x_end,
            apex_x_end,
            self.per_squared[1],
        ));
        // The longest side has acute angles at both ends: above it, it is never the nearest.
        let is_between = x * apex_y > y * apex_x && x_end * apex_y < y * apex_x_end;
        let above = if is_between { 0.0 } else { to_sides };
        height * height + if y < 0.0 { to_longest } else { above }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What rounding leaves of the apex of a line may point along it.
    #[test]
    fn a_line_is_far_from_what_is_far_aside_of_it() {
        let mut state = 5u32;
        let mut steps = |most: u32| {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            f32::from((state >> 16) as u16 % most as u16) / 128.0
        };
        for _ in 0..20_000 {
            let a = Vec3::new(steps(60_000), steps(60_000), steps(9_000));
            let along = Vec3::new(steps(4), steps(4), steps(4) + 1.0 / 128.0);
            let (near, far) =
                (1.0 + (steps(40) * 128.0).round(), 50.0 + (steps(900) * 128.0).round());
            let triangle = Triangle::new([a, a + along * near, a + along * far]);
            let aside = along.normalize().any_orthonormal_vector() * 30.0;
            let found = triangle.squared_distance(a + along * (near + far) * 0.5 + aside).sqrt();
            assert!((found - 30.0).abs() < 0.05, "{found} from {a}, {along}, {near}, {far}");
        }
    }

    /// Against the nearest of many points of the triangle, none of which is nearer than it is.
    #[test]
    fn no_triangle_is_nearer_than_its_points() {
        let mut state = 11u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for case in 0..400 {
            let mut point = || Vec3::new(random() * 100.0, random() * 100.0, random() * 5.0);
            let (p, a, far) = (point(), point(), point());
            // A triangle, a needle, a line, two corners in one place, and a point.
            let [b, c] = match case % 5 {
                0 => [far, point()],
                1 => [far, a + (far - a) * 0.4 + Vec3::new(1e-5, -2e-5, 1e-5)],
                2 => [far, a + (far - a) * 0.3],
                3 => [a, far],
                _ => [a, a],
            };
            let found = Triangle::new([a, b, c]).squared_distance(p).sqrt();
            let mut nearest = f32::INFINITY;
            for i in 0..=200u8 {
                for j in 0..=200 - i {
                    let (u, v) = (f32::from(i) / 200.0, f32::from(j) / 200.0);
                    nearest = nearest.min(p.distance(a + (b - a) * u + (c - a) * v));
                }
            }
            assert!(found <= nearest + 1e-3, "case {case}: {found}, a point at {nearest}");
            let spacing = (b - a).length().max((c - a).length()) / 200.0;
            assert!(found >= nearest - spacing - 1e-3, "case {case}: {found} below {nearest}");
        }
    }
}
