//! Faces that wind one way over one surface, each there once.
//!
//! Edge collapse takes an edge for sound where two faces meet at it that pass along it in opposite
//! directions. Models have faces turned inside out, and faces from both sides at one place; where
//! both sides of a face are drawn, neither changes what is seen. Coarse nodes may therefore have
//! them in order, or nothing there would collapse. Leaves stay as the source is.

use std::hash::BuildHasher;

use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};

use crate::mesh::{AlphaMode, Material, Mesh, PositionKey, key};

/// Whether faces of a material look the same from both sides, and one like several in one place.
pub fn reorientable(material: &Material) -> bool {
    material.double_sided && material.alpha == AlphaMode::Opaque
}

/// The triangles with faces of one place become the first of them, and of neighbours that wind
/// against each other those turned that are less in area; `None` where that changes no more than a
/// share of them (`few`). Only faces of materials that are [`reorientable`] change. Texture seams
/// divide nothing here: places count, not vertices.
pub fn oriented(mesh: &Mesh, reorientable: &[bool], few: f64) -> Option<Vec<[u32; 3]>> {
    let places = places_of(mesh);
    let at = |triangle: [u32; 3]| triangle.map(|vertex| places[vertex as usize]);
    let can_turn = |triangle: [u32; 3]| {
        let material = mesh.triangle_material(triangle) as usize;
        reorientable.get(material).copied().unwrap_or(false)
    };
    // As it mostly is: no two faces pass along a side in the same direction.
    let mut passed = FxHashSet::default();
    let mut passes_first = |&t: &[u32; 3]| sides(at(t)).into_iter().all(|side| passed.insert(side));
    if mesh.triangles.iter().all(&mut passes_first) {
        return None;
    }
    let mut seen = FxHashSet::default();
    let is_first = |&&triangle: &&[u32; 3]| {
        let mut corners = at(triangle);
        corners.sort_unstable();
        !can_turn(triangle) || seen.insert(corners)
    };
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(is_first).copied().collect();
    let placed: Vec<_> = triangles.iter().map(|&t| can_turn(t).then(|| at(t))).collect();
    let areas: Vec<f64> = triangles.iter().map(|&t| mesh.triangle_area(t)).collect();
    let turning = to_turn(&neighbors(&placed), &areas);
    for &triangle in &turning {
        triangles[triangle as usize].swap(1, 2);
    }
    let changed = turning.len() + mesh.triangles.len() - triangles.len();
    (changed as f64 > few * mesh.triangles.len() as f64).then_some(triangles)
}

/// Whether more than a share of the faces (`few`) lie where others do. The quadrics of such sheets
/// know no border: folded in at their rims they count as unchanged.
pub fn has_duplicate_faces(mesh: &Mesh, few: f64) -> bool {
    let hasher = FxBuildHasher;
    let hashes: Vec<u64> = mesh.positions.iter().map(|&p| hasher.hash_one(key(p))).collect();
    let mut seen = FxHashSet::default();
    seen.reserve(mesh.triangles.len());
    let sum = |t: &[u32; 3]| t.iter().fold(0, |sum: u64, &v| sum.wrapping_add(hashes[v as usize]));
    let again = mesh.triangles.iter().filter(|t| !seen.insert(sum(t))).count();
    again as f64 > few * mesh.triangles.len() as f64
}

fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

/// A number for each vertex, the same for all at one place.
fn places_of(mesh: &Mesh) -> Vec<u32> {
    let mut places: FxHashMap<PositionKey<f32>, u32> = FxHashMap::default();
    places.reserve(mesh.positions.len());
    let number = |(vertex, &position)| *places.entry(key(position)).or_insert(vertex);
    (0..).zip(&mesh.positions).map(number).collect()
}

/// Of each face, those beyond the sides at which just two faces meet, and whether they wind against
/// it; faces are given by the places of their corners, where they may turn.
fn neighbors(faces: &[Option<[u32; 3]>]) -> Vec<Vec<(u32, bool)>> {
    let mut at_sides = Vec::with_capacity(3 * faces.len());
    for (face, corners) in (0u32..).zip(faces) {
        for (from, to) in corners.map(sides).into_iter().flatten() {
            at_sides.push((from.min(to), from.max(to), face, from < to));
        }
    }
    at_sides.sort_unstable();
    let mut neighbors = vec![Vec::new(); faces.len()];
    for meeting in at_sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let &[(.., first, up), (.., second, other_up)] = meeting else { continue };
        neighbors[first as usize].push((second, up == other_up));
        neighbors[second as usize].push((first, up == other_up));
    }
    neighbors
}

/// The faces whose turning leaves the fewest of one surface that wind against each other; over a
/// surface with one side alone (Möbius) some do whatever turns.
fn to_turn(neighbors: &[Vec<(u32, bool)>], areas: &[f64]) -> Vec<u32> {
    let mut turning = Vec::new();
    let mut reached = vec![false; neighbors.len()];
    for start in 0..neighbors.len() {
        if std::mem::replace(&mut reached[start], true) {
            continue;
        }
        // Faces that wind as the first does, and those that do not.
        let mut ways: [Vec<u32>; 2] = [Vec::new(), Vec::new()];
        let mut pending = vec![(start as u32, false)];
        while let Some((face, against)) = pending.pop() {
            ways[usize::from(against)].push(face);
            for &(other, turned) in &neighbors[face as usize] {
                if !std::mem::replace(&mut reached[other as usize], true) {
                    pending.push((other, against != turned));
                }
            }
        }
        let area = |faces: &[u32]| faces.iter().map(|&face| areas[face as usize]).sum::<f64>();
        let [with, against] = ways;
        turning.extend(if area(&against) <= area(&with) { against } else { with });
    }
    turning
}

#[cfg(test)]
mod tests {
    use super::*;

    const FEW: f64 = 0.02;

    /// A sheet of squares in two triangles each.
    fn sheet(side: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for y in 0..=side {
            mesh.positions.extend((0..=side).map(|x| [x as f32, y as f32, 0.0]));
        }
        let at = |x: u32, y: u32| y * (side + 1) + x;
        for (x, y) in (0..side * side).map(|square| (square % side, square / side)) {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    fn upward(mesh: &Mesh) -> usize {
        let up = |&&t: &&[u32; 3]| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(c - a).z > 0.0
        };
        mesh.triangles.iter().filter(up).count()
    }

    #[test]
    fn faces_turned_inside_out_turn_back() {
        let sound = sheet(8);
        assert_eq!(oriented(&sound, &[true], FEW), None);
        let mut mesh = sound.clone();
        for triangle in mesh.triangles.iter_mut().step_by(3) {
            triangle.swap(1, 2);
        }
        assert_eq!(oriented(&mesh, &[false], FEW), None, "drawn from one side alone");
        mesh.triangles = oriented(&mesh, &[true], FEW).unwrap();
        assert_eq!((mesh.triangles.len(), upward(&mesh)), (128, 128));
    }

    #[test]
    fn of_faces_from_both_sides_one_stays() {
        let mut mesh = sheet(8);
        // The backs have vertices of their own, of another material.
        let backs: Vec<u32> = (0..81).map(|vertex| mesh.push_copy(vertex)).collect();
        mesh.materials[81..].fill(1);
        let back = |t: &[u32; 3]| t.map(|vertex| backs[vertex as usize]);
        let turned: Vec<_> = mesh.triangles.iter().map(back).map(|[a, b, c]| [a, c, b]).collect();
        assert!(!has_duplicate_faces(&mesh, FEW));
        mesh.triangles.extend(turned);
        assert!(has_duplicate_faces(&mesh, FEW));
        let not_seen = oriented(&mesh, &[true, false], FEW);
        assert_eq!(not_seen, None, "backs that are not seen from the front");
        mesh.triangles = oriented(&mesh, &[true, true], FEW).unwrap();
        assert_eq!((mesh.triangles.len(), upward(&mesh)), (128, 128));
    }

    /// A Möbius strip with three more faces on its first side.
    #[test]
    fn no_face_is_lost_where_no_order_is_sound() {
        let mut mesh = Mesh {
            positions: (0..12).map(|i| [(i / 2) as f32, (i % 2) as f32, 0.0]).collect(),
            materials: vec![0; 12],
            ..Mesh::default()
        };
        for i in (0..10).step_by(2) {
            mesh.triangles.extend([[i, i + 1, i + 2], [i + 1, i + 3, i + 2]]);
        }
        mesh.triangles.extend([[10, 11, 1], [11, 0, 1], [0, 1, 5], [0, 1, 7], [0, 1, 9]]);
        let sorted = |triangles: &[[u32; 3]]| {
            let mut triangles = triangles.to_vec();
            triangles.iter_mut().for_each(|t| t.sort_unstable());
            triangles
        };
        let before = sorted(&mesh.triangles);
        if let Some(triangles) = oriented(&mesh, &[true], FEW) {
            assert_eq!(sorted(&triangles), before);
        }
    }
}
