//! The boundary at which ways of choosing levels of detail differ.

use super::{CostModel, CoveredParts, HiddenNodes, Residents, SeenAreas, Visibility};
use crate::camera::View;
use crate::runtime::SceneTree;
use crate::runtime::residency::MemoryUse;

/// What a policy sees of a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameInput<'a> {
    /// The hierarchy, with its errors.
    pub tree: &'a SceneTree,
    /// The camera.
    pub view: &'a View,
    /// What was found so far of what it has in view: asked for by [`is_visible`](Self::is_visible).
    pub visibility: &'a Visibility,
    /// What was found so far of how much of the picture is under boxes: asked for by
    /// [`covered`](Self::covered).
    pub covered: &'a CoveredParts,
    /// How much of nodes is seen past what is before them, for policies that
    /// [ask for it](Policy::wants_seen_areas).
    pub seen: Option<&'a SeenAreas>,
    /// Which nodes are hidden by what was drawn in the frame before, where that is looked for: asked for
    /// by [`is_hidden`](Self::is_hidden).
    pub hidden: Option<&'a HiddenNodes>,
    /// Where the camera is expected to be soon, if it goes on as it does; nearest in time first.
    pub predicted: &'a [PredictedView],
    /// Which nodes can be drawn now, and which are on their way.
    pub residents: &'a Residents,
    /// The memory cap, and what is in use.
    pub memory: MemoryUse,
    /// What frames take, as learned from those drawn so far; the same as in the frame before while only
    /// noise has changed it.
    pub costs: &'a CostModel,
    /// Milliseconds that the frame may take.
    pub target_ms: f64,
    /// Milliseconds that drawing it may take by the cost model's prices
    /// ([`CostModel::priced_ms`]), so that 84 of 100 frames keep to the target and 98 are
    /// late by less than a tenth of it: less than it as far as frames of late took longer.
    pub budget_ms: f64,
    /// Seconds since the frame before began; 0 in the first.
    pub dt_s: f64,
}

/// A view that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictedView {
    /// Seconds from now.
    pub after_s: f64,
    /// The camera.
    pub view: View,
}

impl FrameInput<'_> {
    /// Whether a node may be in view, as far as its box tells.
    pub fn is_visible(&self, node: u32) -> bool {
        let find = || self.view.frustum.outside(self.tree.node(node).bbox) <= 0.0;
        self.visibility.get_or(node, find)
    }

    /// The part of the picture, 0 to 1, under the box of a node.
    pub fn covered(&self, node: u32) -> f64 {
        self.covered.of(self.tree, node, self.view)
    }

    /// Whether a node takes no time, since nothing of it would be seen, nor has been for a while: what
    /// was drawn in the frame before hides it. It is in the front all the same.
    pub fn is_hidden(&self, node: u32) -> bool {
        self.hidden.is_some_and(|hidden| hidden.hides_steadily(self.tree, node))
    }

    /// How many of the children of a node are in view and not in memory.
    pub fn missing_children(&self, node: u32) -> u32 {
        let children = self.tree.children(node).iter();
        let is_missing = |&&child: &&u32| !self.residents.contains(child) && self.is_visible(child);
        children.filter(is_missing).count() as u32
    }

    /// Whether the children of a node can be drawn in its place: it has some, and all of them that
    /// are in view are resident.
    pub fn can_refine(&self, node: u32) -> bool {
        let children = self.tree.children(node);
        let drawable = |&child: &u32| self.residents.contains(child) || !self.is_visible(child);
        !children.is_empty() && children.iter().all(drawable)
    }
}

/// Chooses what each frame draws, and says how useful it is that nodes be in memory.
///
/// A policy sees the hierarchy, the camera, what is in memory and how long frames take. It reads
/// no files, starts no threads and knows no graphics card, so the same calls give the same choices
/// on every machine.
pub trait Policy {
    /// The name by which a person chooses it.
    fn name(&self) -> &'static str;

    /// Names of what [`Selection::diagnostics`] holds; the same in every frame.
    fn diagnostics(&self) -> &'static [&'static str] {
        &[]
    }

    /// Whether it is to be found out what hides what: [`FrameInput::seen`].
    fn wants_seen_areas(&self) -> bool {
        false
    }

    /// Chooses a front: nodes that cover everything visible, none of them above another, all of
    /// them resident. Called once a frame.
    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection);

    /// How useful a node is in this frame, on the scale of [`Selection::requests`]; for nodes in
    /// memory that [`select`](Policy::select) had no need to visit.
    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64;

    /// What became of the frame that was chosen last.
    fn drawn(&mut self, outcome: &FrameOutcome) {
        let _ = outcome;
    }
}

/// What drawing a frame took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOutcome {
    /// Milliseconds from the beginning of selection until the image was complete.
    pub actual_ms: f64,
    /// Milliseconds of the whole frame: the same with uploads.
    pub frame_ms: f64,
}

/// What a policy chose for a frame; reused from frame to frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// What is drawn, coarse to fine. Nodes outside of the view are left out.
    pub front: Vec<u32>,
    /// Every node that was visited, with its utility: how much it matters that it be in memory, at
    /// least 0. The most useful node that is not in memory is loaded first, and the least useful
    /// ones are evicted for it.
    pub requests: Vec<(u32, f64)>,
    /// Nodes that may be wanted soon and are not among the requests, with their utility: loaded in their
    /// turn, at a tenth of the rate.
    pub ahead: Vec<(u32, f64)>,
    /// Nodes whose memory may be freed though there is room.
    pub released: Vec<u32>,
    /// Milliseconds that the frame should take; `None` for what the [`CostModel`] says.
    pub estimate: Option<FrameEstimate>,
    /// In the order of [`Policy::diagnostics`].
    pub diagnostics: Vec<f64>,
    /// Of the nodes visited, those outside of the view.
    pub culled: u32,
    /// Nodes that would be drawn, in place of coarser ones, were they in memory.
    pub lacking: u32,
    /// Nodes of the front that it hides itself, and that are to be
    /// [counted on](FrameInput::is_hidden) as such at once.
    pub counted_on: Vec<u32>,
    /// None of the nodes visited is evicted, not only those of the front.
    pub keep_visited: bool,
}

/// What a policy of its own reckoning expects of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameEstimate {
    /// Milliseconds.
    pub ms: f64,
    /// The same without any feedback from earlier frames.
    pub without_feedback_ms: f64,
}

impl Selection {
    /// Forgets the last frame and keeps the memory.
    pub fn clear(&mut self) {
        self.front.clear();
        self.requests.clear();
        self.ahead.clear();
        self.released.clear();
        self.diagnostics.clear();
        self.counted_on.clear();
        (self.estimate, self.culled, self.lacking, self.keep_visited) = (None, 0, 0, false);
    }

    /// Number of nodes visited.
    pub fn visited(&self) -> usize {
        self.requests.len()
    }
}
