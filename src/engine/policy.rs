//! The seam at which ways of choosing levels of detail differ.

use crate::camera::View;
use crate::runtime::SceneTree;

/// What a policy sees of a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameInput<'a> {
    /// The hierarchy, with its errors.
    pub tree: &'a SceneTree,
    /// The camera.
    pub view: &'a View,
    /// Which nodes can be drawn now.
    pub residents: &'a Residents,
    /// Milliseconds that the frame may take.
    pub target_ms: f64,
    /// Seconds since the frame before began; 0 in the first.
    pub dt_s: f64,
}

/// Chooses what each frame draws, and says how much each node matters.
///
/// A policy sees the hierarchy, the camera, what is in memory and how long frames took. It reads
/// no files, starts no threads and knows no graphics card, so the same calls give the same choices
/// on every machine.
pub trait Policy {
    /// The name by which a person chooses it.
    fn name(&self) -> &'static str;

    /// Chooses a front: nodes that cover everything visible, none of them above another, all of
    /// them resident. Called once a frame.
    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection);

    /// How much a node matters in this frame, on the scale of [`Selection::priorities`]; for
    /// nodes that [`select`](Policy::select) had no need to visit.
    fn priority(&self, frame: &FrameInput<'_>, node: u32) -> f64;

    /// What became of the frame that was chosen last.
    fn drawn(&mut self, outcome: &FrameOutcome);
}

/// What drawing a frame took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOutcome {
    /// Milliseconds from the beginning of selection until the picture was complete.
    pub actual_ms: f64,
}

/// Which nodes can be drawn now.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Residents(Vec<bool>);

impl Residents {
    /// None of `nodes` nodes.
    pub fn none(nodes: usize) -> Self {
        Self(vec![false; nodes])
    }

    /// All of `nodes` nodes.
    pub fn all(nodes: usize) -> Self {
        Self(vec![true; nodes])
    }

    /// Whether a node can be drawn.
    pub fn contains(&self, node: u32) -> bool {
        self.0.get(node as usize).copied().unwrap_or(false)
    }

    /// Says whether a node can be drawn.
    pub fn set(&mut self, node: u32, resident: bool) {
        if let Some(slot) = self.0.get_mut(node as usize) {
            *slot = resident;
        }
    }
}

/// What a policy chose for a frame; reused from frame to frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// What is drawn, coarse to fine. Nodes outside of the view are left out.
    pub front: Vec<u32>,
    /// Every node that was visited, with its priority: how much it matters that it be in memory.
    pub priorities: Vec<(u32, f64)>,
    /// Milliseconds that the frame should take.
    pub estimated_ms: f64,
    /// The same without any feedback from earlier frames.
    pub estimated_without_feedback_ms: f64,
    /// Milliseconds for one unit of cost (`v_time`); 0 where a policy has no such thing.
    pub v_time: f64,
    /// Milliseconds that roots share (`shareTime`); 0 where a policy has no such thing.
    pub share_ms: f64,
    /// The part of the picture that the front is expected to cover, 0 to 1; 0 where a policy
    /// does not ask.
    pub covered: f64,
    /// Of the nodes visited, those outside of the view.
    pub culled: u32,
    /// None of the nodes visited is evicted, not only those of the front.
    pub keep_visited: bool,
}

impl Selection {
    /// Forgets the last frame and keeps the memory.
    pub fn clear(&mut self) {
        self.front.clear();
        self.priorities.clear();
        (self.estimated_ms, self.estimated_without_feedback_ms) = (0.0, 0.0);
        (self.v_time, self.share_ms) = (0.0, 0.0);
        (self.covered, self.culled, self.keep_visited) = (0.0, 0, false);
    }

    /// Number of nodes visited.
    pub fn visited(&self) -> usize {
        self.priorities.len()
    }
}
