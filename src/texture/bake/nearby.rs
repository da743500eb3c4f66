//! What of the original lies nearest to the vertices of a node.

use super::source::BakeSource;
use crate::mesh::{Mesh, wide};

/// For each vertex of a node's mesh, what of the original is nearest to it.
pub(super) struct Nearby {
    vertices: Vec<Option<Near>>,
}

/// The triangle of the original that is nearest to a vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Near {
    /// Metres.
    distance: f64,
    /// Source texels in a square metre.
    density: f64,
    /// Its part of a source texel.
    triangles: f64,
}

impl Nearby {
    /// Of the vertices of these triangles; each is seen from the first that has it.
    pub fn of(source: &BakeSource, mesh: &Mesh, members: &[u32]) -> Self {
        let mut vertices = vec![None; mesh.positions.len()];
        let mut before = None;
        for &member in members {
            let triangle = mesh.triangles[member as usize];
            let [a, b, c] = mesh.corners(triangle);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for vertex in triangle.map(|vertex| vertex as usize) {
                if vertices[vertex].is_some() {
                    continue;
                }
                let point = wide(mesh.positions[vertex]);
                let Some(near) = source.nearest(point, normal, before, 0.0) else { continue };
                before = Some(near);
                let triangle = source.triangle(near.triangle);
                vertices[vertex] = Some(Near {
                    distance: near.distance,
                    density: triangle.density,
                    triangles: 1.0 / triangle.texel_area().max(1.0),
                });
            }
        }
        Self { vertices }
    }

    /// The largest distance of a triangle's corners from the original, metres.
    pub fn farthest(&self, triangle: [u32; 3]) -> f64 {
        self.corners(triangle).map(|near| near.distance).fold(0.0, f64::max)
    }

    /// Source texels in a square metre of some triangles.
    pub fn density(&self, mesh: &Mesh, triangles: &[u32]) -> f64 {
        self.mean(mesh, triangles, |near| near.density)
    }

    /// Triangles of the original that have a part in a source texel of some triangles, at most 1.
    pub fn triangles(&self, mesh: &Mesh, triangles: &[u32]) -> f64 {
        self.mean(mesh, triangles, |near| near.triangles)
    }

    /// The mean over the area of triangles of what their corners have; 0 where they have no area.
    fn mean(&self, mesh: &Mesh, triangles: &[u32], of: impl Fn(Near) -> f64) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for &triangle in triangles {
            let triangle = mesh.triangles[triangle as usize];
            let own = mesh.triangle_area(triangle);
            sum += self.corners(triangle).map(&of).sum::<f64>() / 3.0 * own;
            area += own;
        }
        if area > 0.0 { sum / area } else { 0.0 }
    }

    fn corners(&self, triangle: [u32; 3]) -> impl Iterator<Item = Near> {
        triangle.into_iter().map(|vertex| self.vertices[vertex as usize].unwrap_or_default())
    }
}
