//! The traversal: from priorities to time slices, to counters, to the front (thesis, section 4.2).

use std::collections::VecDeque;

use super::LakhiaOptions;
use super::benefit::{Seen, seen};
use super::feedback::{Feedback, Outlook};
use super::hysteresis::Hysteresis;
use crate::camera::View;
use crate::runtime::{FrameOutcome, Policy, Residents, SceneTree, Selection, covered};

/// The policy of Lakhia's thesis.
#[derive(Clone, Debug)]
pub struct Lakhia {
    options: LakhiaOptions,
    feedback: Feedback,
    hysteresis: Hysteresis,
    /// Cost of the front that was chosen last.
    cost: f64,
    /// The part of the picture that it covers, 0 to 1.
    covered: f64,
    /// What its siblings would do to later frames.
    outlook: Outlook,
    /// Milliseconds of this frame that nodes met for the first time may still take.
    room_ms: f64,
    queue: VecDeque<Siblings>,
    /// The siblings at hand.
    seen: Vec<Seen>,
}

/// Frames within which refused siblings count as coming: their time is not given to others.
const COMING: f64 = 3000.0;

/// Frames within which siblings count as going: others need not give up time. Counters fall by
/// less than 1 in a frame, so that this has to exceed their whole range.
const GOING: f64 = 10_000.0;

/// Nodes that are drawn together or not at all.
#[derive(Clone, Copy, Debug)]
struct Siblings {
    /// Drawn where they are not; `None` for the roots.
    parent: Option<u32>,
    /// `shareTime`, milliseconds.
    share_ms: f64,
}

/// What the counters of siblings say.
#[derive(Clone, Copy, Debug)]
struct Counted {
    /// `cumHyst` is not below 0.
    allowed: bool,
    /// Milliseconds that all siblings in view need.
    needed_ms: f64,
    /// It will not be within [`COMING`] frames, if nothing changes.
    rising: bool,
    /// It will be within [`GOING`] frames, if nothing changes.
    falling: bool,
}

impl Lakhia {
    /// A policy that has seen no frame yet.
    pub fn new(options: LakhiaOptions) -> Self {
        Self {
            feedback: Feedback::new(&options),
            options,
            hysteresis: Hysteresis::default(),
            cost: 0.0,
            covered: 0.0,
            outlook: Outlook::NONE,
            room_ms: 0.0,
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
        let Counted { allowed, needed_ms, rising, falling } =
            self.update_counters(tree, members, siblings, sum);
        if let Some(parent) = siblings.parent {
            let resident = members.iter().zip(&self.seen).all(|(&node, seen)| {
                residents.contains(node) || !(seen.visible || self.options.all_siblings)
            });
            let more_ms = needed_ms - self.time_needed(tree, parent);
            match (resident, allowed) {
                (true, true) => self.outlook.accepted(more_ms, falling),
                (true, false) => self.outlook.refused(more_ms, rising),
                (false, _) => {}
            }
            if !(resident && allowed) {
                return self.draw(tree, parent, out);
            }
        }
        // Roots have no parent that could stand for them: far ones that need more than their
        // share do not keep the near ones from going on.
        let visible_count = self.seen.iter().filter(|seen| seen.visible).count();
        for (index, &node) in members.iter().enumerate() {
            let Seen { visible, priority } = self.seen[index];
            // A root whose file is broken is not there; others come this far only when they are.
            if !visible || !(siblings.parent.is_some() || residents.contains(node)) {
                continue;
            }
            if tree.children(node).is_empty() {
                self.draw(tree, node, out);
            } else {
                let share_ms = siblings.share_ms * share(priority, sum, visible_count);
                self.queue.push_back(Siblings { parent: Some(node), share_ms });
            }
        }
    }

    /// Time slices (eq. 4.1) against the time needed.
    fn update_counters(
        &mut self,
        tree: &SceneTree,
        members: &[u32],
        siblings: Siblings,
        sum: f64,
    ) -> Counted {
        let share_ms = siblings.share_ms;
        let visible = || members.iter().zip(&self.seen).filter(|(_, seen)| seen.visible);
        let time_needed = |node: u32| self.time_needed(tree, node);
        let count = visible().count();
        let needed_ms = visible().map(|(&node, _)| time_needed(node)).sum::<f64>();
        if visible().any(|(&node, _)| self.hysteresis.is_new(node)) {
            let parent_ms = siblings.parent.map_or(0.0, time_needed);
            let affordable = share_ms > needed_ms && needed_ms - parent_ms <= self.room_ms;
            if affordable {
                self.room_ms -= (needed_ms - parent_ms).max(0.0);
            }
            for (&node, _) in members.iter().zip(&self.seen).filter(|(_, seen)| seen.visible) {
                if self.hysteresis.is_new(node) {
                    self.hysteresis.start(node, affordable, &self.options);
                }
            }
        }
        let (mut cumulative, mut coming, mut going) = (0.0, 0.0, 0.0);
        for (&node, seen) in members.iter().zip(&self.seen).filter(|(_, seen)| seen.visible) {
            let time_slice = share_ms * share(seen.priority, sum, count);
            let time_needed = self.time_needed(tree, node);
            self.hysteresis.update(node, time_slice, time_needed, self.options.hyst_limit);
            cumulative += self.hysteresis.truncated(node, 0.0, &self.options);
            let urgency = time_slice / time_needed - 1.0;
            coming += self.hysteresis.truncated(node, urgency * COMING, &self.options);
            going += self.hysteresis.truncated(node, urgency * GOING, &self.options);
        }
        Counted {
            allowed: cumulative >= 0.0,
            needed_ms,
            rising: coming >= 0.0,
            falling: going < 0.0,
        }
    }

    /// `timeNeeded = v_time × cost`, milliseconds.
    fn time_needed(&self, tree: &SceneTree, node: u32) -> f64 {
        self.feedback.v_time * tree.node(node).cost
    }

    fn draw(&mut self, tree: &SceneTree, node: u32, out: &mut Selection) {
        self.cost += tree.node(node).cost;
        out.front.push(node);
    }

    /// What the frame takes beside the fixed overhead, in units of cost: its nodes, and filling
    /// the part of the picture that they cover, which no choice of level changes.
    fn load(&self) -> f64 {
        self.cost + self.options.time.fill_cost * self.covered
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
        let before_ms = self.feedback.fixed_ms + self.feedback.v_time * self.load();
        self.room_ms = self.options.target_ms - before_ms;
        (self.cost, self.outlook) = (0.0, Outlook::NONE);
        self.queue.clear();
        self.queue.push_back(Siblings { parent: None, share_ms: self.feedback.share_ms });
        // First in, first out: all siblings come before the children of any.
        while let Some(siblings) = self.queue.pop_front() {
            self.visit(tree, siblings, view, residents, out);
        }
        self.covered = covered(tree, &out.front, view);
        let time = &self.options.time;
        out.covered = self.covered;
        out.v_time = self.feedback.v_time;
        out.share_ms = self.feedback.share_ms;
        out.estimated_ms = self.feedback.fixed_ms + self.feedback.v_time * self.load();
        out.estimated_without_feedback_ms = time.fixed_ms + time.ms_per_cost * self.load();
    }

    fn priority(&self, tree: &SceneTree, node: u32, view: &View) -> f64 {
        seen(tree.node(node), view, &self.options).priority
    }

    fn drawn(&mut self, outcome: &FrameOutcome) {
        self.feedback.adjust(&self.options, self.load(), &self.outlook, outcome.actual_ms);
    }
}
