//! The least polygon in a cutting plane that contains part of a border: a triangle or a rectangle.

use glam::DVec3;

use super::chain::distance_to_segment;
use super::skirt_rules::SkirtRules;
use crate::mesh::wide;

/// Rectangles reach this share of their own width beyond the polyline.
const MARGIN: f64 = 0.02;

/// Polygons reach so many lattice steps beyond the polyline, along and across: corners are rounded,
/// and must not come to lie short of its ends.
const ROUNDING_STEPS: f64 = 2.0;

/// A polyline that reaches so many times as far as its end comes back: its chord is not along it.
const TURNED: f64 = 2.0;

/// A polygon over a polyline and its chord.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cover {
    /// Corners in order around it, and at which end of the chord each lies.
    pub corners: Vec<([f32; 3], usize)>,
    /// How far it reaches across the chord, metres.
    pub height: f64,
}

impl Cover {
    /// The cover of a polyline in the plane across `axis`; `None` where it has nothing between its ends, or all of
    /// it is in one place.
    pub fn of(points: &[[f32; 3]], axis: usize, rules: &SkirtRules) -> Option<Self> {
        let [first, _, .., last] = points else { return None };
        if points.len() < 3 {
            return None;
        }
        let frame = Frame::new(wide(*first), direction(points, wide(*last)), axis)?;
        let SkirtRules { step, constants, .. } = rules;
        let rounding = ROUNDING_STEPS * step;
        // Along and across.
        let flat: Vec<[f64; 2]> = points.iter().map(|&point| frame.flat(wide(point))).collect();
        let mirrored: Vec<[f64; 2]> = flat.iter().map(|&[u, v]| [u, -v]).collect();
        let of = |at: usize| flat.iter().map(move |point| point[at]);
        let (from, to) = of(0).fold((0f64, 0f64), |(low, high), u| (low.min(u), high.max(u)));
        let (low, high) = of(1).fold((0f64, 0f64), |(low, high), v| (low.min(v), high.max(v)));
        let above = triangle(&flat, [from, to], low, rounding);
        let below = triangle(&mirrored, [from, to], -high, rounding)
            .map(|corners| corners.map(|[u, v]| [u, -v]));
        let size = |corners: &[[f64; 2]; 3]| {
            let [a, b, c] = *corners;
            ((c[1] - a[1]).abs(), (b[0] - a[0]).abs())
        };
        let most = (high - low) * constants.triangle_height + 2.0 * rounding;
        let length = to - from;
        let by_height = constants.overhang_heights * (high - low + rounding);
        let beyond = (constants.overhang * length).min(by_height);
        let overhang = length + 2.0 * beyond;
        let best = [above, below]
            .into_iter()
            .flatten()
            .filter(|corners| size(corners).0 <= most && size(corners).1 <= overhang)
            .min_by(|a, b| (size(a).0 * size(a).1).total_cmp(&(size(b).0 * size(b).1)));
        let middle = 0.5 * (from + to);
        if let Some(corners) = best {
            let height = size(&corners).0;
            let corners = corners.map(|[u, v]| (frame.point(u, v), usize::from(u > middle)));
            return Some(Self { corners: corners.to_vec(), height });
        }
        let margin = (high - low) * MARGIN + rounding;
        let (left, right) = (from - rounding, to + rounding);
        let (bottom, top) = (low - margin, high + margin);
        let corners = [(left, bottom, 0), (right, bottom, 1), (right, top, 1), (left, top, 0)];
        Some(Self {
            corners: corners.map(|(u, v, end)| (frame.point(u, v), end)).to_vec(),
            height: top - bottom,
        })
    }

    /// How many triangles it has.
    pub fn triangles(&self) -> usize {
        self.corners.len() - 2
    }
}

/// The triangle over points none of which is below `low`: its base below them, and beside both ends
/// the steepest line that leaves all points on one side. The apex is its last corner. `None` where
/// points rise upright at an end.
fn triangle(
    points: &[[f64; 2]],
    [from, to]: [f64; 2],
    low: f64,
    rounding: f64,
) -> Option<[[f64; 2]; 3]> {
    // Of the two sides, how steep.
    let mut slopes = [0f64; 2];
    for &[u, v] in points {
        let rise = v - low;
        for (slope, run) in slopes.iter_mut().zip([u - from, to - u]) {
            if rise > 0.0 {
                *slope = slope.max(rise / run);
            }
        }
    }
    if !slopes.iter().all(|slope| slope.is_finite() && *slope > 0.0) {
        return None;
    }
    // Both sides and the base moved outwards.
    let out = slopes.map(|slope| rounding * (1.0 + slope.hypot(1.0)) / slope);
    let base = low - rounding;
    let (left, right) = (from - out[0], to + out[1]);
    let width = right - left;
    let apex = width * slopes[0] * slopes[1] / (slopes[0] + slopes[1]);
    Some([[left, base], [right, base], [left + apex / slopes[0], base + apex]])
}

/// The end of the chord, or where a polyline comes back to where it began, what is farthest from there.
fn direction(points: &[[f32; 3]], last: DVec3) -> DVec3 {
    let from = |at: DVec3| at.distance(wide(points[0]));
    let farthest = points.iter().map(|&at| wide(at)).max_by(|a, b| from(*a).total_cmp(&from(*b)));
    farthest.filter(|at| from(*at) > TURNED * from(last)).unwrap_or(last)
}

/// Coordinates along a chord and across it, in a plane.
struct Frame {
    start: DVec3,
    along: DVec3,
    across: DVec3,
}

impl Frame {
    /// `None` where the chord has no length.
    fn new(start: DVec3, end: DVec3, axis: usize) -> Option<Self> {
        let along = (end - start).try_normalize()?;
        let mut normal = DVec3::ZERO;
        normal[axis] = 1.0;
        Some(Self { start, along, across: normal.cross(along) })
    }

    fn flat(&self, point: DVec3) -> [f64; 2] {
        let from_start = point - self.start;
        [from_start.dot(self.along), from_start.dot(self.across)]
    }

    fn point(&self, u: f64, v: f64) -> [f32; 3] {
        (self.start + self.along * u + self.across * v).as_vec3().into()
    }
}

/// How far a polyline is from the segment between its ends, metres.
pub(in crate::builder) fn deviation(points: &[[f32; 3]]) -> f64 {
    let [first, .., last] = points else { return 0.0 };
    let (a, b) = (wide(*first), wide(*last));
    points.iter().map(|&point| distance_to_segment(wide(point), a, b)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 1e-6;

    fn rules() -> SkirtRules {
        SkirtRules { step: STEP, closed: STEP, constants: Default::default() }
    }

    fn cover(points: &[[f32; 2]]) -> Cover {
        let points: Vec<[f32; 3]> = points.iter().map(|&[y, z]| [0.0, y, z]).collect();
        let cover = Cover::of(&points, 0, &rules()).unwrap();
        for (at, &point) in points.iter().enumerate() {
            assert!(contains(&cover, point), "{at} of {points:?} is outside of {cover:?}");
        }
        cover
    }

    /// Whether a point in the plane x = 0 is inside, whichever way the polygon turns.
    fn contains(cover: &Cover, point: [f32; 3]) -> bool {
        let flat = |p: [f32; 3]| [f64::from(p[1]), f64::from(p[2])];
        let corners: Vec<[f64; 2]> = cover.corners.iter().map(|&(at, _)| flat(at)).collect();
        let p = flat(point);
        let side = |at: usize| {
            let (a, b) = (corners[at], corners[(at + 1) % corners.len()]);
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
        };
        let sides: Vec<f64> = (0..corners.len()).map(side).collect();
        sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0)
    }

    #[test]
    fn one_side_takes_one_triangle_and_two_sides_a_rectangle() {
        for sign in [1.0, -1.0] {
            let one = cover(&[[0.0, 0.0], [1.0, sign * 0.5], [3.0, 0.0]]);
            assert_eq!(one.triangles(), 1);
            assert!((one.height - 0.5).abs() < 1e-4, "{}", one.height);
            let arch = cover(&[[0.0, 0.0], [1.0, sign * 0.3], [2.0, sign * 0.4], [4.0, 0.0]]);
            assert_eq!(arch.triangles(), 1);
            // A step that rises upright at the start.
            let upright = cover(&[[0.0, 0.0], [0.0, sign], [4.0, sign], [4.0, 0.0]]);
            assert_eq!(upright.triangles(), 2);
        }
        assert_eq!(cover(&[[0.0, 0.0], [1.0, 0.5], [3.0, -0.25], [4.0, 0.0]]).triangles(), 2);
    }

    #[test]
    fn nothing_sticks_far_out_of_the_ends() {
        // Nearly level at one end, where the side of a triangle would be long.
        let points = [[0.0, 0.0], [0.01, 1e-6], [10.0, 0.0024], [12.0, 0.0]];
        for sign in [1.0, -1.0] {
            let cover = cover(&points.map(|[y, z]: [f32; 2]| [y, sign * z]));
            let along = cover.corners.iter().map(|(at, _)| at[1]);
            let (low, high) = along.fold((0f32, 12f32), |(l, h), y| (l.min(y), h.max(y)));
            assert!(low > -0.02 && high < 12.02, "{low} {high}");
        }
    }

    #[test]
    fn covers_contain_any_polyline_and_are_not_much_larger() {
        let mut random = crate::random::Random::new(5, 0);
        for count in 3..40 {
            let mut points: Vec<[f32; 2]> = (0..count)
                .map(|at| {
                    [at as f32 + random.between(-0.4, 0.4) as f32, random.between(-1.0, 1.0) as f32]
                })
                .collect();
            points[0] = [0.0; 2];
            let cover = cover(&points);
            let last = points[count - 1];
            let length = f64::from(last[0].hypot(last[1]));
            let far =
                points.iter().map(|p| f64::from((p[1] * last[0] - p[0] * last[1]).abs()) / length);
            let far = far.fold(0.0, f64::max);
            assert!(cover.height <= 2.3 * 2.0 * far, "{} for {far}", cover.height);
        }
    }

    #[test]
    fn polylines_that_come_back_are_covered_along_their_length() {
        for last in [[0.043, 0.006], [0.0, 0.0]] {
            let cover = cover(&[[0.0, 0.0], [3.0, 0.001], [7.2, 0.001], last]);
            assert!(cover.height < 0.02, "{cover:?}");
        }
    }

    #[test]
    fn nothing_is_covered_along_an_edge_or_in_one_place() {
        assert_eq!(Cover::of(&[[0.0; 3], [0.0, 1.0, 0.0]], 0, &rules()), None);
        assert_eq!(Cover::of(&[[0.0; 3]; 3], 0, &rules()), None);
        assert_eq!(deviation(&[[0.0; 3], [0.0, 1.0, 0.5], [0.0, 2.0, 0.0]]), 0.5);
    }
}
