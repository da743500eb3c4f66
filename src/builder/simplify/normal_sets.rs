//! Normals while a node is simplified.
//!
//! Vertices that differ in their normal alone are seams, which hold edges back from collapsing; the hard
//! edges of a building would divide each of its vertices. So these vertices are welded first, each with
//! the set of normals that corners had there. Simplification carries the number of the set with the
//! vertex. Afterwards each corner takes the normal of its vertex's set that is nearest to its triangle's.

use rustc_hash::FxHashMap;

use crate::builder::border::vertex::Border;
use crate::mesh::{
    Mesh, Normal, PositionKey, VertexNormals, all_differ, color_key, key, texcoord_key,
};

/// A corner takes a normal within this angle of its triangle's: the cosine of 60°. Beyond it the surface
/// has an edge, and the corner has its triangle's own normal.
const CREASE: f64 = 0.5;

/// Plane normals of a vertex's triangles within this angle are one in its set: the cosine of 8°.
const SAME_PLANE: f64 = 0.99;

/// A normal at a vertex.
#[derive(Clone, Copy, PartialEq)]
struct Member {
    normal: Normal,
    /// Corners with it have no normal of their own but that of their triangle.
    is_plane: bool,
}

/// The normals at the vertices of a mesh.
pub struct NormalSets(Vec<Vec<Member>>);

/// A mesh whose vertices differ in more than their normals, with the number of a set in the place of
/// each vertex's normal; `None` where the mesh has no normals.
pub fn weld_normals(mesh: &Mesh, border: &Border) -> Option<(Mesh, Border, NormalSets)> {
    if mesh.normals.is_empty() {
        return None;
    }
    let mut welded = Mesh::default();
    let mut welded_border = Border::default();
    let mut known: FxHashMap<(PositionKey<f32>, u64, u64, u32), u32> = FxHashMap::default();
    let mut sets = NormalSets(Vec::new());
    let mut new_index = Vec::with_capacity(mesh.positions.len());
    for vertex in 0..mesh.positions.len() {
        let same = (
            key(mesh.positions[vertex]),
            mesh.texcoords.get(vertex).map_or(0, |&texcoord| texcoord_key(texcoord)),
            mesh.colors.get(vertex).map_or(0, |&color| color_key(color)),
            mesh.materials[vertex],
        );
        let index = *known.entry(same).or_insert_with(|| {
            welded_border.planes.push(border.planes[vertex]);
            welded_border.keep.push(border.keep[vertex]);
            let index = welded.push_vertex_from(mesh, vertex);
            welded.normals[index as usize] = Normal::NONE;
            index
        });
        welded_border.planes[index as usize] |= border.planes[vertex];
        let keep = &mut welded_border.keep[index as usize];
        *keep = (*keep).min(border.keep[vertex]);
        if mesh.normals[vertex] != Normal::NONE {
            sets.of(&mut welded.normals[index as usize]);
        }
        new_index.push(index);
    }
    for &triangle in &mesh.triangles {
        let plane = mesh.triangle_normal(triangle);
        for vertex in triangle {
            let own = mesh.normals[vertex as usize];
            let set = welded.normals[new_index[vertex as usize] as usize];
            if let Some(set) = set.set_number() {
                sets.add(set, own, plane);
            }
        }
    }
    let triangles = mesh.triangles.iter().map(|t| t.map(|vertex| new_index[vertex as usize]));
    welded.triangles = triangles.filter(|&corners| all_differ(corners)).collect();
    Some((welded, welded_border, sets))
}

impl NormalSets {
    /// Gives a vertex a set, where it has none.
    fn of(&mut self, vertex: &mut Normal) {
        if vertex.set_number().is_none() {
            *vertex = Normal::of_set(self.0.len());
            self.0.push(Vec::new());
        }
    }

    /// Adds a corner's normal, or that of its plane where it has none.
    fn add(&mut self, set: usize, own: Normal, plane: Normal) {
        let is_plane = own == Normal::NONE;
        let member = Member { normal: if is_plane { plane } else { own }, is_plane };
        let is_same = |known: &Member| {
            *known == member
                || known.is_plane && is_plane && known.normal.is_within(plane, SAME_PLANE)
        };
        if !self.0[set].iter().any(is_same) {
            self.0[set].push(member);
        }
    }

    /// Gives the corners of a simplified mesh their normals. Vertices keep their numbers; those whose
    /// corners have several get copies.
    pub fn resolve(&self, mesh: &mut Mesh, border: &mut Border) {
        let mut known = VertexNormals::new(mesh.positions.len());
        let mut entries = Vec::with_capacity(3 * mesh.triangles.len());
        for &triangle in &mesh.triangles {
            let plane = mesh.triangle_normal(triangle);
            entries.extend(triangle.map(|vertex| {
                let set = mesh.normals[vertex as usize].set_number();
                let normal = set.map_or(Normal::NONE, |set| self.nearest(set, plane));
                known.entry(vertex, normal)
            }));
        }
        let (vertices, copies) = known.with_copies();
        for vertex in copies {
            mesh.push_copy(vertex as usize);
            border.planes.push(border.planes[vertex as usize]);
            border.keep.push(border.keep[vertex as usize]);
        }
        mesh.normals.fill(Normal::NONE);
        for (entry, &vertex) in (0..).zip(&vertices) {
            mesh.normals[vertex as usize] = known.normal(entry);
        }
        for (corner, entry) in mesh.triangles.as_flattened_mut().iter_mut().zip(entries) {
            *corner = vertices[entry as usize];
        }
    }

    /// The normal of a set for a corner of a triangle in a plane.
    fn nearest(&self, set: usize, plane: Normal) -> Normal {
        let Some(plane) = plane.vector() else { return Normal::NONE };
        let mut best = (CREASE, Normal::NONE);
        for member in &self.0[set] {
            let cosine = member.normal.vector().map_or(-1.0, |normal| normal.dot(plane));
            if cosine > best.0 {
                best = (cosine, if member.is_plane { Normal::NONE } else { member.normal });
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// A fence of four squares that turns by 30° at each of its posts but the last, where it turns by
    /// 90°: smooth but for that edge.
    fn fence() -> Mesh {
        let mut mesh = Mesh::default();
        let mut at = DVec3::ZERO;
        let turns = [0.0, 30.0, 60.0, 150.0f64];
        let normal_of = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            DVec3::new(sine, -cosine, 0.0)
        };
        for (number, turn) in turns.iter().enumerate() {
            let along = DVec3::new(turn.to_radians().cos(), turn.to_radians().sin(), 0.0);
            let normals = match number {
                0 => [0.0, 15.0],
                1 => [15.0, 45.0],
                2 => [45.0, 60.0],
                _ => [150.0, 150.0],
            };
            let first = mesh.positions.len() as u32;
            for (point, normal) in [at, at + along].into_iter().zip(normals) {
                for height in [0.0, 1.0] {
                    mesh.positions.push((point + DVec3::Z * height).as_vec3().to_array());
                    let flat = number == 3;
                    mesh.normals.push(if flat {
                        Normal::NONE
                    } else {
                        Normal::along(normal_of(normal))
                    });
                }
            }
            mesh.triangles.extend([[0, 2, 3], [0, 3, 1]].map(|t| t.map(|corner| first + corner)));
            at += along;
        }
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    #[test]
    fn welded_normals_come_back_to_the_corners_that_had_them() {
        let mesh = fence();
        let border = Border::interior(mesh.positions.len());
        let (mut welded, mut welded_border, sets) = weld_normals(&mesh, &border).unwrap();
        assert_eq!(welded.positions.len(), 10, "five posts");
        assert_eq!(welded.triangles.len(), mesh.triangles.len());
        sets.resolve(&mut welded, &mut welded_border);
        assert_eq!(welded.positions.len(), welded_border.planes.len());
        assert_eq!(welded.positions.len(), welded.normals.len());
        for (before, after) in mesh.triangles.iter().zip(&welded.triangles) {
            for (&old, &new) in before.iter().zip(after) {
                let (old, new) = (old as usize, new as usize);
                assert_eq!(mesh.positions[old], welded.positions[new]);
                assert_eq!(mesh.normals[old], welded.normals[new], "{:?}", mesh.positions[old]);
            }
        }
        // The smooth posts are whole; the sharp one is divided.
        assert_eq!(welded.positions.len(), 12);
    }

    #[test]
    fn meshes_without_normals_are_left_alone() {
        let mesh = Mesh { normals: Vec::new(), ..fence() };
        assert!(weld_normals(&mesh, &Border::interior(mesh.positions.len())).is_none());
    }
}
