//! The camera as the shaders read it.

use glam::{DMat4, DVec3, DVec4};

use super::options::Shading;
use crate::camera::Pose;

/// What all draws of a frame have in common.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Camera {
    /// From metres relative to the eye, in the scene's axes, to clip space.
    clip_from_scene: [[f32; 4]; 4],
    /// Of a point one metre ahead of the eye: metres to the right, and down, per pixel.
    metres_per_pixel: [f32; 2],
    /// The same, at the picture's upper left corner.
    corner: [f32; 2],
    /// Two corners of a box, metres from the eye; a fourth number is room that the shaders leave.
    box_corners: [[f32; 4]; 2],
    /// Where light comes from, of length 1: right, down, ahead, and room.
    to_light: [f32; 4],
}

/// From behind the viewer and slightly above (Cossutti, section 4.5): right, down, ahead.
const HEAD_LIGHT: DVec3 = DVec3::new(0.0, -0.3304, -0.9438);

/// In the scene's axes. Whichever of them is up, ground, and walls of either direction, are seen from each
/// other.
const SCENE_LIGHT: DVec3 = DVec3::new(0.35, 0.5, 0.79);

/// Where light comes from, in the picture's axes: right, down, ahead.
fn to_light(pose: &Pose, shading: Shading) -> DVec3 {
    match shading {
        Shading::Photo | Shading::Unlit => {
            let seen = pose.rotation.inverse() * SCENE_LIGHT.normalize();
            DVec3::new(seen.x, -seen.y, -seen.z)
        }
        Shading::HeadLight => HEAD_LIGHT,
    }
}

impl Camera {
    /// Depth is `near / distance`: 1 at the near plane and 0 infinitely far away. In floating
    /// point this is as precise far away as it is near, so that no far plane is needed.
    /// `cut` are two corners of the box at which nodes are cut, where they are.
    pub fn new(
        pose: &Pose,
        size: [u32; 2],
        near: f32,
        cut: Option<[DVec3; 2]>,
        shading: Shading,
    ) -> Self {
        let [width, height] = size.map(f64::from);
        let fov_y = pose.fov_y_deg.to_radians();
        let turn = DMat4::from_quat(pose.rotation.inverse());
        let half_height = (fov_y / 2.0).tan();
        let half_width = half_height * width / height;
        let project = DMat4::from_rows(
            DVec4::X / half_width,
            DVec4::Y / half_height,
            DVec4::W * f64::from(near),
            DVec4::NEG_Z,
        );
        Self {
            clip_from_scene: (project * turn).as_mat4().to_cols_array_2d(),
            metres_per_pixel: [half_width * 2.0 / width, half_height * 2.0 / height]
                .map(|metres| metres as f32),
            corner: [-half_width, -half_height].map(|metres| metres as f32),
            box_corners: cut
                .unwrap_or_default()
                .map(|corner| (corner - pose.position).as_vec3().extend(0.0).to_array()),
            to_light: to_light(pose, shading).as_vec3().extend(0.0).to_array(),
        }
    }
}
