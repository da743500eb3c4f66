//! What an input's blocks are given of its borders with other inputs.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use super::meeting::Share;
use super::rim::BoundingBox;
use crate::builder::border::chain::CutPlane;
use crate::builder::border::shared::mark_border;
use crate::builder::cut::split::Chunk;
use crate::mesh::{PositionKey, key};
use crate::report::build_report::MeetingReport;

/// A chunk starts with so many planes of its input's borders at most: others are needed to divide it. What is on
/// further ones stays at every level.
const MOST_PLANES: usize = 16;

/// The borders of an input with all others.
#[derive(Clone, Debug, Default)]
pub struct InputBorder {
    planes: Vec<Arc<CutPlane<f64>>>,
    kept: FxHashSet<PositionKey<f64>>,
    /// The box of the input's vertices; `None` where it is the only one.
    pub bounds: Option<BoundingBox>,
    /// With whom, in order.
    pub meetings: Vec<MeetingReport>,
}

impl InputBorder {
    /// Of an input in a box, with none so far.
    pub fn new(bounds: BoundingBox) -> Self {
        Self { bounds: Some(bounds), ..Self::default() }
    }

    /// Adds what it has in common with the input at a path.
    pub fn add(&mut self, path: String, share: Share) {
        self.meetings.push(MeetingReport { path, hash: share.hash() });
        self.kept.extend(share.kept.into_iter().map(key));
        for plane in share.planes {
            // Several inputs along one side are one border.
            let is_same = |known: &&mut Arc<CutPlane<f64>>| {
                known.axis == plane.axis && known.coordinate == plane.coordinate
            };
            match self.planes.iter_mut().find(is_same) {
                Some(known) => {
                    let chains = known.chains.iter().chain(&plane.chains).cloned().collect();
                    *known = Arc::new(CutPlane::from_chains(plane.axis, plane.coordinate, chains));
                }
                None => self.planes.push(plane),
            }
        }
    }

    /// The planes that it has edges in: axes and coordinates.
    pub fn planes(&self) -> impl Iterator<Item = (usize, f64)> {
        let with_edges = self.planes.iter().filter(|plane| !plane.chains.is_empty());
        with_edges.map(|plane| (plane.axis, plane.coordinate))
    }

    /// The vertices that it has in common with others.
    pub fn positions(&self) -> FxHashSet<PositionKey<f64>> {
        let chains = self.planes.iter().flat_map(|plane| &plane.chains);
        let of_planes = chains.flat_map(|chain| &chain.positions).map(|&at| key(at));
        self.kept.iter().copied().chain(of_planes).collect()
    }

    /// Gives a chunk of the input its part of it.
    pub fn mark(&self, chunk: &mut Chunk<f64>) {
        if !(self.planes.is_empty() && self.kept.is_empty()) {
            mark_border(chunk, &self.planes, &self.kept, MOST_PLANES);
        }
    }
}
