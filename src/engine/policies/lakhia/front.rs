//! The traversal: from priorities to time slices, to counters, to the front (thesis, section 4.2).

use std::collections::VecDeque;
use std::ops::Range;

use super::LakhiaOptions;
use super::benefit::{NodeScore, score};
use super::feedback::{Drawn, Feedback};
use super::hysteresis::Hysteresis;
use super::options::FRAME_S;
use crate::engine::{FrameEstimate, FrameInput, FrameOutcome, Policy, Selection, geometry_load};
use crate::runtime::TreeNode;

pub(super) const NAME: &str = "lakhia";

/// The policy of Lakhia's thesis.
#[derive(Clone, Debug)]
pub struct Lakhia {
    options: LakhiaOptions,
    /// `None` before the first frame.
    feedback: Option<Feedback>,
    hysteresis: Hysteresis,
    /// What was chosen last.
    drawn: Drawn,
    queue: VecDeque<Siblings>,
    /// The siblings at hand.
    scores: Vec<NodeScore>,
}

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

/// What the siblings in view come to.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    priority: f64,
    visible: usize,
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
        // Counters that cannot reach what counts would never switch.
        let hyst_limit = options.hyst_limit.max(options.hyst_switch);
        Self {
            options: LakhiaOptions { hyst_limit, ..options },
            feedback: None,
            hysteresis: Hysteresis::default(),
            drawn: Drawn { cost: 0.0, refused: false, target_ms: 0.0, actual_ms: 0.0, dt_s: 0.0 },
            queue: VecDeque::new(),
            scores: Vec::new(),
        }
    }

    /// Visits siblings: draws their parent, or those of them that have no children, and goes on
    /// to the children of the others.
    fn visit(
        &mut self,
        frame: &FrameInput<'_>,
        feedback: &Feedback,
        siblings: Siblings,
        out: &mut Selection,
    ) {
        let &FrameInput { tree, view, residents, .. } = frame;
        let (indices, nodes) = tree.at(siblings.places.clone());
        let least_distance = least_distance(frame);
        let mut sums = Sums::default();
        self.scores.clear();
        for node in nodes {
            let scored = score(node, view, least_distance, &self.options);
            if scored.visible {
                sums.priority += scored.priority;
                sums.visible += 1;
            }
            self.scores.push(scored);
        }
        out.culled += (nodes.len() - sums.visible) as u32;
        let priorities =
            indices.iter().zip(&self.scores).map(|(&node, scored)| (node, scored.priority));
        out.requests.extend(priorities);
        let allowed = self.update_counters(nodes, feedback, &siblings, sums);
        let parent = siblings.parent.map(|place| tree.at(place..place + 1));
        if let Some((index, node)) = parent.map(|(index, node)| (index[0], &node[0])) {
            let resident = indices.iter().zip(&self.scores).all(|(&node, scored)| {
                residents.contains(node) || !(scored.visible || self.options.all_siblings > 0.0)
            });
            self.drawn.refused |= !allowed;
            if allowed && !resident {
                let is_missing = |&(&node, scored): &(&u32, &NodeScore)| {
                    scored.visible && !residents.contains(node)
                };
                let missing = indices.iter().zip(&self.scores).filter(is_missing).count();
                out.lacking += missing as u32;
            }
            if !(resident && allowed) {
                return self.draw(index, node, out);
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
                self.draw(index, node, out);
            } else {
                self.queue.push_back(Siblings {
                    places: node.children.clone(),
                    parent: Some(siblings.places.start + at as u32),
                    share_ms: siblings.share_ms * sums.share(priority),
                });
            }
        }
    }

    /// Time slices (eq. 4.1) against the time needed; true where `cumHyst` is not below 0.
    fn update_counters(
        &mut self,
        nodes: &[TreeNode],
        feedback: &Feedback,
        siblings: &Siblings,
        sums: Sums,
    ) -> bool {
        let mut cumulative = 0.0;
        for ((place, node), scored) in siblings.places.clone().zip(nodes).zip(&self.scores) {
            if scored.visible {
                let time_slice = siblings.share_ms * sums.share(scored.priority);
                let time_needed = feedback.v_time * node.cost;
                let (dt_s, limit) = (self.drawn.dt_s, self.options.hyst_limit);
                self.hysteresis.update(place, time_slice, time_needed, dt_s, limit);
                cumulative += self.hysteresis.truncated(place, &self.options);
            }
        }
        cumulative >= 0.0
    }

    fn draw(&mut self, index: u32, node: &TreeNode, out: &mut Selection) {
        self.drawn.cost += node.cost;
        out.front.push(index);
    }
}

/// Metres; what is nearer counts as this near. The static benefit is that at 1 m, and in models of
/// a few metres less.
fn least_distance(frame: &FrameInput<'_>) -> f64 {
    (frame.tree.diagonal() / 100.0).clamp(1e-6, 1.0)
}

/// The feedback before any: the overhead of a frame, and what the roots' costs should take.
fn expected(frame: &FrameInput<'_>) -> Feedback {
    let roots = || frame.tree.roots().iter().map(|&root| frame.tree.node(root));
    let ms: f64 = roots().map(|root| frame.costs.added_ms(&geometry_load(root))).sum();
    let v_time = ms / roots().map(|root| root.cost).sum::<f64>();
    let v_time = if v_time.is_finite() { v_time.max(1e-12) } else { 1e-12 };
    Feedback::new(v_time, frame.costs.prices().frame)
}

impl Policy for Lakhia {
    fn name(&self) -> &'static str {
        NAME
    }

    fn diagnostics(&self) -> &'static [&'static str] {
        &["v_time", "share_ms"]
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        self.hysteresis.resize(frame.tree.len());
        let feedback = *self.feedback.get_or_insert_with(|| expected(frame));
        let dt_s = if frame.dt_s > 0.0 { frame.dt_s } else { FRAME_S };
        let target_ms = frame.target_ms;
        self.drawn = Drawn { cost: 0.0, refused: false, target_ms, actual_ms: 0.0, dt_s };
        let share_ms = feedback.share * target_ms;
        self.queue.clear();
        self.queue.push_back(Siblings { places: frame.tree.root_places(), parent: None, share_ms });
        // First in, first out: all siblings come before the children of any.
        while let Some(siblings) = self.queue.pop_front() {
            self.visit(frame, &feedback, siblings, out);
        }
        out.keep_visited = self.options.all_siblings > 0.0;
        out.diagnostics.extend([feedback.v_time, share_ms]);
        let [ms, without_feedback_ms] = feedback.estimate(self.drawn.cost);
        out.estimate = Some(FrameEstimate { ms, without_feedback_ms });
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        score(frame.tree.node(node), frame.view, least_distance(frame), &self.options).priority
    }

    fn drawn(&mut self, outcome: &FrameOutcome) {
        self.drawn.actual_ms = outcome.actual_ms;
        if let Some(feedback) = &mut self.feedback {
            feedback.adjust(&self.options, &self.drawn);
        }
    }
}
