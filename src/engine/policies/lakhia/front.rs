//! The traversal: from priorities to time slices, to counters, to the front (thesis, section 4.2).

use std::collections::VecDeque;
use std::ops::Range;

use super::LakhiaOptions;
use super::benefit::{NodeScore, score};
use super::feedback::{Feedback, PendingChange};
use super::hysteresis::Hysteresis;
use crate::camera::View;
use crate::engine::{FrameInput, FrameOutcome, Policy, Selection};
use crate::runtime::{ScreenCoverage, TreeNode};

/// The policy of Lakhia's thesis.
#[derive(Clone, Debug)]
pub struct Lakhia {
    options: LakhiaOptions,
    feedback: Feedback,
    hysteresis: Hysteresis,
    /// Cost of the front that was chosen last.
    cost: f64,
    /// The part of the picture that it covers, 0 to 1.
    covered: ScreenCoverage,
    /// What its siblings would do to later frames.
    pending: PendingChange,
    /// Milliseconds that a frame may take.
    target_ms: f64,
    /// Milliseconds of this frame that nodes met for the first time may still take.
    room_ms: f64,
    queue: VecDeque<Siblings>,
    /// The siblings at hand.
    scores: Vec<NodeScore>,
}

/// Frames within which refused siblings count as coming: their time is not given to others.
const COMING: f64 = 3000.0;

/// Frames within which siblings count as going: others need not give up time. Counters fall by
/// less than 1 in a frame, so that this has to exceed their whole range.
const GOING: f64 = 10_000.0;

/// Nodes that are drawn together or not at all.
#[derive(Clone, Debug)]
struct Siblings {
    /// Their places in the tree.
    places: Range<u32>,
    /// The place of the node that is drawn where they are not; `None` for the roots.
    parent: Option<u32>,
    /// `shareTime`, milliseconds.
    share_ms: f64,
}

/// What the siblings at hand come to.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Of the priorities of those in view.
    priority: f64,
    /// Number of those in view.
    visible: usize,
    /// Milliseconds that all of these need.
    needed_ms: f64,
}

impl Sums {
    /// `priority / Σ priority` (eq. 4.1); equal parts where none of the siblings matters at all.
    fn share(&self, priority: f64) -> f64 {
        if self.priority > 0.0 { priority / self.priority } else { 1.0 / self.visible as f64 }
    }
}

impl Lakhia {
    /// A policy that has seen no frame yet.
    pub fn new(options: LakhiaOptions) -> Self {
        Self {
            feedback: Feedback::new(&options),
            options,
            hysteresis: Hysteresis::default(),
            cost: 0.0,
            covered: ScreenCoverage::default(),
            pending: PendingChange::NONE,
            target_ms: 0.0,
            room_ms: 0.0,
            queue: VecDeque::new(),
            scores: Vec::new(),
        }
    }

    /// Visits siblings: draws their parent, or those of them that have no children, and goes on
    /// to the children of the others.
    fn visit(&mut self, frame: &FrameInput<'_>, siblings: Siblings, out: &mut Selection) {
        let &FrameInput { tree, view, residents, .. } = frame;
        let (indices, nodes) = tree.at(siblings.places.clone());
        let mut sums = Sums::default();
        self.scores.clear();
        for node in nodes {
            let scored = score(node, view, &self.options);
            if scored.visible {
                sums.priority += scored.priority;
                sums.visible += 1;
                sums.needed_ms += self.time_needed(node);
            }
            self.scores.push(scored);
        }
        out.culled += (nodes.len() - sums.visible) as u32;
        let priorities =
            indices.iter().zip(&self.scores).map(|(&node, scored)| (node, scored.priority));
        out.priorities.extend(priorities);
        let parent = siblings.parent.map(|place| tree.at(place..place + 1));
        let parent = parent.map(|(index, node)| (index[0], &node[0]));
        self.start_counters(&siblings, sums, parent.map(|(_, node)| node));
        let allowed = self.update_counters(nodes, &siblings, sums);
        if let Some((index, node)) = parent {
            let resident = indices.iter().zip(&self.scores).all(|(&node, scored)| {
                residents.contains(node) || !(scored.visible || self.options.all_siblings)
            });
            if resident {
                let more_ms = sums.needed_ms - self.time_needed(node);
                if allowed {
                    let falling = self.counted_in(GOING, nodes, &siblings, sums) < 0.0;
                    self.pending.accepted(more_ms, falling);
                } else {
                    let rising = self.counted_in(COMING, nodes, &siblings, sums) >= 0.0;
                    self.pending.refused(more_ms, rising);
                }
            }
            if !(resident && allowed) {
                return self.draw(index, node, view, out);
            }
        }
        // Roots have no parent that could stand for them: far ones that need more than their
        // share do not keep the near ones from going on.
        for (at, (&index, node)) in indices.iter().zip(nodes).enumerate() {
            let NodeScore { visible, priority } = self.scores[at];
            // A root whose file is broken is not there; others come this far only when they are.
            if !visible || !(parent.is_some() || residents.contains(index)) {
                continue;
            }
            if node.children.is_empty() {
                self.draw(index, node, view, out);
            } else {
                self.queue.push_back(Siblings {
                    places: node.children.clone(),
                    parent: Some(siblings.places.start + at as u32),
                    share_ms: siblings.share_ms * sums.share(priority),
                });
            }
        }
    }

    /// Begins the counters of siblings that are in view for the first time.
    fn start_counters(&mut self, siblings: &Siblings, sums: Sums, parent: Option<&TreeNode>) {
        let is_new =
            |place: u32, scored: &NodeScore| scored.visible && self.hysteresis.is_new(place);
        if !siblings.places.clone().zip(&self.scores).any(|(place, scored)| is_new(place, scored)) {
            return;
        }
        let more_ms = sums.needed_ms - parent.map_or(0.0, |parent| self.time_needed(parent));
        let affordable = siblings.share_ms > sums.needed_ms && more_ms <= self.room_ms;
        if affordable {
            self.room_ms -= more_ms.max(0.0);
        }
        for (place, scored) in siblings.places.clone().zip(&self.scores) {
            if scored.visible && self.hysteresis.is_new(place) {
                self.hysteresis.start(place, affordable, &self.options);
            }
        }
    }

    /// Time slices (eq. 4.1) against the time needed; true where `cumHyst` is not below 0.
    fn update_counters(&mut self, nodes: &[TreeNode], siblings: &Siblings, sums: Sums) -> bool {
        let mut cumulative = 0.0;
        for ((place, node), scored) in siblings.places.clone().zip(nodes).zip(&self.scores) {
            if scored.visible {
                let time_slice = siblings.share_ms * sums.share(scored.priority);
                let time_needed = self.time_needed(node);
                self.hysteresis.update(place, time_slice, time_needed, self.options.hyst_limit);
                cumulative += self.hysteresis.truncated(place, 0.0, &self.options);
            }
        }
        cumulative >= 0.0
    }

    /// `cumHyst` so many frames from now, if nothing else changes.
    fn counted_in(&self, frames: f64, nodes: &[TreeNode], siblings: &Siblings, sums: Sums) -> f64 {
        let mut cumulative = 0.0;
        for ((place, node), scored) in siblings.places.clone().zip(nodes).zip(&self.scores) {
            if scored.visible {
                let time_slice = siblings.share_ms * sums.share(scored.priority);
                let urgency = time_slice / self.time_needed(node) - 1.0;
                cumulative += self.hysteresis.truncated(place, urgency * frames, &self.options);
            }
        }
        cumulative
    }

    /// `timeNeeded = v_time × cost`, milliseconds.
    fn time_needed(&self, node: &TreeNode) -> f64 {
        self.feedback.v_time * node.cost
    }

    fn draw(&mut self, index: u32, node: &TreeNode, view: &View, out: &mut Selection) {
        self.cost += node.cost;
        self.covered.add(node.bbox, view);
        out.front.push(index);
    }

    /// What the frame takes beside the fixed overhead, in units of cost: its nodes, and filling
    /// the part of the picture that they cover, which no choice of level changes.
    fn load(&self) -> f64 {
        self.cost + self.options.time.fill_cost * self.covered.part()
    }
}

impl Policy for Lakhia {
    fn name(&self) -> &'static str {
        "lakhia"
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        self.hysteresis.resize(frame.tree.len());
        self.target_ms = frame.target_ms;
        let before_ms = self.feedback.fixed_ms + self.feedback.v_time * self.load();
        self.room_ms = self.target_ms - before_ms;
        let share_ms = self.feedback.share_ms(&self.options, self.target_ms);
        (self.cost, self.covered, self.pending) =
            (0.0, ScreenCoverage::default(), PendingChange::NONE);
        self.queue.clear();
        self.queue.push_back(Siblings { places: frame.tree.root_places(), parent: None, share_ms });
        // First in, first out: all siblings come before the children of any.
        while let Some(siblings) = self.queue.pop_front() {
            self.visit(frame, siblings, out);
        }
        let time = &self.options.time;
        out.covered = self.covered.part();
        out.keep_visited = self.options.all_siblings;
        out.v_time = self.feedback.v_time;
        out.share_ms = share_ms;
        out.estimated_ms = self.feedback.fixed_ms + self.feedback.v_time * self.load();
        out.estimated_without_feedback_ms = time.fixed_ms + time.ms_per_cost * self.load();
    }

    fn priority(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        score(frame.tree.node(node), frame.view, &self.options).priority
    }

    fn drawn(&mut self, outcome: &FrameOutcome) {
        let load = self.load();
        let Self { options, pending, target_ms, .. } = self;
        self.feedback.adjust(options, *target_ms, load, pending, outcome.actual_ms);
    }
}
