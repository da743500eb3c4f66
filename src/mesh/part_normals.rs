//! Normals of a source's corners become normals of a part's vertices.

use glam::DVec3;

use super::vertex_normals::VertexNormals;
use super::{Normal, Part};

impl Part {
    /// Gives the part normals, one per corner of its triangles. Returns how many were dropped because
    /// they point to the back of their triangle.
    ///
    /// Triangles whose normals are all within an angle of their plane's, whose cosine is `plane`, need
    /// none: without a normal a corner has its triangle's. Vertices whose corners have several normals
    /// are divided, so models with hard edges alone keep their vertices.
    pub fn set_normals(&mut self, mut corners: Vec<Normal>, plane: f64) -> u64 {
        let mut backward = 0;
        let triangles = self.indices.as_chunks::<3>().0;
        for (triangle, normals) in triangles.iter().zip(corners.as_chunks_mut::<3>().0) {
            let [a, b, c] = triangle.map(|vertex| DVec3::from(self.positions[vertex as usize]));
            let face = Normal::along((b - a).cross(c - a));
            for normal in &mut *normals {
                if normal.is_within(face, 0.0) {
                    continue;
                }
                backward += u64::from(*normal != Normal::NONE && face != Normal::NONE);
                *normal = Normal::NONE;
            }
            let is_own = |normal: &Normal| *normal == Normal::NONE || normal.is_within(face, plane);
            if normals.iter().all(is_own) {
                *normals = [Normal::NONE; 3];
            }
        }
        self.normals.clear();
        if corners.iter().all(|normal| *normal == Normal::NONE) {
            return backward;
        }
        let mut known = VertexNormals::new(self.positions.len());
        let entries: Vec<u32> = self
            .indices
            .iter()
            .zip(corners)
            .map(|(&vertex, normal)| known.entry(vertex, normal))
            .collect();
        let (vertices, copies) = known.with_copies();
        let copies = || copies.iter().map(|&vertex| vertex as usize);
        self.positions.reserve(copies().len());
        for vertex in copies() {
            self.positions.push(self.positions[vertex]);
            self.texcoords.extend(self.texcoords.get(vertex).copied());
            self.colors.extend(self.colors.get(vertex).copied());
        }
        self.normals = vec![Normal::NONE; self.positions.len()];
        for (entry, &vertex) in (0..).zip(&vertices) {
            self.normals[vertex as usize] = known.normal(entry);
        }
        for (index, entry) in self.indices.iter_mut().zip(entries) {
            *index = vertices[entry as usize];
        }
        backward
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::SAME_NORMAL;

    /// Two squares that meet at a right angle, with these normals of theirs.
    fn folded(normals: [[DVec3; 4]; 2]) -> (Part, u64) {
        let positions = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [1, 0, -1], [1, 1, -1]];
        let squares = [[0, 2, 3, 1], [2, 4, 5, 3]];
        let mut part = Part {
            positions: positions.map(|position| position.map(f64::from)).to_vec(),
            ..Part::default()
        };
        let mut corners = Vec::new();
        for (square, normals) in squares.iter().zip(normals) {
            for corner in [0, 1, 2, 0, 2, 3] {
                part.indices.push(square[corner]);
                corners.push(Normal::along(normals[corner]));
            }
        }
        let dropped = part.set_normals(corners, SAME_NORMAL);
        (part, dropped)
    }

    fn corners(part: &Part) -> Vec<Option<DVec3>> {
        part.indices.iter().map(|&vertex| part.normals[vertex as usize].vector()).collect()
    }

    #[test]
    fn normals_of_planes_are_not_kept() {
        let (part, dropped) = folded([[DVec3::Z; 4], [DVec3::X; 4]]);
        assert_eq!((part.positions.len(), part.normals.len(), dropped), (6, 0, 0));
    }

    #[test]
    fn vertices_are_divided_where_normals_differ() {
        let edge = DVec3::new(0.6, 0.0, 0.8);
        let (part, dropped) = folded([[DVec3::Z, edge, edge, DVec3::Z], [DVec3::X; 4]]);
        // The second square is flat: the edge has a vertex for each side.
        assert_eq!((part.positions.len(), part.normals.len(), dropped), (8, 8, 0));
        for (at, found) in corners(&part).into_iter().enumerate() {
            let [x, ..] = part.positions[part.indices[at] as usize];
            let expected = if x == 0.0 { DVec3::Z } else { edge };
            assert!(found.is_none_or(|found| found.distance(expected) < 1e-4), "{at}");
            assert_eq!(found.is_some(), at < 6);
        }
        // One vertex where both sides have one normal.
        let (part, _) =
            folded([[DVec3::Z, edge, edge, DVec3::Z], [edge, DVec3::X, DVec3::X, edge]]);
        assert_eq!(part.positions.len(), 6);
    }

    #[test]
    fn normals_that_point_to_the_back_or_nowhere_are_dropped() {
        let tilted = DVec3::new(0.1, 0.0, 1.0);
        let back = DVec3::new(1.0, 0.0, -0.1);
        let (part, dropped) = folded([[tilted, tilted, back, DVec3::NAN], [DVec3::ZERO; 4]]);
        assert_eq!(dropped, 2, "one corner of two triangles");
        let found: Vec<bool> = corners(&part).iter().map(Option::is_some).collect();
        assert_eq!(found[..6], [true, true, false, true, false, false]);
        assert!(found[6..].iter().all(|is_there| !is_there));
    }
}
