//! One block of a generated city, for those who need no file.

use super::scan::{STEPS_PER_METRE, Scan, TEXCOORD_STEPS};

/// A block: façade first, then roofs and ground.
#[derive(Clone, Debug, PartialEq)]
pub struct CityBlock {
    /// Group name in the files.
    pub name: String,
    /// World coordinates near the block, whole metres: the translation of its node in a GLB.
    pub origin: [f64; 3],
    /// World coordinates in metres, multiples of 0.1 mm.
    pub positions: Vec<[f64; 3]>,
    /// Of the first vertices, which are the façade's; empty in a city without textures. v grows
    /// downwards; all in 0–1, and no two triangles overlap.
    pub texcoords: Vec<[f32; 2]>,
    /// Vertices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// How many of the triangles, from the first, are façade and take the block's texture.
    pub facade_triangles: usize,
}

impl CityBlock {
    pub(super) fn new(name: String, origin: [i64; 3], scan: Scan, is_textured: bool) -> Self {
        let steps = origin.map(|metres| metres * STEPS_PER_METRE as i64);
        let world = |position: [i32; 3]| {
            std::array::from_fn(|axis| {
                (steps[axis] + i64::from(position[axis])) as f64 / STEPS_PER_METRE
            })
        };
        Self {
            name,
            origin: origin.map(|metres| metres as f64),
            positions: scan.positions.into_iter().map(world).collect(),
            texcoords: if is_textured {
                scan.texcoords.into_iter().map(texcoord).collect()
            } else {
                Vec::new()
            },
            triangles: scan.triangles,
            facade_triangles: scan.facade_triangles,
        }
    }
}

/// Texture coordinates from whole steps.
pub(super) fn texcoord(steps: [u32; 2]) -> [f32; 2] {
    steps.map(|step| (f64::from(step) / f64::from(TEXCOORD_STEPS)) as f32)
}
