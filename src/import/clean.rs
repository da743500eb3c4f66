//! Removes triangles that are no surface (not finite, degenerate, there twice) and their vertices.

use std::path::Path;

use crate::mesh::{Part, Warnings, all_differ};

/// What was removed or ignored in one file, and how often.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CleanStats {
    /// Triangles with a coordinate that is NaN or infinite.
    pub(super) not_finite: u64,
    /// Triangles with two corners at the same position.
    pub(super) degenerate: u64,
    /// Triangles with the corners, the winding and the material of an earlier one of their group.
    pub(super) duplicate: u64,
    /// Polygons of more than three corners that have no area.
    pub(super) flat_polygons: u64,
    /// Points, lines, curves and free-form surfaces.
    pub(super) not_triangles: u64,
    /// Faces of a textured material without texture coordinates.
    pub(super) untextured_faces: u64,
    /// Texture coordinates that are NaN or infinite.
    pub(super) texcoords_not_finite: u64,
    /// Vertex colours with a component out of range.
    pub(super) colors_clamped: u64,
    /// Normals that have no direction, or point to the back of their face.
    pub(super) normals_dropped: u64,
    /// Vertices that no face uses.
    pub(super) unused_vertices: u64,
}

impl CleanStats {
    /// Adds what was counted elsewhere.
    pub(super) fn add(&mut self, other: &Self) {
        self.not_finite += other.not_finite;
        self.degenerate += other.degenerate;
        self.duplicate += other.duplicate;
        self.flat_polygons += other.flat_polygons;
        self.not_triangles += other.not_triangles;
        self.untextured_faces += other.untextured_faces;
        self.texcoords_not_finite += other.texcoords_not_finite;
        self.colors_clamped += other.colors_clamped;
        self.normals_dropped += other.normals_dropped;
        self.unused_vertices += other.unused_vertices;
    }

    /// Adds what was counted to `warnings`, naming the file.
    pub(super) fn report(&self, file: &Path, warnings: &mut Warnings) {
        let file = file.display();
        let mut add = |what: &str, times| warnings.add(format!("{file}: {what}"), times);
        add("triangle with a coordinate that is not finite, dropped", self.not_finite);
        add("degenerate triangle, dropped", self.degenerate);
        add("duplicate triangle, dropped", self.duplicate);
        add("polygon without area, dropped", self.flat_polygons);
        add("point, line or free-form element, ignored", self.not_triangles);
        add("textured face without texture coordinates, set to 0", self.untextured_faces);
        add("texture coordinate that is not finite, set to 0", self.texcoords_not_finite);
        add("vertex colour out of range, clamped", self.colors_clamped);
        add(
            "normal without a direction or to the back of its face, replaced by the face's",
            self.normals_dropped,
        );
        add("vertex that no face uses, ignored", self.unused_vertices);
    }
}

/// Removes from `part` what is no triangle, and the vertices that nothing uses any more.
///
/// Colours and texture coordinates do not count in what makes two triangles the same.
pub(super) fn clean(part: &mut Part, stats: &mut CleanStats) {
    let before = part.indices.len();
    drop_flat(part, stats);
    drop_duplicates(part, stats);
    if part.indices.len() < before {
        drop_unused_vertices(part);
    }
}

fn drop_flat(part: &mut Part, stats: &mut CleanStats) {
    let positions = &part.positions;
    retain_triangles(&mut part.indices, |_, [a, b, c]| {
        let corners = [a, b, c].map(|vertex| positions[vertex as usize]);
        if !corners.as_flattened().iter().all(|coordinate| coordinate.is_finite()) {
            stats.not_finite += 1;
            return false;
        }
        if !all_differ(corners) {
            stats.degenerate += 1;
            return false;
        }
        true
    });
}

/// Finds duplicates through a hash of each triangle's three positions that their order does not
/// change; only triangles of equal hash are compared. Nothing is welded for it.
fn drop_duplicates(part: &mut Part, stats: &mut CleanStats) {
    let triangles = part.indices.len() / 3;
    if triangles < 2 || triangles >= u32::MAX as usize {
        return;
    }
    let hashes: Vec<u64> = part.positions.iter().map(position_hash).collect();
    // Open addressing at a load of at most 2/3: upper half of the hash beside the triangle.
    let slots = (triangles + triangles / 2).next_power_of_two();
    let mask = slots - 1;
    let mut table = vec![(0_u32, EMPTY); slots];
    let positions = &part.positions;
    let mut kept = 0_u32;
    // Kept triangles are moved to the front as the pass goes on, so the table names those places.
    let indices = &mut part.indices;
    for triangle in 0..triangles {
        let corners = [0, 1, 2].map(|corner| indices[triangle * 3 + corner]);
        let hash = corners
            .iter()
            .fold(0_u64, |sum, vertex| sum.wrapping_add(hashes[*vertex as usize]))
            .wrapping_mul(MULTIPLIER);
        let (mark, mut slot) = ((hash >> 32) as u32, hash as usize >> 7 & mask);
        let duplicate = loop {
            let (known_mark, known) = table[slot];
            if known == EMPTY {
                break false;
            }
            if known_mark == mark {
                let known = known as usize * 3;
                let other = [indices[known], indices[known + 1], indices[known + 2]];
                if same_triangle(positions, corners, other) {
                    break true;
                }
            }
            slot = (slot + 1) & mask;
        };
        if duplicate {
            stats.duplicate += 1;
            continue;
        }
        table[slot] = (mark, kept);
        indices[kept as usize * 3..kept as usize * 3 + 3].copy_from_slice(&corners);
        kept += 1;
    }
    indices.truncate(kept as usize * 3);
}

/// A free slot of the table.
const EMPTY: u32 = u32::MAX;

/// Odd, with its bits well spread (the fractional part of the golden ratio).
const MULTIPLIER: u64 = 0x9e37_79b9_7f4a_7c15;

/// A hash of a position; −0 and 0 are the same.
fn position_hash(position: &[f64; 3]) -> u64 {
    position.iter().fold(0_u64, |hash, coordinate| {
        let mixed = (hash ^ (coordinate + 0.0).to_bits()).wrapping_mul(MULTIPLIER);
        mixed ^ (mixed >> 29)
    })
}

/// True where both have the same three places in the same winding.
fn same_triangle(positions: &[[f64; 3]], a: [u32; 3], b: [u32; 3]) -> bool {
    let same = |first: usize, second: usize| {
        a[first] == b[second] || positions[a[first] as usize] == positions[b[second] as usize]
    };
    (0..3).any(|turn| (0..3).all(|corner| same(corner, (corner + turn) % 3)))
}

/// Removes vertices that no triangle uses; the others keep their order.
pub(super) fn drop_unused_vertices(part: &mut Part) {
    let mut new_index = vec![u32::MAX; part.positions.len()];
    for vertex in &part.indices {
        new_index[*vertex as usize] = 0;
    }
    let mut kept = 0;
    for index in new_index.iter_mut().filter(|index| **index == 0) {
        *index = kept;
        kept += 1;
    }
    if kept as usize == part.positions.len() {
        return;
    }
    for vertex in &mut part.indices {
        *vertex = new_index[*vertex as usize];
    }
    compact(&mut part.positions, &new_index);
    compact(&mut part.texcoords, &new_index);
    compact(&mut part.colors, &new_index);
    compact(&mut part.normals, &new_index);
}

/// Keeps the elements that have a new index; an empty (absent) attribute stays empty.
fn compact<T>(values: &mut Vec<T>, new_index: &[u32]) {
    let mut old = 0;
    values.retain(|_| {
        old += 1;
        new_index[old - 1] != u32::MAX
    });
}

/// Keeps the triangles for which `keep` (called with the triangle's number) is true.
fn retain_triangles(indices: &mut Vec<u32>, mut keep: impl FnMut(usize, [u32; 3]) -> bool) {
    let mut kept = 0;
    for triangle in 0..indices.len() / 3 {
        let corners = [0, 1, 2].map(|corner| indices[triangle * 3 + corner]);
        if keep(triangle, corners) {
            indices[kept..kept + 3].copy_from_slice(&corners);
            kept += 3;
        }
    }
    indices.truncate(kept);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Part {
        Part {
            positions: positions.to_vec(),
            texcoords: (0..positions.len()).map(|at| [at as f32, 0.0]).collect(),
            indices: triangles.as_flattened().to_vec(),
            ..Part::default()
        }
    }

    const CORNERS: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-0.0, 0.0, 0.0],
        [f64::NAN, 0.0, 0.0],
    ];

    #[test]
    fn what_is_no_triangle_goes_and_vertices_with_it() {
        let mut part = part(&CORNERS, &[[0, 0, 1], [0, 4, 1], [5, 1, 2], [1, 3, 2]]);
        let mut stats = CleanStats::default();
        clean(&mut part, &mut stats);
        assert_eq!(stats, CleanStats { degenerate: 2, not_finite: 1, ..CleanStats::default() });
        assert_eq!(part.positions, [CORNERS[1], CORNERS[2], CORNERS[3]]);
        assert_eq!(part.texcoords, [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]);
        assert_eq!(part.indices, [0, 2, 1]);
        assert!(part.colors.is_empty());
    }

    #[test]
    fn duplicates_go_in_any_rotation_but_not_mirrored() {
        let triangles = [[0, 1, 2], [1, 2, 0], [2, 1, 0], [4, 1, 2], [1, 3, 2]];
        let mut part = part(&CORNERS[..5], &triangles);
        let mut stats = CleanStats::default();
        clean(&mut part, &mut stats);
        assert_eq!(stats, CleanStats { duplicate: 2, ..CleanStats::default() });
        assert_eq!(part.indices, [0, 1, 2, 2, 1, 0, 1, 3, 2]);
        assert_eq!(part.positions.len(), 4, "the second vertex at the origin is unused now");
    }

    #[test]
    fn a_grid_loses_nothing_and_its_copy_everything() {
        let side = 60_u32;
        let positions: Vec<_> = (0..side * side)
            .map(|at| [f64::from(at % side) + 678_016.0, f64::from(at / side) + 5_403_456.0, 0.0])
            .collect();
        let mut triangles = Vec::new();
        for at in 0..side * (side - 1) {
            if at % side != side - 1 {
                triangles.push([at, at + 1, at + side]);
                triangles.push([at + 1, at + side + 1, at + side]);
            }
        }
        let once = part(&positions, &triangles);
        let mut cleaned = once.clone();
        let mut stats = CleanStats::default();
        clean(&mut cleaned, &mut stats);
        assert_eq!((&cleaned, stats), (&once, CleanStats::default()));
        cleaned.indices.extend(&once.indices);
        clean(&mut cleaned, &mut stats);
        assert_eq!(cleaned, once);
        assert_eq!(stats.duplicate, triangles.len() as u64);
    }
}
