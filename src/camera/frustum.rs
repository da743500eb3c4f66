//! The pyramid that a camera sees, and boxes against it.

use glam::DVec3;

use super::Pose;

/// The four sides of the pyramid that a camera sees. It has no far end, and its near end is the
/// eye: what is behind the eye is outside of the sides already.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Where the sides meet.
    pub eye: DVec3,
    /// Normals of the left, right, bottom and top side, inward, of length 1: their x, their y and
    /// their z, so that a box is held against all sides at a time.
    sides: [[f64; 4]; 3],
    /// The line of sight, of length 1.
    pub forward: DVec3,
    /// What a metre to the right, and a metre up, at a depth of 1 m is of half the picture.
    across: [DVec3; 2],
    /// Least and greatest corner of a box outside of which nothing is seen either.
    within: Option<[DVec3; 2]>,
}

impl Frustum {
    /// The pyramid of a camera whose picture is `aspect` times as wide as high.
    pub fn new(pose: &Pose, aspect: f64) -> Self {
        // The same on every machine, unlike the system's.
        let half_height = libm::tan(pose.fov_y_deg.to_radians() / 2.0);
        let half_width = half_height * aspect;
        let (right, up, forward) = (pose.right(), pose.up(), pose.forward());
        let side = |axis: DVec3, half: f64| (forward * half + axis).normalize();
        let sides = [
            side(right, half_width),
            side(-right, half_width),
            side(up, half_height),
            side(-up, half_height),
        ];
        Self {
            eye: pose.position,
            sides: [0, 1, 2].map(|axis| sides.map(|side| side[axis])),
            forward,
            across: [right / half_width, up / half_height],
            within: None,
        }
    }

    /// The same where nothing is seen outside of a box; without a box, as far as the pyramid goes.
    pub fn within(self, within: Option<[DVec3; 2]>) -> Self {
        Self { within, ..self }
    }

    /// The box outside of which nothing is seen.
    pub fn box_within(&self) -> Option<[DVec3; 2]> {
        self.within
    }

    /// What a metre to the right, and a metre up, at a depth of 1 m is of half the picture.
    pub fn across(&self) -> [DVec3; 2] {
        self.across
    }

    /// Metres by which a box is outside of the pyramid: 0 where it may be seen, otherwise the
    /// greatest distance by which the whole of it is beyond one side. Never says that a visible
    /// box is outside; near the edges it may call an invisible one visible.
    #[inline(always)]
    pub fn outside(&self, bbox: [DVec3; 2]) -> f64 {
        let centre = (bbox[0] + bbox[1]) / 2.0 - self.eye;
        let half = (bbox[1] - bbox[0]) / 2.0;
        let forward = self.forward;
        let behind = -(centre.dot(forward) + half.dot(forward.abs()));
        let [x, y, z] = &self.sides;
        let beyond: [f64; 4] = std::array::from_fn(|side| {
            let at = centre.x * x[side] + centre.y * y[side] + centre.z * z[side];
            let reach = half.x * x[side].abs() + half.y * y[side].abs() + half.z * z[side].abs();
            -(at + reach)
        });
        let beyond =
            beyond.into_iter().fold(behind.max(0.0), |most, by| if by > most { by } else { most });
        match self.within {
            None => beyond,
            Some(within) => beyond.max(outside_of(within, bbox)),
        }
    }

    /// The part of the picture, 0 to 1, under the smallest upright rectangle around what is seen
    /// of a box.
    pub fn covered(&self, bbox: [DVec3; 2]) -> f64 {
        self.around(bbox).map_or(0.0, |rectangle| rectangle.part())
    }

    /// That rectangle: from and to across and up the picture, which reaches from −1 to 1; `None`
    /// where nothing of the box is seen.
    pub fn rectangle(&self, bbox: [DVec3; 2]) -> Option<[[f64; 2]; 2]> {
        self.around(bbox).filter(|rectangle| rectangle.part() > 0.0).map(|rectangle| rectangle.0)
    }

    #[inline(always)]
    fn around(&self, bbox: [DVec3; 2]) -> Option<Rectangle> {
        // Of all eight corners: picture plane times depth, and depth.
        let [x, y, depth] = [self.across[0], self.across[1], self.forward].map(|direction| {
            let [in_x, in_y, in_z]: [[f64; 2]; 3] = std::array::from_fn(|axis| {
                bbox.map(|corner| (corner[axis] - self.eye[axis]) * direction[axis])
            });
            std::array::from_fn(|i| in_x[i & 1] + in_y[i >> 1 & 1] + in_z[i >> 2])
        });
        let reach = greatest(depth).max(0.0);
        let near = reach * 1e-6; // what is nearer is seen at the picture's edge or beyond
        if reach <= 0.0 {
            return None;
        }
        if least(depth) < near {
            return Some(Rectangle::cut(std::array::from_fn(|i| [x[i], y[i], depth[i]]), near));
        }
        let ends = [x, y].map(|side| {
            let at: [f64; 8] = std::array::from_fn(|i| side[i] / depth[i]);
            [least(at).clamp(-1.0, 1.0), greatest(at).clamp(-1.0, 1.0)]
        });
        Some(Rectangle(ends))
    }
}

/// Metres by which a box is outside of another; below 0 where it is not. Out of the way of what is asked at
/// every node of every frame: where no box is, pyramids took a fifth longer with it in line.
#[cold]
#[inline(never)]
fn outside_of([min, max]: [DVec3; 2], bbox: [DVec3; 2]) -> f64 {
    (min - bbox[1]).max_element().max((bbox[0] - max).max_element())
}

fn least(numbers: [f64; 8]) -> f64 {
    in_pairs(numbers, |a, b| if a < b { a } else { b })
}

fn greatest(numbers: [f64; 8]) -> f64 {
    in_pairs(numbers, |a, b| if a > b { a } else { b })
}

/// What is left of eight numbers once one of every two was picked, three times: in a row, each
/// pick would wait for the one before.
fn in_pairs(numbers: [f64; 8], pick: impl Fn(f64, f64) -> f64) -> f64 {
    let four: [f64; 4] = std::array::from_fn(|i| pick(numbers[i], numbers[i + 4]));
    pick(pick(four[0], four[2]), pick(four[1], four[3]))
}

/// A part of the picture, which reaches from −1 to 1: from and to, across and up.
struct Rectangle([[f64; 2]; 2]);

impl Rectangle {
    /// Around what a box with these corners has beyond a depth of `near`.
    fn cut(corners: [[f64; 3]; 8], near: f64) -> Self {
        let mut rectangle = Self([[1.0, -1.0]; 2]);
        for (index, &a) in corners.iter().enumerate() {
            if a[2] >= near {
                rectangle.add(a);
            }
            for b in [1, 2, 4].map(|axis| index ^ axis).into_iter().filter(|&b| b > index) {
                let b = corners[b];
                if (a[2] < near) != (b[2] < near) {
                    let part = (near - a[2]) / (b[2] - a[2]);
                    rectangle.add(std::array::from_fn(|i| a[i] + part * (b[i] - a[i])));
                }
            }
        }
        rectangle
    }

    fn add(&mut self, [x, y, depth]: [f64; 3]) {
        for (side, at) in self.0.iter_mut().zip([x / depth, y / depth]) {
            *side = [side[0].min(at.max(-1.0)), side[1].max(at.min(1.0))];
        }
    }

    /// How much of the picture it is, 0 to 1.
    fn part(&self) -> f64 {
        self.0.iter().map(|[from, to]| ((to - from) / 2.0).max(0.0)).product()
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn frustum() -> Frustum {
        let pose = Pose {
            position: DVec3::new(100.0, 200.0, 300.0),
            rotation: DQuat::IDENTITY,
            fov_y_deg: 90.0,
        };
        Frustum::new(&pose, 2.0)
    }

    fn cube(x: f64, y: f64, z: f64) -> [DVec3; 2] {
        let corner = DVec3::new(100.0 + x, 200.0 + y, 300.0 + z);
        [corner - 1.0, corner + 1.0]
    }

    #[test]
    fn boxes_ahead_are_inside_and_others_outside_by_their_distance() {
        let frustum = frustum();
        assert_eq!(frustum.outside(cube(0.0, 0.0, -10.0)), 0.0);
        assert_eq!(frustum.outside(cube(0.0, 0.0, 0.0)), 0.0, "the eye's own box");
        assert_eq!(frustum.outside(cube(20.0, 0.0, -10.0)), 0.0, "on the edge");
        assert!((frustum.outside(cube(0.0, 0.0, 10.0)) - 9.0).abs() < 1e-12, "behind");
        // At 45° above: (y − |z|) / √2, less the box's half diagonal along the normal, √2.
        let above = frustum.outside(cube(0.0, 14.0, -10.0));
        assert!((above - (4.0 / 2f64.sqrt() - 2f64.sqrt())).abs() < 1e-12, "{above}");
    }

    /// The part of the picture under a box, by asking 100 × 100 of its rays.
    fn seen_by_rays(frustum: &Frustum, bbox: [DVec3; 2]) -> Vec<[f64; 2]> {
        let mut hits = Vec::new();
        for step in 0..10_000u32 {
            let [x, y] = [step % 100, step / 100].map(|i| (f64::from(i) + 0.5) / 50.0 - 1.0);
            let ray = DVec3::new(x * 2.0, y, -1.0); // 90° high, twice as wide
            let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
            for axis in 0..3 {
                let times = bbox.map(|corner| (corner[axis] - frustum.eye[axis]) / ray[axis]);
                enter = enter.max(times[0].min(times[1]));
                leave = leave.min(times[0].max(times[1]));
            }
            if enter <= leave {
                hits.push([x, y]);
            }
        }
        hits
    }

    #[test]
    fn the_part_covered_is_that_of_the_rectangle_around_the_rays_that_hit() {
        let frustum = frustum();
        let long = |x: f64, from: f64, to: f64| {
            let eye = frustum.eye;
            [eye + DVec3::new(x, -3.0, from), eye + DVec3::new(x + 1.0, 5.0, to)]
        };
        let boxes = [
            cube(0.0, 0.0, -10.0),
            cube(3.0, 2.0, -4.0),
            cube(20.0, 0.0, -10.0),
            cube(0.0, 0.0, 0.0),
            long(4.0, -60.0, 20.0),
            long(-9.0, -60.0, -4.0),
        ];
        for bbox in boxes {
            let hits = seen_by_rays(&frustum, bbox);
            let range = |axis: usize| {
                let along = || hits.iter().map(|hit| hit[axis]);
                along().fold(-1.0, f64::max) - along().fold(1.0, f64::min) + 0.02
            };
            let naive = range(0) * range(1) / 4.0;
            let found = frustum.covered(bbox);
            assert!(!hits.is_empty() && (found - naive).abs() < 0.02, "{bbox:?} {found} {naive}");
        }
        assert_eq!(frustum.covered(cube(0.0, 0.0, 10.0)), 0.0, "behind");
        assert_eq!(frustum.covered(cube(0.0, 50.0, -10.0)), 0.0, "above");
    }

    #[test]
    fn a_point_that_is_drawn_is_never_outside() {
        let frustum = frustum();
        for step in 0..2000u32 {
            let along = |prime: u32| f64::from(step.wrapping_mul(prime) % 1000) / 1000.0;
            let depth = 0.01 + 50.0 * along(7919);
            let point = frustum.eye
                + DVec3::new(
                    (along(6007) * 2.0 - 1.0) * 2.0 * depth,
                    (along(5003) * 2.0 - 1.0) * depth,
                    -depth,
                );
            assert!(frustum.outside([point, point]) < 1e-9, "{point}");
        }
    }

    #[test]
    fn outside_of_a_box_nothing_is_seen_either() {
        let whole = frustum();
        let eye = whole.eye;
        let within = [eye - DVec3::splat(10.0), eye + DVec3::splat(10.0)];
        let cut = whole.within(Some(within));
        let ahead = |from: f64, to: f64| {
            let ends = [from, to].map(|metres| eye + whole.forward * metres);
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        };
        for (from, to, outside) in [(2.0, 5.0, 0.0), (8.0, 50.0, 0.0), (13.0, 50.0, 3.0)] {
            assert_eq!(whole.outside(ahead(from, to)), 0.0);
            assert_eq!(cut.outside(ahead(from, to)), outside);
        }
        let behind = ahead(-5.0, -4.0);
        assert_eq!(cut.outside(behind), whole.outside(behind));
        assert_eq!(cut.within(None), whole);
    }
}
