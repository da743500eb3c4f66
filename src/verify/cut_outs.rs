//! How much of surfaces with cut-outs (leaves, fences) is visible.

use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::node_textures::{NodePoint, NodeTextures};
use super::sample::{area, spread};

/// Points of each node: where a third is visible, one in a hundred of the estimates is off by more than 3 %.
const POINTS: f64 = 16_384.0;

/// The visible area of the cut-outs of each node, square metres: without what is see-through.
pub(super) struct CutOuts {
    of_node: Vec<f64>,
}

impl CutOuts {
    /// Measures all nodes by points.
    pub fn of(geometry: &[NodeGeometry], images: &NodeTextures, seed: u64) -> Self {
        let visible = |(node, geometry): (usize, &NodeGeometry)| {
            let cut_out = images.cut_out(node as u32);
            if cut_out.is_empty() {
                return 0.0;
            }
            let mut triangles = Vec::new();
            geometry.surface().for_each(|(number, corners)| {
                if cut_out.binary_search(&number).is_ok() {
                    triangles.push((number, corners));
                }
            });
            let whole: f64 = triangles.iter().map(|&(_, corners)| area(corners)).sum();
            let points = spread(triangles.into_iter(), POINTS / whole, seed, node as u64);
            let at: Vec<NodePoint> =
                points.iter().map(|point| (point.triangle, point.weights)).collect();
            let seen = images.colors(node as u32, &at).into_iter().flatten().count();
            whole * seen as f64 / at.len().max(1) as f64
        };
        Self { of_node: geometry.par_iter().enumerate().map(visible).collect() }
    }

    /// The visible area of some nodes over that of others; `None` where these have none.
    pub fn share(
        &self,
        nodes: impl IntoIterator<Item = u32>,
        others: impl IntoIterator<Item = u32>,
    ) -> Option<f64> {
        let sum = |nodes: &mut dyn Iterator<Item = u32>| -> f64 {
            nodes.map(|node| self.of_node[node as usize]).sum()
        };
        let all = sum(&mut others.into_iter());
        (all > 0.0).then(|| sum(&mut nodes.into_iter()) / all)
    }
}
