//! Telling a chunk which of its vertices lie on borders with others.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use crate::builder::border::chain::{Chain, CutPlane};
use crate::builder::border::vertex::{Border, Path};
use crate::builder::cut::split::Chunk;
use crate::mesh::{PositionKey, key};

/// The borders of a chunk with others.
pub struct Marks<'a> {
    /// Cutting planes that bound the chunk.
    pub planes: Vec<&'a CutPlane<f64>>,
    /// Positions in which other chunks touch this one without a common edge. They are kept at every level.
    pub touching: FxHashSet<PositionKey<f64>>,
    /// Levels that planes are ranked for and that are coarser than any of the chunk.
    pub coarser: usize,
}

/// Gives a chunk that nothing has cut its borders.
pub fn mark_border(chunk: &mut Chunk<f64>, marks: &Marks) {
    let positions = &chunk.mesh.positions;
    chunk.border = Border::interior(positions.len());
    let mut path = Path::default();
    for plane in &marks.planes {
        let plane = with_levels(plane, marks.coarser);
        let bit = 1 << path.len();
        for (vertex, &position) in positions.iter().enumerate() {
            if position[plane.axis] != plane.coordinate {
                continue;
            }
            let touches = || marks.touching.contains(&key(position)).then_some(0);
            if let Some(level) = plane.keep_level(position).or_else(touches) {
                chunk.border.planes[vertex] |= bit;
                let keep = &mut chunk.border.keep[vertex];
                *keep = (*keep).max(level);
            }
        }
        path = path.with(Arc::new(plane));
    }
    chunk.path = path;
}

/// A plane without its coarsest levels.
fn with_levels(plane: &CutPlane<f64>, coarser: usize) -> CutPlane<f64> {
    let coarser = coarser.min(u8::MAX.into()) as u8;
    let chain = |chain: &Chain<f64>| Chain {
        positions: chain.positions.clone(),
        keep: chain.keep.iter().map(|keep| keep.saturating_sub(coarser)).collect(),
    };
    let chains = plane.chains.iter().map(chain).collect();
    CutPlane::from_chains(plane.axis, plane.coordinate, chains)
}
