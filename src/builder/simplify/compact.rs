//! Dropping the vertices that no triangle uses any more.

use crate::builder::border::vertex::Border;
use crate::mesh::Mesh;

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

/// Triangles over their own vertices alone, numbered by first use, and which vertex of the
/// `vertices` given each of these is.
pub fn renumber(triangles: &[[u32; 3]], vertices: usize) -> (Vec<[u32; 3]>, Vec<u32>) {
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; vertices];
    let mut used: Vec<u32> = Vec::with_capacity(vertices.min(3 * triangles.len()));
    let mut result = Vec::with_capacity(triangles.len());
    for &[a, b, c] in triangles {
        let mut number = |vertex: u32| {
            let index = &mut new_index[vertex as usize];
            if *index == UNUSED {
                *index = used.len() as u32;
                used.push(vertex);
            }
            *index
        };
        result.push([number(a), number(b), number(c)]);
    }
    (result, used)
}
