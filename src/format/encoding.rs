//! How a node's geometry is stored: plain, in steps or compressed.

use rustc_hash::FxHashMap;

use super::corner_normals::unify_normals;
use super::node_mesh::{NodeMesh, Primitive};
use super::quantized::{place, round_texcoords};
use crate::mesh::{Normal, PositionKey, key};

/// How a node's geometry is stored. The default is a form that all viewers read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoding {
    /// Positions that are multiples of this many metres, a power of two, are stored in 16 bits
    /// (`KHR_mesh_quantization`), normals beside them in 8 bits, and texture coordinates within 0–1 in 16.
    pub step: Option<f64>,
    /// Vertices and indices are compressed without loss (`EXT_meshopt_compression`).
    pub compress: bool,
}

impl Encoding {
    /// Gives a mesh the origin and order that it is stored best with, and rounds texture coordinates
    /// and normals that are stored in fewer bits. Positions stay where they are.
    pub fn prepare(&self, mesh: &mut NodeMesh) {
        if let Some(step) = self.step {
            place(mesh, step);
            let NodeMesh { images, primitives, .. } = mesh;
            primitives.iter_mut().for_each(|primitive| round_texcoords(primitive, images));
        }
        for primitive in &mut mesh.primitives {
            weld(primitive);
            order(primitive);
            unify_normals(primitive);
            if self.step.is_some() {
                round_normals(&mut primitive.normals);
            }
        }
    }
}

/// Rounds normals to 8 bits. The corners of a triangle and of its neighbours often have the same.
fn round_normals(normals: &mut [Normal]) {
    let mut last = [Normal::NONE; 2];
    for normal in normals {
        if *normal != last[0] {
            last = [*normal, normal.rounded_to_8_bits()];
        }
        *normal = last[1];
    }
}

/// Makes equal vertices of an untextured primitive one: where its file has copies of a vertex, they
/// differ in their normal ([`super::corner_normals`]).
fn weld(primitive: &mut Primitive) {
    let Primitive { positions, colors, indices, surface, .. } = primitive;
    if surface.image.is_some() {
        return;
    }
    let mut known: FxHashMap<(PositionKey<f32>, Option<[u16; 4]>), u32> = FxHashMap::default();
    known.reserve(positions.len());
    let mut kept: Vec<usize> = Vec::with_capacity(positions.len());
    let number: Vec<u32> = (0..positions.len())
        .map(|vertex| {
            let same = (key(positions[vertex]), colors.get(vertex).copied());
            *known.entry(same).or_insert_with(|| {
                kept.push(vertex);
                kept.len() as u32 - 1
            })
        })
        .collect();
    if kept.len() < positions.len() {
        *positions = kept.iter().map(|&vertex| positions[vertex]).collect();
        *colors = kept.iter().filter_map(|&vertex| colors.get(vertex).copied()).collect();
        indices.iter_mut().for_each(|vertex| *vertex = number[*vertex as usize]);
    }
}

/// Triangles near each other in space follow each other, and vertices follow triangles: a graphics
/// card transforms and fetches few vertices twice, and what resembles its neighbour takes few bits.
/// Skirts stay behind all other triangles.
fn order(primitive: &mut Primitive) {
    let Primitive { positions, texcoords, colors, normals, indices, skirt_triangles, .. } =
        primitive;
    let vertices = positions.len();
    let skirts = indices.len() - 3 * *skirt_triangles;
    let (mut ordered, mut ordered_normals) =
        (Vec::with_capacity(indices.len()), Vec::with_capacity(normals.len()));
    for range in [0..skirts, skirts..indices.len()] {
        let corners = meshopt::optimize_vertex_cache(&indices[range.clone()], vertices);
        if !normals.is_empty() {
            ordered_normals.extend(moved_normals(
                &indices[range.clone()],
                &normals[range],
                &corners,
            ));
        }
        ordered.extend(corners);
    }
    (*indices, *normals) = (ordered, ordered_normals);
    let remap = meshopt::optimize_vertex_fetch_remap(indices, vertices);
    let kept = remap.iter().filter(|&&to| to != u32::MAX).count();
    fn moved<T: Copy + Default>(from: &[T], remap: &[u32], kept: usize) -> Vec<T> {
        if from.is_empty() {
            return Vec::new();
        }
        let mut to = vec![T::default(); kept];
        for (value, &place) in from.iter().zip(remap) {
            if let Some(slot) = to.get_mut(place as usize) {
                *slot = *value;
            }
        }
        to
    }
    *positions = moved(positions, &remap, kept);
    *texcoords = moved(texcoords, &remap, kept);
    *colors = moved(colors, &remap, kept);
    for index in indices {
        *index = remap[*index as usize];
    }
}

/// The normals of triangles' corners in another order of the triangles. Triangles of the same corners
/// are found in the order in which they come.
fn moved_normals(before: &[u32], normals: &[Normal], after: &[u32]) -> Vec<Normal> {
    let (before, after) = (before.as_chunks::<3>().0, after.as_chunks::<3>().0);
    let mut first: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    first.reserve(before.len());
    let mut next = vec![u32::MAX; before.len()];
    for (number, corners) in before.iter().enumerate().rev() {
        if let Some(later) = first.insert(*corners, number as u32) {
            next[number] = later;
        }
    }
    let mut moved = Vec::with_capacity(normals.len());
    for corners in after {
        let number = first.get_mut(corners).map_or(0, |first| {
            let number = *first as usize;
            *first = if next[number] == u32::MAX { *first } else { next[number] };
            number
        });
        moved.extend_from_slice(&normals[3 * number..3 * number + 3]);
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::super::test_mesh::mesh;
    use super::*;

    #[test]
    fn ordering_keeps_every_triangle() {
        let mut ordered = mesh();
        Encoding { step: None, compress: true }.prepare(&mut ordered);
        for (before, after) in mesh().primitives.iter().zip(&ordered.primitives) {
            let corners = |p: &Primitive| {
                let of_triangle = |corners: &[u32]| {
                    let mut corners: Vec<[u32; 3]> = corners
                        .iter()
                        .map(|&i| p.positions[i as usize].map(f32::to_bits))
                        .collect();
                    corners.sort_unstable();
                    corners
                };
                let mut triangles: Vec<_> = p.indices.chunks(3).map(of_triangle).collect();
                triangles.sort_unstable();
                triangles
            };
            assert_eq!(corners(before), corners(after));
            assert_eq!(before.texcoords.len(), after.texcoords.len());
        }
    }
}
