//! The working mesh of a piece: a block, a part of one between cutting planes, or a node.

/// An indexed triangle mesh in f32 metres from its block's f64 origin.
///
/// Source and cut vertices lie on the block's lattice (see [`crate::build::lattice`]), so their
/// f32 offsets are exact. A vertex belongs to one material: where two materials meet there are
/// two vertices at the same position, as at a texture seam. Arrays are parallel per vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Metres from the block's origin.
    pub positions: Vec<[f32; 3]>,
    /// One per vertex, or empty where no material of the block is textured. v grows downwards.
    pub texcoords: Vec<[f32; 2]>,
    /// One per vertex, or empty where the block has no vertex colours. RGBA, linear, 65535 is 1.
    pub colors: Vec<[u16; 4]>,
    /// One per vertex: index into the materials of the block's model.
    pub materials: Vec<u32>,
    /// Vertices of each triangle; all three have the same material.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The material of a triangle.
    pub fn triangle_material(&self, triangle: [u32; 3]) -> u32 {
        self.materials[triangle[0] as usize]
    }

    /// Corner positions of a triangle, widened to f64.
    pub fn corners(&self, triangle: [u32; 3]) -> [glam::DVec3; 3] {
        triangle.map(|vertex| glam::Vec3::from(self.positions[vertex as usize]).as_dvec3())
    }
}
