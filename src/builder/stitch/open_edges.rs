//! The borders of a model: the edges that one triangle has.

use std::hash::{Hash, Hasher};

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHasher};

use crate::mesh::{Part, PositionKey, all_differ, key, wide};
use crate::stage_timer::StageTimer;

/// An edge that one triangle of a model has, by position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenEdge {
    /// Which part's triangle it is.
    pub part: u32,
    /// From where to where, as the triangle winds.
    pub ends: [[f64; 3]; 2],
    /// The triangle's third corner.
    pub corner: [f64; 3],
}

impl OpenEdge {
    /// The unit vector from its start to its end.
    pub fn direction(&self) -> DVec3 {
        (wide(self.ends[1]) - wide(self.ends[0])).normalize_or_zero()
    }

    /// Across the edge in its triangle's plane, away from the triangle; a unit vector.
    pub fn outward(&self) -> DVec3 {
        let along = self.direction();
        let inward = wide(self.corner) - wide(self.ends[0]);
        -(inward - along * inward.dot(along)).normalize_or_zero()
    }
}

/// The open edges of some parts taken together, ordered by position.
pub fn open_edges(parts: &[Part]) -> Vec<OpenEdge> {
    let timer = StageTimer::current();
    let rests: Vec<Rests> = parts.par_iter().map(|part| timer.time(|| rests(part))).collect();
    // What is open in one part may be closed by others.
    let mut sums = Rests::default();
    for (&position, rest) in rests.iter().flatten() {
        let sum = sums.entry(position).or_default();
        *sum = sum.wrapping_add(*rest);
    }
    sums.retain(|_, sum| *sum != 0);
    drop(rests);
    let edges_of = |(number, part): (usize, &Part)| {
        timer.time(|| {
            let mut edges = edges_at(number as u32, part, &sums);
            edges.sort_unstable();
            edges
        })
    };
    let found: Vec<Vec<Candidate>> = parts.par_iter().enumerate().map(edges_of).collect();
    let mut candidates: Vec<Candidate> = Vec::with_capacity(found.iter().map(Vec::len).sum());
    found.into_iter().for_each(|mut of_part| candidates.append(&mut of_part));
    // Stable, since that merges the parts' runs, which are in order.
    candidates.sort();
    let mut open: Vec<OpenEdge> = Vec::new();
    for of_hash in candidates.chunk_by(|a, b| a.hash == b.hash) {
        let edges = of_hash.iter().map(|candidate| candidate.edge(parts));
        if of_hash.len() == 1 {
            open.extend(edges);
            continue;
        }
        // Different edges may have one hash.
        let undirected = |edge: OpenEdge| {
            let [a, b] = edge.ends.map(key);
            ([a.min(b), a.max(b)], edge)
        };
        let mut edges: Vec<_> = edges.map(undirected).collect();
        edges.sort_by_key(|(ends, _)| *ends);
        let alone = edges.chunk_by(|(a, _), (b, _)| a == b).filter(|same| same.len() == 1);
        open.extend(alone.flatten().map(|(_, edge)| *edge));
    }
    open.sort_unstable_by_key(|edge| edge.ends.map(key));
    open
}

/// An edge that may be open, in few bytes, as in some models all edges may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// Of the positions of both ends, whichever is first.
    hash: u64,
    part: u32,
    /// The index of the corner at which it starts.
    corner: u32,
}

impl Candidate {
    fn edge(&self, parts: &[Part]) -> OpenEdge {
        let part = &parts[self.part as usize];
        let (first, place) = (self.corner - self.corner % 3, self.corner % 3);
        let at = |step: u32| {
            part.positions[part.indices[(first + (place + step) % 3) as usize] as usize]
        };
        OpenEdge { part: self.part, ends: [at(0), at(1)], corner: at(2) }
    }
}

/// By position, the sum over the edges there of hashes of where they lead to, less those of where
/// they come from. It is 0 where each edge is there in both directions: at all vertices within a
/// surface, which take no map to find.
type Rests = FxHashMap<PositionKey<f64>, u64>;

/// The rests of a part that are not 0.
fn rests(part: &Part) -> Rests {
    let hashes: Vec<u64> = part.positions.iter().map(|&position| hash(position)).collect();
    let mut rests = vec![0u64; part.positions.len()];
    for corners in part.indices.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|vertex| vertex as usize);
        for (at, to, from) in [(a, b, c), (b, c, a), (c, a, b)] {
            rests[at] = rests[at].wrapping_add(hashes[to]).wrapping_sub(hashes[from]);
        }
    }
    // Wedges of one place close each other.
    let mut of_place = Rests::default();
    for (&position, rest) in part.positions.iter().zip(rests).filter(|(_, rest)| *rest != 0) {
        let sum = of_place.entry(key(position)).or_default();
        *sum = sum.wrapping_add(rest);
    }
    of_place.retain(|_, sum| *sum != 0);
    of_place.shrink_to_fit();
    of_place
}

fn hash(position: [f64; 3]) -> u64 {
    let mut hasher = FxHasher::default();
    key(position).hash(&mut hasher);
    hasher.finish()
}

/// The edges of a part between places whose rests are not 0.
fn edges_at(number: u32, part: &Part, sums: &Rests) -> Vec<Candidate> {
    let mut edges = Vec::new();
    if sums.is_empty() {
        return edges;
    }
    let hash_if_open =
        |&position: &[f64; 3]| sums.contains_key(&key(position)).then(|| hash(position));
    let open: Vec<Option<u64>> = part.positions.iter().map(hash_if_open).collect();
    for (first, &corners) in (0..).step_by(3).zip(part.indices.as_chunks::<3>().0) {
        if !all_differ(corners.map(|vertex| part.positions[vertex as usize])) {
            continue;
        }
        let [a, b, c] = corners.map(|vertex| open[vertex as usize]);
        for (corner, ends) in (first..).zip([(a, b), (b, c), (c, a)]) {
            if let (Some(from), Some(to)) = ends {
                let hash = from.wrapping_add(to);
                edges.push(Candidate { hash, part: number, corner });
            }
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(positions: &[[f64; 3]], indices: &[u32]) -> Part {
        Part { positions: positions.to_vec(), indices: indices.to_vec(), ..Part::default() }
    }

    const SQUARE: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn a_square_has_four_and_its_diagonal_is_none() {
        let open = open_edges(&[part(&SQUARE, &[0, 1, 2, 0, 2, 3])]);
        assert_eq!(open.len(), 4);
        for edge in &open {
            let middle = (wide(edge.ends[0]) + wide(edge.ends[1])) * 0.5;
            let away = middle - DVec3::new(0.5, 0.5, 0.0);
            assert!(edge.outward().dot(away) > 0.49, "{edge:?}");
        }
    }

    #[test]
    fn what_another_part_or_wedge_closes_is_not_open() {
        let halves = [part(&SQUARE, &[0, 1, 2]), part(&SQUARE, &[0, 2, 3])];
        let apart = open_edges(&halves);
        assert_eq!(apart.len(), 4);
        // The same with vertices of its own for the second triangle, in one part.
        let both = [SQUARE, SQUARE].concat();
        let wedges = open_edges(&[part(&both, &[0, 1, 2, 4, 6, 7])]);
        let ends = |edges: &[OpenEdge]| edges.iter().map(|edge| edge.ends).collect::<Vec<_>>();
        assert_eq!(ends(&wedges), ends(&apart));
    }

    #[test]
    fn a_closed_body_has_none_whichever_way_its_faces_wind() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let sound = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        assert_eq!(open_edges(&[part(&corners, &sound)]), []);
        let turned = [0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        assert_eq!(open_edges(&[part(&corners, &turned)]), []);
    }
}
