//! Joining the simplified children of a node into one mesh, welded along the planes between them.

use rustc_hash::FxHashMap;

use crate::builder::border::slit::close_slits;
use crate::builder::border::vertex::Border;
use crate::mesh::{Mesh, Normal, PositionKey, color_key, key, texcoord_key};

/// Vertices are one where these are equal: position, texture coordinate, colour, material and normal.
type VertexKey = (PositionKey<f32>, u64, u64, u32, Normal);

/// Joins meshes that bound each other at planes beyond the first `parent_planes`.
pub fn merge(children: &[(&Mesh, &Border)], parent_planes: usize) -> (Mesh, Border) {
    let parent_bits = if parent_planes >= 64 { !0 } else { (1u64 << parent_planes) - 1 };
    let mut mesh = Mesh::default();
    let mut border = Border::default();
    let mut released: Vec<bool> = Vec::new();
    let mut welded: FxHashMap<VertexKey, u32> = FxHashMap::default();
    for (child, child_border) in children {
        let mut new_index = Vec::with_capacity(child.positions.len());
        for vertex in 0..child.positions.len() {
            let planes = child_border.planes[vertex];
            let mut add = || {
                border.planes.push(planes & parent_bits);
                border.keep.push(child_border.keep[vertex]);
                released.push(planes & !parent_bits != 0);
                mesh.push_vertex_from(child, vertex)
            };
            let index = if planes & !parent_bits == 0 {
                add()
            } else {
                let index = *welded.entry(vertex_key(child, vertex)).or_insert_with(add);
                let slot = &mut border.planes[index as usize];
                *slot |= planes & parent_bits;
                let keep = &mut border.keep[index as usize];
                *keep = (*keep).min(child_border.keep[vertex]);
                index
            };
            new_index.push(index);
        }
        mesh.triangles
            .extend(child.triangles.iter().map(|t| t.map(|vertex| new_index[vertex as usize])));
    }
    close_slits(&mut mesh, &border, &released);
    (mesh, border)
}

fn vertex_key(mesh: &Mesh, vertex: usize) -> VertexKey {
    (
        key(mesh.positions[vertex]),
        mesh.texcoords.get(vertex).map_or(0, |&texcoord| texcoord_key(texcoord)),
        mesh.colors.get(vertex).map_or(0, |&color| color_key(color)),
        mesh.materials[vertex],
        mesh.normals.get(vertex).copied().unwrap_or(Normal::NONE),
    )
}
