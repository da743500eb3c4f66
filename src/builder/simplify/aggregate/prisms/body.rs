//! What may become part of a prism.

use glam::{DVec2, DVec3};

use crate::builder::constants::PrismConstants;
use crate::builder::simplify::aggregate::appearance::{Appearance, AppearanceSum};
use crate::mesh::{Coordinate, Mesh, UpAxis, wide};

/// A separate body with walls and roofs, whichever way its faces wind.
pub(in super::super) struct Body {
    /// What it covers of the ground, about, square metres.
    pub footprint: f64,
    /// The height of its lowest point, metres.
    pub low: f64,
    /// The mean height of its roofs above that, metres.
    pub height: f64,
    pub roof: Appearance,
    pub wall: Appearance,
}

impl Body {
    /// `None` for what is flat, or has hardly any walls.
    pub fn of<C: Coordinate>(
        mesh: &Mesh<C>,
        triangles: &[[u32; 3]],
        up: UpAxis,
        constants: &PrismConstants,
    ) -> Option<Self> {
        let at = |vertex: u32| up.z_up(wide(mesh.positions[vertex as usize]));
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &vertex in triangles.as_flattened() {
            (low, high) = (low.min(at(vertex)), high.max(at(vertex)));
        }
        let middle = (low.z + high.z) * 0.5;
        let (mut upper, mut lower) = (0.0, 0.0);
        let (mut roof, mut wall) = (AppearanceSum::default(), AppearanceSum::default());
        let mut upper_heights = 0.0;
        for &triangle in triangles {
            let [a, b, c] = triangle.map(at);
            let normal = (b - a).cross(c - a) * 0.5;
            let area = normal.length();
            let height = (a.z + b.z + c.z) / 3.0;
            if normal.z.abs() <= constants.wall_rise * area {
                wall.add(mesh, triangle, area);
            } else if height >= middle {
                upper += normal.z.abs();
                upper_heights += normal.z.abs() * height;
                roof.add(mesh, triangle, area);
            } else {
                lower += normal.z.abs();
            }
        }
        let (roof, walls, wall) = (roof.look()?, wall.area, wall.look()?);
        // Lower roofs count among what is lower.
        let footprint = upper.max(lower);
        let height = upper_heights / upper - low.z;
        let size: DVec2 = (high - low).truncate();
        let is_body = height > constants.least_height * footprint.sqrt()
            && walls >= constants.least_walls * 2.0 * size.element_sum() * height;
        is_body.then_some(Self { footprint, low: low.z, height, roof, wall })
    }
}
