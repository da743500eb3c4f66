//! The chunks of a node's border, each with the edge that stands for it.
//!
//! A chunk runs along its plane's original polyline from one vertex that the node has to the next.
//! Chunks are found on the original mesh and joined from level to level where the vertices between
//! them go, not looked up in the thinned mesh: where two chunks come to have the same edge (a slit
//! that thinned to a line) the mesh seems to go on behind it, and where a narrow part closes up at
//! the border its edge is gone; the neighbour's border follows the polyline all the same.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::border::chain::Chain;
use crate::builder::border::thin::{EdgeKey, border_edges, edge_key};
use crate::builder::border::vertex::{Border, Path};
use crate::mesh::{Mesh, PositionKey, key};

/// A chunk of the border that a plane made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BorderSpan {
    /// The plane's place on the path.
    plane: u32,
    /// The chain's place in the plane.
    chain: u32,
    /// Places of its ends in the chain.
    ends: [u32; 2],
}

impl BorderSpan {
    /// An edge of a chain.
    pub fn of_edge(plane: u32, chain: usize, edge: usize) -> Self {
        Self { plane, chain: chain as u32, ends: [edge as u32, edge as u32 + 1] }
    }

    /// Whether all of it lies in the plane across an axis.
    pub fn is_in(&self, axis: usize, coordinate: f32, path: &Path) -> bool {
        self.points(path).iter().all(|at| at[axis] == coordinate)
    }

    /// A chain of its own.
    pub fn chain(&self, path: &Path) -> Chain {
        let Chain { keep, .. } = &path.plane(self.plane).chains[self.chain as usize];
        let keep = keep[self.ends[0] as usize..=self.ends[1] as usize].to_vec();
        Chain { positions: self.points(path).to_vec(), keep }
    }

    /// The original polyline, ends included.
    pub fn points<'a>(&self, path: &'a Path) -> &'a [[f32; 3]] {
        let chain = &path.plane(self.plane).chains[self.chain as usize];
        &chain.positions[self.ends[0] as usize..=self.ends[1] as usize]
    }

    /// The original polyline from this span to a later one of its chain, ends included.
    pub fn points_to<'a>(&self, last: &Self, path: &'a Path) -> &'a [[f32; 3]] {
        Self { ends: [self.ends[0], last.ends[1]], ..*self }.points(path)
    }

    /// The same span of chains that have other positions between theirs: `places` has where each of
    /// them is now, by plane, chain and index.
    pub fn at(&self, places: &[Vec<Vec<u32>>]) -> Self {
        let now = &places[self.plane as usize][self.chain as usize];
        Self { ends: self.ends.map(|end| now[end as usize]), ..*self }
    }

    /// Whether this span goes on where another one ends.
    pub fn follows(&self, before: &Self) -> bool {
        [self.plane, self.chain, self.ends[0]] == [before.plane, before.chain, before.ends[1]]
    }

    /// The plane's place on the path.
    pub fn plane(&self) -> u32 {
        self.plane
    }

    /// The chain's place in the plane, and those of the edges that it spans.
    pub fn edges(&self) -> (usize, std::ops::Range<usize>) {
        (self.chain as usize, self.ends[0] as usize..self.ends[1] as usize)
    }

    /// The edge that stands for it.
    pub fn edge(&self, path: &Path) -> EdgeKey {
        let points = self.points(path);
        let [a, b] = [key(points[0]), key(points[points.len() - 1])];
        if a <= b { [a, b] } else { [b, a] }
    }
}

/// The border of an original mesh, edge by edge.
pub fn original_spans(mesh: &Mesh, border: &Border, path: &Path) -> Vec<BorderSpan> {
    let mut runs: Vec<BorderSpan> = border_edges(mesh, border, path)
        .into_iter()
        .filter_map(|[a, b]| {
            let planes = border.planes[a as usize] & border.planes[b as usize];
            let [a, b] = [a, b].map(|vertex| mesh.positions[vertex as usize]);
            (0..path.len() as u32).filter(|plane| planes & (1 << plane) != 0).find_map(|plane| {
                let (chain, first) = path.plane(plane).edge_place(a, b)?;
                Some(BorderSpan { plane, chain, ends: [first, first + 1] })
            })
        })
        .collect();
    runs.sort_unstable();
    runs
}

/// Joins chunks at the vertices that `level` does without. `thinned` is the node's mesh after
/// [`crate::builder::border::thin`]: what it has of the border stays.
pub fn join_spans(
    mut runs: Vec<BorderSpan>,
    path: &Path,
    level: u8,
    thinned: &Mesh,
    border: &Border,
) -> Vec<BorderSpan> {
    runs.retain(|run| run.plane < path.len() as u32);
    runs.sort_unstable();
    runs.dedup();
    let on_border = |&vertex: &u32| border.planes[vertex as usize] & path.bits() != 0;
    let there: FxHashSet<PositionKey<f32>> = thinned
        .triangles
        .as_flattened()
        .iter()
        .filter(|vertex| on_border(vertex))
        .map(|&vertex| key(thinned.positions[vertex as usize]))
        .collect();
    let stays = |run: &BorderSpan| {
        let (chain, at) = (&path.plane(run.plane).chains[run.chain as usize], run.ends[1] as usize);
        chain.keep[at] <= level || there.contains(&key(chain.positions[at]))
    };
    let mut joined: Vec<BorderSpan> = Vec::with_capacity(runs.len());
    for run in runs {
        match joined.last_mut() {
            Some(last) if run.follows(last) && !stays(last) => {
                last.ends[1] = run.ends[1];
            }
            _ => joined.push(run),
        }
    }
    joined
}

/// The vertices of the edges that stand for runs, as the first triangle winds that has each.
pub fn edges_of(
    runs: &[BorderSpan],
    path: &Path,
    mesh: &Mesh,
    border: &Border,
) -> FxHashMap<EdgeKey, [u32; 2]> {
    let wanted: FxHashSet<EdgeKey> = runs.iter().map(|run| run.edge(path)).collect();
    let mut found = FxHashMap::default();
    let on_border = |vertex: u32| border.planes[vertex as usize] & path.bits() != 0;
    for &[a, b, c] in &mesh.triangles {
        for ends in [[a, b], [b, c], [c, a]] {
            if on_border(ends[0]) && on_border(ends[1]) {
                let edge = edge_key(mesh, ends);
                if wanted.contains(&edge) {
                    found.entry(edge).or_insert(ends);
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::builder::border::chain::CutPlane;

    /// A slit across the plane x = 0: two polylines from one end to the other, with two triangles
    /// behind each edge's ends.
    fn slit() -> (Mesh, Border, Path) {
        let ends = [[0.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let middles = [[0.0, 2.0, 1.0], [0.0, 2.0, -1.0]];
        let chains = middles
            .map(|middle| Chain { positions: vec![ends[0], middle, ends[1]], keep: vec![0, 2, 0] });
        let mesh = Mesh {
            positions: vec![ends[0], ends[1], middles[0], middles[1], [5.0, 2.0, 0.0]],
            materials: vec![0; 5],
            triangles: vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]],
            ..Mesh::default()
        };
        let border = Border { planes: vec![1, 1, 1, 1, 0], keep: vec![0, 0, 2, 2, 0] };
        (
            mesh,
            border,
            Path::default().with(Arc::new(CutPlane::from_chains(0, 0.0, chains.to_vec()))),
        )
    }

    #[test]
    fn a_slit_that_thins_to_a_line_keeps_both_its_sides() {
        let (mesh, border, path) = slit();
        let runs = original_spans(&mesh, &border, &path);
        assert_eq!(runs.len(), 4);
        assert_eq!(join_spans(runs.clone(), &path, 2, &mesh, &border), runs, "nothing goes");
        // Both middles go to the first end.
        let thinned = Mesh { triangles: vec![[0, 1, 4], [1, 0, 4]], ..mesh };
        assert!(border_edges(&thinned, &border, &path).is_empty(), "it seems to go on");
        let joined = join_spans(runs.clone(), &path, 1, &thinned, &border);
        let points: Vec<_> = joined.iter().map(|run| run.points(&path)[1][2]).collect();
        assert_eq!(points, [1.0, -1.0]);
        let edges = edges_of(&joined, &path, &thinned, &border);
        assert_eq!(edges.len(), 1);
        assert!(joined.iter().all(|run| edges[&run.edge(&path)] == [0, 1]));

        // A coarser level that knows the same runs, joined already.
        assert_eq!(join_spans(joined.clone(), &path, 0, &thinned, &border), joined);
        assert!(join_spans(joined, &Path::default(), 0, &thinned, &border).is_empty());
    }

    #[test]
    fn what_could_not_be_thinned_divides_runs() {
        let (mesh, border, path) = slit();
        let runs = original_spans(&mesh, &border, &path);
        // The first middle is stuck.
        let thinned = Mesh { triangles: vec![[0, 2, 4], [2, 1, 4], [1, 0, 4]], ..mesh };
        assert_eq!(join_spans(runs, &path, 1, &thinned, &border).len(), 3);
    }
}
