//! The separate parts of a mesh.

use rustc_hash::FxHashMap;

use crate::mesh::{Coordinate, DisjointSet, Mesh, PositionKey, key};

/// Triangles that hang together by their corners' positions.
pub(super) struct Part {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Square metres.
    pub(super) area: f64,
}

/// All parts, in order of their first triangles.
pub(super) fn parts<C: Coordinate>(mesh: &Mesh<C>) -> Vec<Part> {
    let mut first: FxHashMap<PositionKey<C>, u32> = FxHashMap::default();
    let mut connected = DisjointSet::new(mesh.positions.len());
    for (vertex, &position) in (0..).zip(&mesh.positions) {
        connected.join(*first.entry(key(position)).or_insert(vertex), vertex);
    }
    for &[a, b, c] in &mesh.triangles {
        connected.join(a, b);
        connected.join(b, c);
    }
    let mut number: FxHashMap<u32, usize> = FxHashMap::default();
    let mut parts: Vec<Part> = Vec::new();
    for &triangle in &mesh.triangles {
        let next = parts.len();
        let part = *number.entry(connected.root(triangle[0])).or_insert(next);
        if part == next {
            parts.push(Part { triangles: Vec::new(), area: 0.0 });
        }
        parts[part].triangles.push(triangle);
        parts[part].area += mesh.triangle_area(triangle);
    }
    parts
}
