//! A node above trees that are written already: a district ([`crate::builder::districts`]).

use std::sync::Arc;

use glam::DVec3;

use super::coarse::{CoarseNode, NodeSurface, Outcome};
use super::node::NodeSink;
use super::options::BorderMode;
use super::outline::LeftOut;
use super::{BlockBuilder, source_of};
use crate::Result;
use crate::builder::border::chain::CutPlane;
use crate::builder::border::span::original_spans;
use crate::builder::border::vertex::Path;
use crate::builder::cut::split::Chunk;
use crate::builder::districts::cuts::is_in_plane;
use crate::builder::districts::widened::Widened;
use crate::builder::error::{Original, SurfaceError};
use crate::builder::stages::Stage;
use crate::mesh::Mesh;

/// What a node is made of that stands above others.
pub struct Below {
    /// Their surfaces, without skirts.
    pub chunk: Chunk,
    /// Their skirts, in the chunk's coordinates.
    pub skirts: Vec<Vec<DVec3>>,
    /// The most that any of them is off the source, metres.
    pub bound: f64,
}

impl<S: NodeSink> BlockBuilder<'_, S> {
    /// Makes the node above others, of `budget` triangles, and writes it; what it would have been where
    /// it kept too little of their outline. `measure` says how far it is off the source.
    pub fn above(
        &self,
        below: Below,
        budget: usize,
        measure: impl FnOnce(&Mesh) -> Result<SurfaceError>,
    ) -> Result<Result<S::Record, LeftOut>> {
        let Below { chunk, skirts, bound } = below;
        let Chunk { mut mesh, border, path, mut stitches, .. } = chunk;
        let constants = self.options.constants.measure;
        let of_mesh = || Arc::new(Original::of(&source_of(&mesh, &stitches), constants));
        let original = self.stages.time(Stage::Measure, of_mesh);
        mesh.triangles.append(&mut stitches);
        let spans = match self.options.borders {
            // Around lids that close what cuts opened the border goes on.
            BorderMode::Skirts => {
                let mut spans = original_spans(&mesh, &border, &path);
                spans.extend(original_spans(&beside_cuts(&mesh, &path), &border, &path));
                spans.sort_unstable();
                spans.dedup();
                spans
            }
            BorderMode::Locked => Vec::new(),
        };
        let Widened { path, spans } = Widened::by(&skirts, &path, spans);
        let error = SurfaceError { bound, ..SurfaceError::default() };
        let source = NodeSurface { mesh, border, spans, original, moved: 0.0, error, baked: false };
        let node = CoarseNode { path: &path, resolution: 0, child_path: &[], budget };
        let (outcome, _) = self.measured_node(source, node, |_, mesh| measure(mesh))?;
        Ok(match outcome {
            Outcome::Written(record) => Ok(record),
            Outcome::LeftOut(left_out) => Err(left_out),
        })
    }
}

/// A mesh without its triangles in the planes of cuts.
fn beside_cuts(mesh: &Mesh, path: &Path) -> Mesh {
    let is_in = |plane: &CutPlane, corners: &[u32; 3]| {
        let corners = corners.map(|corner| mesh.positions[corner as usize].map(f64::from));
        is_in_plane(&corners, plane.axis, plane.coordinate.into())
    };
    let mut beside = mesh.clone();
    for bit in 0..path.len() as u32 {
        beside.triangles.retain(|corners| !is_in(path.plane(bit), corners));
    }
    beside
}
