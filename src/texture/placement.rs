//! Steps from a texture coordinate of a node's mesh to one of an image of its file.

use super::atlas::PatchPlacement;
use super::charts;

/// From a chart's texture coordinates to a position in its level image:
/// `clamp(uv · scale − offset)`, clamped to the image where it has a limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mapping {
    /// Texels of the level image for one of texture coordinates.
    pub scale: [f64; 2],
    /// Texels that are taken off.
    pub offset: [f64; 2],
    /// Size of the level image, or infinite.
    pub limit: [f64; 2],
}

impl Mapping {
    /// Keeps coordinates that are texels.
    pub const TEXELS: Self = Self { scale: [1.0; 2], offset: [0.0; 2], limit: [f64::INFINITY; 2] };

    /// Returns the position in the level image, texels.
    pub fn texel(&self, uv: [f32; 2]) -> [f64; 2] {
        let uv = charts::sane(uv);
        let along = |axis: usize| {
            let texel = uv[axis] * self.scale[axis] - self.offset[axis];
            if self.limit[axis].is_finite() { texel.clamp(0.0, self.limit[axis]) } else { texel }
        };
        [along(0), along(1)]
    }
}

/// From a position in a level image to a texture coordinate of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImagePlacement {
    /// Number among the images of the node.
    pub image: usize,
    /// Place of the chart on that image.
    pub patch: PatchPlacement,
    /// Size of a texel of the image in texture coordinates.
    pub unit: [f64; 2],
}

impl ImagePlacement {
    /// Returns the texture coordinate of a position in the level image, texels.
    pub fn texcoord(&self, texel: [f64; 2]) -> [f32; 2] {
        let texel = self.patch.texel(texel);
        [0, 1].map(|axis| (texel[axis] * self.unit[axis]) as f32)
    }
}
