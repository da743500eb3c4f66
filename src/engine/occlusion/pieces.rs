//! Boxes around parts of a node.

use glam::{DVec3, Vec3};

use crate::format::NodeMesh;

/// How often a node is halved. Measured: with the boxes of 6 halvings half more to twice as much is found
/// to be hidden as with that of the whole, with those of 8 a tenth to a third more than that.
const HALVINGS: u32 = 7;

/// Fewer triangles are not halved.
const LEAST: usize = 8;

/// Boxes have their corners at every so manieth part of that around the whole node; two such parts are
/// left over, for what rounding adds.
const PARTS: f64 = 65_533.0;

/// A box that holds some triangles of a node, opaque or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Least and greatest corner, in [steps](Pieces::step).
    corners: [[u16; 3]; 2],
    /// How many boxes from this one on are of these triangles: this one, and those of both halves.
    pub boxes: u16,
}

/// Boxes around the whole node, its halves, theirs and so on, each before those of its halves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pieces {
    /// Metres from the node's origin.
    min: DVec3,
    /// Metres.
    step: DVec3,
    pieces: Vec<Piece>,
}

impl Pieces {
    /// Of all triangles of a node; without boxes where one has a place that is no number.
    pub fn new(mesh: &NodeMesh) -> Self {
        let mut triangles = Vec::new();
        for primitive in &mesh.primitives {
            let triples: &[[u32; 3]] = primitive.indices.as_chunks().0;
            triangles.extend(triples.iter().map(|triple| {
                let [a, b, c] = triple.map(|at| Vec3::from(primitive.positions[at as usize]));
                [a.min(b).min(c), a.max(b).max(c)]
            }));
        }
        let is_finite = |triangle: &[Vec3; 2]| triangle.iter().all(|corner| corner.is_finite());
        let Some([min, max]) = around(&triangles).filter(|_| triangles.iter().all(is_finite))
        else {
            return Self::default();
        };
        let [min, max] = [min, max].map(|corner| corner.as_dvec3());
        let mut pieces = Self {
            min,
            step: (max - min) / PARTS,
            pieces: Vec::with_capacity(count(triangles.len(), HALVINGS)),
        };
        pieces.halve(&mut triangles, HALVINGS);
        pieces
    }

    /// Most bytes of the boxes of so many triangles.
    pub fn most_bytes(triangles: usize) -> u64 {
        (count(triangles, HALVINGS) * size_of::<Piece>()) as u64
    }

    pub fn get(&self, at: usize) -> Option<&Piece> {
        self.pieces.get(at)
    }

    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Least and greatest corner of a box, metres from the node's origin.
    pub fn bbox(&self, piece: &Piece) -> [DVec3; 2] {
        piece.corners.map(|corner| self.min + self.step * DVec3::from(corner.map(f64::from)))
    }

    fn halve(&mut self, triangles: &mut [[Vec3; 2]], halvings: u32) {
        let Some(bbox) = around(triangles) else { return };
        let at = self.pieces.len();
        self.pieces.push(Piece { corners: self.corners(bbox), boxes: 1 });
        if is_whole(triangles.len(), halvings) {
            return;
        }
        let size = (bbox[1] - bbox[0]).to_array();
        let longer = |a: usize, b: usize| if size[b] > size[a] { b } else { a };
        let axis = longer(longer(0, 1), 2);
        let twice_middle = |at: &[Vec3; 2]| at[0][axis] + at[1][axis];
        let half = triangles.len() / 2;
        triangles.select_nth_unstable_by(half, |a, b| twice_middle(a).total_cmp(&twice_middle(b)));
        let (one, other) = triangles.split_at_mut(half);
        self.halve(one, halvings - 1);
        self.halve(other, halvings - 1);
        self.pieces[at].boxes = (self.pieces.len() - at) as u16;
    }

    /// Rounded outward.
    fn corners(&self, bbox: [Vec3; 2]) -> [[u16; 3]; 2] {
        let [min, max] = bbox.map(|corner| (corner.as_dvec3() - self.min) / self.step);
        // Flat nodes have steps of no length. Numbers are cut off at 0, and none is above 65,535.
        [min.floor() - 1.0, max.ceil() + 1.0]
            .map(|corner| corner.to_array().map(|part| part as u16))
    }
}

fn around(triangles: &[[Vec3; 2]]) -> Option<[Vec3; 2]> {
    triangles.iter().copied().reduce(|[min, max], at| [min.min(at[0]), max.max(at[1])])
}

fn is_whole(triangles: usize, halvings: u32) -> bool {
    halvings == 0 || triangles < LEAST
}

/// How many boxes there are of so many triangles.
fn count(triangles: usize, halvings: u32) -> usize {
    match triangles {
        0 => 0,
        _ if is_whole(triangles, halvings) => 1,
        _ => {
            let half = triangles / 2;
            1 + count(half, halvings - 1) + count(triangles - half, halvings - 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::occlusion::test_mesh::mesh;
    use crate::random::Random;

    fn is_in(at: DVec3, [min, max]: [DVec3; 2]) -> bool {
        at.clamp(min, max) == at
    }

    #[test]
    fn every_triangle_is_in_a_smallest_box_and_boxes_are_in_those_of_the_whole() {
        let mut random = Random::new(5, 0);
        let mut corner = || [0; 3].map(|_| random.between(-9.0, 9.0) as f32);
        let triangles: Vec<[[f32; 3]; 3]> = (0..500).map(|_| [0; 3].map(|_| corner())).collect();
        let pieces = Pieces::new(&mesh(&triangles));
        let at = |corner: &[f32; 3]| Vec3::from(*corner).as_dvec3();
        for triangle in triangles {
            let holds = |piece: &&Piece| triangle.iter().all(|c| is_in(at(c), pieces.bbox(piece)));
            assert!(
                pieces.pieces.iter().filter(|piece| piece.boxes == 1).any(|piece| holds(&piece))
            );
        }
        let all = &pieces.pieces;
        assert!(all[0].boxes as usize == all.len() && all.len() > 200);
        for (at, piece) in all.iter().enumerate() {
            let [min, max] = pieces.bbox(piece);
            for within in &all[at..at + piece.boxes as usize] {
                let inner = pieces.bbox(within);
                assert!(is_in(inner[0], [min, max]) && is_in(inner[1], [min, max]));
            }
        }
    }

    #[test]
    fn boxes_are_hardly_larger_than_what_they_hold_and_hold_what_is_flat() {
        let flat = [[[2.0, -1.0, 7.0], [2.0, 3.0, 7.5], [2.0, 0.0, 9.0]]];
        let pieces = Pieces::new(&mesh(&flat));
        let [min, max] = pieces.bbox(&pieces.pieces[0]);
        let [least, most] = [DVec3::new(2.0, -1.0, 7.0), DVec3::new(2.0, 3.0, 9.0)];
        assert!(is_in(least, [min, max]) && is_in(most, [min, max]));
        assert!(
            (min - least).abs().max_element() < 1e-3 && (max - most).abs().max_element() < 1e-3
        );
    }

    #[test]
    fn bytes_are_known_beforehand() {
        for triangles in [0, 1, 7, 8, 9, 100, 1023, 1024, 5000] {
            let mesh = mesh(&vec![[[0.0; 3], [1.0; 3], [2.0; 3]]; triangles]);
            let bytes = Pieces::new(&mesh).pieces.capacity() * size_of::<Piece>();
            assert_eq!(bytes as u64, Pieces::most_bytes(triangles), "{triangles}");
        }
    }

    #[test]
    fn nothing_has_no_box_and_what_is_nowhere_neither() {
        assert!(Pieces::new(&mesh(&[])).is_empty());
        for nowhere in [f32::NAN, f32::INFINITY] {
            assert!(Pieces::new(&mesh(&[[[0.0; 3], [1.0; 3], [nowhere; 3]]])).is_empty());
        }
    }
}
