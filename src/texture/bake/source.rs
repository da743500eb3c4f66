//! The block's original surface, as texels of coarse nodes look for it.

use glam::{DVec2, DVec3};

use super::classes::BakeClasses;
use super::density;
use crate::mesh::{Mesh, Surface, wide};
use crate::texture::charts::NO_CHART;

/// A triangle of the original that faces away from where a texel looks counts as so many times as
/// far: of the two sides of a thin wall each texel finds its own.
const AWAY: f64 = 4.0;

/// One that is seen from its edge counts as so much more: beyond the edge of a house each side
/// goes on in its own colour.
const ASIDE: f64 = 0.25;

/// A triangle of the original faces a surface's way where their normals' cosine is at least this.
const ALONG: f64 = 0.5;

/// Opaque triangles of a block at full detail, with what they show.
#[derive(Debug)]
pub(crate) struct BakeSource {
    surface: Surface,
    triangles: Vec<SourceTriangle>,
    repeating_texels: f64,
    /// Square metres of what is not lit.
    unlit_area: f64,
}

/// What a triangle of the original shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SourceTriangle {
    /// Unit length.
    pub normal: DVec3,
    /// Square metres.
    pub area: f64,
    /// Material of the model.
    pub material: u32,
    /// It is shown with light.
    pub is_lit: bool,
    /// The kind of its image.
    pub image: ImageKind,
    /// Triangles of one chart lie beside each other in the image as they do in space.
    pub chart: u32,
    /// Positions of the corners in the part of the image that the block uses, source texels. All at 0
    /// where there is no image.
    pub texels: [[f32; 2]; 3],
    /// Vertex colours of the corners.
    pub colors: Option<[[u16; 4]; 3]>,
    /// Texels in a square metre that it deserves at full detail.
    pub density: f64,
}

/// The kind of image that a triangle of the original shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ImageKind {
    /// No image.
    #[default]
    Plain,
    /// Its texels are shown about once.
    CutUp,
    /// It repeats.
    Repeating,
}

/// Positions of the texels of a triangle of the original.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleTexels {
    /// See [`SourceTriangle::chart`].
    pub chart: u32,
    /// See [`SourceTriangle::texels`].
    pub texels: [[f64; 2]; 3],
    /// See [`SourceTriangle::image`].
    pub image: ImageKind,
}

impl Default for TriangleTexels {
    fn default() -> Self {
        Self { chart: NO_CHART, texels: [[0.0; 2]; 3], image: ImageKind::Plain }
    }
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

impl BakeSource {
    /// The triangles of `mesh` whose material is of some class. `texels` says of each that has an image
    /// where its texels lie.
    pub fn new(
        mesh: &Mesh,
        classes: &BakeClasses,
        texels: impl Fn([u32; 3]) -> Option<TriangleTexels>,
    ) -> Self {
        let mut triangles = Vec::new();
        let mut sources = Vec::new();
        for &triangle in &mesh.triangles {
            let material = mesh.triangle_material(triangle);
            if classes.of(material).is_none() {
                continue;
            }
            let TriangleTexels { chart, texels, image } = texels(triangle).unwrap_or_default();
            let [a, b, c] = mesh.corners(triangle);
            let cross = (b - a).cross(c - a);
            let [p, q, r] = texels.map(DVec2::from);
            let colored = !mesh.colors.is_empty();
            sources.push(SourceTriangle {
                normal: cross.normalize_or_zero(),
                area: cross.length() * 0.5,
                material,
                is_lit: classes.is_lit(material),
                image,
                chart,
                texels: texels.map(|corner| corner.map(|value| value as f32)),
                colors: colored.then(|| triangle.map(|vertex| mesh.colors[vertex as usize])),
                density: (q - p).perp_dot(r - p).abs() / cross.length().max(f64::MIN_POSITIVE),
            });
            triangles.push(triangle);
        }
        let repeating_texels = density::settle(&mut sources);
        let unlit = sources.iter().filter(|source| !source.is_lit);
        let unlit_area = unlit.map(|source| source.area).sum();
        let positions = mesh.positions.iter().map(|&position| wide(position)).collect();
        let surface = Surface::new(positions, triangles);
        Self { surface, triangles: sources, repeating_texels, unlit_area }
    }

    /// Square metres of the triangles that are not lit.
    pub fn unlit_area(&self) -> f64 {
        self.unlit_area
    }

    /// Texels at full detail of the triangles whose texture repeats.
    pub fn repeating_texels(&self) -> f64 {
        self.repeating_texels
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
