//! Dropping the vertices that no triangle uses any more.

use super::border::Border;
use crate::mesh::Mesh;

/// Keeps the used vertices in order of first use; border facts follow.
pub fn compact(mesh: &Mesh, border: &Border) -> (Mesh, Border) {
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; mesh.positions.len()];
    let mut result = Mesh::default();
    let mut result_border = Border::default();
    result.triangles.reserve_exact(mesh.triangles.len());
    for &triangle in &mesh.triangles {
        let corners = triangle.map(|vertex| {
            let old = vertex as usize;
            if new_index[old] == UNUSED {
                new_index[old] = result.push_vertex_from(mesh, old);
                result_border.planes.push(border.planes[old]);
                result_border.keep.push(border.keep[old]);
            }
            new_index[old]
        });
        result.triangles.push(corners);
    }
    (result, result_border)
}
