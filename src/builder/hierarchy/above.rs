//! A node above trees that are written already ([`crate::builder::upper`]).

use std::sync::Arc;

use super::coarse::{CoarseNode, NodeSurface, Outcome};
use super::node::NodeSink;
use super::options::BorderMode;
use super::outline::SkippedNode;
use super::{BlockBuilder, source_of};
use crate::Result;
use crate::builder::border::span::BorderSpan;
use crate::builder::border::vertex::Path;
use crate::builder::cut::split::Chunk;
use crate::builder::error::{Below, SearchableSurface};
use crate::builder::stages::Stage;

/// What a node is made of that stands above others.
pub struct MemberSurfaces {
    /// Surfaces of the members without skirts. The planes have the border of the source.
    pub chunk: Chunk,
    /// The surface that the node is measured against.
    pub below: Below,
}

impl<S: NodeSink> BlockBuilder<'_, S> {
    /// Makes the node above others, of `budget` triangles, and writes it; what it would have been where
    /// it kept too little of their outline.
    pub fn above(
        &self,
        members: MemberSurfaces,
        budget: usize,
    ) -> Result<Result<S::Record, SkippedNode>> {
        let MemberSurfaces { chunk, below } = members;
        let Chunk { mut mesh, border, path, mut stitches, .. } = chunk;
        let constants = self.options.constants.measure;
        let of_mesh = || Arc::new(SearchableSurface::of(&source_of(&mesh, &stitches), constants));
        let original = self.stages.time(Stage::Measure, of_mesh);
        mesh.triangles.append(&mut stitches);
        let spans = match self.options.borders {
            BorderMode::Skirts => all_spans(&path),
            BorderMode::Locked => Vec::new(),
        };
        let source = NodeSurface { mesh, border, spans, original, below, baked: false };
        let node = CoarseNode { path: &path, resolution: 0, child_path: &[], budget };
        let (outcome, _) = self.coarse_node(source, node)?;
        Ok(match outcome {
            Outcome::Written(record) => Ok(record),
            Outcome::Skipped(left_out) => Err(left_out),
        })
    }
}

/// Every edge of the source's border.
fn all_spans(path: &Path) -> Vec<BorderSpan> {
    let of_plane = |bit: u32| {
        let chains = path.plane(bit).chains.iter().enumerate();
        chains.flat_map(move |(chain, all)| {
            let edges = 0..all.positions.len().saturating_sub(1);
            edges.map(move |edge| BorderSpan::of_edge(bit, chain, edge))
        })
    };
    (0..path.len() as u32).flat_map(of_plane).collect()
}
