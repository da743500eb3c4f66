//! Several nodes as one surface: the leaves, or the front of a level.

use glam::DVec3;

use super::geometry::NodeGeometry;
use crate::mesh::Surface;

/// Nodes joined; triangles in cutting planes are left out.
pub(super) struct Assembly {
    /// All triangles.
    pub surface: Surface,
    /// Node of each triangle, and its number in the node's file.
    owners: Vec<(u32, u32)>,
}

impl Assembly {
    /// Joins nodes.
    pub fn new(nodes: impl Iterator<Item = u32>, geometry: &[NodeGeometry]) -> Self {
        let (mut positions, mut triangles): (Vec<DVec3>, Vec<[u32; 3]>) = Default::default();
        let mut owners = Vec::new();
        for node in nodes {
            let part = &geometry[node as usize];
            let first = positions.len() as u32;
            positions.extend((0..part.positions.len() as u32).map(|v| part.position(v)));
            for (number, triangle) in (0..).zip(&part.triangles) {
                if part.is_surface(number) {
                    triangles.push(triangle.map(|vertex| first + vertex));
                    owners.push((node, number));
                }
            }
        }
        Self { surface: Surface::new(positions, triangles), owners }
    }

    /// The node of a triangle, and the triangle's number in the node's file.
    pub fn owner(&self, triangle: u32) -> (u32, u32) {
        self.owners[triangle as usize]
    }
}
