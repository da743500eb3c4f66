//! What one draw of a frame has of its own.

use glam::{DVec3, Vec3};

use super::content::Alpha;

/// What one draw of a frame has of its own, as the shaders read it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Instance {
    /// From the eye to the node's origin, metres. Subtracted in f64 before it is narrowed, so
    /// that large coordinates cost no precision near the eye, where it is seen.
    pub offset: [f32; 3],
    /// Multiplies alpha, so that one half is the cutoff.
    pub alpha_scale: f32,
    /// Multiplies colour, linear.
    pub tint: [f32; 3],
    /// [`Draw::projection`](super::content::Draw::projection), where there is one.
    pub projection: [f32; 4],
}

impl Instance {
    pub fn new(
        eye: DVec3,
        origin: DVec3,
        alpha: Alpha,
        tint: Vec3,
        projection: Option<[f32; 4]>,
    ) -> Self {
        Self {
            offset: (origin - eye).as_vec3().to_array(),
            alpha_scale: alpha_scale(alpha),
            tint: tint.to_array(),
            projection: projection.unwrap_or_default(),
        }
    }
}

fn alpha_scale(alpha: Alpha) -> f32 {
    match alpha {
        // Never infinite, which times zero is no number.
        Alpha::Mask { cutoff } => 0.5 / cutoff.max(1e-6),
        Alpha::Opaque | Alpha::Screen => 1.0,
    }
}

/// The colour that nodes of a level are multiplied by where levels are shown, linear; the same
/// again every six levels.
pub fn level_tint(level: u32) -> [f32; 3] {
    const TINTS: [[f32; 3]; 6] = [
        [1.6, 0.35, 0.3],
        [1.6, 0.9, 0.25],
        [1.3, 1.4, 0.25],
        [0.35, 1.4, 0.4],
        [0.3, 1.0, 1.7],
        [0.9, 0.5, 1.7],
    ];
    TINTS[level as usize % TINTS.len()]
}
