//! What selection needs to know of a node without opening its file (thesis section 3.3).

use crate::format::NodeMesh;

/// The thesis's weight of a textured triangle against an untextured one (table 6.1), 0–1.
pub const TEXTURED_WEIGHT: f64 = 0.127;

/// Facts computed from a node's geometry as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attributes {
    /// All triangles, skirts included.
    pub triangles: u32,
    /// Those with an image.
    pub textured_triangles: u32,
    /// Vertices of all primitives.
    pub vertices: u32,
    /// Smallest source coordinates.
    pub bbox_min: [f64; 3],
    /// Largest source coordinates.
    pub bbox_max: [f64; 3],
    /// Equation 3.1: `textured * c_textured + untextured * (1 - c_textured)`.
    pub cost: f64,
    /// `sqrt(triangles * area)`, area in square metres.
    pub static_benefit: f64,
    /// Normals weighted by area, normalised; zero where they cancel.
    pub average_normal: [f64; 3],
}

/// Computes the attributes of a node; `textured_weight` is the thesis's `c_textured`.
pub fn attributes(mesh: &NodeMesh, textured_weight: f64) -> Attributes {
    let (mut triangles, mut textured) = (0u64, 0u64);
    let vertices: usize = mesh.primitives.iter().map(|primitive| primitive.positions.len()).sum();
    let mut area = 0f64;
    let mut normal = glam::DVec3::ZERO;
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for primitive in &mesh.primitives {
        let count = (primitive.indices.len() / 3) as u64;
        triangles += count;
        if primitive.surface.image.is_some() {
            textured += count;
        }
        for position in &primitive.positions {
            for i in 0..3 {
                let coordinate = mesh.origin[i] + f64::from(position[i]);
                low[i] = low[i].min(coordinate);
                high[i] = high[i].max(coordinate);
            }
        }
        for corners in primitive.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners
                .map(|vertex| glam::Vec3::from(primitive.positions[vertex as usize]).as_dvec3());
            // Its length is twice the area, its direction the normal.
            let cross = (b - a).cross(c - a);
            area += cross.length() * 0.5;
            normal += cross * 0.5;
        }
    }
    // Normals that cancel to rounding noise have no direction.
    let average_normal =
        if normal.length() > area * 1e-9 { normal.normalize().into() } else { [0.0; 3] };
    Attributes {
        triangles: triangles as u32,
        textured_triangles: textured as u32,
        vertices: vertices as u32,
        bbox_min: low,
        bbox_max: high,
        cost: textured as f64 * textured_weight
            + (triangles - textured) as f64 * (1.0 - textured_weight),
        static_benefit: (triangles as f64 * area).sqrt(),
        average_normal,
    }
}
