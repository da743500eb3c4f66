//! What fronts keep of the outline of the leaves.

use rayon::prelude::*;

use super::geometry::NodeGeometry;
use crate::mesh::{Outline, OutlineCoverage, OutlineFrame, UpAxis};

/// Along the longer side of the scene.
const CELLS: usize = 4096;

/// The outline of all leaves, to compare fronts with.
pub(super) struct Outlines<'a> {
    geometry: &'a [NodeGeometry],
    frame: OutlineFrame,
    leaves: Outline,
}

impl<'a> Outlines<'a> {
    /// `None` where the leaves cover no ground.
    pub fn of(up: UpAxis, leaves: &[u32], geometry: &'a [NodeGeometry]) -> Option<Self> {
        let vertices = |&node: &u32| {
            let node = &geometry[node as usize];
            (0..node.positions.len() as u32).map(|vertex| node.position(vertex))
        };
        let positions = leaves.iter().flat_map(vertices);
        let frame = OutlineFrame::around(up, positions, CELLS)?;
        let leaves = outline(&frame, leaves, geometry);
        Some(Self { geometry, frame, leaves })
    }

    /// What nodes keep of it.
    pub fn kept_by(&self, nodes: &[u32]) -> OutlineCoverage {
        self.leaves.kept_by(&outline(&self.frame, nodes, self.geometry))
    }
}

fn outline(frame: &OutlineFrame, nodes: &[u32], geometry: &[NodeGeometry]) -> Outline {
    let outline = frame.empty();
    nodes.par_iter().for_each(|&node| {
        let surface = geometry[node as usize].surface();
        surface.for_each(|(_, corners)| frame.add(&outline, corners));
    });
    outline
}
