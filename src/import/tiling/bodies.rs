//! Small bodies of a file, which stay whole: a building that is cut in two has halves that are simplified each by
//! itself, so that one may close where the other is open.

use super::super::obj::statements::Statements;
use super::division::Division;

/// A body of fewer vertices is none: faces that have no vertex in common with others.
const LEAST_VERTICES: u32 = 8;

/// The tile is not known, or there is none.
const NONE: u32 = u32::MAX;

/// Vertices by what they are of: those that faces join.
#[derive(Default)]
pub(super) struct Bodies {
    parents: Vec<u32>,
    /// By the first vertex of a body: the tile in which all of it goes.
    tiles: Vec<u32>,
}

impl Bodies {
    /// So many vertices are known.
    pub fn grow(&mut self, vertices: usize) {
        self.parents.extend(self.parents.len() as u32..vertices as u32);
    }

    /// Joins what the faces of a settled chunk have in common; so many vertices come before it.
    pub fn join_faces(&mut self, chunk: &Statements, before: usize) {
        let mut corners = chunk.corners.iter().map(|[position, ..]| position.resolve(before));
        for &count in &chunk.faces {
            let mut first = None;
            for corner in corners.by_ref().take(count as usize) {
                let Some(corner) = corner else { continue };
                let first = *first.get_or_insert(corner);
                let (one, other) = (self.root(first), self.root(corner));
                self.parents[one.max(other) as usize] = one.min(other);
            }
        }
    }

    fn root(&mut self, mut vertex: u32) -> u32 {
        while self.parents[vertex as usize] != vertex {
            let above = self.parents[self.parents[vertex as usize] as usize];
            self.parents[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }

    /// Says which tiles small bodies are in: those that are no wider than `width` along both axes of the ground and
    /// have no more than `most` vertices. `position` has the place of each vertex.
    pub fn settle<E>(
        &mut self,
        division: &Division,
        axes: [usize; 2],
        (width, most): (f64, u32),
        mut position: impl FnMut(usize) -> Result<[f64; 3], E>,
    ) -> Result<(), E> {
        let mut counts = vec![0u32; self.parents.len()];
        for vertex in 0..self.parents.len() as u32 {
            counts[self.root(vertex) as usize] += 1;
        }
        let is_body = |count: u32| (LEAST_VERTICES..=most).contains(&count);
        let mut boxes: rustc_hash::FxHashMap<u32, [[f64; 3]; 2]> = Default::default();
        for vertex in 0..self.parents.len() as u32 {
            let root = self.root(vertex);
            if is_body(counts[root as usize]) {
                let at = position(vertex as usize)?;
                let known = boxes.entry(root).or_insert([at; 2]);
                *known = super::super::bounds::joined(*known, [at; 2]);
            }
        }
        counts.fill(NONE);
        for (root, [low, high]) in boxes {
            let is_small = axes.iter().all(|&axis| high[axis] - low[axis] <= width);
            let middle = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
            if is_small && let Some(tile) = division.tile_of(&[middle]) {
                counts[root as usize] = tile as u32;
            }
        }
        self.tiles = counts;
        Ok(())
    }

    /// The tile of the small body that a vertex is of, if it is of one.
    pub fn tile_of(&mut self, vertex: u32) -> Option<usize> {
        let root = self.root(vertex);
        self.tiles.get(root as usize).filter(|tile| **tile != NONE).map(|tile| *tile as usize)
    }
}
