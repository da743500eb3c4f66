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
pub(crate) struct Source {
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

impl Source {
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
