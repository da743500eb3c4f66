//! Closed boxes, of which tests make towns.

use glam::DVec2;

use crate::mesh::Mesh;

/// Adds a closed box of 12 triangles over four corners, counter-clockwise, from the ground up to a height.
pub fn add_box(mesh: &mut Mesh, corners: [DVec2; 4], height: f64) {
    let first = mesh.positions.len() as u32;
    for z in [0.0, height] {
        mesh.positions.extend(corners.map(|at| at.extend(z).as_vec3().to_array()));
    }
    let mut triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
    for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
        triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
    }
    mesh.triangles.extend(triangles.iter().map(|t| t.map(|vertex| first + vertex)));
    mesh.materials.resize(mesh.positions.len(), 0);
}
