//! Vertices of several inputs that are nearly one ([`crate::builder::tiles::meeting`]), made one.
//!
//! Blocks keep such vertices where each input has them. A district is one surface, and it is off the source by more
//! than what the vertices are apart, which is measured with the rest.

use blake3::Hasher;
use rustc_hash::FxHashMap;

use super::made_of::update;
use super::members::Members;
use crate::builder::border::shared::Bounds;
use crate::builder::stitch::open_edges;
use crate::builder::tiles::meeting::WRITTEN;
use crate::mesh::{NEAR, NearVertices, Part, PositionKey, all_differ, key};

/// What members of districts have where inputs meet and is nearly one, and where it goes: planes of cuts to one
/// of them, and vertices at which members end to others that may be the same, of each few to the first in
/// order.
pub struct Joined {
    cuts: JoinedCuts,
    moved: FxHashMap<PositionKey<f64>, [f64; 3]>,
    /// The same: from where and to where, in order.
    moves: Vec<[[f64; 3]; 2]>,
}

impl Joined {
    /// Of the planes alone, which divided blocks.
    pub fn of_cuts(cuts: &[(usize, f64)]) -> Self {
        Self { cuts: JoinedCuts::new(cuts), moved: FxHashMap::default(), moves: Vec::new() }
    }

    /// Edges at which the members of a district end.
    pub fn ends(members: &Members) -> Vec<[[f64; 3]; 2]> {
        open_edges(&members.model.parts).into_iter().map(|edge| edge.ends).collect()
    }

    /// With the vertices, by the [ends](Self::ends) of all districts, to which the planes were
    /// [applied](Self::apply).
    pub fn with_ends(self, ends: &[Vec<[[f64; 3]; 2]>]) -> Self {
        let moves = joined(&NearVertices::new(ends.iter().flatten().copied(), NEAR));
        let moved = moves.iter().map(|&[from, to]| (key(from), to)).collect();
        Self { moved, moves, ..self }
    }

    /// Adds to a hash what becomes of planes within bounds.
    pub fn hash_cuts(&self, (low, high): &Bounds, hasher: &mut Hasher) {
        for (axis, moves) in self.cuts.moves.iter().enumerate() {
            hasher.update(b"across");
            let first = moves.partition_point(|(from, _)| *from < low[axis] - WRITTEN);
            let behind = moves.partition_point(|(from, _)| *from <= high[axis] + WRITTEN);
            for (from, to) in &moves[first..behind] {
                update(hasher, *from);
                update(hasher, *to);
            }
        }
    }

    /// Adds to a hash what becomes of vertices within bounds.
    pub fn hash_moved(&self, (low, high): &Bounds, hasher: &mut Hasher) {
        let first = self.moves.partition_point(|[from, _]| from[0] < low[0]);
        let behind = self.moves.partition_point(|[from, _]| from[0] <= high[0]);
        let is_in = |[from, _]: &&[[f64; 3]; 2]| {
            (0..3).all(|axis| low[axis] <= from[axis] && from[axis] <= high[axis])
        };
        for ends in self.moves[first..behind].iter().filter(is_in) {
            ends.as_flattened().iter().for_each(|at| update(hasher, *at));
        }
    }

    /// The planes that there are.
    pub fn cuts(&self) -> &[(usize, f64)] {
        &self.cuts.cuts
    }

    /// Moves what is to be moved of the members of a district.
    pub fn apply(&self, members: &mut Members) {
        let Members { model, skirts } = members;
        if self.cuts.any() {
            let positions = model.parts.iter_mut().flat_map(|part| &mut part.positions);
            positions.for_each(|position| self.cuts.apply(position));
            skirts.iter_mut().flatten().for_each(|corner| {
                let mut at = corner.to_array();
                self.cuts.apply(&mut at);
                *corner = at.into();
            });
        }
        if !self.moved.is_empty() {
            model.parts.iter_mut().for_each(|part| move_vertices(part, &self.moved));
        }
    }
}

/// Cuts of which none is nearly another.
struct JoinedCuts {
    cuts: Vec<(usize, f64)>,
    /// By axis, in order: what was near to which.
    moves: [Vec<(f64, f64)>; 3],
}

impl JoinedCuts {
    fn new(cuts: &[(usize, f64)]) -> Self {
        let mut sorted = cuts.to_vec();
        sorted.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut cuts: Vec<(usize, f64)> = Vec::new();
        let mut moves: [Vec<(f64, f64)>; 3] = Default::default();
        for (axis, coordinate) in sorted {
            let last = cuts.last().filter(|last| last.0 == axis).map(|last| last.1);
            match last.filter(|last| coordinate - last <= NEAR) {
                Some(last) if last == coordinate => {}
                Some(last) => moves[axis].push((coordinate, last)),
                None => cuts.push((axis, coordinate)),
            }
        }
        Self { cuts, moves }
    }

    fn any(&self) -> bool {
        self.moves.iter().any(|moves| !moves.is_empty())
    }

    /// Brings what is in a plane that is gone to the one that stayed.
    fn apply(&self, position: &mut [f64; 3]) {
        for (coordinate, moves) in position.iter_mut().zip(&self.moves) {
            let next = moves.partition_point(|&(from, _)| from < *coordinate - WRITTEN);
            if let Some(&(_, to)) = moves.get(next).filter(|move_| move_.0 <= *coordinate + WRITTEN)
            {
                *coordinate = to;
            }
        }
    }
}

/// From where and to where vertices go that do not stay where they are, in order.
fn joined(vertices: &NearVertices) -> Vec<[[f64; 3]; 2]> {
    let mut moved: FxHashMap<PositionKey<f64>, [f64; 3]> = FxHashMap::default();
    for (number, &position) in (0u32..).zip(vertices.positions()) {
        let stays = |other: u32| {
            let at = vertices.positions()[other as usize];
            other < number && !moved.contains_key(&key(at))
        };
        if let Some(other) = vertices.nearest_to(number, stays) {
            moved.insert(key(position), vertices.positions()[other as usize]);
        }
    }
    let mut moves: Vec<[[f64; 3]; 2]> = vertices
        .positions()
        .iter()
        .filter_map(|from| moved.get(&key(*from)).map(|to| [*from, *to]))
        .collect();
    moves.sort_unstable_by_key(|ends| ends.map(key));
    moves
}

fn move_vertices(part: &mut Part, moved: &FxHashMap<PositionKey<f64>, [f64; 3]>) {
    let Part { positions, indices, .. } = part;
    let mut any = false;
    for position in positions.iter_mut() {
        if let Some(to) = moved.get(&key(*position)) {
            (*position, any) = (*to, true);
        }
    }
    if any {
        let apart =
            |corners: &&[u32; 3]| all_differ(corners.map(|vertex| positions[vertex as usize]));
        let kept: Vec<[u32; 3]> =
            indices.as_chunks::<3>().0.iter().filter(apart).copied().collect();
        *indices = kept.into_flattened();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    use crate::mesh::Model;

    fn square(from: [f64; 3]) -> Model {
        let at = |x: f64, y: f64| [from[0] + x, from[1] + y, from[2]];
        let part = Part {
            positions: vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Part::default()
        };
        Model::of_parts(vec![part])
    }

    #[test]
    fn what_is_millimetres_apart_is_joined_and_nothing_else_moves() {
        let squares = [square([0.0; 3]), square([1.002, -0.001, 0.001]), square([-1.02, 0.0, 0.0])];
        let skirts = vec![vec![DVec3::new(1.002, 0.5, 0.0), DVec3::new(1.002, 0.6, 0.5)]];
        let mut members = squares.clone().map(|model| Members { model, skirts: skirts.clone() });
        let cuts = [(0, 1.0), (1, 1.0), (0, 1.002), (0, 7.0)];
        let joined = Joined::of_cuts(&cuts);
        members.iter_mut().for_each(|members| joined.apply(members));
        let joined = joined.with_ends(&members.each_ref().map(Joined::ends));
        members.iter_mut().for_each(|members| joined.apply(members));
        assert_eq!(joined.cuts(), [(0, 1.0), (0, 7.0), (1, 1.0)]);
        let at = |model: usize, vertex: usize| members[model].model.parts[0].positions[vertex];
        assert_eq!([at(1, 0)[0], at(1, 3)[0]], [1.0; 2], "in the plane that stayed");
        assert_eq!([at(1, 0), at(1, 3)], [at(0, 1), at(0, 2)]);
        assert_eq!(at(1, 1), squares[1].parts[0].positions[1]);
        assert_eq!(members[2].model.parts, squares[2].parts, "two centimetres are too far");
        assert!(members[0].skirts[0].iter().all(|corner| corner.x == 1.0));
    }
}
