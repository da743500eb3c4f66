//! How a mesh hangs together.

use rustc_hash::FxHashMap;

use crate::mesh::{DisjointSet, Mesh, PositionKey, key};

/// What of a mesh hangs together by its vertices' positions.
pub(super) struct Connected {
    /// Separate parts; all that touch a border are one, since they go on beyond it.
    pub parts: usize,
    /// Whether several vertices lie at one position.
    pub has_seams: bool,
}

impl Connected {
    /// Of a mesh of which some vertices are `locked` on borders.
    pub fn of(mesh: &Mesh, locked: &[bool]) -> Self {
        let mut first: FxHashMap<PositionKey<f32>, u32> = FxHashMap::default();
        first.reserve(mesh.positions.len());
        let mut sets = DisjointSet::new(mesh.positions.len());
        let mut first_locked = None;
        for ((vertex, &position), &is_locked) in (0..).zip(&mesh.positions).zip(locked) {
            sets.join(*first.entry(key(position)).or_insert(vertex), vertex);
            if is_locked {
                sets.join(*first_locked.get_or_insert(vertex), vertex);
            }
        }
        for &[a, b, c] in &mesh.triangles {
            sets.join(a, b);
            sets.join(b, c);
        }
        let mut roots: Vec<u32> = mesh.triangles.iter().map(|t| sets.root(t[0])).collect();
        roots.sort_unstable();
        roots.dedup();
        Self { parts: roots.len(), has_seams: first.len() < mesh.positions.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hang_together_by_positions_and_borders() {
        // Two triangles with a seam between them, and two apart.
        let side = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let far = |x: f32| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
        let mut mesh = Mesh::default();
        for corners in
            [[side[0], side[1], [1.0; 3]], [side[1], side[0], [-1.0; 3]], far(5.0), far(9.0)]
        {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(corners);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        let of = |locked: &[usize]| {
            let locked: Vec<bool> = (0..12).map(|vertex| locked.contains(&vertex)).collect();
            let Connected { parts, has_seams } = Connected::of(&mesh, &locked);
            (parts, has_seams)
        };
        assert_eq!(of(&[]), (3, true));
        assert_eq!(of(&[0, 7]), (2, true));
        assert_eq!(of(&[0, 7, 11]), (1, true));
        let one =
            Mesh { positions: far(5.0).to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        assert!(!Connected::of(&one, &[false; 3]).has_seams);
    }
}
