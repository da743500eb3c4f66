//! The working mesh of a block, of a chunk of one between cutting planes, or of a node.

use super::Normal;
use super::coordinate::{Coordinate, wide};

/// An indexed triangle mesh: f32 metres from its block's f64 origin, or, while a file is divided
/// into blocks, f64 source coordinates.
///
/// Source and cut vertices lie on the block's lattice, so their f32 offsets are exact. A vertex
/// belongs to one material: where two materials meet there are two vertices at the same position,
/// as at a texture seam. Arrays are parallel per vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh<C = f32> {
    /// Metres from the block's origin (f32) or source coordinates (f64).
    pub positions: Vec<[C; 3]>,
    /// One per vertex, or empty where no material of the block is textured. v grows downwards.
    pub texcoords: Vec<[f32; 2]>,
    /// One per vertex, or empty where the block has no vertex colours. RGBA, linear, 65535 is 1.
    pub colors: Vec<[u16; 4]>,
    /// One per vertex, or empty where the block has no normals but those of its triangles. A vertex with
    /// [`Normal::NONE`] has those of its triangles.
    pub normals: Vec<Normal>,
    /// One per vertex: index into the materials of the block's model.
    pub materials: Vec<u32>,
    /// Vertices of each triangle; all three have the same material.
    pub triangles: Vec<[u32; 3]>,
}

/// Whether a triangle's three corners (vertices, places or cells) are all different.
pub(crate) fn all_differ<T: PartialEq>([a, b, c]: [T; 3]) -> bool {
    a != b && b != c && c != a
}

impl<C: Coordinate> Mesh<C> {
    /// The material of a triangle.
    pub fn triangle_material(&self, triangle: [u32; 3]) -> u32 {
        self.materials[triangle[0] as usize]
    }

    /// Corner positions of a triangle, widened to f64.
    pub fn corners(&self, triangle: [u32; 3]) -> [glam::DVec3; 3] {
        triangle.map(|vertex| wide(self.positions[vertex as usize]))
    }

    /// Appends a copy of a vertex of `other`, which has the same kinds of attributes.
    pub fn push_vertex_from(&mut self, other: &Self, vertex: usize) -> u32 {
        self.push_vertex(
            other.positions[vertex],
            other.texcoords.get(vertex).copied(),
            other.colors.get(vertex).copied(),
            other.normals.get(vertex).copied(),
            other.materials[vertex],
        )
    }

    /// Adds the vertices and triangles of a mesh that has the same attributes.
    pub fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        let triangles = other.triangles.iter().map(|t| t.map(|vertex| first + vertex));
        self.triangles.extend(triangles);
        self.positions.extend(other.positions);
        self.texcoords.extend(other.texcoords);
        self.colors.extend(other.colors);
        self.normals.extend(other.normals);
        self.materials.extend(other.materials);
    }

    /// Appends a copy of one of its own vertices.
    pub fn push_copy(&mut self, vertex: usize) -> u32 {
        self.push_vertex(
            self.positions[vertex],
            self.texcoords.get(vertex).copied(),
            self.colors.get(vertex).copied(),
            self.normals.get(vertex).copied(),
            self.materials[vertex],
        )
    }

    /// Appends a vertex, which has the attributes that the others have.
    fn push_vertex(
        &mut self,
        position: [C; 3],
        texcoord: Option<[f32; 2]>,
        color: Option<[u16; 4]>,
        normal: Option<Normal>,
        material: u32,
    ) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(position);
        self.texcoords.extend(texcoord);
        self.colors.extend(color);
        self.normals.extend(normal);
        self.materials.push(material);
        index
    }

    /// A mesh of these of its vertices, in this order, and these triangles over them.
    pub fn with_vertices(&self, vertices: &[u32], triangles: Vec<[u32; 3]>) -> Self {
        fn pick<T: Copy>(values: &[T], vertices: &[u32]) -> Vec<T> {
            if values.is_empty() {
                return Vec::new();
            }
            // Room for the vertices that a cut adds.
            let mut picked = Vec::with_capacity(vertices.len() + vertices.len() / 16 + 16);
            picked.extend(vertices.iter().map(|&vertex| values[vertex as usize]));
            picked
        }
        Self {
            positions: pick(&self.positions, vertices),
            texcoords: pick(&self.texcoords, vertices),
            colors: pick(&self.colors, vertices),
            normals: pick(&self.normals, vertices),
            materials: pick(&self.materials, vertices),
            triangles,
        }
    }

    /// The normal of a triangle's plane.
    pub fn triangle_normal(&self, triangle: [u32; 3]) -> Normal {
        let [a, b, c] = self.corners(triangle);
        Normal::along((b - a).cross(c - a))
    }

    /// Bounding box of the vertices, metres from the block's origin; `None` without vertices.
    pub fn bounds(&self) -> Option<([C; 3], [C; 3])> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(low, high), p| {
            (
                std::array::from_fn(|i| if p[i] < low[i] { p[i] } else { low[i] }),
                std::array::from_fn(|i| if p[i] > high[i] { p[i] } else { high[i] }),
            )
        }))
    }

    /// The sum of the areas of all triangles, square metres.
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|&triangle| self.triangle_area(triangle)).sum()
    }

    /// The area of one triangle, square metres.
    pub fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() * 0.5
    }
}
