//! Where a camera stands, where it looks, and how wide.

use glam::{DQuat, DVec3};

/// Where a camera stands, where it looks, and how wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The eye, in source coordinates (metres).
    pub position: DVec3,
    /// From the camera's axes (x right, y up, looking along −z) to the scene's; of length 1.
    pub rotation: DQuat,
    /// Vertical angle of view in degrees, between 0 and 180.
    pub fov_y_deg: f64,
}

impl Pose {
    /// The direction in which the camera looks, of length 1.
    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::NEG_Z
    }

    /// The direction of the picture's right, of length 1.
    pub fn right(&self) -> DVec3 {
        self.rotation * DVec3::X
    }

    /// The direction of the picture's top, of length 1.
    pub fn up(&self) -> DVec3 {
        self.rotation * DVec3::Y
    }
}
