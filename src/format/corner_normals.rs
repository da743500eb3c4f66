//! Normals of corners in files that have one normal per vertex.
//!
//! A node in memory has the vertices that its triangles join at, and a normal for each corner. glTF has
//! one normal per vertex. So a vertex whose corners have several normals is written once for each of
//! them, and these copies follow each other in the file: a reader that joins vertices which follow each
//! other and differ in their normal alone has the node as it was.

use super::node_mesh::Primitive;
use crate::mesh::{Normal, VertexNormals};

/// Gives corners at one vertex one normal where theirs are nearly the same.
pub(super) fn unify_normals(primitive: &mut Primitive) {
    let Primitive { positions, normals, indices, .. } = primitive;
    let mut known = VertexNormals::new(positions.len());
    for (normal, &vertex) in normals.iter_mut().zip(&*indices) {
        let entry = known.near_entry(vertex, *normal);
        *normal = known.normal(entry);
    }
}

/// A primitive with the vertices of its file, whose normals are returned beside it, one per vertex.
pub(super) fn divide_vertices(primitive: &Primitive) -> (Primitive, Vec<Normal>) {
    let Primitive { positions, texcoords, colors, normals, indices, .. } = primitive;
    let mut known = VertexNormals::new(positions.len());
    let entries: Vec<u32> =
        indices.iter().zip(normals).map(|(&vertex, &normal)| known.entry(vertex, normal)).collect();
    let mut vertices: Vec<usize> = Vec::with_capacity(known.len());
    let mut vertex_normals = Vec::with_capacity(known.len());
    let mut number = vec![0; known.len()];
    for vertex in 0..positions.len() {
        let before = vertices.len();
        for entry in known.entries_of(vertex as u32) {
            number[entry as usize] = vertices.len() as u32;
            vertices.push(vertex);
            vertex_normals.push(known.normal(entry));
        }
        if vertices.len() == before {
            vertices.push(vertex);
            vertex_normals.push(Normal::NONE);
        }
    }
    let divided = Primitive {
        positions: vertices.iter().map(|&vertex| positions[vertex]).collect(),
        texcoords: vertices.iter().filter_map(|&vertex| texcoords.get(vertex).copied()).collect(),
        colors: vertices.iter().filter_map(|&vertex| colors.get(vertex).copied()).collect(),
        normals: Vec::new(),
        indices: entries.iter().map(|&entry| number[entry as usize]).collect(),
        skirt_triangles: primitive.skirt_triangles,
        surface: primitive.surface.clone(),
    };
    (divided, vertex_normals)
}

/// The inverse of [`divide_vertices`]: joins vertices that follow each other and differ in nothing but
/// their normals. Without `normals` corners get none.
pub(super) fn join_vertices(divided: &mut Primitive, normals: &[Normal]) {
    let Primitive { positions, texcoords, colors, indices, .. } = divided;
    if !normals.is_empty() {
        divided.normals = indices.iter().map(|&vertex| normals[vertex as usize]).collect();
    }
    let mut number: Vec<u32> = Vec::with_capacity(positions.len());
    let mut kept = 0;
    for vertex in 0..positions.len() {
        let is_copy = vertex > 0
            && positions[vertex] == positions[vertex - 1]
            && texcoords.get(vertex) == texcoords.get(vertex - 1)
            && colors.get(vertex) == colors.get(vertex - 1);
        kept += u32::from(!is_copy);
        number.push(kept - 1);
    }
    fn retain_first<T>(values: &mut Vec<T>, number: &[u32]) {
        let mut at = 0;
        values.retain(|_| {
            at += 1;
            at == 1 || number[at - 1] != number[at - 2]
        });
    }
    retain_first(positions, &number);
    retain_first(texcoords, &number);
    retain_first(colors, &number);
    indices.iter_mut().for_each(|vertex| *vertex = number[*vertex as usize]);
}
