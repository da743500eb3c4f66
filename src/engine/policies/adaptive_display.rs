//! Benefit over cost, changed little by little from frame to frame.
//!
//! Funkhouser and Séquin, "Adaptive Display Algorithm for Interactive Frame Rates During
//! Visualization of Complex Virtual Environments" (SIGGRAPH 1993), with two changes that a
//! hierarchy asks for, as Lakhia's thesis discusses them (chapter 5): what is replaced by finer
//! detail is a node by its children, and nothing in view is ever skipped. The benefit of a node is
//! `size × accuracy × focus × motion` (section 4), with `accuracy = 1 − 0.5 / samples`; the benefit
//! of a level that the frame before did not have is less by a part of it ("hysteresis"). Levels
//! change incrementally (section 5): the upgrade of the greatest value, then downgrades of the
//! least until the frame is estimated to be within its time, and so on until one undoes the other.

use std::collections::BinaryHeap;

use super::parameter::{Parameter, info, parameter, with_settings};
use super::ranked::{Ranked, count_culled, front_ms, refining_ms, visible_children};
use super::{PolicyKind, Settings};
use crate::Result;
use crate::engine::{FrameInput, Policy, Selection};

const NAME: &str = "adaptive-display";

/// `BaseError` of the paper: half of a triangle's pixels are wrong.
const BASE_ERROR: f64 = 0.5;

/// Seconds of a frame, by which motion is seen.
const FRAME_S: f64 = 1.0 / 60.0;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Options {
    hysteresis: f64,
    focus: f64,
    motion: f64,
}

/// The paper gives no numbers; these are ours.
const OPTIONS: Options = Options { hysteresis: 0.1, focus: 0.5, motion: 0.5 };

const PARAMETERS: [Parameter<Options>; 3] = [
    parameter!(hysteresis, 0.0, 0.99, "part of its value that a change of level loses"),
    parameter!(focus, 0.0, 1.0, "part of its benefit that a node loses at the edge of the image"),
    parameter!(motion, 0.0, 100.0, "weight of a node's apparent speed against its size"),
];

pub(super) const KIND: PolicyKind = PolicyKind {
    name: NAME,
    summary: "benefit over cost, by upgrades and downgrades of the frame before",
    source: "Funkhouser and Séquin, Adaptive Display Algorithm, 1993, on hierarchies",
    parameters: || info(&OPTIONS, &PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(NAME, OPTIONS, &PARAMETERS, settings)?;
        Ok(Box::new(AdaptiveDisplay { options, ..AdaptiveDisplay::default() }))
    },
};

impl Default for Options {
    fn default() -> Self {
        OPTIONS
    }
}

#[derive(Clone, Debug, Default)]
struct AdaptiveDisplay {
    options: Options,
    /// By node: whether its children stand for it.
    refined: Vec<bool>,
    /// The same in the frame before.
    before: Vec<bool>,
    /// Nodes that could be refined, by value.
    upgrades: BinaryHeap<Ranked>,
    /// Refined nodes of which no child in view is refined, by value, the least first.
    downgrades: BinaryHeap<Ranked>,
    queue: Vec<u32>,
}

impl AdaptiveDisplay {
    /// What a node counts for, however it is shown: `size × focus × motion` (section 4 of the
    /// paper).
    fn importance(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        let &FrameInput { tree, view, .. } = frame;
        let at = tree.node(node);
        let [width, height] = view.size.map(f64::from);
        let size = frame.covered(node) * width * height;
        let to_node = (at.bbox[0] + at.bbox[1]) / 2.0 - view.pose.position;
        let aside = 1.0 - to_node.normalize_or_zero().dot(view.frustum.forward).max(0.0);
        let focus = 1.0 - self.options.focus * aside;
        // Pixels that the node moves in a frame, against those of its side.
        let speed = view.velocity.length() * view.pixels_per_metre() / to_node.length().max(1e-3);
        let moved = speed * FRAME_S / size.sqrt().max(1.0);
        size * focus / (1.0 + self.options.motion * moved)
    }

    /// Benefit of the children of a node in view over that of the node, over what they cost more;
    /// less where that is a change, more where the change is the other way.
    fn value(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        if frame.is_hidden(node) {
            return 0.0;
        }
        let triangles = |node: u32| f64::from(frame.tree.node(node).triangles.max(1));
        let accuracy = |samples: f64| 1.0 - BASE_ERROR / samples;
        let children: f64 = visible_children(frame, node).map(triangles).sum();
        let more = (accuracy(children.max(1.0)) - accuracy(triangles(node))).max(0.0);
        let changed = match self.before[node as usize] {
            true => 1.0 + self.options.hysteresis,
            false => 1.0 - self.options.hysteresis,
        };
        changed * self.importance(frame, node) * more / refining_ms(frame, node)
    }

    /// Goes down what is refined and can stay so; the front of what is left.
    fn walk(&mut self, frame: &FrameInput<'_>, mut visit: impl FnMut(&Self, u32, bool)) {
        let mut queue = std::mem::take(&mut self.queue);
        queue.clear();
        let roots = frame.tree.roots().iter();
        queue.extend(roots.filter(|&&root| frame.residents.contains(root)));
        let mut at = 0;
        while let Some(&node) = queue.get(at) {
            at += 1;
            if !frame.is_visible(node) {
                continue;
            }
            let refined = self.refined[node as usize] && frame.can_refine(node);
            self.refined[node as usize] = refined;
            if refined {
                queue.extend(frame.tree.children(node));
            }
            visit(self, node, refined);
        }
        self.queue = queue;
    }

    /// Whether no child in view is refined.
    fn is_last(&self, frame: &FrameInput<'_>, node: u32) -> bool {
        visible_children(frame, node).all(|child| !self.refined[child as usize])
    }

    fn push_upgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        if frame.can_refine(node) && frame.is_visible(node) && !frame.is_hidden(node) {
            self.upgrades.push(Ranked { rank: self.value(frame, node), node });
        }
    }

    fn push_downgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        if self.is_last(frame, node) && !frame.is_hidden(node) {
            self.downgrades.push(Ranked { rank: -self.value(frame, node), node });
        }
    }

    fn upgrade(&mut self, frame: &FrameInput<'_>, node: u32) -> f64 {
        self.refined[node as usize] = true;
        for child in visible_children(frame, node) {
            // A child that is refined from an earlier frame, when its parent was too.
            self.refined[child as usize] = false;
            self.push_upgrade(frame, child);
        }
        self.push_downgrade(frame, node);
        refining_ms(frame, node)
    }

    fn downgrade(&mut self, frame: &FrameInput<'_>, node: u32) -> f64 {
        self.refined[node as usize] = false;
        self.push_upgrade(frame, node);
        if let Some(parent) = frame.tree.node(node).parent {
            self.push_downgrade(frame, parent);
        }
        refining_ms(frame, node)
    }

    /// The upgrade of the greatest value that can be made.
    fn best_upgrade(&mut self) -> Option<u32> {
        while let Some(Ranked { node, .. }) = self.upgrades.pop() {
            if !self.refined[node as usize] {
                return Some(node);
            }
        }
        None
    }

    /// The downgrade of the least value that can be made.
    fn worst_downgrade(&mut self, frame: &FrameInput<'_>) -> Option<u32> {
        while let Some(Ranked { node, .. }) = self.downgrades.pop() {
            if self.refined[node as usize] && self.is_last(frame, node) {
                return Some(node);
            }
        }
        None
    }

    /// The incremental algorithm (section 5 of the paper), from the front of the frame before, of `ms`
    /// milliseconds; what the front takes that it comes to.
    fn improve(&mut self, frame: &FrameInput<'_>, mut ms: f64) -> f64 {
        while ms > frame.budget_ms {
            let Some(node) = self.worst_downgrade(frame) else { return ms };
            ms -= self.downgrade(frame, node);
        }
        while let Some(up) = self.best_upgrade() {
            let value = self.value(frame, up);
            ms += self.upgrade(frame, up);
            while ms > frame.budget_ms {
                let Some(down) = self.worst_downgrade(frame) else { return ms };
                // Of two that are worth as much, none makes way for the other.
                if down == up || self.value(frame, down) >= value {
                    ms -= self.downgrade(frame, up);
                    return ms;
                }
                ms -= self.downgrade(frame, down);
            }
        }
        ms
    }
}

impl Policy for AdaptiveDisplay {
    fn name(&self) -> &'static str {
        NAME
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        self.refined.resize(frame.tree.len(), false);
        self.before.clone_from(&self.refined);
        self.upgrades.clear();
        self.downgrades.clear();
        let mut visited = Vec::new();
        self.walk(frame, |_, node, refined| visited.push((node, refined)));
        for &(node, refined) in &visited {
            match refined {
                true => self.push_downgrade(frame, node),
                false => self.push_upgrade(frame, node),
            }
        }
        out.front.extend(visited.iter().filter(|(_, refined)| !refined).map(|&(node, _)| node));
        let ms = self.improve(frame, front_ms(frame, &out.front));
        out.front.clear();
        out.requests.extend(frame.tree.roots().iter().map(|&root| (root, f64::MAX)));
        self.walk(frame, |policy, node, refined| {
            if !refined {
                out.front.push(node);
                if refining_ms(frame, node) <= frame.budget_ms - ms {
                    out.lacking += frame.missing_children(node);
                }
            }
            let children = frame.tree.children(node);
            if !children.is_empty() {
                let value = policy.value(frame, node);
                out.requests.extend(children.iter().map(|&child| (child, value)));
            }
        });
        count_culled(frame, out);
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        match frame.tree.node(node).parent {
            Some(parent) if self.before.len() == frame.tree.len() => self.value(frame, parent),
            _ => f64::MAX,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::TestFrame;
    use crate::runtime::test_tree::{Sketch, sketch, tree};

    /// A root at a distance with two children; refining it takes 10 ms.
    fn root(distance: f64, y: f64) -> Sketch {
        let at = |y: f64| [distance + 1.0, y, 0.0];
        Sketch {
            size: 4.0,
            triangles: 5,
            ..sketch(
                at(y),
                1.0,
                vec![sketch(at(y - 1.0), 1.0, vec![]), sketch(at(y + 1.0), 1.0, vec![])],
            )
        }
    }

    fn policy(settings: &[(&str, f64)]) -> Box<dyn Policy> {
        KIND.make(&settings.iter().map(|&(name, value)| (name.into(), value)).collect()).unwrap()
    }

    #[test]
    fn the_greatest_value_is_upgraded_and_the_least_downgraded() {
        // The near one is larger in the image; 5 ms for a root, 20 for its children.
        let mut frame = TestFrame::new(tree(vec![root(40.0, 0.0), root(10.0, 0.0)]));
        let mut policy = policy(&[]);
        for (target_ms, front) in [
            (10.0, &[0, 3][..]),
            (25.0, &[0, 4, 5]),
            (40.0, &[1, 2, 4, 5]),
            (39.0, &[0, 4, 5]),
            (5.0, &[0, 3]), // nothing in view is skipped
        ] {
            frame.target_ms = target_ms;
            assert_eq!(frame.front(&mut *policy), front, "{target_ms} ms");
        }
    }

    #[test]
    fn a_change_of_level_must_be_worth_its_penalty() {
        // Two alike, and time for one of them: the one that was refined stays so although the
        // other comes nearer, unless that weighs more than the penalty.
        let refined = |penalty: f64, nearer: f64| {
            let mut policy = policy(&[("hysteresis", penalty), ("focus", 0.0), ("motion", 0.0)]);
            let mut frame = TestFrame::new(tree(vec![root(20.0, -5.0), root(20.0, 5.0)]));
            frame.target_ms = 25.0;
            assert_eq!(frame.front(&mut *policy), [1, 2, 3]);
            let moved = tree(vec![root(20.0, -5.0), root(nearer, 5.0)]);
            let mut frame = TestFrame::new(moved);
            frame.target_ms = 25.0;
            frame.front(&mut *policy)
        };
        assert_eq!(refined(0.0, 19.8), [0, 4, 5]);
        assert_eq!(refined(0.1, 19.8), [1, 2, 3]);
        assert_eq!(refined(0.1, 12.0), [0, 4, 5]);
    }

    #[test]
    fn what_left_memory_is_drawn_more_coarsely() {
        let mut frame = TestFrame::new(tree(vec![root(10.0, 0.0)]));
        frame.target_ms = 100.0;
        let mut policy = policy(&[]);
        assert_eq!(frame.front(&mut *policy), [1, 2]);
        frame.residents.set(2, false);
        assert_eq!(frame.front(&mut *policy), [0]);
    }
}
