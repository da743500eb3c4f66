//! Vertices that blocks made of groups have in common.
//!
//! Tiles of a scan and the groups of a modelled city are separate in the file but meet along
//! borders, vertex by vertex. These borders are no cutting planes and need not be flat, so there
//! are no skirts to cover what thinning would open: such vertices are kept at every level.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::border::chain::CutPlane;
use crate::builder::border::vertex::{Border, Path};
use crate::builder::cut::split::Chunk;
use crate::mesh::{PositionKey, key};

/// A box of source coordinates: least and greatest corner.
pub type Bounds = ([f64; 3], [f64; 3]);

/// Whether two boxes have a place in common.
pub fn meet(one: &Bounds, other: &Bounds) -> bool {
    (0..3).all(|axis| one.0[axis] <= other.1[axis] && other.0[axis] <= one.1[axis])
}

/// Whether a position is in a box, or on its sides.
pub fn holds((low, high): &Bounds, at: &[f64; 3]) -> bool {
    (0..3).all(|axis| low[axis] <= at[axis] && at[axis] <= high[axis])
}

/// The box of some positions; inside out where there are none.
pub fn bounds_of(positions: impl Iterator<Item = [f64; 3]>) -> Bounds {
    let empty = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    positions.fold(empty, |(low, high), p| {
        (std::array::from_fn(|i| low[i].min(p[i])), std::array::from_fn(|i| high[i].max(p[i])))
    })
}

/// Finds positions that several blocks use. `blocks` are each block's bounds and positions.
pub fn shared_positions<P>(
    blocks: &[Bounds],
    positions: impl Fn(usize) -> P,
) -> FxHashSet<PositionKey<f64>>
where
    P: Iterator<Item = [f64; 3]>,
{
    let mut shared: FxHashSet<PositionKey<f64>> = FxHashSet::default();
    each_shared(blocks, positions, |position, _, _| {
        shared.insert(position);
    });
    shared
}

/// Calls `found` with each position that several blocks use, the first of them, and each other one.
pub fn each_shared<P>(
    blocks: &[Bounds],
    positions: impl Fn(usize) -> P,
    mut found: impl FnMut(PositionKey<f64>, usize, usize),
) where
    P: Iterator<Item = [f64; 3]>,
{
    // The first block that uses a position, and the last.
    let mut users: FxHashMap<PositionKey<f64>, [u32; 2]> = FxHashMap::default();
    for (number, bounds) in blocks.iter().enumerate() {
        let others: Vec<&Bounds> = blocks
            .iter()
            .enumerate()
            .filter(|&(other, _)| other != number)
            .map(|(_, other)| other)
            .filter(|other| meet(bounds, other))
            .collect();
        if others.is_empty() {
            continue;
        }
        let block = number as u32;
        for position in positions(number) {
            if !others.iter().any(|other| holds(other, &position)) {
                continue;
            }
            let key = key(position);
            let [first, last] = users.entry(key).or_insert([block; 2]);
            if *last != block {
                *last = block;
                found(key, *first as usize, number);
            }
        }
    }
}

/// Whether a chunk's plane stands for vertices that it shares with other blocks, and is none.
pub fn is_of_shared(plane: &CutPlane<f64>) -> bool {
    plane.coordinate.is_nan()
}

/// Gives a chunk that has no border yet its part of borders: the vertices that are in `planes`, of which it takes
/// `most` at most, and those that are `kept` at every level.
pub fn mark_border<'a>(
    chunk: &mut Chunk<f64>,
    planes: impl IntoIterator<Item = &'a Arc<CutPlane<f64>>>,
    kept: &FxHashSet<PositionKey<f64>>,
    most: usize,
) {
    let positions = &chunk.mesh.positions;
    chunk.border = Border::interior(positions.len());
    let at = |plane: &CutPlane<f64>| -> Vec<(usize, u8)> {
        let level =
            |(vertex, &position): (usize, &[f64; 3])| Some((vertex, plane.keep_level(position)?));
        positions.iter().enumerate().filter_map(level).collect()
    };
    let mut path = Path::default();
    let mut kept: Vec<usize> =
        (0..positions.len()).filter(|&vertex| kept.contains(&key(positions[vertex]))).collect();
    for plane in planes {
        let vertices = at(plane);
        if vertices.is_empty() {
            continue;
        }
        if path.len() >= most {
            kept.extend(vertices.iter().map(|&(vertex, _)| vertex));
            continue;
        }
        for (vertex, level) in vertices {
            chunk.border.planes[vertex] |= 1 << path.len();
            chunk.border.keep[vertex] = level;
        }
        path = path.with(Arc::clone(plane));
    }
    if !kept.is_empty() {
        for vertex in kept {
            chunk.border.planes[vertex] |= 1 << path.len();
            chunk.border.keep[vertex] = 0;
        }
        path = path.with(Arc::new(CutPlane::from_chains(0, f64::NAN, Vec::new())));
    }
    chunk.path = path;
}

/// Marks the shared vertices of a block, if it has any, as lying on a border that never thins, and
/// whose edges cuts do not divide.
pub fn keep_shared(chunk: &mut Chunk<f64>, shared: &FxHashSet<PositionKey<f64>>) {
    if shared.is_empty() || chunk.path.len() >= 60 {
        return;
    }
    let bit = 1u64 << chunk.path.len();
    let mut any = false;
    for (vertex, &position) in chunk.mesh.positions.iter().enumerate() {
        if shared.contains(&key(position)) {
            chunk.border.planes[vertex] |= bit;
            chunk.border.keep[vertex] = 0;
            any = true;
        }
    }
    if any {
        chunk.path = chunk.path.with(Arc::new(CutPlane::from_chains(0, f64::NAN, Vec::new())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::border::vertex::BorderVertexState;
    use crate::mesh::Mesh;

    #[test]
    fn only_positions_of_two_blocks_are_shared_and_they_are_kept_at_every_level() {
        let blocks = [
            vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
            vec![[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.5]],
        ];
        let bounds = [([0.0; 3], [1.0, 1.0, 0.0]), ([1.0, 0.0, 0.0], [2.0, 1.0, 0.5])];
        let shared = shared_positions(&bounds, |block| blocks[block].iter().copied());
        assert_eq!(shared.len(), 1);
        assert!(shared.contains(&key([1.0, 0.0, 0.0])));

        let mesh = Mesh { positions: blocks[0].clone(), ..Mesh::default() };
        let mut chunk = Chunk { mesh, border: Border::interior(4), ..Chunk::default() };
        keep_shared(&mut chunk, &shared);
        let state = |vertex: usize, level| {
            chunk.path.state(chunk.border.planes[vertex], chunk.border.keep[vertex], level)
        };
        assert_eq!(
            [state(1, 0), state(1, 9), state(0, 0)],
            [BorderVertexState::Kept, BorderVertexState::Kept, BorderVertexState::Free]
        );
    }
}
