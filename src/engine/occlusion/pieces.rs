//! Boxes around parts of a node.

use glam::Vec3;

use crate::format::NodeMesh;

/// How often a node is halved. Measured: with the boxes of 6 halvings half more to twice as much is found
/// to be hidden as with that of the whole, with those of 8 a tenth to a third more than that.
const HALVINGS: u32 = 7;

/// Fewer triangles are not halved.
const LEAST: usize = 8;

/// A box that holds some triangles of a node, opaque or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Least and greatest corner, metres from the node's origin.
    pub bbox: [Vec3; 2],
    /// How many boxes from this one on are of these triangles: this one, and those of both halves.
    pub boxes: u32,
}

/// Boxes around the whole node, its halves, theirs and so on, each before those of its halves.
pub(super) fn pieces(mesh: &NodeMesh) -> Vec<Piece> {
    let mut triangles = Vec::new();
    for primitive in &mesh.primitives {
        let triples: &[[u32; 3]] = primitive.indices.as_chunks().0;
        triangles.extend(triples.iter().map(|triple| {
            let [a, b, c] = triple.map(|at| Vec3::from(primitive.positions[at as usize]));
            [a.min(b).min(c), a.max(b).max(c)]
        }));
    }
    let mut pieces = Vec::new();
    halve(&mut triangles, HALVINGS, &mut pieces);
    pieces
}

fn halve(triangles: &mut [[Vec3; 2]], halvings: u32, pieces: &mut Vec<Piece>) {
    let Some(&first) = triangles.first() else { return };
    let bbox = triangles.iter().fold(first, |[min, max], at| [min.min(at[0]), max.max(at[1])]);
    let at = pieces.len();
    pieces.push(Piece { bbox, boxes: 1 });
    if halvings == 0 || triangles.len() < LEAST {
        return;
    }
    let size = (bbox[1] - bbox[0]).to_array();
    let longer = |a: usize, b: usize| if size[b] > size[a] { b } else { a };
    let axis = longer(longer(0, 1), 2);
    let twice_middle = |at: &[Vec3; 2]| at[0][axis] + at[1][axis];
    let half = triangles.len() / 2;
    triangles.select_nth_unstable_by(half, |a, b| twice_middle(a).total_cmp(&twice_middle(b)));
    let (one, other) = triangles.split_at_mut(half);
    halve(one, halvings - 1, pieces);
    halve(other, halvings - 1, pieces);
    pieces[at].boxes = (pieces.len() - at) as u32;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::occlusion::test_mesh::mesh;
    use crate::random::Random;

    #[test]
    fn every_triangle_is_in_a_smallest_box_and_boxes_are_in_those_of_the_whole() {
        let mut random = Random::new(5, 0);
        let mut corner = || [0; 3].map(|_| random.between(-9.0, 9.0) as f32);
        let triangles: Vec<[[f32; 3]; 3]> = (0..500).map(|_| [0; 3].map(|_| corner())).collect();
        let pieces = pieces(&mesh(&triangles));
        let is_in = |at: Vec3, [min, max]: [Vec3; 2]| at.clamp(min, max) == at;
        for triangle in triangles {
            let holds = |piece: &&Piece| triangle.iter().all(|&at| is_in(at.into(), piece.bbox));
            assert!(pieces.iter().filter(|piece| piece.boxes == 1).any(|piece| holds(&piece)));
        }
        assert!(pieces[0].boxes as usize == pieces.len() && pieces.len() > 200);
        for (at, piece) in pieces.iter().enumerate() {
            for within in &pieces[at..at + piece.boxes as usize] {
                assert!(within.bbox.iter().all(|&corner| is_in(corner, piece.bbox)));
            }
        }
    }

    #[test]
    fn nothing_has_no_box() {
        assert_eq!(pieces(&mesh(&[])), []);
    }
}
