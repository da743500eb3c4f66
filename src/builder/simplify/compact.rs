//! Dropping the vertices that no triangle uses any more.

use crate::builder::border::vertex::Border;
use crate::mesh::{Mesh, renumber};

/// Keeps the used vertices in order of first use; border facts follow.
pub fn compact(mesh: &Mesh, border: &Border) -> (Mesh, Border) {
    with_triangles(mesh, border, &mesh.triangles)
}

/// The same with other triangles over the mesh's vertices.
pub fn with_triangles(mesh: &Mesh, border: &Border, triangles: &[[u32; 3]]) -> (Mesh, Border) {
    let (triangles, used) = renumber(triangles, mesh.positions.len());
    let result_border = Border {
        planes: used.iter().map(|&vertex| border.planes[vertex as usize]).collect(),
        keep: used.iter().map(|&vertex| border.keep[vertex as usize]).collect(),
    };
    (mesh.with_vertices(&used, triangles), result_border)
}
