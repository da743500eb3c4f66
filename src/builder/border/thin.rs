//! Moving the border vertices that a level does without onto their kept neighbours.
//!
//! A half-edge collapse along the border: nothing but an index changes, so texture coordinates
//! stay those of a vertex of the same chart. Both sides of a plane do the same, since which
//! vertices go was decided by the plane ([`crate::builder::border::chain`]).

use rustc_hash::FxHashMap;

use crate::builder::border::vertex::{Border, BorderVertexState, Path};
use crate::mesh::{Mesh, PositionKey, all_differ, key, wide};

/// An edge by the positions of its ends, in key order.
pub type EdgeKey = [PositionKey<f32>; 2];

/// The [`EdgeKey`] of two vertices.
pub fn edge_key(mesh: &Mesh, ends: [u32; 2]) -> EdgeKey {
    let [a, b] = ends.map(|vertex| key(mesh.positions[vertex as usize]));
    if a <= b { [a, b] } else { [b, a] }
}

/// The open edges of a mesh whose ends share a plane of `path`: each once, as the first triangle
/// that has it winds. A mesh that is folded over such an edge has it three times, and ends there
/// all the same; one that has it twice goes on from there.
pub fn border_edges(mesh: &Mesh, border: &Border, path: &Path) -> Vec<[u32; 2]> {
    let bits = path.bits();
    let mut count: FxHashMap<EdgeKey, (u32, [u32; 2])> = FxHashMap::default();
    if bits == 0 {
        return Vec::new();
    }
    let planes = |vertex: u32| border.planes[vertex as usize] & bits;
    for &[a, b, c] in &mesh.triangles {
        for ends in [[a, b], [b, c], [c, a]] {
            if planes(ends[0]) & planes(ends[1]) != 0 {
                count.entry(edge_key(mesh, ends)).or_insert((0, ends)).0 += 1;
            }
        }
    }
    let mut edges: Vec<[u32; 2]> =
        count.into_values().filter(|(uses, _)| uses % 2 == 1).map(|(_, ends)| ends).collect();
    edges.sort_unstable();
    edges
}

/// Collapses the vertices that are gone at `level`; returns how many could not be, because they
/// are on a seam or the border branches there. Those become kept.
pub fn thin_border(mesh: &mut Mesh, border: &mut Border, path: &Path, level: u8) -> usize {
    let gone = |border: &Border, vertex: usize| {
        path.state(border.planes[vertex], border.keep[vertex], level) == BorderVertexState::Gone
    };
    let candidates: Vec<u32> =
        (0..mesh.positions.len()).filter(|&v| gone(border, v)).map(|v| v as u32).collect();
    if candidates.is_empty() {
        return 0;
    }
    let on_border = |vertex: usize| border.planes[vertex] & path.bits() != 0;
    let mut is_gone: Vec<bool> = (0..mesh.positions.len()).map(|v| gone(border, v)).collect();
    let edges = border_edges(mesh, border, path);
    let stuck = collapse_along(mesh, &edges, on_border, &mut is_gone);
    for vertex in candidates.into_iter().filter(|&vertex| !is_gone[vertex as usize]) {
        border.keep[vertex as usize] = 0;
    }
    stuck
}

/// Collapses the vertices that are `gone` along edges onto the nearest that is not. Those that
/// cannot be, since there is another vertex of the border at the same place or there are more or
/// fewer than two edges, stay and are gone no longer; returns how many these are.
pub(super) fn collapse_along(
    mesh: &mut Mesh,
    edges: &[[u32; 2]],
    on_border: impl Fn(usize) -> bool,
    gone: &mut [bool],
) -> usize {
    let mut wedges: FxHashMap<PositionKey<f32>, u32> = FxHashMap::default();
    let mut on_seam = vec![false; mesh.positions.len()];
    for (vertex, &position) in mesh.positions.iter().enumerate() {
        if on_border(vertex)
            && let Some(other) = wedges.insert(key(position), vertex as u32)
        {
            on_seam[vertex] = true;
            on_seam[other as usize] = true;
        }
    }
    let mut neighbours: FxHashMap<u32, ([u32; 2], u32)> = FxHashMap::default();
    for &[a, b] in edges {
        for (from, to) in [(a, b), (b, a)] {
            let entry = neighbours.entry(from).or_insert(([u32::MAX; 2], 0));
            if let Some(slot) = entry.0.get_mut(entry.1 as usize) {
                *slot = to;
            }
            entry.1 += 1;
        }
    }
    let candidates: Vec<u32> =
        (0..mesh.positions.len() as u32).filter(|&vertex| gone[vertex as usize]).collect();
    let mut stuck = 0;
    for &vertex in &candidates {
        let two = neighbours.get(&vertex).is_some_and(|(_, count)| *count == 2);
        if !two || on_seam[vertex as usize] {
            gone[vertex as usize] = false;
            stuck += 1;
        }
    }
    let mut target: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for vertex in candidates {
        if !gone[vertex as usize] {
            continue;
        }
        let ends = neighbours[&vertex]
            .0
            .map(|first| walk(mesh, vertex, first, &neighbours, |v| gone[v as usize]));
        let nearest = match ends {
            [Some(a), Some(b)] => {
                let nearer = a.1.total_cmp(&b.1).then_with(|| {
                    key(mesh.positions[a.0 as usize]).cmp(&key(mesh.positions[b.0 as usize]))
                });
                Some(if nearer.is_le() { a.0 } else { b.0 })
            }
            [Some(end), None] | [None, Some(end)] => Some(end.0),
            [None, None] => None,
        };
        match nearest {
            Some(end) => target[vertex as usize] = end,
            None => stuck += 1,
        }
    }
    for corner in mesh.triangles.as_flattened_mut() {
        *corner = target[*corner as usize];
    }
    mesh.triangles.retain(|&corners| all_differ(corners));
    stuck
}

/// From `start` through `next` along the border to the first vertex that stays, and how far it is
/// along the way.
fn walk(
    mesh: &Mesh,
    start: u32,
    next: u32,
    neighbours: &FxHashMap<u32, ([u32; 2], u32)>,
    gone: impl Fn(u32) -> bool,
) -> Option<(u32, f64)> {
    let point = |vertex: u32| wide(mesh.positions[vertex as usize]);
    let (mut before, mut at) = (start, next);
    let mut length = point(start).distance(point(next));
    while gone(at) {
        let [a, b] = neighbours.get(&at)?.0;
        let onward = if a == before { b } else { a };
        length += point(at).distance(point(onward));
        (before, at) = (at, onward);
        if at == start {
            return None;
        }
    }
    Some((at, length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::builder::border::chain::CutPlane;

    #[test]
    fn a_border_edge_that_the_mesh_folds_over_is_still_of_the_border() {
        // Triangles over the edge from 0 to 1, which both lie on the plane.
        let fan = |apexes: &[u32]| Mesh {
            positions: vec![
                [0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 0.0, 1.0],
                [1.0, 0.0, 2.0],
            ],
            materials: vec![0; 5],
            triangles: apexes.iter().map(|&apex| [0, 1, apex]).collect(),
            ..Mesh::default()
        };
        let border = Border { planes: vec![1, 1, 0, 0, 0], keep: vec![0; 5] };
        let path = Path::default().with(Arc::new(CutPlane::from_chains(0, 0.0, Vec::new())));
        let open = |mesh: &Mesh| border_edges(mesh, &border, &path);
        assert_eq!(open(&fan(&[2])), [[0, 1]]);
        assert_eq!(open(&fan(&[2, 3])), [[0u32; 2]; 0], "it goes on behind the edge");
        assert_eq!(open(&fan(&[2, 3, 4])), [[0, 1]]);
    }
}
