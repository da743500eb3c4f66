//! Making a coarse node: simplification, border, distance from the original.

use std::sync::Arc;

use glam::DVec3;

use super::BlockBuilder;
use super::node::{Forest, NodeDraft, NodeSink, Tree};
use super::outline::{SkippedNode, SourceOutline, more_triangles};
use super::surfaces::{Materials, NodeSurfaces};
use crate::Result;
use crate::builder::border::skirt::{Skirt, skirts, triangles_of};
use crate::builder::border::skirt_rules::SkirtRules;
use crate::builder::border::span::{BorderSpan, join_spans};
use crate::builder::border::thin::thin_border;
use crate::builder::border::vertex::{Border, Path};
use crate::builder::error::{Below, SearchableSurface, measure};
use crate::builder::simplify::cap::cap_sections;
use crate::builder::simplify::compact::compact;
use crate::builder::simplify::face_colors::with_face_colors;
use crate::builder::simplify::fallback::fallback_triangles;
use crate::builder::simplify::ladder::{AppearanceWeights, BodyPlacement, Method};
use crate::builder::simplify::normal_sets::{NormalSets, weld_normals};
use crate::builder::simplify::simplified::{LadderStep, Simplified};
use crate::builder::simplify::weld_seams::weld_seams;
use crate::builder::stages::Stage;
use crate::mesh::{Mesh, OutlineCoverage, all_differ};
use crate::texture::BakeReason;

/// Where simplification leaves nothing, so many of the largest triangles stay: a chunk must not
/// vanish.
const FALLBACK_TRIANGLES: usize = 8;

/// A node's geometry as its parent needs it.
pub(super) struct NodeSurface {
    pub mesh: Mesh,
    pub border: Border,
    /// The spans of its border, if skirts are to cover them.
    pub spans: Vec<BorderSpan>,
    /// The surface whose outline and colours it keeps.
    pub original: Arc<SearchableSurface>,
    /// The surface that the parent is measured against.
    pub below: Below,
    /// A texture of its own stands for its texture coordinates.
    pub baked: bool,
}

/// Which node is to be made.
#[derive(Clone, Copy)]
pub(super) struct CoarseNode<'a> {
    pub path: &'a Path,
    pub resolution: usize,
    pub child_path: &'a [u32],
    pub budget: usize,
}

/// What a node has come to.
struct Attempt {
    coarse: Coarse,
    /// Why it needs a texture of its own, where it does.
    reason: Option<BakeReason>,
    /// Of the source's outline.
    kept: OutlineCoverage,
    /// What it would keep within its budget, where it was given more.
    within_budget: Option<OutlineCoverage>,
}

/// A simplified mesh with its border.
struct Coarse {
    simplified: Simplified,
    spans: Vec<BorderSpan>,
    skirts: Vec<Skirt>,
}

/// Simplifies a node.
struct NodeLadder<'a> {
    /// The normals of each corner are welded.
    source: Mesh,
    /// The source with its border thinned.
    mesh: Mesh,
    border: Border,
    normal_sets: Option<NormalSets>,
    spans: Vec<BorderSpan>,
    /// Number of skirt triangles that the thinned border needs.
    skirt_triangles: usize,
    rules: SkirtRules,
    surfaces: NodeSurfaces<'a>,
}

/// How a coarse node ends.
pub(super) enum Outcome<R> {
    Written(R),
    Skipped(SkippedNode),
}

impl<R> Outcome<R> {
    /// The node, if it is written, above what became of its children.
    pub fn above(self, below: impl IntoIterator<Item = Forest<R>>) -> Forest<R> {
        let mut forest = Forest { trees: Vec::new(), left_out: Vec::new() };
        for Forest { trees, left_out } in below {
            forest.trees.extend(trees);
            forest.left_out.extend(left_out);
        }
        match self {
            Self::Written(record) => {
                forest.trees = vec![Tree { record, children: forest.trees }];
            }
            Self::Skipped(node) => forest.left_out.push(node),
        }
        forest
    }
}

/// A skirt lies in a cutting plane where the cosine of the angle between its normal and the plane's axis is
/// at least the first, and its corners are no farther from the plane than the second times its longest edge.
const IN_PLANE: (f64, f64) = (0.99, 0.01);

/// The skirt triangles that lie in no cutting plane: from a border vertex beside the plane to the
/// plane. They are seen as surface, so they must be near the source; but they stand for none of it.
fn skirts_beside(mesh: &Mesh, skirts: &[Skirt], path: &Path) -> Mesh {
    let mut positions: Vec<[f32; 3]> = Vec::new();
    for Skirt { edge, corners, triangles } in skirts {
        let position = |corner: u8| match usize::from(corner) {
            end @ (0 | 1) => mesh.positions[edge[end] as usize],
            corner => corners[corner - 2].0,
        };
        let all = triangles.iter().map(|triangle| triangle.map(position));
        positions.extend(all.filter(|&corners| !lies_in_plane(corners, path)).flatten());
    }
    let triangles = (0..positions.len() as u32 / 3).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]);
    Mesh { triangles: triangles.collect(), positions, ..Mesh::default() }
}

/// Walls may be parallel to an axis, too: a skirt that lies in one is surface.
fn lies_in_plane(corners: [[f32; 3]; 3], path: &Path) -> bool {
    let corners = corners.map(|corner| DVec3::from(corner.map(f64::from)));
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let (cosine, share) = IN_PLANE;
    (0..path.len() as u32).any(|bit| {
        let plane = path.plane(bit);
        let beside = |corner: DVec3| (corner[plane.axis] - f64::from(plane.coordinate)).abs();
        normal[plane.axis].abs() >= cosine * normal.length()
            && corners.into_iter().all(|corner| beside(corner) <= share * longest)
    })
}

/// Bodies that stand apart become fewer and larger boxes where the node would not be written otherwise, and
/// what is drawn in its place has more than this many times its triangles. Where one level alone is not written,
/// it has four times as many, which is better than boxes in other places.
const HEAVY: usize = 8;

impl<S: NodeSink> BlockBuilder<'_, S> {
    /// Simplifies and writes a node that is not a leaf, or leaves it out.
    pub(super) fn coarse_node(
        &self,
        source: NodeSurface,
        node: CoarseNode,
    ) -> Result<(Outcome<S::Record>, NodeSurface)> {
        let Attempt { coarse, reason, kept, within_budget } = self.attempt(&source, &node);
        let NodeSurface { original, below, .. } = source;
        let Coarse { simplified: Simplified { mesh, border, step, .. }, spans, skirts } = coarse;
        let (outcome, below) = if !self.keeps_enough(&kept, step) {
            let triangles = (mesh.triangles.len() + triangles_of(&skirts)) as u64;
            let child_path = node.child_path.to_vec();
            // Nobody draws it: what is above need not be farther off than what is below.
            (Outcome::Skipped(SkippedNode { child_path, triangles, kept }), below)
        } else {
            let constants = self.options.constants.measure;
            let (surface, error) = self.stages.time(Stage::Measure, || {
                let surface = SearchableSurface::of(&mesh, constants);
                let beside =
                    SearchableSurface::of(&skirts_beside(&mesh, &skirts, node.path), constants);
                let error = measure(&below, &surface, &beside).error;
                (surface, error)
            });
            let on_border = |&&planes: &&u64| planes & node.path.bits() != 0;
            // Of what is written alone: parents take their colours from the original, too.
            // A baked texture has its colours.
            let face_colors = || with_face_colors(&mesh, &skirts, &original);
            let painted = match reason {
                None => self.stages.time(Stage::Simplify, face_colors),
                Some(_) => None,
            };
            let (drawn, skirts) = match &painted {
                Some((painted, skirts)) => (painted, skirts),
                None => (&mesh, &skirts),
            };
            let record = self.sink.take(&NodeDraft {
                mesh: drawn,
                skirts,
                resolution: node.resolution,
                child_path: node.child_path,
                budget: node.budget,
                within_budget,
                error: error.plus(&below.off),
                step,
                baked: reason,
                locked: border.planes.iter().filter(on_border).count(),
            })?;
            (Outcome::Written(record), below.above(surface, error.bound))
        };
        let baked = reason.is_some();
        Ok((outcome, NodeSurface { mesh, border, spans, original, below, baked }))
    }

    /// Simplifies a node, and again with more and more triangles where it keeps too little of the
    /// source's outline.
    fn attempt(&self, source: &NodeSurface, node: &CoarseNode) -> Attempt {
        let constants = &self.options.constants.outline;
        let outline = self
            .stages
            .time(Stage::Measure, || SourceOutline::of(&source.original, self.up, constants));
        let kept_by = |coarse: &Coarse| {
            let mesh = &coarse.simplified.mesh;
            let kept =
                || outline.as_ref().map_or_else(OutlineCoverage::default, |o| o.kept_by(mesh));
            self.stages.time(Stage::Measure, kept)
        };
        let simplified = |ladder: &NodeLadder, budget: usize, bodies: BodyPlacement| {
            self.stages.time(Stage::Simplify, || self.simplified(ladder, node, budget, bodies))
        };
        let (ladder, first, reason) =
            self.stages.time(Stage::Simplify, || self.ladder(source, node));
        let mut coarse =
            first.unwrap_or_else(|| simplified(&ladder, node.budget, BodyPlacement::InPlace));
        let mut kept = kept_by(&coarse);
        let mut within_budget = None;
        let mut budget = node.budget as f64;
        let most = budget * self.resolutions.step(node.resolution) * constants.most_triangles;
        while kept.least() < constants.least_kept && budget < most {
            budget = most.min(budget * more_triangles(kept.least(), constants));
            within_budget = within_budget.or(Some(kept));
            coarse = simplified(&ladder, budget as usize, BodyPlacement::InPlace);
            kept = kept_by(&coarse);
        }
        let is_heavy = source.below.triangles() > HEAVY * node.budget;
        if kept.least() < constants.least_kept && is_heavy {
            let spread = simplified(&ladder, node.budget, BodyPlacement::Spread);
            let kept_spread = kept_by(&spread);
            if self.keeps_enough(&kept_spread, spread.simplified.step) {
                (coarse, kept) = (spread, kept_spread);
            }
        }
        Attempt { coarse, reason, kept, within_budget }
    }

    /// Tells whether a node keeps enough of the outline of its source to be drawn in its place. Boxes that stand
    /// for bodies nearby cover as much ground, if not the same.
    fn keeps_enough(&self, kept: &OutlineCoverage, step: LadderStep) -> bool {
        let kept = if step == LadderStep::Boxes { kept.covered() } else { kept.least() };
        kept >= self.options.constants.outline.least_kept
    }

    /// Prepares the simplification of a node. If it reaches the budget within texture seams, that result is
    /// returned, too. Otherwise seams are ignored, and the node needs a texture of its own: the reason is
    /// returned.
    fn ladder(
        &self,
        source: &NodeSurface,
        node: &CoarseNode,
    ) -> (NodeLadder<'_>, Option<Coarse>, Option<BakeReason>) {
        let NodeSurface { mesh, border, spans, .. } = source;
        let ladder = |mesh: &Mesh, border: Border, is_baked: bool| {
            self.node_ladder(mesh, border, spans.clone(), node, is_baked)
        };
        let Some(plan) = self.bake else {
            return (ladder(mesh, border.clone(), false), None, None);
        };
        let mut reason = plan.always.or(source.baked.then_some(BakeReason::Below));
        if reason.is_none() {
            let within_seams = ladder(mesh, border.clone(), false);
            let coarse = self.simplified(&within_seams, node, node.budget, BodyPlacement::InPlace);
            let Simplified { mesh, step, .. } = &coarse.simplified;
            let keeps_seams = matches!(step, LadderStep::Collapse | LadderStep::Cards);
            reason = plan.reason(mesh, keeps_seams);
            if reason.is_none() {
                return (within_seams, Some(coarse), None);
            }
        }
        let (mesh, border) = weld_seams(mesh, border, plan.classes);
        (ladder(&mesh, border, true), None, reason)
    }

    fn node_ladder(
        &self,
        source: &Mesh,
        mut border: Border,
        spans: Vec<BorderSpan>,
        node: &CoarseNode,
        is_baked: bool,
    ) -> NodeLadder<'_> {
        let &CoarseNode { path, resolution, .. } = node;
        let constants = &self.options.constants;
        let rules = SkirtRules::of(&self.lattice, self.quantization.is_some(), constants.border);
        let at = resolution as u8;
        let (source, normal_sets) = match weld_normals(source, &border) {
            Some((mesh, of_mesh, sets)) => {
                border = of_mesh;
                (mesh, Some(sets))
            }
            None => (source.clone(), None),
        };
        let mut mesh = source.clone();
        thin_border(&mut mesh, &mut border, path, at);
        let spans = join_spans(spans, path, at, &mesh, &border);
        let skirt_triangles = triangles_of(&skirts(&mesh, &border, &spans, path, &rules));
        let method = Method {
            simplifier: self.options.simplifier,
            weights: AppearanceWeights { keep_folds: is_baked, ..self.options.weights },
            up: self.up,
            reorientable: self.reorientable,
            extrudable: self.extrudable.materials(is_baked),
            without: self.options.without,
            constants,
        };
        let materials = Materials { alpha: self.alpha, repeats: &self.repeats };
        let surfaces = NodeSurfaces::new(&mesh, &border, path, at, method, materials);
        NodeLadder { source, mesh, border, normal_sets, spans, skirt_triangles, rules, surfaces }
    }

    /// The surfaces' result for a budget, with its sections capped and its skirts.
    fn simplified(
        &self,
        with: &NodeLadder,
        node: &CoarseNode,
        budget: usize,
        bodies: BodyPlacement,
    ) -> Coarse {
        let NodeLadder { source, mesh, border, normal_sets, spans, rules, surfaces, .. } = with;
        let path = node.path;
        // Skirts count towards the budget, but may not take more than half of it.
        let target = budget.saturating_sub(with.skirt_triangles).max(budget / 2).max(1);
        let fallback = || fallback_triangles(source, border, FALLBACK_TRIANGLES.min(target));
        let mut result = surfaces.simplified(target, bodies).unwrap_or_else(fallback);
        if self.quantization.is_some() {
            result = self.snapped(result);
        }
        if result.mesh.triangles.is_empty() {
            result = fallback();
        }
        cap_sections(&mut result, spans, path, mesh, border);
        if let Some(sets) = normal_sets {
            sets.resolve(&mut result.mesh, &mut result.border);
        }
        let mut skirts = skirts(&result.mesh, &result.border, spans, path, rules);
        if self.quantization.is_some() {
            for (position, _) in skirts.iter_mut().flat_map(|skirt| &mut skirt.corners) {
                *position = self.lattice.nearest(*position);
            }
        }
        Coarse { simplified: result, spans: spans.clone(), skirts }
    }

    /// A simplified mesh with all its vertices on the lattice. Those on borders are there already;
    /// triangles of which two corners meet are left out.
    fn snapped(&self, simplified: Simplified) -> Simplified {
        let Simplified { mut mesh, border, error, step } = simplified;
        mesh.positions.iter_mut().for_each(|position| *position = self.lattice.nearest(*position));
        let positions = &mesh.positions;
        mesh.triangles.retain(|t| all_differ(t.map(|vertex| positions[vertex as usize])));
        let (mesh, border) = compact(&mesh, &border);
        Simplified { mesh, border, error, step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::border::chain::{CutPlane, KeepRule};

    #[test]
    fn skirts_in_a_cutting_plane_are_not_measured_and_others_are() {
        let mesh = Mesh {
            positions: vec![[4.0, 0.0, 0.0], [4.0, 9.0, 0.0], [0.0, 0.0, 0.0]],
            materials: vec![0; 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let rule = KeepRule {
            shares: vec![1.0],
            most: Vec::new(),
            first_level: 0,
            collinear: -1.0,
            baked: None,
            constants: Default::default(),
        };
        let at = |x: f32| Path::default().with(Arc::new(CutPlane::new(0, x, &[], &[], &rule)));
        let skirt = |x: f32| Skirt {
            edge: [0, 1],
            corners: vec![([x, 9.0, -0.5], 0)],
            triangles: vec![[0, 1, 2]],
        };
        let measured = |x: f32, path: &Path| skirts_beside(&mesh, &[skirt(x)], path);
        assert_eq!(measured(4.0, &at(4.0)), Mesh::default());
        assert_eq!(measured(3.0, &at(4.0)).triangles.len(), 1, "it leans away from the plane");
        assert_eq!(measured(4.0, &at(5.0)).triangles.len(), 1, "it lies in a wall");
    }
}
