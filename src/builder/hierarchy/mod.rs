//! The tree of one block (thesis section 3.2): divide, simplify, recurse.
//!
//! How deep it is and what each node may have is in [`shape`], where it is cut in `divide`. A
//! node whose children are all leaves is simplified from the original while these are made (Cozzi
//! & Loo, section 5.3), any other from its children's results. Work is parallel over children.

mod above;
mod coarse;
mod divide;
pub mod node;
pub mod options;
mod outline;
pub mod shape;
mod surfaces;

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;

pub use self::above::MemberSurfaces;
pub use self::node::{Forest, NodeDraft, NodeSink, Tree};
pub use self::options::{BorderMode, HierarchyOptions, TreeShape};
pub use self::outline::SkippedNode;
pub use self::shape::Resolutions;

use self::coarse::{CoarseNode, NodeSurface};
use self::shape::{NodePlan, Parent};
use crate::Result;
use crate::builder::border::span::original_spans;
use crate::builder::border::vertex::Border;
use crate::builder::cut::split::Chunk;
use crate::builder::error::{Below, SearchableSurface, SurfaceError};
use crate::builder::simplify::aggregate::{ComponentRules, Extrudable, has_many_bodies};
use crate::builder::simplify::merge::merge;
use crate::builder::simplify::simplified::LadderStep;
use crate::builder::stages::{Stage, Stages};
use crate::lattice::{Lattice, Quantization};
use crate::mesh::{AlphaMode, Mesh, UpAxis, renumber};
use crate::texture::BakePlan;

/// Chunks with more than this many times the desired triangles are divided and built in parallel.
const PARALLEL: usize = 4;

/// One block being built.
pub struct BlockBuilder<'a, S> {
    /// How.
    pub options: &'a HierarchyOptions,
    /// Its steps of simplification.
    pub resolutions: Resolutions,
    /// The seams that coarse nodes may ignore, where there are some in the way.
    pub bake: Option<BakePlan<'a>>,
    /// The block's lattice.
    pub lattice: Lattice,
    /// Where all vertices are rounded to a lattice that shows.
    pub quantization: Option<Quantization>,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// Of each material, whether its faces may be reoriented ([`crate::builder::simplify::orient`]).
    pub reorientable: &'a [bool],
    /// The alpha mode of each material.
    pub alpha: &'a [AlphaMode],
    /// Tells by material whether its image can be shown several times side by side.
    pub repeats: Vec<bool>,
    /// Of each material, whether prisms may have it.
    pub extrudable: &'a Extrudable,
    /// Where nodes go.
    pub sink: &'a S,
    /// Where the time goes.
    pub stages: &'a Stages,
}

/// A subtree, or several where its root is left out, and what its parent is simplified from.
struct Built<R> {
    forest: Forest<R>,
    /// `None` below a node that is simplified from the original.
    surface: Option<NodeSurface>,
}

impl<S: NodeSink> BlockBuilder<'_, S> {
    /// Builds all nodes of a block.
    pub fn build(&self, block: Chunk) -> Result<Forest<S::Record>> {
        let plan = self.resolutions.root(block.mesh.triangles.len());
        Ok(self.subtree(block, plan, &[], false)?.forest)
    }

    /// What counts as a body in any node of the block.
    fn bodies(&self) -> ComponentRules<'_> {
        let is_baked = self.bake.is_some_and(|plan| plan.always.is_some());
        let extrudable = self.extrudable.materials(is_baked);
        ComponentRules { up: self.up, extrudable, constants: &self.options.constants.prisms }
    }

    /// How far rounding has moved a chunk off the source, metres at most, where that shows.
    fn moved(&self, chunk: &Chunk) -> f64 {
        self.quantization.map_or(0.0, |lattice| lattice.bound() + chunk.most_moved())
    }

    /// Builds what becomes of a chunk; `wanted` where its parent is simplified from it.
    fn subtree(
        &self,
        chunk: Chunk,
        plan: NodePlan,
        child_path: &[u32],
        wanted: bool,
    ) -> Result<Built<S::Record>> {
        let NodePlan::Coarse { resolution, budget, share } = plan else {
            return self.leaf(chunk, child_path, wanted);
        };
        let path = chunk.path.clone();
        let node = CoarseNode { path: &path, resolution, child_path, budget };
        let mesh = chunk.mesh.clone();
        let stitches = chunk.stitches.clone();
        let (border, moved) = (chunk.border.clone(), self.moved(&chunk));
        let parallel = mesh.triangles.len() > PARALLEL * self.options.desired_tris as usize;
        let chunks = self.stages.time(Stage::Cut, || self.divide(chunk, resolution));
        let of_children = chunks.iter().map(|chunk| chunk.mesh.triangles.len()).sum();
        let triangles = mesh.triangles.len();
        let parent = Parent { resolution, triangles, share, of_children };
        // What no plane divides would not be divided by the next ones either.
        let divided = chunks.len() > 1 || self.options.tree == TreeShape::Thesis;
        let children: Vec<(Chunk, NodePlan)> = chunks
            .into_iter()
            .map(|chunk| {
                let triangles = chunk.mesh.triangles.len();
                let plan = self.resolutions.child(triangles, chunk.path.len(), parent);
                (chunk, if divided { plan } else { NodePlan::Leaf })
            })
            .collect();
        let all_leaves = children.iter().all(|(_, plan)| *plan == NodePlan::Leaf);
        if all_leaves {
            let from_original = || {
                let source = self.original(mesh, border, stitches, moved, &node);
                self.coarse_node(source, node)
            };
            let (coarse, built) =
                rayon::join(from_original, || self.children(children, child_path, parallel, false));
            let ((outcome, surface), built) = (coarse?, built?);
            let below = built.into_iter().map(|built| built.forest);
            return Ok(Built { forest: outcome.above(below), surface: Some(surface) });
        }
        let original =
            has_many_bodies(&mesh, budget, &self.bodies()).then_some((mesh, border, stitches));
        let built = self.children(children, child_path, parallel, true)?;
        let (below, surfaces): (Vec<_>, Vec<_>) =
            built.into_iter().map(|built| (built.forest, built.surface)).unzip();
        let surfaces: Vec<NodeSurface> = surfaces.into_iter().flatten().collect();
        let source = match original {
            // Prisms of prisms would be poor ones.
            Some((mesh, border, stitches)) => {
                let below = surfaces.into_iter().map(|surface| surface.below).collect();
                self.over(mesh, border, stitches, Below::join(below), &node)
            }
            None => join(surfaces, path.len()),
        };
        let (outcome, surface) = self.coarse_node(source, node)?;
        Ok(Built { forest: outcome.above(below), surface: Some(surface) })
    }

    fn children(
        &self,
        children: Vec<(Chunk, NodePlan)>,
        child_path: &[u32],
        parallel: bool,
        wanted: bool,
    ) -> Result<Vec<Built<S::Record>>> {
        let build = |(number, (chunk, plan)): (usize, (Chunk, NodePlan))| {
            let mut path = child_path.to_vec();
            path.push(number as u32);
            self.subtree(chunk, plan, &path, wanted)
        };
        if parallel {
            children.into_par_iter().enumerate().map(build).collect()
        } else {
            children.into_iter().enumerate().map(build).collect()
        }
    }

    fn leaf(&self, chunk: Chunk, child_path: &[u32], wanted: bool) -> Result<Built<S::Record>> {
        let moved = self.moved(&chunk);
        let triangles = chunk.mesh.triangles.len();
        let resolution = self.resolutions.last();
        let record = self.sink.take(&NodeDraft {
            mesh: &source_of(&chunk.mesh, &chunk.stitches),
            skirts: &[],
            resolution,
            child_path,
            budget: triangles,
            within_budget: None,
            error: SurfaceError::everywhere(moved),
            step: LadderStep::Original,
            baked: None,
            locked: 0,
        })?;
        self.sink.leaves_done(triangles);
        let surface = wanted.then(|| {
            let path = chunk.path.clone();
            let node = CoarseNode { path: &path, resolution, child_path, budget: triangles };
            self.original(chunk.mesh, chunk.border, chunk.stitches, moved, &node)
        });
        let trees = vec![Tree { record, children: Vec::new() }];
        Ok(Built { forest: Forest { trees, left_out: Vec::new() }, surface })
    }

    /// A chunk of the original, with its stitches, as what a node is simplified from; errors are
    /// measured to the original alone.
    fn original(
        &self,
        mesh: Mesh,
        border: Border,
        stitches: Vec<[u32; 3]>,
        moved: f64,
        node: &CoarseNode,
    ) -> NodeSurface {
        let constants = self.options.constants.measure;
        let of_mesh = || SearchableSurface::of(&source_of(&mesh, &stitches), constants);
        let below = Below::source(self.stages.time(Stage::Measure, of_mesh), moved);
        self.over(mesh, border, stitches, below, node)
    }

    /// A chunk of the original, with its stitches, as what a node is simplified from that is measured against
    /// `below`.
    fn over(
        &self,
        mut mesh: Mesh,
        border: Border,
        mut stitches: Vec<[u32; 3]>,
        below: Below,
        node: &CoarseNode,
    ) -> NodeSurface {
        mesh.triangles.append(&mut stitches);
        let spans = match self.options.borders {
            BorderMode::Skirts => original_spans(&mesh, &border, node.path),
            BorderMode::Locked => Vec::new(),
        };
        let original = Arc::clone(&below.source);
        NodeSurface { mesh, border, spans, original, below, baked: false }
    }
}

/// The triangles of the source alone, with the vertices that they use.
fn source_of<'a>(mesh: &'a Mesh, stitches: &[[u32; 3]]) -> Cow<'a, Mesh> {
    if stitches.is_empty() {
        return Cow::Borrowed(mesh);
    }
    let (triangles, used) = renumber(&mesh.triangles, mesh.positions.len());
    Cow::Owned(mesh.with_vertices(&used, triangles))
}

/// The children of a node as one surface; `planes` are those of the node's own path.
fn join(parts: Vec<NodeSurface>, planes: usize) -> NodeSurface {
    let pairs: Vec<(&Mesh, &Border)> =
        parts.iter().map(|part| (&part.mesh, &part.border)).collect();
    let (mesh, border) = merge(&pairs, planes);
    let baked = parts.iter().any(|part| part.baked);
    let (spans, below): (Vec<_>, Vec<_>) =
        parts.into_iter().map(|part| (part.spans, part.below)).unzip();
    let below = Below::join(below);
    let original = Arc::clone(&below.source);
    NodeSurface { mesh, border, spans: spans.concat(), original, below, baked }
}
