//! The share of a node's surface that shows another material's colour than the source does there.

use glam::Vec3;

use super::light_votes::point_on;
use super::prepared::PreparedBake;
use super::shading::tint;
use super::source::{BakeSource, SurfacePoint};
use crate::color;
use crate::mesh::Mesh;
use crate::random::Random;
use crate::texture::block::{BlockTextures, Prepared};

/// Points at which a node is compared with the source: the share is known to about a fiftieth.
const POINTS: usize = 256;

/// A point is wrong where some channel differs by more than this, of 255.
const WRONG: u8 = 64;

impl BlockTextures<'_> {
    /// The share of a node's opaque surface whose material has another mean colour than that of the source
    /// nearest to it, 0–1.
    pub fn wrong_colors(&self, mesh: &Mesh) -> f64 {
        let Some(PreparedBake { classes, source, .. }) = &self.bake_source else { return 0.0 };
        let members: Vec<[u32; 3]> = mesh
            .triangles
            .iter()
            .copied()
            .filter(|&triangle| classes.of(mesh.triangle_material(triangle)).is_some())
            .collect();
        let area: f64 = members.iter().map(|&triangle| mesh.triangle_area(triangle)).sum();
        let mut random = Random::new(1, 0);
        let mut wrong = 0;
        let (mut points, mut before): (usize, Option<SurfacePoint>) = (0, None);
        let mut passed = 0.0;
        for &triangle in &members {
            passed += mesh.triangle_area(triangle);
            // One point for each equal part of the area.
            while points < POINTS && (points as f64 + 0.5) * area <= passed * POINTS as f64 {
                points += 1;
                let (v, w) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
                let weights = if v + w > 1.0 { [1.0 - v, 1.0 - w] } else { [v, w] };
                let (point, normal) = point_on(mesh, triangle, weights);
                let Some(near) = source.nearest(point, normal, before, 0.0) else { continue };
                before = Some(near);
                wrong += usize::from(self.is_wrong(source, mesh, triangle, near));
            }
        }
        wrong as f64 / points.max(1) as f64
    }

    /// Returns true where the source has another colour at a point than a triangle of a node.
    fn is_wrong(
        &self,
        source: &BakeSource,
        mesh: &Mesh,
        triangle: [u32; 3],
        near: SurfacePoint,
    ) -> bool {
        let material = mesh.triangle_material(triangle);
        let shown = source.triangle(near.triangle);
        let [own, other] = [material, shown.material].map(|of| self.mean_light(of));
        // Plain colours are of triangles, which are given the right ones later.
        if shown.material == material || own.is_none() && other.is_none() {
            return false;
        }
        let plain = |material: u32, colors: Option<[[u16; 4]; 3]>| {
            (self.factor_of(material) * tint(colors, || [1.0 / 3.0; 3])).truncate()
        };
        let colors = |vertex: u32| mesh.colors[vertex as usize];
        let own_colors = (!mesh.colors.is_empty()).then(|| triangle.map(colors));
        let own = own.unwrap_or_else(|| plain(material, own_colors));
        let other = other.unwrap_or_else(|| plain(shown.material, shown.colors));
        let byte = color::linear_to_byte();
        let encoded = |light: Vec3| light.to_array().map(|part| byte.of((part * 65535.0) as u16));
        encoded(own).iter().zip(encoded(other)).any(|(own, other)| own.abs_diff(other) > WRONG)
    }

    /// The mean of a material's image times its colour, linear light, 0–1; `None` where it has no image.
    fn mean_light(&self, material: u32) -> Option<Vec3> {
        let texture = self.material_textures.get(material as usize).copied().flatten()?;
        let coarsest = match self.image_of_material(material)? {
            Prepared::Absent => return None,
            Prepared::Atlas(source) => source.pyramid.first()?,
            Prepared::Repeating(decoded) => decoded.pyramid().first()?,
        };
        let mean = *self.means.get(texture as usize)?.get_or_init(|| coarsest.mean());
        Some(mean * self.factor_of(material).truncate())
    }
}
