//! Normals of the triangles of a node.

use rustc_hash::FxHashMap;

use super::node::AppendedSkirts;
use crate::mesh::{Mesh, Normal};

/// The normal of each triangle of a mesh whose last triangles are `skirts`.
///
/// A skirt has the normal of the triangle whose edge it hangs from: it is seen where that surface goes on
/// at another level, and must not be darker or lighter than it.
pub(super) fn face_normals(mesh: &Mesh, skirts: &AppendedSkirts) -> Vec<Normal> {
    let own = |&triangle: &[u32; 3]| mesh.triangle_normal(triangle);
    let (surface, hanging) = mesh.triangles.split_at(mesh.triangles.len() - skirts.triangles);
    let mut normals: Vec<Normal> = surface.iter().map(own).collect();
    if hanging.is_empty() {
        return normals;
    }
    let model_of: FxHashMap<u32, u32> =
        skirts.alike.iter().map(|&[model, own]| (own, model)).collect();
    // The ends of the edge that a skirt hangs from; twice the same where it has one of them alone.
    let edges: Vec<[u32; 2]> = hanging
        .iter()
        .map(|triangle| {
            let mut models =
                triangle.map(|vertex| model_of.get(&vertex).copied().unwrap_or(vertex));
            models.sort_unstable();
            [models[0], models[2]]
        })
        .collect();
    let mut is_end = vec![false; mesh.positions.len()];
    edges.as_flattened().iter().for_each(|&end| is_end[end as usize] = true);
    let mut at_edge: FxHashMap<[u32; 2], Normal> = FxHashMap::default();
    for (&[a, b, c], &normal) in surface.iter().zip(&normals) {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            if is_end[from as usize] {
                at_edge.entry([from; 2]).or_insert(normal);
                if is_end[to as usize] {
                    at_edge.entry([from.min(to), from.max(to)]).or_insert(normal);
                }
            }
        }
    }
    normals.extend(hanging.iter().zip(&edges).map(|(triangle, edge)| {
        let known = at_edge.get(edge).or_else(|| at_edge.get(&[edge[0]; 2]));
        known.copied().unwrap_or_else(|| own(triangle))
    }));
    normals
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn skirts_have_the_normal_of_the_triangle_that_they_hang_from() {
        // A floor and a wall, and a skirt of two triangles below the wall's other end.
        let positions =
            [[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 0, 3], [0, 0, 3], [0, 0, 9], [4, 0, 9]];
        let mesh = Mesh {
            positions: positions.map(|position| position.map(|c| c as f32)).to_vec(),
            materials: vec![0; positions.len()],
            triangles: vec![[0, 1, 2], [0, 3, 1], [0, 4, 3], [4, 5, 6], [4, 6, 3]],
            ..Mesh::default()
        };
        let skirts = AppendedSkirts { triangles: 2, alike: vec![[4, 5], [3, 6]] };
        let vectors: Vec<DVec3> =
            face_normals(&mesh, &skirts).iter().map(|normal| normal.vector().unwrap()).collect();
        assert_eq!(vectors, [DVec3::Z, DVec3::Y, DVec3::Y, DVec3::Y, DVec3::Y]);
    }
}
