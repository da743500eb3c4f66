//! What selection is told of the camera for one frame.

use glam::DVec3;

use super::{Frustum, Pose};

/// The camera of one frame, as selection sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub pose: Pose,
    /// Metres a second that the eye moved since the frame before; zero in the first.
    pub velocity: DVec3,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// What it sees.
    pub frustum: Frustum,
    pixels_per_metre: f64,
}

impl View {
    /// The view of a camera whose picture has `size` pixels.
    pub fn new(pose: Pose, velocity: DVec3, size: [u32; 2]) -> Self {
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        // Asked for at every node. The same on every machine, unlike the system's tangent.
        let pixels_per_metre =
            f64::from(size[1]) / (2.0 * libm::tan(pose.fov_y_deg.to_radians() / 2.0));
        Self { pose, velocity, size, frustum: Frustum::new(&pose, aspect), pixels_per_metre }
    }

    /// The same where nothing is seen outside of a box.
    pub fn within(self, within: Option<[DVec3; 2]>) -> Self {
        Self { frustum: self.frustum.within(within), ..self }
    }

    /// Whether its camera is where numbers are: neither infinite nor NaN.
    pub fn is_finite(&self) -> bool {
        let Pose { position, rotation, fov_y_deg } = self.pose;
        position.is_finite() && rotation.is_finite() && fov_y_deg.is_finite()
    }

    /// Pixels that one metre takes at one metre's distance, in the middle of the picture.
    pub fn pixels_per_metre(&self) -> f64 {
        self.pixels_per_metre
    }
}
