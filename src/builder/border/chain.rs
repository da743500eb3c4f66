//! The border that a cutting plane makes, as chains of edges, and the ranking of its vertices.
//!
//! A chain runs between two vertices that can never go: ends, branches, corners with other
//! planes, texture seams that coarse nodes keep, and vertices that lie beside the plane rather than
//! on it. Those between go in the order of [`crate::builder::border::rank`], which is one for all
//! chains of a plane, so that what is left is spent where it does most.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::builder::border::rank::{Polyline, SurfaceQuadric, removals};
use crate::builder::constants::BorderConstants;
use crate::mesh::{Coordinate, PositionKey, key, wide};
use crate::texture::BakeClasses;

/// One polyline of border edges, ends included; a loop has its first vertex again at its end.
#[derive(Clone, Debug, Default)]
pub struct Chain<C = f32> {
    /// Positions along it.
    pub positions: Vec<[C; 3]>,
    /// The coarsest level at which each is kept.
    pub keep: Vec<u8>,
}

/// A cutting plane and the border that it made, at full resolution.
#[derive(Clone, Debug, Default)]
pub struct CutPlane<C: Coordinate = f32> {
    /// The axis that the plane is perpendicular to: 0, 1 or 2.
    pub axis: usize,
    /// Its coordinate on that axis, metres from the block's origin.
    pub coordinate: C,
    /// The border edges as chains.
    pub chains: Vec<Chain<C>>,
    /// A number for each position.
    numbers: FxHashMap<PositionKey<C>, u32>,
    /// Where the places of each numbered position begin in `places`, and where the last ones end.
    first_place: Vec<u32>,
    /// Where positions stand: chain and index within it.
    places: Vec<(u32, u32)>,
}

/// A border vertex before ranking.
#[derive(Clone, Copy, Debug)]
pub struct BorderVertex<C = f32> {
    /// Metres from the block's origin.
    pub position: [C; 3],
    /// It may not go at any level.
    pub fixed: bool,
    /// The planes of the triangles around it, on both sides of the cut.
    pub surface: SurfaceQuadric,
    /// No node that the border is ranked for has it: it is where skirts reach to, and no more.
    pub gone: bool,
}

/// How many border vertices each level keeps.
#[derive(Clone, Debug)]
pub struct KeepRule<'a> {
    /// For each level from the coarsest node that the plane bounds down to the leaves, the share
    /// of the border's vertices that is kept, 0–1; the last entry (leaves) is 1.
    pub shares: Vec<f64>,
    /// For each of these levels, the most vertices that are kept whatever the share is; parallel
    /// to `shares`, not applied to the last entry.
    pub most: Vec<f64>,
    /// The level of `shares[0]`.
    pub first_level: u8,
    /// Vertices closer than this to their chord are kept at the leaves only; metres.
    pub collinear: f64,
    /// The materials whose seams coarse nodes do not have, so that vertices on them may go.
    pub baked: Option<&'a BakeClasses>,
    /// See [`BorderConstants`].
    pub constants: BorderConstants,
}

impl KeepRule<'_> {
    /// Whether coarse nodes have a seam between vertices of one place and two materials.
    pub fn keeps_seam(&self, materials: [u32; 2]) -> bool {
        let [a, b] = materials.map(|material| self.baked.and_then(|classes| classes.of(material)));
        a.is_none() || a != b
    }

    /// The level after [`Self::first_level`] from which a vertex is kept of which `rank` of `total`
    /// are more important and whose chord is so far from the polyline.
    fn step(&self, rank: usize, total: usize, deviation: f64) -> u8 {
        let last = self.shares.len() - 1;
        if deviation <= self.collinear {
            return last as u8;
        }
        let most = self.most.iter().chain(std::iter::repeat(&f64::INFINITY));
        let kept =
            |(share, &most): (&f64, &f64)| (rank as f64) < (total as f64 * share).ceil().min(most);
        self.shares.iter().zip(most).position(kept).unwrap_or(last) as u8
    }
}

impl<C: Coordinate> CutPlane<C> {
    /// Joins border edges (pairs of indices into `vertices`, each edge once) into chains and
    /// ranks their vertices.
    pub fn new(
        axis: usize,
        coordinate: C,
        vertices: &[BorderVertex<C>],
        edges: &[[u32; 2]],
        rule: &KeepRule,
    ) -> Self {
        let runs = chains_of(vertices, edges);
        // Per run, the indices of the vertices that some node has.
        let there: Vec<Vec<u32>> = runs
            .iter()
            .map(|run| {
                let last = run.len() - 1;
                let is_there =
                    |&at: &usize| at == 0 || at == last || !vertices[run[at] as usize].gone;
                (0..run.len()).filter(is_there).map(|at| at as u32).collect()
            })
            .collect();
        let line = |(run, there): (&Vec<u32>, &Vec<u32>)| {
            let all = there.iter().map(|&at| &vertices[run[at as usize] as usize]);
            Polyline {
                points: all.clone().map(|vertex| wide(vertex.position)).collect(),
                surfaces: all.map(|vertex| vertex.surface).collect(),
            }
        };
        let lines: Vec<Polyline> = runs.iter().zip(&there).map(line).collect();
        let order = removals(&lines, &rule.constants);
        let last_level = rule.first_level + rule.shares.len() as u8 - 1;
        let mut chains: Vec<Chain<C>> = runs
            .iter()
            .zip(&there)
            .map(|(run, there)| {
                let positions = run.iter().map(|&vertex| vertices[vertex as usize].position);
                let mut keep = vec![last_level; run.len()];
                there.iter().for_each(|&at| keep[at as usize] = rule.first_level);
                Chain { positions: positions.collect(), keep }
            })
            .collect();
        let total = order.len();
        for (rank, removal) in order.iter().rev().enumerate() {
            let step = rule.step(rank, total, removal.deviation);
            let at = there[removal.line as usize][removal.index as usize];
            chains[removal.line as usize].keep[at as usize] = rule.first_level + step;
        }
        Self::from_chains(axis, coordinate, chains)
    }

    /// A plane whose chains are ranked already.
    pub fn from_chains(axis: usize, coordinate: C, chains: Vec<Chain<C>>) -> Self {
        let total = chains.iter().map(|chain| chain.positions.len()).sum();
        let mut numbers: FxHashMap<PositionKey<C>, u32> = FxHashMap::default();
        numbers.reserve(total);
        let mut number_at: Vec<u32> = Vec::with_capacity(total);
        // Counted one ahead of each position's own entry.
        let mut first_place = vec![0];
        for &position in chains.iter().flat_map(|chain| &chain.positions) {
            let number = *numbers.entry(key(position)).or_insert_with(|| {
                first_place.push(0);
                first_place.len() as u32 - 2
            });
            first_place[number as usize + 1] += 1;
            number_at.push(number);
        }
        for number in 1..first_place.len() {
            first_place[number] += first_place[number - 1];
        }
        let mut next = first_place.clone();
        let mut places = vec![(0, 0); total];
        let mut number_at = number_at.into_iter();
        for (chain, number_of_chain) in chains.iter().zip(0..) {
            for (number, index) in number_at.by_ref().take(chain.positions.len()).zip(0..) {
                let place = &mut next[number as usize];
                places[*place as usize] = (number_of_chain, index);
                *place += 1;
            }
        }
        Self { axis, coordinate, chains, numbers, first_place, places }
    }

    /// Where a position stands on this border.
    fn places(&self, position: [C; 3]) -> Option<&[(u32, u32)]> {
        let number = *self.numbers.get(&key(position))? as usize;
        let [from, to] = [self.first_place[number], self.first_place[number + 1]];
        Some(&self.places[from as usize..to as usize])
    }

    /// The coarsest level at which the border vertex at `position` is kept: the strictest of its
    /// places. `None` where the position is not on this border.
    pub fn keep_level(&self, position: [C; 3]) -> Option<u8> {
        let places = self.places(position)?;
        places.iter().map(|&(chain, at)| self.chains[chain as usize].keep[at as usize]).min()
    }

    /// Where the edge between two positions stands on this border: the chain, and the place in it
    /// of the first of both. `None` where it is no edge of this border.
    pub fn edge_place(&self, a: [C; 3], b: [C; 3]) -> Option<(u32, u32)> {
        let (from, to) = (self.places(a)?, self.places(b)?);
        from.iter().find_map(|&(chain, at)| {
            let next = |&&(other, here): &&(u32, u32)| other == chain && here.abs_diff(at) == 1;
            to.iter().find(next).map(|&(_, here)| (chain, at.min(here)))
        })
    }
}

/// Splits the edge graph into runs of vertex indices between fixed vertices; loops are opened at
/// their first vertex (in index order) that some node has, as ends never go, and repeat it at the end.
pub fn chains_of<C>(vertices: &[BorderVertex<C>], edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut neighbours: Vec<Vec<(u32, u32)>> = vec![Vec::new(); vertices.len()];
    for (number, &[a, b]) in edges.iter().enumerate() {
        neighbours[a as usize].push((b, number as u32));
        neighbours[b as usize].push((a, number as u32));
    }
    let ends =
        |vertex: u32| vertices[vertex as usize].fixed || neighbours[vertex as usize].len() != 2;
    let mut used = vec![false; edges.len()];
    let mut runs = Vec::new();
    let follow = |start: u32, first: (u32, u32), used: &mut Vec<bool>| {
        let mut run = vec![start];
        let (mut at, mut edge) = first;
        loop {
            used[edge as usize] = true;
            run.push(at);
            if ends(at) || at == start {
                return run;
            }
            let next = neighbours[at as usize].iter().find(|(_, number)| !used[*number as usize]);
            match next {
                Some(&(to, number)) => (at, edge) = (to, number),
                None => return run,
            }
        }
    };
    // Runs that begin at a fixed vertex first, then what is left are loops.
    let is_there = |vertex: u32| !vertices[vertex as usize].gone;
    let starts: [&dyn Fn(u32) -> bool; 3] = [&ends, &is_there, &|_| true];
    for is_start in starts {
        for vertex in (0..vertices.len() as u32).filter(|&vertex| is_start(vertex)) {
            for &first in &neighbours[vertex as usize] {
                if !used[first.1 as usize] {
                    runs.push(follow(vertex, first, &mut used));
                }
            }
        }
    }
    runs
}

/// The distance of a point to a segment.
pub(super) fn distance_to_segment(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let length = along.length_squared();
    let t = if length > 0.0 { ((point - a).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertices(points: &[[f32; 3]]) -> Vec<BorderVertex> {
        points
            .iter()
            .map(|&position| BorderVertex {
                position,
                fixed: false,
                surface: SurfaceQuadric::default(),
                gone: false,
            })
            .collect()
    }

    fn rule(shares: &[f64]) -> KeepRule<'static> {
        KeepRule {
            shares: shares.to_vec(),
            most: Vec::new(),
            first_level: 1,
            collinear: 1e-6,
            baked: None,
            constants: BorderConstants::default(),
        }
    }

    #[test]
    fn collinear_vertices_are_kept_at_the_leaves_only() {
        let points: Vec<_> = (0..9).map(|i| [0.0, i as f32, 0.0]).collect();
        let edges: Vec<_> = (0..8).map(|i| [i, i + 1]).collect();
        let plane = CutPlane::new(0, 0.0, &vertices(&points), &edges, &rule(&[0.5, 0.8, 1.0]));
        assert_eq!(plane.chains.len(), 1);
        assert_eq!(plane.keep_level(points[0]), Some(1));
        assert_eq!(plane.keep_level(points[4]), Some(3));
        assert_eq!(plane.edge_place(points[5], points[4]), Some((0, 4)));
        assert_eq!(plane.edge_place(points[5], points[3]), None);
    }

    #[test]
    fn kept_sets_are_nested_and_removed_vertices_lie_near_the_chord() {
        let points: Vec<_> =
            (0..200).map(|i| [0.0, i as f32 * 0.1, ((i * 7919) % 13) as f32 * 0.01]).collect();
        let edges: Vec<_> = (0..199).map(|i| [i, i + 1]).collect();
        let shares = [0.1, 0.3, 1.0];
        let plane = CutPlane::new(0, 0.0, &vertices(&points), &edges, &rule(&shares));
        let count =
            |level: u8| points.iter().filter(|&&p| plane.keep_level(p).unwrap() <= level).count();
        assert_eq!(count(1), 2 + 20);
        assert_eq!(count(2), 2 + 60);
        assert_eq!(count(3), 200);
    }

    #[test]
    fn a_loop_is_opened_where_some_node_has_a_vertex() {
        let mut square =
            vertices(&[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
        square[0].gone = true;
        let edges = [[0, 1], [1, 2], [2, 3], [3, 0]];
        let plane = CutPlane::new(0, 0.0, &square, &edges, &rule(&[1.0, 1.0]));
        let levels: Vec<_> = square.iter().map(|at| plane.keep_level(at.position)).collect();
        assert_eq!(levels, [Some(2), Some(1), Some(1), Some(1)], "no node keeps what none has");
    }

    #[test]
    fn loops_and_branches_are_covered_edge_by_edge() {
        // A square loop, and a tail that branches off its first corner.
        let points =
            [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
        let edges = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4]];
        let plane = CutPlane::new(0, 0.0, &vertices(&points), &edges, &rule(&[0.0, 1.0]));
        let covered: usize = plane.chains.iter().map(|chain| chain.positions.len() - 1).sum();
        assert_eq!(covered, edges.len());
        assert_eq!(plane.keep_level(points[0]), Some(1), "the branch is fixed");
    }
}
