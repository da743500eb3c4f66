//! The tree of one block (thesis section 3.2): divide, simplify, recurse.
//!
//! With `N` triangles in the block, `simplification_0 = N / desired_tris` and
//! `simplification_{d+1} = simplification_d / level_factor`; a node at level `d` has its piece's
//! triangles divided by `simplification_d`. The first level whose factor is at most 1 holds the
//! original pieces: the leaves. Work is parallel over children and, where a node is simplified
//! from the original, between its simplification and its division (Cozzi & Loo, section 5.3).

use rayon::prelude::*;

use super::border::{Border, Path};
use super::border_run::{BorderRun, join_runs, original_runs};
use super::chain::KeepRule;
use super::compact::compact;
use super::cut::{Cut, CutTolerance, Piece, cut};
use super::cut_axis::axis_to_cut;
use super::distance::hausdorff_with;
use super::lattice::Lattice;
use super::lid::close_sections;
use super::merge::merge;
use super::quantize::Quantization;
use super::remnant::remnant;
use super::seamless::without_seams;
use super::simplify::{AppearanceWeights, LadderStep, Method, Simplified, Simplifier, simplify};
use super::skirt::{Skirt, skirts, triangles_of};
use super::stages::{Stage, Stages};
use super::thin_border::thin_border;
use super::whole::WholeBodies;
use crate::Result;
use crate::mesh::{Mesh, UpAxis, all_differ};
use crate::texture::{BakePlan, BakeReason, Seams};

/// What a coarse node is simplified from.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum SimplifyFrom {
    /// The original triangles of its piece, as the thesis does it.
    Original,
    /// Its children's results: every triangle is touched about once, not once a level.
    #[default]
    Children,
}

/// What happens to vertices on cutting planes.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum BorderMode {
    /// None is ever removed: no gaps, and a large part of every coarse node's budget.
    Locked,
    /// Thinned alike on both sides; gaps between different levels stay open.
    Shared,
    /// Thinned alike on both sides, and the gaps between different levels closed by skirts.
    #[default]
    Skirts,
}

/// Where simplification leaves nothing, so many of the largest triangles stay: a piece must not
/// vanish.
const REMNANT_TRIANGLES: usize = 8;

/// A node's budget is at least this share of `desired_tris`, where its piece has so many. Pieces
/// with few triangles are walls and roofs that stand alone, and large: dividing their number by
/// that of a level saves next to nothing and takes whole sides off them. Measured against half of
/// this: 0.1 to 0.4 % more triangles on level 1 of cities; 2 % on `torcs_street1`, at a fifth of the
/// RMS distance.
const LEAST_BUDGET: f64 = 1.0 / 4.0;

/// A node keeps at most one border vertex on a plane for this many triangles of its budget: each
/// costs about a triangle of the mesh and two of a skirt, and a node has two planes. Measured: with
/// half of this scans gain border and lose more on the surface; with twice, borders are coarser
/// than the surface (`docs/choices.md`).
const BUDGET_PER_BORDER_VERTEX: f64 = 24.0;

/// How much more thoroughly errors are measured where positions are in steps. Measured: with 1 one
/// of ten thousand nodes of real cities had an error that was much too small.
const QUANTIZED_EFFORT: usize = 4;

/// How one block is built.
#[derive(Clone, Debug)]
pub struct HierarchyOptions {
    /// Desired triangles of a node (`c_desiredTris`), at least 1.
    pub desired_tris: u32,
    /// Ratio of triangles and texels between levels (`c_levelFactor`), at least 2.
    pub level_factor: u32,
    /// See [`SimplifyFrom`].
    pub simplify_from: SimplifyFrom,
    /// See [`Simplifier`].
    pub simplifier: Simplifier,
    /// See [`BorderMode`].
    pub borders: BorderMode,
    /// See [`AppearanceWeights`].
    pub weights: AppearanceWeights,
    /// See [`Seams`].
    pub seams: Seams,
    /// See [`CutTolerance`].
    pub tolerance: CutTolerance,
}

impl Default for HierarchyOptions {
    fn default() -> Self {
        Self {
            desired_tris: 900,
            level_factor: 4,
            simplify_from: SimplifyFrom::default(),
            simplifier: Simplifier::default(),
            borders: BorderMode::default(),
            weights: AppearanceWeights::default(),
            seams: Seams::default(),
            tolerance: CutTolerance::default(),
        }
    }
}

/// The simplification factors of a block's levels, coarsest first; the last is the leaves' and
/// is 1.
pub fn simplifications(triangles: usize, options: &HierarchyOptions) -> Vec<f64> {
    let mut factors = Vec::new();
    let mut factor = triangles as f64 / f64::from(options.desired_tris);
    while factor > 1.0 {
        factors.push(factor);
        factor /= f64::from(options.level_factor);
    }
    factors.push(1.0);
    factors
}

/// A finished node, on its way to disk.
#[derive(Debug)]
pub struct NodeDraft<'a> {
    /// Geometry with source texture coordinates, without skirts.
    pub mesh: &'a Mesh,
    /// What closes its borders.
    pub skirts: &'a [Skirt],
    /// 0 is the block's root.
    pub level: usize,
    /// Child numbers from the root down; empty for the root.
    pub place: &'a [u32],
    /// The triangles that it may have.
    pub budget: usize,
    /// Distance from the original, metres; 0 for leaves, where they are not quantised.
    pub geometric_error: f64,
    /// How it was made.
    pub step: LadderStep,
    /// Why it needs a texture of its own, where it does.
    pub baked: Option<BakeReason>,
    /// Border vertices that were locked.
    pub locked: usize,
}

/// Takes finished nodes, from many threads at once.
pub trait NodeSink: Sync {
    /// What is kept of a node once it is written.
    type Record: Send;

    /// Writes a node.
    fn take(&self, node: &NodeDraft) -> Result<Self::Record>;

    /// Called when pieces holding this many source triangles have become leaves.
    fn leaves_done(&self, _triangles: usize) {}
}

/// A node's record and its children.
#[derive(Debug)]
pub struct Tree<R> {
    /// Of the node itself.
    pub record: R,
    /// In the order of their place along the cut axis.
    pub children: Vec<Tree<R>>,
}

/// One block being built.
pub struct BlockBuilder<'a, S> {
    /// How.
    pub options: &'a HierarchyOptions,
    /// From [`simplifications`].
    pub factors: Vec<f64>,
    /// The seams that coarse nodes may ignore, where there are some in the way.
    pub bake: Option<BakePlan<'a>>,
    /// The block's lattice.
    pub lattice: Lattice,
    /// Where all vertices are rounded to a lattice that shows.
    pub quantization: Option<Quantization>,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// Of each material, whether its faces may turn ([`super::windings`]).
    pub turnable: &'a [bool],
    /// Where nodes go.
    pub sink: &'a S,
    /// Where the time goes.
    pub stages: &'a Stages,
}

/// The box of a piece without what small bodies reach beyond the planes that it was cut at
/// ([`super::whole`]): slabs stay as even as their planes are.
fn bounds_within_cuts(piece: &Piece) -> Option<([f32; 3], [f32; 3])> {
    let (mut low, mut high) = piece.mesh.bounds()?;
    for bit in 0..piece.path.len() as u32 {
        let plane = piece.path.plane(bit);
        let (axis, at) = (plane.axis, plane.coordinate);
        let (below, above) = (at - low[axis], high[axis] - at);
        if below > 0.0 && above > 0.0 {
            if below < above {
                low[axis] = at;
            } else {
                high[axis] = at;
            }
        }
    }
    Some((low, high))
}

/// A node's geometry as its parent needs it.
struct Carried {
    mesh: Mesh,
    border: Border,
    /// The pieces of its border, if skirts are to cover them.
    runs: Vec<BorderRun>,
    error: f64,
    /// A texture of its own stands for its texture coordinates.
    baked: bool,
}

impl<S: NodeSink> BlockBuilder<'_, S> {
    /// Builds the whole tree over a block.
    pub fn build(&self, block: Piece) -> Result<Tree<S::Record>> {
        Ok(self.subtree(block, 0, &[])?.0)
    }

    fn leaf_level(&self) -> usize {
        self.factors.len() - 1
    }

    /// How far rounding has moved a piece off the source, metres at most, where that shows.
    fn moved(&self, piece: &Piece) -> f64 {
        self.quantization.map_or(0.0, |lattice| lattice.bound() + piece.most_moved())
    }

    fn subtree(
        &self,
        piece: Piece,
        level: usize,
        place: &[u32],
    ) -> Result<(Tree<S::Record>, Option<Carried>)> {
        let moved = self.moved(&piece);
        if level == self.leaf_level() {
            let triangles = piece.mesh.triangles.len();
            let record = self.sink.take(&NodeDraft {
                mesh: &piece.mesh,
                skirts: &[],
                level,
                place,
                budget: triangles,
                geometric_error: moved,
                step: LadderStep::Original,
                baked: None,
                locked: 0,
            })?;
            self.sink.leaves_done(triangles);
            return Ok((Tree { record, children: Vec::new() }, None));
        }
        let triangles = piece.mesh.triangles.len();
        let least = (f64::from(self.options.desired_tris) * LEAST_BUDGET).ceil() as usize;
        let budget =
            ((triangles as f64 / self.factors[level]).round() as usize).max(least.min(triangles));
        let path = piece.path.clone();
        let from_original =
            self.options.simplify_from == SimplifyFrom::Original || level + 1 == self.leaf_level();
        let (carried, record, children) = if from_original {
            let (mesh, border) = (piece.mesh.clone(), piece.border.clone());
            let simplify = || {
                let runs = match self.options.borders {
                    BorderMode::Skirts => original_runs(&mesh, &border, &path),
                    BorderMode::Locked | BorderMode::Shared => Vec::new(),
                };
                let source = Carried { mesh, border, runs, error: moved, baked: false };
                self.coarse_node(source, &path, level, place, budget)
            };
            let (node, children) = rayon::join(simplify, || self.children(piece, level, place));
            let ((record, carried), children) = (node?, children?);
            (carried, record, children.into_iter().map(|(tree, _)| tree).collect())
        } else {
            let children = self.children(piece, level, place)?;
            let (trees, parts): (Vec<_>, Vec<_>) = children.into_iter().unzip();
            let parts: Vec<Carried> = parts.into_iter().flatten().collect();
            let pairs: Vec<(&Mesh, &Border)> =
                parts.iter().map(|part| (&part.mesh, &part.border)).collect();
            let (mesh, border) = merge(&pairs, path.len());
            let error = parts.iter().map(|part| part.error).fold(0.0, f64::max);
            let baked = parts.iter().any(|part| part.baked);
            let runs = parts.into_iter().flat_map(|part| part.runs).collect();
            let source = Carried { mesh, border, runs, error, baked };
            let (record, carried) = self.coarse_node(source, &path, level, place, budget)?;
            (carried, record, trees)
        };
        Ok((Tree { record, children }, Some(carried)))
    }

    /// Divides a piece and builds what comes of it.
    fn children(
        &self,
        piece: Piece,
        level: usize,
        place: &[u32],
    ) -> Result<Vec<(Tree<S::Record>, Option<Carried>)>> {
        let large = piece.mesh.triangles.len() > 4 * self.options.desired_tris as usize;
        let pieces = self.stages.time(Stage::Cut, || self.divide(piece, level));
        let build = |(number, piece): (usize, Piece)| {
            let mut child_place = place.to_vec();
            child_place.push(number as u32);
            self.subtree(piece, level + 1, &child_place)
        };
        if large {
            pieces.into_par_iter().enumerate().map(build).collect()
        } else {
            pieces.into_iter().enumerate().map(build).collect()
        }
    }

    /// Cuts a piece by `level_factor - 1` planes at even distances ([`super::cut_axis`]); pieces
    /// without triangles are left out.
    pub fn divide(&self, piece: Piece, level: usize) -> Vec<Piece> {
        let Some((low, high)) = bounds_within_cuts(&piece) else { return vec![piece] };
        let slabs = self.options.level_factor;
        let planes = |axis: usize| -> Vec<f32> {
            let (low, high) = (f64::from(low[axis]), f64::from(high[axis]));
            let at = |i| low + (high - low) * (f64::from(i) / f64::from(slabs));
            let even = (1..slabs).map(|i| self.lattice.round(at(i)) as f32);
            even.map(|even| self.through_vertices(&piece.mesh, axis, even)).collect()
        };
        let slack = self.options.tolerance.sliver_steps * self.lattice.step;
        let Some(axis) = axis_to_cut(&piece.mesh, planes, slack) else { return vec![piece] };
        let planes = planes(axis);
        let shares: Vec<f64> = self.factors[level + 1..]
            .iter()
            .map(|factor| match self.options.borders {
                BorderMode::Locked => 1.0,
                BorderMode::Shared | BorderMode::Skirts => 1.0 / factor.sqrt(),
            })
            .collect();
        let locked = self.options.borders == BorderMode::Locked;
        // The deeper the level, the more nodes share the plane: as many as fit along its length.
        let across = f64::from(self.options.level_factor).sqrt();
        let most = (0..shares.len() - 1)
            .map(|deeper| {
                let each = f64::from(self.options.desired_tris) / BUDGET_PER_BORDER_VERTEX;
                if locked { f64::INFINITY } else { (each * across.powi(deeper as i32)).ceil() }
            })
            .collect();
        let rule = KeepRule {
            shares,
            most,
            first_level: level as u8 + 1,
            collinear: if locked { -1.0 } else { self.lattice.step },
        };
        let mut pieces = Vec::with_capacity(slabs as usize);
        let slab = (f64::from(high[axis]) - f64::from(low[axis])) / f64::from(slabs);
        let whole = WholeBodies::in_slabs(slab, self.options.desired_tris as usize / 2);
        self.bisect(piece, axis, &planes, whole, &rule, &mut pieces);
        pieces
    }

    /// The coordinate of a plane, moved to that of the most vertices that are so near it that they
    /// count as on it ([`CutTolerance::sliver_steps`]), of several the nearest. Vertices beside
    /// their plane stay at every level; rows of a grid are often beside it by a step.
    fn through_vertices(&self, mesh: &Mesh, axis: usize, even: f32) -> f32 {
        let step = self.lattice.step as f32;
        let most = self.options.tolerance.sliver_steps as i32;
        let reach = most as f32 * step;
        let mut counts = vec![0u32; 2 * most as usize + 1];
        for position in &mesh.positions {
            // Multiples of the step, all of them: differences and quotients are exact.
            let beside = position[axis] - even;
            if beside.abs() <= reach {
                counts[((beside / step) as i32 + most) as usize] += 1;
            }
        }
        let best = (-most..=most).max_by_key(|&at| (counts[(at + most) as usize], -at.abs(), at));
        even + best.unwrap_or(0) as f32 * step
    }

    /// Cuts at the middle plane, then each half at its own.
    fn bisect(
        &self,
        piece: Piece,
        axis: usize,
        planes: &[f32],
        whole: WholeBodies,
        rule: &KeepRule,
        pieces: &mut Vec<Piece>,
    ) {
        if piece.mesh.triangles.is_empty() {
            return;
        }
        if planes.is_empty() {
            pieces.push(piece);
            return;
        }
        let middle = planes.len() / 2;
        let (below, above) = cut(
            piece,
            &Cut {
                axis,
                coordinate: planes[middle],
                lattice: Some(self.lattice),
                tolerance: self.options.tolerance,
                whole,
                rule,
            },
        );
        self.bisect(below, axis, &planes[..middle], whole, rule, pieces);
        self.bisect(above, axis, &planes[middle + 1..], whole, rule, pieces);
    }

    /// Simplifies and writes a node that is not a leaf.
    fn coarse_node(
        &self,
        source: Carried,
        path: &Path,
        level: usize,
        place: &[u32],
        budget: usize,
    ) -> Result<(S::Record, Carried)> {
        let Carried { mesh: mut source_mesh, mut border, runs, error: error_below, baked } = source;
        let simplified = |mesh: &Mesh, border: Border, runs, keep_folds| {
            self.stages.time(Stage::Simplify, || {
                self.simplified(mesh, border, runs, path, level, budget, keep_folds)
            })
        };
        // Why it is baked, and where that is not known yet, what there is with its seams.
        let (mut reason, mut kept) = (None, None);
        if let Some(plan) = self.bake {
            reason = plan.always.or(baked.then_some(BakeReason::Below));
            if reason.is_none() {
                let coarse = simplified(&source_mesh, border.clone(), runs.clone(), false);
                if coarse.0.step == LadderStep::Collapse {
                    kept = Some(coarse);
                } else {
                    reason = Some(BakeReason::Seams);
                }
            }
            if reason.is_some() {
                (source_mesh, border) = self
                    .stages
                    .time(Stage::Simplify, || without_seams(&source_mesh, &border, plan.classes));
            }
        }
        let coarse = match kept {
            Some(kept) => kept,
            None => simplified(&source_mesh, border, runs, reason.is_some()),
        };
        let (simplified, runs, skirts) = coarse;
        let Simplified { mesh, border, step, .. } = simplified;
        // On a coarse lattice hardly any triangle comes back exactly.
        let effort = if self.quantization.is_some() { QUANTIZED_EFFORT } else { 1 };
        let error =
            self.stages.time(Stage::Measure, || hausdorff_with(&source_mesh, &mesh, effort));
        let total_error = error_below + error;
        let record = self.sink.take(&NodeDraft {
            mesh: &mesh,
            skirts: &skirts,
            level,
            place,
            budget,
            geometric_error: total_error,
            step,
            baked: reason,
            locked: border.planes.iter().filter(|&&planes| planes & path.bits() != 0).count(),
        })?;
        Ok((record, Carried { mesh, border, runs, error: total_error, baked: reason.is_some() }))
    }

    /// A simplified mesh with all its vertices on the lattice. Those on borders are there already;
    /// triangles of which two corners meet are left out.
    fn snapped(&self, simplified: Simplified) -> Simplified {
        let Simplified { mut mesh, border, error, step } = simplified;
        mesh.positions.iter_mut().for_each(|position| *position = self.lattice.nearest(*position));
        let Mesh { positions, triangles, .. } = &mut mesh;
        triangles.retain(|corners| all_differ(corners.map(|vertex| positions[vertex as usize])));
        let (mesh, border) = compact(&mesh, &border);
        Simplified { mesh, border, error, step }
    }

    /// The geometry of a node that is not a leaf, what is left of its border's pieces, and its
    /// skirts.
    fn simplified(
        &self,
        source: &Mesh,
        mut border: Border,
        runs: Vec<BorderRun>,
        path: &Path,
        level: usize,
        budget: usize,
        keep_folds: bool,
    ) -> (Simplified, Vec<BorderRun>, Vec<Skirt>) {
        // Skirts have a margin of two steps; one is enough where corners are rounded to the nearest.
        let skirt_step = self.lattice.step * if self.quantization.is_some() { 0.5 } else { 1.0 };
        let at = level as u8;
        let mut mesh = source.clone();
        thin_border(&mut mesh, &mut border, path, at);
        // Skirts count towards the budget, but may not take more than half of it.
        let runs = join_runs(runs, path, at, &mesh, &border);
        let skirt_triangles = triangles_of(&skirts(&mesh, &border, &runs, path, skirt_step));
        let target = budget.saturating_sub(skirt_triangles).max(budget / 2).max(1);
        let HierarchyOptions { simplifier, weights, .. } = *self.options;
        let weights = AppearanceWeights { keep_folds, ..weights };
        let method = Method { simplifier, weights, up: self.up, turnable: self.turnable };
        let mut result = simplify(&mesh, &border, path, at, target, &method);
        if self.quantization.is_some() {
            result = self.snapped(result);
        }
        if result.mesh.triangles.is_empty() {
            result = remnant(source, &border, REMNANT_TRIANGLES.min(target));
        }
        close_sections(&mut result, &runs, path, &mesh, &border);
        let mut skirts = skirts(&result.mesh, &result.border, &runs, path, skirt_step);
        if self.quantization.is_some() {
            for (position, _) in skirts.iter_mut().flat_map(|skirt| &mut skirt.corners) {
                *position = self.lattice.nearest(*position);
            }
        }
        (result, runs, skirts)
    }
}
