//! Vertices that blocks made of groups have in common.
//!
//! Tiles of a scan and the groups of a modelled city are separate in the file but meet along
//! borders, vertex by vertex. These borders are no cutting planes and need not be flat, so there
//! are no skirts to cover what thinning would open: such vertices are kept at every level.

use std::hash::Hasher;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet, FxHasher};

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
///
/// Time is linear in the number of positions, however many blocks there are and however they overlap:
/// positions are compared in those cells of a grid alone in which several blocks have any.
pub fn each_shared<P>(
    blocks: &[Bounds],
    positions: impl Fn(usize) -> P,
    mut found: impl FnMut(PositionKey<f64>, usize, usize),
) where
    P: Iterator<Item = [f64; 3]>,
{
    let counts = (0..blocks.len()).map(|block| positions(block).count());
    let mut cells =
        CellUsers::new(bounds_of(blocks.iter().flat_map(|&(a, b)| [a, b])), counts.sum());
    for block in 0..blocks.len() {
        positions(block).for_each(|position| cells.add(position, block as u32));
    }
    // The first block that uses a position, and the last.
    let mut users: FxHashMap<PositionKey<f64>, [u32; 2]> = FxHashMap::default();
    for number in 0..blocks.len() {
        let block = number as u32;
        for position in positions(number).filter(|&position| cells.has_several(position)) {
            let key = key(position);
            let [first, last] = users.entry(key).or_insert([block; 2]);
            if *last != block {
                *last = block;
                found(key, *first as usize, number);
            }
        }
    }
}

/// Which cells of a grid have positions of several blocks. Different cells may share a slot: then one of
/// them may seem to have several.
struct CellUsers {
    low: [f64; 3],
    side: f64,
    /// The one block of each slot, [`NO_BLOCK`] or [`SEVERAL`]. The length is a power of two.
    slots: Vec<u32>,
}

const NO_BLOCK: u32 = u32::MAX;
const SEVERAL: u32 = u32::MAX - 1;

impl CellUsers {
    /// For so many positions within bounds: about as many cells on the ground as there are positions.
    fn new((low, high): Bounds, positions: usize) -> Self {
        let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let side = (longest / (positions as f64).sqrt()).max(f64::MIN_POSITIVE);
        Self { low, side, slots: vec![NO_BLOCK; positions.next_power_of_two()] }
    }

    fn slot(&self, position: [f64; 3]) -> usize {
        let mut hasher = FxHasher::default();
        for (at, low) in position.into_iter().zip(self.low) {
            hasher.write_i64(((at - low) / self.side) as i64);
        }
        hasher.finish() as usize & (self.slots.len() - 1)
    }

    fn add(&mut self, position: [f64; 3], block: u32) {
        let slot = self.slot(position);
        let user = &mut self.slots[slot];
        *user = if [NO_BLOCK, block].contains(user) { block } else { SEVERAL };
    }

    fn has_several(&self, position: [f64; 3]) -> bool {
        self.slots[self.slot(position)] == SEVERAL
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
    use crate::random::Random;

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

    #[test]
    fn shared_positions_are_those_of_a_slow_count_however_blocks_overlap() {
        let mut random = Random::new(7, 0);
        for spread in [0.0, 4.0, 1e9] {
            let blocks: Vec<Vec<[f64; 3]>> = (0..40)
                .map(|block| {
                    let corner = f64::from(block) * spread;
                    let mut at = || corner + (random.unit() * 12.0).floor();
                    (0..30).map(|_| [at(), at(), at()]).collect()
                })
                .collect();
            let bounds: Vec<Bounds> =
                blocks.iter().map(|block| bounds_of(block.iter().copied())).collect();
            let found = shared_positions(&bounds, |block| blocks[block].iter().copied());
            let users = |at: [f64; 3]| blocks.iter().filter(|block| block.contains(&at)).count();
            let all = blocks.iter().flatten().copied();
            let expected: FxHashSet<_> = all.filter(|&at| users(at) > 1).map(key).collect();
            assert_eq!(found, expected, "{spread}");
        }
    }

    #[test]
    fn each_position_is_looked_at_three_times_however_many_blocks_there_are() {
        for blocks in [10, 160] {
            let looked = std::cell::Cell::new(0);
            let bounds = vec![([0.0; 3], [9.0; 3]); blocks];
            let positions = |block: usize| {
                (0..10).map(move |at| [f64::from(at), block as f64, 0.0]).inspect(|_| {
                    looked.set(looked.get() + 1);
                })
            };
            assert!(shared_positions(&bounds, positions).is_empty());
            assert!(looked.get() <= 3 * 10 * blocks, "{} of {blocks}", looked.get());
        }
    }
}
