//! A test that tells whether a mesh is one connected surface without seams.

use rustc_hash::FxHashSet;

use crate::mesh::{DisjointSet, Mesh, key};

/// True if a mesh is one component in which each position has one vertex. Everything that touches a
/// border by a `locked` vertex counts as connected, since it continues beyond the border.
pub(super) fn is_one_sheet(mesh: &Mesh, locked: &[bool]) -> bool {
    let mut positions = FxHashSet::default();
    positions.reserve(mesh.positions.len());
    if !mesh.positions.iter().all(|&position| positions.insert(key(position))) {
        return false;
    }
    let mut sets = DisjointSet::new(mesh.positions.len());
    let mut on_border = (0..).zip(locked).filter(|&(_, &is_locked)| is_locked);
    if let Some((first, _)) = on_border.next() {
        on_border.for_each(|(vertex, _)| sets.join(first, vertex));
    }
    for &[a, b, c] in &mesh.triangles {
        sets.join(a, b);
        sets.join(b, c);
    }
    let mut roots = mesh.triangles.iter().map(|corners| sets.root(corners[0]));
    let first = roots.next();
    roots.all(|root| Some(root) == first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_and_parts_beside_each_other_are_no_sheet_but_parts_on_a_border_are() {
        let corners = |x: f32| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
        let mesh = |firsts: &[f32]| Mesh {
            positions: firsts.iter().flat_map(|&x| corners(x)).collect(),
            triangles: (0..firsts.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..Mesh::default()
        };
        let is_sheet = |firsts: &[f32], locked: &[usize]| {
            let locked: Vec<bool> = (0..9).map(|vertex| locked.contains(&vertex)).collect();
            is_one_sheet(&mesh(firsts), &locked)
        };
        assert!(is_sheet(&[5.0], &[]));
        assert!(!is_sheet(&[5.0, 9.0, 13.0], &[]));
        assert!(!is_sheet(&[5.0, 9.0, 13.0], &[0, 4]));
        assert!(is_sheet(&[5.0, 9.0, 13.0], &[0, 4, 8]));
        // The second begins where the first ends.
        assert!(!is_sheet(&[5.0, 6.0], &[0, 4]));
    }
}
