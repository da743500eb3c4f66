//! The points at which levels are compared with the source: spread over the leaves, which are the
//! source cut into pieces, so that it is known below which nodes each point lies.

use super::geometry::NodeGeometry;
use super::sample::{SurfacePoint, spread};

/// Points of all leaves, leaf by leaf.
pub(super) struct Points {
    /// All points.
    pub all: Vec<SurfacePoint>,
    /// The leaf of each.
    pub leaf: Vec<u32>,
    /// Where each leaf's points begin, by index among the leaves, and where the last ones end.
    first: Vec<usize>,
    /// Points a square metre.
    pub density: f64,
}

impl Points {
    /// About `samples` points over the leaves.
    pub fn new(leaves: &[u32], geometry: &[NodeGeometry], samples: u64, seed: u64) -> Self {
        let area: f64 = leaves.iter().map(|&leaf| geometry[leaf as usize].area()).sum();
        let density = if area > 0.0 { samples as f64 / area } else { 0.0 };
        let mut points = Self { all: Vec::new(), leaf: Vec::new(), first: vec![0], density };
        for &leaf in leaves {
            let node = &geometry[leaf as usize];
            points.all.extend(spread(node.surface(), density, seed, u64::from(leaf)));
            points.leaf.resize(points.all.len(), leaf);
            points.first.push(points.all.len());
        }
        points
    }

    /// The numbers of a leaf's points; the leaf by its index among the leaves.
    pub fn of_leaf(&self, index: usize) -> std::ops::Range<usize> {
        self.first[index]..self.first[index + 1]
    }
}
