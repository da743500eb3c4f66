//! The pyramid that a camera sees, and boxes against it.

use glam::DVec3;

use super::Pose;

/// The four sides of the pyramid that a camera sees. It has no far end, and its near end is the
/// eye: what is behind the eye is outside of the sides already.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Where the sides meet.
    pub eye: DVec3,
    /// Normals of the left, right, bottom and top side, inward, of length 1.
    pub sides: [DVec3; 4],
    /// The line of sight, of length 1.
    pub forward: DVec3,
}

impl Frustum {
    /// The pyramid of a camera whose picture is `aspect` times as wide as high.
    pub fn new(pose: &Pose, aspect: f64) -> Self {
        // The same on every machine, unlike the system's.
        let half_height = libm::tan(pose.fov_y_deg.to_radians() / 2.0);
        let half_width = half_height * aspect;
        let (right, up, forward) = (pose.right(), pose.up(), pose.forward());
        let side = |axis: DVec3, half: f64| (forward * half + axis).normalize();
        Self {
            eye: pose.position,
            sides: [
                side(right, half_width),
                side(-right, half_width),
                side(up, half_height),
                side(-up, half_height),
            ],
            forward,
        }
    }

    /// Metres by which a box is outside of the pyramid: 0 where it may be seen, otherwise the
    /// greatest distance by which the whole of it is beyond one side. Never says that a visible
    /// box is outside; near the edges it may call an invisible one visible.
    pub fn outside(&self, bbox: [DVec3; 2]) -> f64 {
        let centre = (bbox[0] + bbox[1]) / 2.0 - self.eye;
        let half = (bbox[1] - bbox[0]) / 2.0;
        let beyond = |normal: DVec3| -(centre.dot(normal) + half.dot(normal.abs()));
        self.sides.iter().fold(beyond(self.forward).max(0.0), |most, &side| most.max(beyond(side)))
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
}
