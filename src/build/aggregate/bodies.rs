//! The separate parts of a mesh.

use rustc_hash::FxHashMap;

use crate::mesh::{Mesh, PositionKey, key};

/// Triangles that hang together by their corners' positions.
pub(super) struct Part {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Square metres.
    pub(super) area: f64,
}

/// All parts, in order of their first triangles.
pub(super) fn parts(mesh: &Mesh) -> Vec<Part> {
    let mut first: FxHashMap<PositionKey<f32>, u32> = FxHashMap::default();
    let mut parent: Vec<u32> = (0..)
        .zip(&mesh.positions)
        .map(|(vertex, &position)| *first.entry(key(position)).or_insert(vertex))
        .collect();
    for &[a, b, c] in &mesh.triangles {
        for (x, y) in [(a, b), (b, c)] {
            let (x, y) = (root(&mut parent, x), root(&mut parent, y));
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    let mut number: FxHashMap<u32, usize> = FxHashMap::default();
    let mut parts: Vec<Part> = Vec::new();
    for &triangle in &mesh.triangles {
        let next = parts.len();
        let part = *number.entry(root(&mut parent, triangle[0])).or_insert(next);
        if part == next {
            parts.push(Part { triangles: Vec::new(), area: 0.0 });
        }
        parts[part].triangles.push(triangle);
        parts[part].area += mesh.triangle_area(triangle);
    }
    parts
}

fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}
