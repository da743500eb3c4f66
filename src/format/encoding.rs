//! How a node's geometry is stored: plain, in steps or compressed.

use super::node_mesh::{NodeMesh, Primitive};
use super::quantized::{place, round_texcoords};

/// How a node's geometry is stored. The default is a form that all viewers read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoding {
    /// Positions that are multiples of this many metres, a power of two, are stored in 16 bits
    /// (`KHR_mesh_quantization`), and so are texture coordinates within 0–1.
    pub step: Option<f64>,
    /// Vertices and indices are compressed without loss (`EXT_meshopt_compression`).
    pub compress: bool,
}

impl Encoding {
    /// Gives a mesh the origin and order that it is stored best with, and rounds texture coordinates
    /// that are stored in 16 bits. Positions stay where they are.
    pub fn prepare(&self, mesh: &mut NodeMesh) {
        if let Some(step) = self.step {
            place(mesh, step);
            let NodeMesh { images, primitives, .. } = mesh;
            primitives.iter_mut().for_each(|primitive| round_texcoords(primitive, images));
        }
        mesh.primitives.iter_mut().for_each(order);
    }
}

/// Triangles near each other in space follow each other, and vertices follow triangles: a graphics
/// card transforms and fetches few vertices twice, and what resembles its neighbour takes few bits.
/// Skirts stay behind all other triangles.
fn order(primitive: &mut Primitive) {
    let Primitive { positions, texcoords, colors, indices, skirt_triangles, .. } = primitive;
    let vertices = positions.len();
    let (surface, skirts) = indices.split_at(indices.len() - 3 * *skirt_triangles);
    let mut ordered = meshopt::optimize_vertex_cache(surface, vertices);
    ordered.extend(meshopt::optimize_vertex_cache(skirts, vertices));
    *indices = ordered;
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
