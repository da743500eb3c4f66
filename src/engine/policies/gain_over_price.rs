//! Gain over price, from the front of the frame before.
//!
//! Every node that could be refined has a rank: what the image gains by its children, over what they
//! take. Upgrades of the highest rank are made while they fit, or where what makes way for them ranks
//! lower by a factor (`hysteresis`): between these, both levels may stay as they are. A frame that
//! would be late is relieved at once, by downgrades of the lowest rank; detail returns once a change
//! is some time ago (`dwell_s`) and the frame has room for it. What is out of view keeps its level.
//!
//! The gain is the part of the image that a node covers, times how much less wrong it is by its
//! children. How wrong an image is grows with the error in pixels and then no more: `e / (e + e₀)`.

use std::collections::BinaryHeap;

use super::parameter::{Parameter, info, parameter, with_settings};
use super::ranked::{Ranked, count_culled, front_ms, refining_ms, visible_children};
use super::{PolicyKind, Settings};
use crate::Result;
use crate::engine::{FrameInput, Policy, Selection};

const NAME: &str = "gain-over-price";

#[derive(Clone, Copy, Debug, PartialEq)]
struct Options {
    hysteresis: f64,
    dwell_s: f64,
    refill: f64,
    half_error_px: f64,
    away: f64,
}

const OPTIONS: Options =
    Options { hysteresis: 1.5, dwell_s: 0.5, refill: 0.97, half_error_px: 2.0, away: 0.2 };

const PARAMETERS: [Parameter<Options>; 5] = [
    parameter!(hysteresis, 1.0, 100.0, "how many times higher ranks what others make way for"),
    parameter!(dwell_s, 0.0, 60.0, "seconds for which a node keeps a level, unless time is short"),
    parameter!(refill, 0.1, 1.0, "part of its time to which a frame is filled with upgrades"),
    parameter!(half_error_px, 1e-3, 1e3, "pixels of error by which an image is half wrong"),
    parameter!(away, 0.0, 1.0, "what a node out of view is worth in memory, over one in view"),
];

pub(super) const KIND: PolicyKind = PolicyKind {
    name: NAME,
    summary: "what the image gains over what it takes, with hysteresis, from the frame before",
    source: "this project",
    parameters: || info(&OPTIONS, &PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(NAME, OPTIONS, &PARAMETERS, settings)?;
        Ok(Box::new(GainOverPrice { options, ..GainOverPrice::default() }))
    },
};

impl Default for Options {
    fn default() -> Self {
        OPTIONS
    }
}

#[derive(Clone, Debug, Default)]
struct GainOverPrice {
    options: Options,
    now_s: f64,
    /// By node: whether its children stand for it when it is in view.
    refined: Vec<bool>,
    /// By node: when that was last chosen to change.
    changed_s: Vec<f64>,
    /// Nodes that could be refined, by rank.
    upgrades: BinaryHeap<Ranked>,
    /// Refined nodes of which no child in view is refined, by rank, the least first.
    downgrades: BinaryHeap<Ranked>,
    /// In view, coarse to fine.
    visited: Vec<u32>,
}

impl GainOverPrice {
    /// How wrong the image is where an error of `error` metres is seen at so many pixels a metre.
    fn wrong(&self, error: f64, pixels_per_metre: f64) -> f64 {
        let pixels = error.max(0.0) * pixels_per_metre;
        pixels / (pixels + self.options.half_error_px)
    }

    /// What the image gains by the children of a node, over what they take.
    fn rank(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        self.gain(frame, node) / refining_ms(frame, node)
    }

    fn gain(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        let &FrameInput { tree, view, .. } = frame;
        let at = tree.node(node);
        let nearest = view.pose.position.clamp(at.bbox[0], at.bbox[1]);
        let distance = view.pose.position.distance(nearest).max(tree.diagonal() * 1e-6);
        let per_metre = view.pixels_per_metre() / distance;
        let children = tree.children(node);
        let of_children = |&child: &u32| self.wrong(tree.node(child).mean_error, per_metre);
        let after = children.iter().map(of_children).sum::<f64>() / children.len().max(1) as f64;
        let less = self.wrong(at.mean_error, per_metre) - after;
        self.part(frame, node, per_metre) * less.max(0.0)
    }

    /// The part of the image that a node covers; of what is out of view, less than it would.
    fn part(&self, frame: &FrameInput<'_>, node: u32, per_metre: f64) -> f64 {
        let &FrameInput { tree, view, .. } = frame;
        let bbox = tree.node(node).bbox;
        if frame.is_visible(node) {
            return view.frustum.covered(bbox);
        }
        let [width, height] = view.size.map(f64::from);
        let pixels = (bbox[1] - bbox[0]).length() / 2.0 * per_metre;
        self.options.away * (pixels * pixels / (width * height)).min(1.0)
    }

    fn is_fresh(&self, node: u32) -> bool {
        self.now_s - self.changed_s[node as usize] < self.options.dwell_s
    }

    /// Goes down what is refined and can stay so; the front is what of it is not refined.
    fn walk(&mut self, frame: &FrameInput<'_>) {
        self.visited.clear();
        let roots = frame.tree.roots().iter();
        let is_there = |&&root: &&u32| frame.residents.contains(root) && frame.is_visible(root);
        self.visited.extend(roots.filter(is_there));
        let mut at = 0;
        while let Some(&node) = self.visited.get(at) {
            at += 1;
            self.refined[node as usize] &= frame.can_refine(node);
            if self.refined[node as usize] {
                self.visited.extend(visible_children(frame, node));
            }
        }
    }

    fn front_into(&self, out: &mut Selection) {
        out.front.clear();
        let is_drawn = |&&node: &&u32| !self.refined[node as usize];
        out.front.extend(self.visited.iter().filter(is_drawn));
    }

    /// Whether no child in view is refined.
    fn is_last(&self, frame: &FrameInput<'_>, node: u32) -> bool {
        visible_children(frame, node).all(|child| !self.refined[child as usize])
    }

    fn push_upgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        if frame.is_visible(node) && frame.can_refine(node) {
            self.upgrades.push(Ranked { rank: self.rank(frame, node), node });
        }
    }

    fn push_downgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        if self.is_last(frame, node) {
            self.downgrades.push(Ranked { rank: -self.rank(frame, node), node });
        }
    }

    fn upgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        self.refined[node as usize] = true;
        self.changed_s[node as usize] = self.now_s;
        for child in visible_children(frame, node) {
            // A child that was refined in an earlier frame, when its parent was too.
            self.refined[child as usize] = false;
            self.push_upgrade(frame, child);
        }
        self.push_downgrade(frame, node);
    }

    fn downgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        self.refined[node as usize] = false;
        self.changed_s[node as usize] = self.now_s;
        if let Some(parent) = frame.tree.node(node).parent {
            self.push_downgrade(frame, parent);
        }
    }

    /// The downgrade of the least rank.
    fn worst(&mut self, frame: &FrameInput<'_>) -> Option<Ranked> {
        while let Some(&Ranked { rank, node }) = self.downgrades.peek() {
            if self.refined[node as usize] && self.is_last(frame, node) {
                return Some(Ranked { rank: -rank, node });
            }
            self.downgrades.pop();
        }
        None
    }

    /// Downgrades until a frame of `ms` milliseconds is not late.
    fn relieve(&mut self, frame: &FrameInput<'_>, mut ms: f64) -> f64 {
        while ms > frame.budget_ms {
            let Some(Ranked { node, .. }) = self.worst(frame) else { break };
            ms -= refining_ms(frame, node);
            self.downgrade(frame, node);
        }
        ms
    }

    fn refine(&mut self, frame: &FrameInput<'_>, mut ms: f64) {
        let full_ms = frame.budget_ms * self.options.refill;
        while let Some(Ranked { rank, node }) = self.upgrades.pop() {
            if rank <= 0.0 {
                break;
            }
            if self.is_fresh(node) {
                continue;
            }
            let more_ms = refining_ms(frame, node);
            if ms + more_ms <= full_ms {
                ms += more_ms;
                self.upgrade(frame, node);
                continue;
            }
            // What makes way for it.
            let mut way = Vec::new();
            let mut freed_ms = 0.0;
            while ms + more_ms - freed_ms > full_ms {
                let Some(worst) = self.worst(frame) else { break };
                if worst.rank * self.options.hysteresis >= rank || self.is_fresh(worst.node) {
                    break;
                }
                self.downgrades.pop();
                freed_ms += refining_ms(frame, worst.node);
                way.push(worst);
            }
            if ms + more_ms - freed_ms > full_ms {
                self.downgrades.extend(way.iter().map(|w| Ranked { rank: -w.rank, node: w.node }));
                break;
            }
            for worst in way {
                self.downgrade(frame, worst.node);
            }
            ms += more_ms - freed_ms;
            self.upgrade(frame, node);
        }
    }
}

impl Policy for GainOverPrice {
    fn name(&self) -> &'static str {
        NAME
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        self.refined.resize(frame.tree.len(), false);
        self.changed_s.resize(frame.tree.len(), f64::NEG_INFINITY);
        self.now_s += frame.dt_s;
        self.upgrades.clear();
        self.downgrades.clear();
        self.walk(frame);
        for at in 0..self.visited.len() {
            let node = self.visited[at];
            match self.refined[node as usize] {
                true => self.push_downgrade(frame, node),
                false => self.push_upgrade(frame, node),
            }
        }
        self.front_into(out);
        let ms = self.relieve(frame, front_ms(frame, &out.front));
        self.refine(frame, ms);
        self.walk(frame);
        self.front_into(out);
        // Finer nodes also hide and cover other parts of the image, which none of them pays for.
        self.relieve(frame, front_ms(frame, &out.front));
        self.walk(frame);
        self.front_into(out);
        out.requests.extend(frame.tree.roots().iter().map(|&root| (root, f64::MAX)));
        for &node in &self.visited {
            let children = frame.tree.children(node);
            if !children.is_empty() {
                let rank = self.rank(frame, node);
                out.requests.extend(children.iter().map(|&child| (child, rank)));
            }
        }
        count_culled(frame, out);
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        match frame.tree.node(node).parent {
            Some(parent) => self.rank(frame, parent),
            None => f64::MAX,
        }
    }
}
