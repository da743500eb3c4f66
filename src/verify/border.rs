//! What a node has of a seam: the edge that stands for each piece of it.
//!
//! A node's border follows the seam with fewer vertices. The piece of it that an edge of the seam
//! belongs to runs, to both sides along the seam, up to the next vertices that the node has. Where
//! the node has no edge between these two, or the seam branches or ends before there is one, the
//! node leaves out the surface there.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::geometry::NodeGeometry;
use super::seams::Seam;
use crate::mesh::{PositionKey, key};

/// For each seam that a node bounds, whether the node has the border there.
pub(super) fn kept(node: &NodeGeometry, seams: &[&Seam]) -> Vec<bool> {
    let graph = SeamGraph::new(seams);
    let number = |vertex: u32| graph.number(node.position(vertex));
    let numbers: Vec<Option<u32>> = (0..node.positions.len() as u32).map(number).collect();
    let mut has = vec![false; graph.neighbours.len()];
    let mut edges: FxHashSet<[u32; 2]> = FxHashSet::default();
    for (_, &triangle) in (0..).zip(&node.triangles).filter(|&(n, _)| node.is_surface(n)) {
        let [a, b, c] = triangle.map(|vertex| numbers[vertex as usize]);
        for ends in [[a, b], [b, c], [c, a]] {
            ends.into_iter().flatten().for_each(|end| has[end as usize] = true);
            if let [Some(a), Some(b)] = ends {
                edges.insert([a.min(b), a.max(b)]);
            }
        }
    }
    seams
        .iter()
        .map(|seam| {
            let [Some(from), Some(to)] = seam.ends.map(|end| graph.number(end)) else {
                return false;
            };
            match (graph.next(to, from, &has), graph.next(from, to, &has)) {
                (Some(a), Some(b)) => edges.contains(&[a.min(b), a.max(b)]),
                _ => false,
            }
        })
        .collect()
}

/// The ends of seams and how they are joined.
struct SeamGraph {
    numbers: FxHashMap<PositionKey<f64>, u32>,
    neighbours: Vec<Vec<u32>>,
}

impl SeamGraph {
    fn new(seams: &[&Seam]) -> Self {
        let mut graph = Self { numbers: FxHashMap::default(), neighbours: Vec::new() };
        for seam in seams {
            let [a, b] = seam.ends.map(|end| {
                *graph.numbers.entry(key(end.to_array())).or_insert_with(|| {
                    graph.neighbours.push(Vec::new());
                    graph.neighbours.len() as u32 - 1
                })
            });
            for (from, to) in [(a, b), (b, a)] {
                // The same edge may be a seam to several leaves.
                if !graph.neighbours[from as usize].contains(&to) {
                    graph.neighbours[from as usize].push(to);
                }
            }
        }
        graph
    }

    fn number(&self, position: DVec3) -> Option<u32> {
        self.numbers.get(&key(position.to_array())).copied()
    }

    /// The first vertex along the seam that the node has: `at`, which is reached from `before`, or
    /// one beyond it.
    fn next(&self, mut before: u32, mut at: u32, has: &[bool]) -> Option<u32> {
        let end = before;
        while !has[at as usize] {
            let &[a, b] = &self.neighbours[at as usize][..] else { return None };
            (before, at) = (at, if a == before { b } else { a });
            if at == end {
                return has[end as usize].then_some(end);
            }
        }
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seams along x from 0 to 4, and what a node with triangles over some of their ends has.
    fn kept_by(triangles: &[[u32; 3]]) -> Vec<bool> {
        let position = |x: u32| DVec3::new(f64::from(x), 0.0, 0.0);
        let seams: Vec<Seam> = (0..4)
            .map(|x| {
                let ends = [position(x), position(x + 1)];
                Seam { ends, leaves: [0, 1] }
            })
            .collect();
        // Vertex 5 lies beside the seam.
        let mut positions: Vec<[f32; 3]> = (0..5).map(|x| [x as f32, 0.0, 0.0]).collect();
        positions.push([2.0, 1.0, 0.0]);
        let node =
            NodeGeometry { positions, triangles: triangles.to_vec(), ..NodeGeometry::default() };
        kept(&node, &seams.iter().collect::<Vec<_>>())
    }

    #[test]
    fn an_edge_stands_for_the_piece_of_the_seam_between_its_ends() {
        assert_eq!(kept_by(&[[0, 4, 5]]), [true; 4]);
        assert_eq!(kept_by(&[[0, 1, 5], [1, 4, 5]]), [true; 4]);
        assert_eq!(kept_by(&[[0, 1, 5], [3, 4, 5]]), [true, false, false, true]);
        assert_eq!(kept_by(&[[0, 1, 5], [1, 3, 5]]), [true, true, true, false], "its end is gone");
        assert_eq!(kept_by(&[]), [false; 4]);
    }
}
