//! The block's original surface, as texels of coarse nodes look for it.

use glam::{DVec2, DVec3};

use super::classes::BakeClasses;
use crate::mesh::{Mesh, Surface, wide};

/// A triangle of the original that faces away from where a texel looks counts as so many times as
/// far: of the two sides of a thin wall each texel finds its own.
const AWAY: f64 = 4.0;

/// One that is seen from its edge counts as so much more: beyond the edge of a house each side
/// goes on in its own colour.
const ASIDE: f64 = 0.25;

/// A triangle of the original faces a surface's way where their normals' cosine is at least this.
const ALONG: f64 = 0.5;

/// Textured triangles of a block at full detail, with their texels.
#[derive(Debug)]
pub(crate) struct BakeSource {
    surface: Surface,
    triangles: Vec<SourceTriangle>,
}

/// What a triangle of the original shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SourceTriangle {
    /// Unit length.
    pub normal: DVec3,
    /// Texture of the model.
    pub texture: u32,
    /// Triangles of one chart lie beside each other in the image as they do in space.
    pub chart: u32,
    /// Positions of the corners in the part of the image that the block uses, source texels.
    pub texels: [[f32; 2]; 3],
    /// Vertex colours of the corners.
    pub colors: Option<[[u16; 4]; 3]>,
    /// Source texels in a square metre.
    pub density: f64,
}

impl SourceTriangle {
    /// Source texels.
    pub fn texel_area(&self) -> f64 {
        let [p, q, r] = self.texels.map(|texel| DVec2::from(texel.map(f64::from)));
        (q - p).perp_dot(r - p).abs() * 0.5
    }
}

/// A point of the original.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    pub triangle: u32,
    pub weights: [f64; 3],
    /// From where it was looked for, metres.
    pub distance: f64,
}

/// A triangle has at most so many times the density of all together. One that has more lost its
/// area, as rounding to a lattice makes it, and says nothing of how sharp the original is.
const MOST_DENSITY: f64 = 1e4;

/// Gives triangles that all but lost their area the density of all together.
fn limit_density(triangles: &mut [SourceTriangle]) {
    let texels: f64 = triangles.iter().map(SourceTriangle::texel_area).sum();
    let sound = triangles.iter().filter(|triangle| triangle.density.is_finite());
    let metres: f64 = sound
        .filter(|triangle| triangle.density > 0.0)
        .map(|triangle| triangle.texel_area() / triangle.density)
        .sum();
    let mean = if metres > 0.0 { texels / metres } else { 0.0 };
    for triangle in triangles {
        if !triangle.density.is_finite() || triangle.density > mean * MOST_DENSITY {
            triangle.density = mean;
        }
    }
}

impl BakeSource {
    /// The triangles of `mesh` whose material is of some class. `texels` gives the texture of a
    /// triangle, its chart, and where its corners lie in the image.
    pub fn new(
        mesh: &Mesh,
        classes: &BakeClasses,
        texels: impl Fn([u32; 3]) -> Option<(u32, u32, [[f64; 2]; 3])>,
    ) -> Self {
        let mut triangles = Vec::new();
        let mut sources = Vec::new();
        for &triangle in &mesh.triangles {
            if classes.of(mesh.triangle_material(triangle)).is_none() {
                continue;
            }
            let Some((texture, chart, texels)) = texels(triangle) else { continue };
            let [a, b, c] = mesh.corners(triangle);
            let cross = (b - a).cross(c - a);
            let [p, q, r] = texels.map(glam::DVec2::from);
            let texel_area = (q - p).perp_dot(r - p).abs();
            let colored = !mesh.colors.is_empty();
            sources.push(SourceTriangle {
                normal: cross.normalize_or_zero(),
                texture,
                chart,
                texels: texels.map(|corner| corner.map(|value| value as f32)),
                colors: colored.then(|| triangle.map(|vertex| mesh.colors[vertex as usize])),
                density: texel_area / cross.length().max(f64::MIN_POSITIVE),
            });
            triangles.push(triangle);
        }
        limit_density(&mut sources);
        let positions = mesh.positions.iter().map(|&position| wide(position)).collect();
        Self { surface: Surface::new(positions, triangles), triangles: sources }
    }

    /// The point nearest to `point` on a surface with this unit normal. The search begins at the
    /// triangle of `near`, and ends there where the point lies over it and is not farther from it
    /// than `near` was by more than `slack`.
    pub fn nearest(
        &self,
        point: DVec3,
        normal: DVec3,
        near: Option<SurfacePoint>,
        slack: f64,
    ) -> Option<SurfacePoint> {
        if let Some(SurfacePoint { triangle, distance, .. }) = near
            && self.triangles[triangle as usize].normal.dot(normal) >= ALONG
        {
            let hit = self.surface.on_triangle(point, triangle);
            if hit.distance() <= distance + slack && hit.weights.iter().all(|&weight| weight > 0.0)
            {
                return Some(SurfacePoint {
                    triangle,
                    weights: hit.weights,
                    distance: hit.distance(),
                });
            }
        }
        let away =
            |triangle: u32| Self::weight(self.triangles[triangle as usize].normal.dot(normal));
        let hit = self.surface.closest_of(point, near.map(|near| near.triangle), away)?;
        Some(SurfacePoint {
            triangle: hit.triangle,
            weights: hit.weights,
            distance: hit.distance(),
        })
    }

    /// How many times the distance counts of a triangle whose normal has this cosine with that of
    /// the surface that looks for it.
    pub fn weight(cosine: f64) -> f64 {
        if cosine < 0.0 { AWAY } else { 1.0 + ASIDE * (1.0 - cosine) }
    }

    /// Visits the triangles whose boxes may meet the box from `low` to `high`, in no order.
    pub fn in_box(&self, low: DVec3, high: DVec3, visit: impl FnMut(u32)) {
        self.surface.in_box(low, high, visit);
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.surface.corners(triangle)
    }

    /// What a triangle shows.
    pub fn triangle(&self, triangle: u32) -> &SourceTriangle {
        &self.triangles[triangle as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of half a texel.
    fn triangle(density: f64) -> SourceTriangle {
        SourceTriangle {
            normal: DVec3::Z,
            texture: 0,
            chart: 0,
            texels: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            colors: None,
            density,
        }
    }

    #[test]
    fn triangles_without_area_have_the_density_of_all_together() {
        let limited = |densities: &[f64]| {
            let mut triangles: Vec<_> = densities.iter().map(|&at| triangle(at)).collect();
            limit_density(&mut triangles);
            triangles.into_iter().map(|triangle| triangle.density).collect::<Vec<f64>>()
        };
        assert_eq!(limited(&[100.0, 400.0, 0.0]), [100.0, 400.0, 0.0], "all sound");
        let mean = |count: f64| count / (2.0 / 100.0);
        for lost in [f64::INFINITY, f64::NAN, 1e300, 0.5 / f64::MIN_POSITIVE] {
            let found = limited(&[100.0, 100.0, lost]);
            assert_eq!(found[..2], [100.0; 2]);
            assert!((found[2] - mean(3.0)).abs() < 1e-9, "{found:?}");
        }
        assert_eq!(limited(&[f64::INFINITY]), [0.0], "nothing is known");
    }
}
