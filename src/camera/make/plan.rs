//! A scene seen as a map: two coordinates along the ground and one towards the sky.

use glam::{DVec2, DVec3};

use crate::mesh::UpAxis;

/// Turns source coordinates into a map's and back. On the map x is the source's +x, y is to its
/// left as seen from the sky (yaw 90°), z is the height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plan {
    /// The source coordinates of the map's origin; maps stay near it, so that f32 holds them.
    pub(super) origin: DVec3,
    up: UpAxis,
}

impl Plan {
    pub(super) fn new(up: UpAxis, origin: DVec3) -> Self {
        Self { origin, up }
    }

    /// A direction of the source on the map.
    fn turn(&self, vector: DVec3) -> DVec3 {
        self.up.z_up(vector)
    }

    /// A point of the source on the map.
    pub(super) fn map(&self, point: DVec3) -> DVec3 {
        self.turn(point - self.origin)
    }

    /// A box of the source on the map.
    pub(super) fn map_box(&self, [min, max]: [[f64; 3]; 2]) -> [DVec3; 2] {
        let (a, b) = (self.map(DVec3::from_array(min)), self.map(DVec3::from_array(max)));
        [a.min(b), a.max(b)]
    }

    /// A point of the map in the source.
    pub(super) fn source(&self, point: DVec3) -> DVec3 {
        self.origin + self.up.from_z_up(point)
    }

    /// Which axis of the source is the map's height.
    pub(super) fn up(&self) -> UpAxis {
        self.up
    }
}

/// Degrees from the map's x towards its y, as [`from_angles`](crate::camera::from_angles) has it.
pub(super) fn yaw_deg(direction: DVec2) -> f64 {
    libm::atan2(direction.y, direction.x).to_degrees()
}

/// The direction of a yaw on the map, of length 1.
pub(super) fn direction(yaw_deg: f64) -> DVec2 {
    // The same on every machine, unlike the system's.
    let (sin, cos) = libm::sincos(yaw_deg.to_radians());
    DVec2::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{from_angles, up_vector};

    #[test]
    fn maps_agree_with_yaw_and_sky() {
        for up in [UpAxis::Y, UpAxis::Z] {
            let plan = Plan::new(up, DVec3::new(678_016.0, 400.0, 5_403_456.0));
            for yaw in [0.0, 30.0, 90.0, -135.0] {
                let ahead = from_angles(up, yaw, 0.0, 0.0) * DVec3::NEG_Z;
                let on_map = plan.map(plan.origin + ahead);
                assert!((on_map.truncate() - direction(yaw)).length() < 1e-9);
                assert!((yaw_deg(on_map.truncate()) - yaw).abs() < 1e-6);
            }
            assert!((plan.map(plan.origin + up_vector(up)) - DVec3::Z).length() < 1e-9);
            let point = DVec3::new(1.0, 2.0, 3.0);
            assert!((plan.map(plan.source(point)) - point).length() < 1e-9);
        }
    }
}
