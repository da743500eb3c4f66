//! The traversal: from priorities to time slices, to counters, to the front (thesis, section 4.2).

use std::collections::VecDeque;

use super::LakhiaOptions;
use super::benefit::{Seen, seen};
use super::feedback::{Feedback, Outlook};
use super::hysteresis::Hysteresis;
use crate::camera::View;
use crate::runtime::{FrameOutcome, Policy, Residents, SceneTree, Selection};

/// The policy of Lakhia's thesis.
#[derive(Clone, Debug)]
pub struct Lakhia {
    options: LakhiaOptions,
    feedback: Feedback,
    hysteresis: Hysteresis,
    /// Cost of the front that was chosen last.
    cost: f64,
    /// What its siblings would do to later frames.
    outlook: Outlook,
    queue: VecDeque<Siblings>,
    /// The siblings at hand.
    seen: Vec<Seen>,
}

/// Nodes that are drawn together or not at all.
#[derive(Clone, Copy, Debug)]
struct Siblings {
    /// Drawn where they are not; `None` for the roots.
    parent: Option<u32>,
    /// `shareTime`, milliseconds.
    share_ms: f64,
}

impl Lakhia {
    /// A policy that has seen no frame yet.
    pub fn new(options: LakhiaOptions) -> Self {
        Self {
            feedback: Feedback::new(&options),
            options,
            hysteresis: Hysteresis::default(),
            cost: 0.0,
            outlook: Outlook::NONE,
            queue: VecDeque::new(),
            seen: Vec::new(),
        }
    }

    /// Visits siblings: draws their parent, or those of them that have no children, and goes on
    /// to the children of the others.
    fn visit(
        &mut self,
        tree: &SceneTree,
        siblings: Siblings,
        view: &View,
        residents: &Residents,
        out: &mut Selection,
    ) {
        let members = siblings.parent.map_or(tree.roots(), |parent| tree.children(parent));
        let mut sum = 0.0;
        self.seen.clear();
        for &node in members {
            let seen = seen(tree.node(node), view, &self.options);
            out.priorities.push((node, seen.priority));
            if seen.visible {
                sum += seen.priority;
            } else {
                out.culled += 1;
            }
            self.seen.push(seen);
        }
        let (allowed, needed_ms) = self.update_counters(tree, members, siblings.share_ms, sum);
        let resident = || {
            members.iter().zip(&self.seen).all(|(&node, seen)| {
                residents.contains(node) || !(seen.visible || self.options.all_siblings)
            })
        };
        if let Some(parent) = siblings.parent {
            let resident = resident();
            if !(allowed && resident) {
                if resident {
                    let more_ms = needed_ms - self.feedback.v_time * tree.node(parent).cost;
                    self.outlook.refused(more_ms, siblings.share_ms / needed_ms - 1.0);
                }
                self.draw(tree, parent, out);
                return;
            }
            self.outlook.accepted(siblings.share_ms / needed_ms - 1.0);
        }
        // Roots have no parent that could stand for them: far ones that need more than their
        // share do not keep the near ones from going on.
        let visible_count = self.seen.iter().filter(|seen| seen.visible).count();
        for (&node, seen) in members.iter().zip(&self.seen) {
            if !seen.visible || !(siblings.parent.is_some() || residents.contains(node)) {
                continue;
            }
            if !tree.children(node).is_empty() {
                let share_ms = siblings.share_ms * share(seen.priority, sum, visible_count);
                self.queue.push_back(Siblings { parent: Some(node), share_ms });
            } else {
                self.cost += tree.node(node).cost;
                out.front.push(node);
            }
        }
    }

    /// Time slices (eq. 4.1) against the time needed: whether `cumHyst` is not below 0, and the
    /// milliseconds that all siblings in view need.
    fn update_counters(
        &mut self,
        tree: &SceneTree,
        members: &[u32],
        share_ms: f64,
        sum: f64,
    ) -> (bool, f64) {
        let visible = || members.iter().zip(&self.seen).filter(|(_, seen)| seen.visible);
        let time_needed = |node: u32| self.feedback.v_time * tree.node(node).cost;
        let count = visible().count();
        let needed_ms = visible().map(|(&node, _)| time_needed(node)).sum::<f64>();
        if visible().any(|(&node, _)| self.hysteresis.is_new(node)) {
            let affordable = share_ms > needed_ms;
            for (&node, _) in members.iter().zip(&self.seen).filter(|(_, seen)| seen.visible) {
                if self.hysteresis.is_new(node) {
                    self.hysteresis.start(node, affordable, &self.options);
                }
            }
        }
        let mut cumulative = 0.0;
        for (&node, seen) in members.iter().zip(&self.seen).filter(|(_, seen)| seen.visible) {
            let time_slice = share_ms * share(seen.priority, sum, count);
            let time_needed = self.feedback.v_time * tree.node(node).cost;
            self.hysteresis.update(node, time_slice, time_needed, self.options.hyst_limit);
            cumulative += self.hysteresis.truncated(node, self.options.hyst_switch);
        }
        (cumulative >= 0.0, needed_ms)
    }

    fn draw(&mut self, tree: &SceneTree, node: u32, out: &mut Selection) {
        self.cost += tree.node(node).cost;
        out.front.push(node);
    }
}

/// `priority / Σ priority` (eq. 4.1); equal parts where none of the siblings matters at all.
fn share(priority: f64, sum: f64, count: usize) -> f64 {
    if sum > 0.0 { priority / sum } else { 1.0 / count as f64 }
}

impl Policy for Lakhia {
    fn name(&self) -> &'static str {
        "lakhia"
    }

    fn select(
        &mut self,
        tree: &SceneTree,
        view: &View,
        residents: &Residents,
        out: &mut Selection,
    ) {
        out.clear();
        self.hysteresis.resize(tree.len());
        (self.cost, self.outlook) = (0.0, Outlook::NONE);
        self.queue.clear();
        self.queue.push_back(Siblings { parent: None, share_ms: self.feedback.share_ms });
        // First in, first out: all siblings come before the children of any.
        while let Some(siblings) = self.queue.pop_front() {
            self.visit(tree, siblings, view, residents, out);
        }
        let time = &self.options.time;
        out.v_time = self.feedback.v_time;
        out.share_ms = self.feedback.share_ms;
        out.estimated_ms = time.fixed_ms + self.feedback.v_time * self.cost;
        out.estimated_without_feedback_ms = time.fixed_ms + time.ms_per_cost * self.cost;
    }

    fn priority(&self, tree: &SceneTree, node: u32, view: &View) -> f64 {
        seen(tree.node(node), view, &self.options).priority
    }

    fn drawn(&mut self, outcome: &FrameOutcome) {
        self.feedback.adjust(&self.options, self.cost, &self.outlook, outcome.actual_ms);
    }
}
