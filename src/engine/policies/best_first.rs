//! Best first: all nodes as coarse as can be, then one level of one node after another, by the
//! error that this removes from the image over what it takes, until the first that does not fit.
//!
//! As the splat budget of PlayCanvas 2.22 does it (`gsplat-budget-balancer.js`), which starts anew in
//! each frame; later versions choose by distance. Options are what streamers of splats do beside it, at
//! 1/60 s a frame: a node keeps a new level for 10 frames (Babylon.js; its budget goes before that, so
//! that levels fall at once), and what nobody asked for in 100 frames leaves memory (PlayCanvas and
//! Babylon.js).
//!
//! Ours are: the error that is removed counts in pixels rather than in the units of the scene (over
//! walks, flights and rises of five scenes, FLIP is 2.7 % less by that); only what is in view takes part;
//! of what is not in memory nothing is spent; and a front that would take longer than its steps did
//! together is chosen again with less.

use std::collections::BinaryHeap;

use super::parameter::{Parameter, info, parameter, with_settings};
use super::ranked::{Ranked, count_culled, front_ms, refining_ms, visible_children};
use super::unused::Unused;
use super::{PolicyKind, Settings};
use crate::Result;
use crate::engine::{FrameInput, Policy, Selection};

const NAME: &str = "best-first";

/// How often a frame is chosen anew because it was expected to be late.
const PASSES: usize = 3;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Options {
    cooldown_s: f64,
    unused_s: f64,
}

/// Neither of Babylon.js's additions.
const OPTIONS: Options = Options { cooldown_s: 0.0, unused_s: 0.0 };

const PARAMETERS: [Parameter<Options>; 2] = [
    parameter!(
        cooldown_s,
        0.0,
        60.0,
        "seconds for which a node keeps a new level, unless time is short; Babylon.js: 0.167"
    ),
    parameter!(
        unused_s,
        0.0,
        1e6,
        "seconds after which unused nodes leave memory, 0: never; PlayCanvas: 1.67"
    ),
];

pub(super) const KIND: PolicyKind = PolicyKind {
    name: NAME,
    summary: "single levels by error removed over cost, until the first that does not fit",
    source: "PlayCanvas 2.22, budget of splats",
    parameters: || info(&OPTIONS, &PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(NAME, OPTIONS, &PARAMETERS, settings)?;
        Ok(Box::new(BestFirst { options, ..BestFirst::default() }))
    },
};

#[derive(Clone, Debug, Default)]
struct BestFirst {
    options: Options,
    now_s: f64,
    /// How often anything was chosen, so that no table needs to be cleared.
    choices: u32,
    /// By node: the last choice that draws its children in its place.
    refined_by: Vec<u32>,
    /// The nodes that the frame at hand refines.
    refined: Vec<u32>,
    /// Those that the frame before refined.
    before: Vec<u32>,
    /// By node: whether it is one of these.
    was_refined: Vec<bool>,
    /// By node: when that changed last.
    changed_s: Vec<f64>,
    unused: Unused,
    candidates: BinaryHeap<Ranked>,
    queue: Vec<u32>,
}

/// What refining a node removes of the error of the image, over what it takes: the part of the
/// image that it covers, times the metres of mean error that its children do not have, in pixels.
fn rank(frame: &FrameInput<'_>, node: u32) -> f64 {
    if frame.is_hidden(node) {
        return 0.0;
    }
    let &FrameInput { tree, view, .. } = frame;
    let at = tree.node(node);
    let children = tree.children(node).iter().map(|&child| tree.node(child).mean_error);
    let removed = at.mean_error - children.sum::<f64>() / at.children.len().max(1) as f64;
    let nearest = view.pose.position.clamp(at.bbox[0], at.bbox[1]);
    let distance = view.pose.position.distance(nearest).max(tree.diagonal() * 1e-6);
    let pixels = removed.max(0.0) * view.pixels_per_metre() / distance;
    frame.covered(node) * pixels / refining_ms(frame, node)
}

/// How useful a node is: as refining its parent is.
fn utility(frame: &FrameInput<'_>, node: u32) -> f64 {
    match frame.tree.node(node).parent {
        Some(parent) => rank(frame, parent),
        None => f64::MAX,
    }
}

impl BestFirst {
    /// Whether a node has just changed its level, and to what.
    fn held(&self, node: u32) -> Option<bool> {
        let is_fresh = self.now_s - self.changed_s[node as usize] < self.options.cooldown_s;
        is_fresh.then(|| self.was_refined[node as usize])
    }

    /// Notes which nodes changed their level in this frame.
    fn note_changes(&mut self) {
        for &node in &self.refined {
            if !std::mem::replace(&mut self.was_refined[node as usize], true) {
                self.changed_s[node as usize] = self.now_s;
            }
        }
        for &node in &self.before {
            if self.refined_by[node as usize] != self.choices {
                self.was_refined[node as usize] = false;
                self.changed_s[node as usize] = self.now_s;
            }
        }
        std::mem::swap(&mut self.before, &mut self.refined);
    }

    /// A node that is drawn could be refined.
    fn consider(&mut self, frame: &FrameInput<'_>, node: u32, out: &mut Selection) {
        let children = frame.tree.children(node);
        if children.is_empty() || !frame.is_visible(node) || frame.is_hidden(node) {
            return;
        }
        let rank = rank(frame, node);
        out.requests.extend(children.iter().map(|&child| (child, rank)));
        match self.held(node) {
            Some(false) => {}
            Some(true) => self.candidates.push(Ranked { rank: f64::INFINITY, node }),
            None => self.candidates.push(Ranked { rank, node }),
        }
    }

    /// Chooses anew, by what each step is expected to take.
    fn refine_within(&mut self, frame: &FrameInput<'_>, budget_ms: f64, out: &mut Selection) {
        out.clear();
        self.choices += 1;
        self.refined.clear();
        self.candidates.clear();
        self.front(frame, out);
        let mut left_ms = budget_ms - front_ms(frame, &out.front);
        out.requests.extend(frame.tree.roots().iter().map(|&root| (root, f64::MAX)));
        for &root in &std::mem::take(&mut out.front) {
            self.consider(frame, root, out);
        }
        while let Some(Ranked { rank, node }) = self.candidates.pop() {
            let more_ms = refining_ms(frame, node);
            if !frame.can_refine(node) {
                if more_ms <= left_ms {
                    out.lacking += frame.missing_children(node);
                }
                continue; // its children are asked for
            }
            if more_ms > left_ms && rank < f64::INFINITY {
                break;
            } else if more_ms > left_ms {
                continue; // what would be kept gives way to the budget
            }
            left_ms -= more_ms;
            self.refined_by[node as usize] = self.choices;
            self.refined.push(node);
            for &child in frame.tree.children(node) {
                self.consider(frame, child, out);
            }
        }
        self.front(frame, out);
    }

    /// The nodes in view at which what is refined ends.
    fn front(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        self.queue.clear();
        let roots = frame.tree.roots().iter();
        self.queue.extend(roots.filter(|&&root| frame.residents.contains(root)));
        let mut at = 0;
        while let Some(&node) = self.queue.get(at) {
            at += 1;
            if self.refined_by[node as usize] == self.choices {
                self.queue.extend(visible_children(frame, node));
            } else if frame.is_visible(node) {
                out.front.push(node);
            }
        }
    }
}

impl Policy for BestFirst {
    fn name(&self) -> &'static str {
        NAME
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        let nodes = frame.tree.len();
        self.refined_by.resize(nodes, 0);
        self.was_refined.resize(nodes, false);
        self.changed_s.resize(nodes, f64::NEG_INFINITY);
        self.now_s += frame.dt_s;
        let mut budget_ms = frame.budget_ms;
        for _ in 0..PASSES {
            self.refine_within(frame, budget_ms, out);
            // Finer nodes also hide and cover other parts of the image, which none of them pays for.
            let over_ms = front_ms(frame, &out.front) - frame.budget_ms;
            if over_ms <= 0.0 {
                break;
            }
            budget_ms -= over_ms;
        }
        if self.options.cooldown_s > 0.0 {
            self.note_changes();
        }
        count_culled(frame, out);
        if self.options.unused_s > 0.0 {
            self.unused.release(self.now_s, self.options.unused_s, nodes, out);
        }
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        utility(frame, node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::{TestFrame, passes_over_what_is_not_in_memory, root};
    use crate::runtime::test_tree::tree;

    fn policy(settings: &[(&str, f64)]) -> Box<dyn Policy> {
        KIND.make(&settings.iter().map(|&(name, value)| (name.into(), value)).collect()).unwrap()
    }

    #[test]
    fn the_most_error_removed_for_its_time_comes_first_and_the_first_that_does_not_fit_ends_it() {
        // Far: 0 → 1, 2 removes little; near: 3 → 4, 5 much; 6 → 7, 8, 9 more but takes twice.
        let trees = vec![root(40.0, 0.1, 2), root(10.0, 0.1, 2), root(10.0, 0.15, 3)];
        let mut frame = TestFrame::new(tree(trees));
        for (target_ms, front) in [
            (30.0, &[0, 3, 6][..]),
            (40.0, &[0, 4, 5, 6]),
            (59.0, &[0, 4, 5, 6]), // the far one would fit, but comes after
            (60.0, &[0, 4, 5, 7, 8, 9]),
            (70.0, &[1, 2, 4, 5, 7, 8, 9]),
            (5.0, &[0, 3, 6]), // roots are never skipped
        ] {
            frame.target_ms = target_ms;
            assert_eq!(frame.front(&mut *policy(&[])), front, "{target_ms} ms");
        }
    }

    #[test]
    fn what_is_not_in_memory_is_asked_for_and_passed_over() {
        passes_over_what_is_not_in_memory(&mut *policy(&[]));
    }

    #[test]
    fn a_node_that_became_coarser_stays_so_while_it_cools_down_and_none_exceeds_the_budget() {
        let fronts = |settings: &[(&str, f64)]| {
            let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2)]));
            frame.dt_s = 1.0 / 60.0;
            let mut policy = policy(settings);
            (0..30)
                .map(|index| {
                    frame.target_ms = if index % 2 == 0 { 30.0 } else { 5.0 };
                    frame.front(&mut *policy).len()
                })
                .collect::<Vec<_>>()
        };
        let changes = |fronts: &[usize]| fronts.windows(2).filter(|at| at[0] != at[1]).count();
        assert_eq!(changes(&fronts(&[])), 29);
        let cooled = fronts(&[("cooldown_s", 10.0 / 60.0)]);
        // Fine, coarse at once, and coarse for ten frames, over and over.
        assert!((4..=6).contains(&changes(&cooled)), "{cooled:?}");
        assert!(cooled.iter().skip(1).step_by(2).all(|&drawn| drawn == 1), "{cooled:?}");
    }

    #[test]
    fn unused_nodes_leave_memory_only_where_asked_for() {
        let trees = || tree(vec![root(10.0, 0.1, 2)]);
        let released = |settings: &[(&str, f64)]| {
            let mut frame = TestFrame { dt_s: 0.1, ..TestFrame::new(trees()) };
            let mut policy = policy(settings);
            frame.select(&mut *policy);
            let mut pose = frame.view.pose;
            pose.position.x = 100.0;
            frame.view = crate::camera::View::new(pose, frame.view.velocity, frame.view.size);
            (0..30).flat_map(|_| frame.select(&mut *policy).released).collect::<Vec<_>>()
        };
        assert!(released(&[]).is_empty());
        assert_eq!(released(&[("unused_s", 1.67)]), [1, 2]);
    }
}
