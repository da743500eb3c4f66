//! Simplification without regard to texture seams: vertices that differ in nothing but texture
//! coordinates, colours and materials of one class become one.
//!
//! What is left of a seam is then where classes meet. A node made so has no texture coordinates;
//! it is given a texture of its own ([`crate::texture::BakedMesh`]).

use rustc_hash::FxHashMap;

use crate::builder::border::vertex::Border;
use crate::mesh::{Mesh, Normal, PositionKey, all_differ, key};
use crate::texture::BakeClasses;

/// Joins the vertices of each class that lie at one place.
pub fn weld_seams(mesh: &Mesh, border: &Border, classes: &BakeClasses) -> (Mesh, Border) {
    let mut result = Mesh::default();
    let mut joined_border = Border::default();
    let mut joined: FxHashMap<(PositionKey<f32>, u32), u32> = FxHashMap::default();
    let mut new_index = Vec::with_capacity(mesh.positions.len());
    for vertex in 0..mesh.positions.len() {
        let mut add = || {
            joined_border.planes.push(border.planes[vertex]);
            joined_border.keep.push(border.keep[vertex]);
            result.push_vertex_from(mesh, vertex)
        };
        let Some(class) = classes.of(mesh.materials[vertex]) else {
            new_index.push(add());
            continue;
        };
        let index = *joined.entry((key(mesh.positions[vertex]), class)).or_insert_with(add);
        joined_border.planes[index as usize] |= border.planes[vertex];
        let keep = &mut joined_border.keep[index as usize];
        *keep = (*keep).min(border.keep[vertex]);
        result.materials[index as usize] = class;
        if let Some(texcoord) = result.texcoords.get_mut(index as usize) {
            *texcoord = [0.0; 2];
        }
        if let Some(normal) = result.normals.get_mut(index as usize) {
            *normal = Normal::NONE;
        }
        if let Some(color) = result.colors.get_mut(index as usize) {
            *color = [u16::MAX; 4];
        }
        new_index.push(index);
    }
    let triangles = mesh.triangles.iter().map(|t| t.map(|vertex| new_index[vertex as usize]));
    result.triangles = triangles.filter(|&corners| all_differ(corners)).collect();
    (result, joined_border)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Material;

    #[test]
    fn vertices_of_a_class_at_one_place_become_one() {
        let materials = ["a", "b", "c"].map(Material::plain);
        // The first two may be baked.
        let classes = BakeClasses::new(&materials, |_| true, |material| material < 2);
        let mesh = Mesh {
            positions: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0; 3],
                [0.0, 1.0, 0.0],
                [0.0; 3],
                [0.0; 3],
            ],
            texcoords: (0..6).map(|i| [i as f32, 0.5]).collect(),
            colors: vec![[1, 2, 3, 4]; 6],
            materials: vec![0, 0, 1, 1, 2, 2],
            triangles: vec![[0, 1, 3], [2, 1, 3], [0, 2, 3], [4, 5, 3]],
            ..Mesh::default()
        };
        let border = Border { planes: vec![1, 0, 2, 0, 4, 0], keep: vec![3, 0, 2, 0, 1, 0] };
        let (joined, border) = weld_seams(&mesh, &border, &classes);
        assert_eq!(joined.positions.len(), 5);
        assert_eq!(joined.triangles, [[0, 1, 2], [0, 1, 2], [3, 4, 2]]);
        assert_eq!((border.planes[0], border.keep[0]), (3, 2));
        assert_eq!(joined.materials, [0, 0, 0, 2, 2]);
        // What is not of the class keeps its look.
        assert_eq!(joined.texcoords[3..], [[4.0, 0.5], [5.0, 0.5]]);
        assert_eq!((joined.colors[0], joined.colors[3]), ([u16::MAX; 4], [1, 2, 3, 4]));
    }
}
