//! The triangles of a node's file, without what they look like.

use glam::DVec3;

use super::sample::area;
use crate::format::NodeMesh;

/// The triangles of one node, in the order of its file: primitive by primitive.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeGeometry {
    /// Source coordinates of the file's origin.
    pub origin: DVec3,
    /// Metres from it.
    pub positions: Vec<[f32; 3]>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Which triangles are skirts, as the file says.
    pub skirts: Vec<bool>,
    /// Which of these lie in a cutting plane (see [`super::cut_planes`]) and are no part of the
    /// surface; empty where none does.
    pub in_cut_plane: Vec<bool>,
}

impl NodeGeometry {
    /// Keeps the geometry of a file.
    pub fn new(mesh: &NodeMesh) -> Self {
        let mut geometry = Self { origin: mesh.origin.into(), ..Self::default() };
        for primitive in &mesh.primitives {
            let first = geometry.positions.len() as u32;
            geometry.positions.extend(&primitive.positions);
            let triangles = primitive.indices.as_chunks::<3>().0;
            geometry.triangles.extend(triangles.iter().map(|t| t.map(|vertex| first + vertex)));
            geometry.skirts.resize(geometry.triangles.len() - primitive.skirt_triangles, false);
            geometry.skirts.resize(geometry.triangles.len(), true);
        }
        geometry
    }

    /// Source coordinates of a vertex. Offsets and origin are multiples of one step, so the sum
    /// is exact.
    pub fn position(&self, vertex: u32) -> DVec3 {
        let [x, y, z] = self.positions[vertex as usize];
        self.origin + DVec3::new(x.into(), y.into(), z.into())
    }

    /// Corners of a triangle in source coordinates.
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.position(vertex))
    }

    /// Numbers and corners of the triangles that are surface: not in a cutting plane.
    pub fn surface(&self) -> impl Iterator<Item = (u32, [DVec3; 3])> {
        (0..)
            .zip(&self.triangles)
            .filter(|&(number, _)| self.is_surface(number))
            .map(|(number, &triangle)| (number, self.corners(triangle)))
    }

    /// False for a triangle in a cutting plane.
    pub fn is_surface(&self, triangle: u32) -> bool {
        !self.in_cut_plane.get(triangle as usize).copied().unwrap_or(false)
    }

    /// Vertices of triangles that are surface.
    pub fn surface_vertices(&self) -> Vec<DVec3> {
        let mut used = vec![false; self.positions.len()];
        for (number, triangle) in (0..).zip(&self.triangles) {
            if self.is_surface(number) {
                triangle.iter().for_each(|&vertex| used[vertex as usize] = true);
            }
        }
        (0..).zip(used).filter(|(_, used)| *used).map(|(vertex, _)| self.position(vertex)).collect()
    }

    /// The area of all triangles, square metres.
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|&triangle| area(self.corners(triangle))).sum()
    }
}
