//! Gain over price, going on from the front of the frame before.
//!
//! Every node that could give way to its children has a rank: what the image gains by them, over what
//! they take. A frame that would be late is relieved at once, by the nodes of the least rank. What is
//! left of its time is filled by those of the highest; where none is left, what ranks lower by a factor
//! (`hysteresis`) makes way. Between the two, both levels of a node may stay as they are, and do. Once
//! changed, a node rests for `dwell_s`; one that was relieved of what it had just got rests longer each
//! time, unless its rank has doubled meanwhile: a camera that sways comes to rest. What is out of view
//! keeps its level.

mod ahead;
mod gain;
mod leap;
mod levels;
mod sway;
#[cfg(test)]
mod tests;
mod worth;

use std::collections::BinaryHeap;

use super::parameter::{Parameter, info, parameter, with_settings};
use super::ranked::{
    Ranked, count_culled, drawn_ms, front_ms, refining_ms, visible_children, wholly_refining_ms,
};
use super::{PolicyKind, Settings};
use crate::Result;
use crate::engine::{FrameInput, Policy, Selection};
use ahead::Ahead;
use gain::Gain;
pub(in crate::engine) use gain::{part_of_picture, removed};
use leap::{Leap, Rests};
use levels::{Cause, Levels};
use worth::Worth;

/// A frame is full from this part of its budget on.
const FULL: f64 = 0.9;

/// Where a front takes so many times its budget, it may be that what it hides is not known yet.
const MUCH_LATE: f64 = 1.1;

/// So often at most a front is summed up in a frame and relieved of what it takes too long.
const MOST_ROUNDS: usize = 8;

const NAME: &str = "gain-over-price";

#[derive(Clone, Copy, Debug, PartialEq)]
struct Options {
    hysteresis: f64,
    dwell_s: f64,
    backoff_s: f64,
    slack: f64,
    away: f64,
    keep_s: f64,
    ahead: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            hysteresis: 1.5,
            dwell_s: 0.5,
            backoff_s: 16.0,
            slack: 0.02,
            away: 0.2,
            keep_s: 16.0,
            ahead: 0.2,
        }
    }
}

const PARAMETERS: [Parameter<Options>; 7] = [
    parameter!(hysteresis, 1.0, 100.0, "how many times higher ranks what others make way for"),
    parameter!(dwell_s, 0.0, 60.0, "seconds for which a node keeps a level, unless time is short"),
    parameter!(
        backoff_s,
        0.0,
        60.0,
        "seconds for which a node keeps a level to which it had soon to return; longer each time"
    ),
    parameter!(
        slack,
        0.0,
        0.5,
        "part of its time by which a frame is longer before it is relieved"
    ),
    parameter!(away, 0.0, 1.0, "what a node out of view is worth in memory, over one in view"),
    parameter!(
        keep_s,
        0.1,
        600.0,
        "seconds in which what a node was worth in memory is half forgotten"
    ),
    parameter!(
        ahead,
        0.0,
        1.0,
        "what a node that is expected in a second is worth, over one in view"
    ),
];

pub(super) const KIND: PolicyKind = PolicyKind {
    name: NAME,
    summary: "what the image gains over what it takes, with hysteresis, from the frame before",
    source: "this project",
    parameters: || info(&Options::default(), &PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(NAME, Options::default(), &PARAMETERS, settings)?;
        Ok(Box::new(GainOverPrice { options, ..GainOverPrice::default() }))
    },
};

#[derive(Clone, Debug, Default)]
struct GainOverPrice {
    options: Options,
    gain: Gain,
    levels: Levels,
    leap: Leap,
    ahead: Ahead,
    worth: Worth,
    /// The frame at hand is filled until it takes so many milliseconds.
    fill_ms: f64,
    /// By node: its rank, where it was visited in the frame at hand.
    ranks: Vec<f64>,
    /// Nodes that could be refined, the highest rank first.
    upgrades: BinaryHeap<Ranked>,
    /// Whether any of them was passed over in the frame at hand because it rests.
    have_rested: bool,
    /// Refined nodes of which no child in view is refined, the least rank first.
    downgrades: BinaryHeap<Ranked>,
    /// Those that make way for an upgrade.
    way: Vec<u32>,
    /// In view, coarse to fine.
    visited: Vec<u32>,
    queue: Vec<u32>,
}

impl GainOverPrice {
    fn rank(&mut self, frame: &FrameInput<'_>, node: u32) -> f64 {
        self.gain.of(frame, node) / wholly_refining_ms(frame, node)
    }

    /// Goes down what is refined and can stay so.
    fn walk(&mut self, frame: &FrameInput<'_>) {
        self.visited.clear();
        let roots = frame.tree.roots().iter();
        let is_there = |&&root: &&u32| frame.residents.contains(root) && frame.is_visible(root);
        self.visited.extend(roots.filter(is_there));
        let mut at = 0;
        while let Some(&node) = self.visited.get(at) {
            at += 1;
            if !self.levels.is_refined(node) {
                continue;
            } else if frame.can_refine(node) {
                self.visited.extend(visible_children(frame, node));
            } else {
                self.levels.lose(node);
            }
        }
    }

    /// What of the nodes visited is drawn.
    fn front_into(&self, out: &mut Selection) {
        out.front.clear();
        let is_drawn = |&&node: &&u32| !self.levels.is_refined(node);
        out.front.extend(self.visited.iter().filter(is_drawn));
    }

    fn is_last(&self, frame: &FrameInput<'_>, node: u32) -> bool {
        visible_children(frame, node).all(|child| !self.levels.is_refined(child))
    }

    fn push_upgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        let rank = self.ranks[node as usize];
        if rank > 0.0 && !frame.is_hidden(node) && frame.can_refine(node) {
            self.upgrades.push(Ranked { rank, node });
        }
    }

    fn push_downgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        // What is hidden takes no time.
        if self.is_last(frame, node) && !frame.is_hidden(node) {
            self.downgrades.push(Ranked { rank: -self.ranks[node as usize], node });
        }
    }

    fn upgrade(&mut self, frame: &FrameInput<'_>, node: u32) {
        self.levels.refine(node);
        self.queue.clear();
        self.queue.extend(visible_children(frame, node));
        for child in std::mem::take(&mut self.queue) {
            // It may have been refined when its parent was last.
            self.levels.lose(child);
            if !frame.tree.children(child).is_empty() {
                self.ranks[child as usize] = self.rank(frame, child);
                self.push_upgrade(frame, child);
            }
        }
        self.push_downgrade(frame, node);
    }

    /// Whether it had been refined of late, and seen so.
    fn downgrade(&mut self, frame: &FrameInput<'_>, node: u32, cause: Cause) -> bool {
        let is_back = self.levels.coarsen(node, self.ranks[node as usize], cause, &self.options);
        if let Some(parent) = frame.tree.node(node).parent {
            self.push_downgrade(frame, parent);
        }
        is_back
    }

    /// The refined node of the least rank.
    fn worst(&mut self, frame: &FrameInput<'_>) -> Option<u32> {
        while let Some(&Ranked { node, .. }) = self.downgrades.peek() {
            if self.levels.is_refined(node) && self.is_last(frame, node) {
                return Some(node);
            }
            self.downgrades.pop();
        }
        None
    }

    /// Its rank.
    fn least(&mut self, frame: &FrameInput<'_>) -> Option<f64> {
        self.worst(frame).map(|worst| self.ranks[worst as usize])
    }

    /// Whether a frame is late, as far as is known.
    fn is_late(&self, frame: &FrameInput<'_>, ms: f64) -> bool {
        ms > frame.budget_ms * (1.0 + self.options.slack)
    }

    /// Whether a front is not late without what it hides itself. Where the camera turns to other parts of the
    /// scene, or jumps, what was drawn before hides nothing of them.
    fn hides_enough(&self, frame: &FrameInput<'_>, out: &mut Selection) -> bool {
        let Some(hidden) = frame.hidden else { return false };
        let behind = hidden.behind(frame.tree, &out.front, frame.view);
        let is_hidden = |node: u32| behind.hides(node);
        let hides_enough = drawn_ms(frame, &out.front, &is_hidden) <= frame.budget_ms;
        if hides_enough {
            out.counted_on.extend(out.front.iter().copied().filter(|&node| is_hidden(node)));
        }
        hides_enough
    }

    /// Coarsens until a frame of `ms` milliseconds is not late.
    fn relieve(&mut self, frame: &FrameInput<'_>, mut ms: f64) -> f64 {
        if self.is_late(frame, ms) {
            let mut is_back = false;
            while ms > frame.budget_ms {
                let Some(node) = self.worst(frame) else { break };
                ms -= refining_ms(frame, node);
                is_back |= self.downgrade(frame, node, Cause::Late);
            }
            if is_back {
                self.levels.take_back();
            }
        }
        ms
    }

    /// The same of the front as it came to be: finer nodes also hide and cover other parts of the
    /// image, and coarser ones may cover more, which no node's price says. Whether it
    /// was late.
    fn relieve_whole(&mut self, frame: &FrameInput<'_>, out: &mut Selection) -> bool {
        for round in 0..MOST_ROUNDS {
            let ms = front_ms(frame, &out.front);
            if self.relieve(frame, ms) == ms {
                return round > 0;
            }
            self.walk(frame);
            self.front_into(out);
        }
        true
    }

    /// Refines while there is time, or what makes way; milliseconds that the frame then takes. Upgrades are
    /// left over where there is none.
    fn refine(&mut self, frame: &FrameInput<'_>, mut ms: f64) -> f64 {
        self.have_rested = false;
        while let Some(Ranked { rank, node }) = self.upgrades.pop() {
            let least = self.least(frame);
            if self.levels.rests(node, rank, least) {
                self.have_rested = true;
                continue;
            }
            let more_ms = ms + refining_ms(frame, node);
            let Some(freed_ms) = self.make_way(frame, rank, more_ms - self.fill_ms) else {
                self.upgrades.push(Ranked { rank, node });
                break;
            };
            ms = more_ms - freed_ms;
            self.upgrade(frame, node);
        }
        ms
    }

    /// Coarsens what ranks so much lower than `rank` that it makes way, until `over_ms` are freed;
    /// nothing where that does not come to as much.
    fn make_way(&mut self, frame: &FrameInput<'_>, rank: f64, over_ms: f64) -> Option<f64> {
        let mut way = std::mem::take(&mut self.way);
        way.clear();
        let mut freed_ms = 0.0;
        while freed_ms < over_ms {
            let Some(worst) = self.worst(frame) else { break };
            let worst_rank = self.ranks[worst as usize];
            if worst_rank * self.options.hysteresis >= rank || self.levels.is_fresh(worst) {
                break;
            }
            self.downgrades.pop();
            freed_ms += refining_ms(frame, worst);
            way.push(worst);
        }
        let is_enough = freed_ms >= over_ms;
        for &node in &way {
            match is_enough {
                true => _ = self.downgrade(frame, node, Cause::MakesWay),
                false => self.push_downgrade(frame, node),
            }
        }
        self.way = way;
        is_enough.then_some(freed_ms)
    }

    /// Refines what hides so much that all of it fits, where what ranks higher than `least`, by as much as
    /// others make way for, does not fit otherwise.
    fn leap(&mut self, frame: &FrameInput<'_>, least: Option<f64>, out: &mut Selection) {
        let makes_way = |&node: &u32| {
            self.levels.is_refined(node) && self.is_last(frame, node) && !self.levels.is_fresh(node)
        };
        let way = self.visited.iter().copied().filter(makes_way);
        let mut way: Vec<Ranked> =
            way.map(|node| Ranked { rank: self.ranks[node as usize], node }).collect();
        way.sort_unstable();
        let rests = Rests { levels: &self.levels, least, way };
        let hysteresis = self.options.hysteresis;
        let found =
            self.leap.find(frame, self.fill_ms, &out.front, &rests, hysteresis, &mut self.gain);
        let Some(leapt) = found else { return };
        for node in leapt.coarsened {
            let rank = self.ranks[node as usize];
            self.levels.coarsen(node, rank, Cause::MakesWay, &self.options);
        }
        for node in leapt.refined {
            self.levels.refine(node);
            for &child in frame.tree.children(node) {
                self.levels.lose(child);
            }
        }
        self.walk(frame);
        self.front_into(out);
        out.counted_on = leapt.hidden;
    }

    /// How many nodes would be drawn in a frame of `ms` milliseconds, were they in memory, where the
    /// least rank of what is refined is `least`.
    fn lacking(&self, frame: &FrameInput<'_>, ms: f64, least: Option<f64>) -> u32 {
        let makes_way = |rank: f64| rank > least.unwrap_or(0.0) * self.options.hysteresis;
        // Which of its children are in view need not be found out where there is time for all of them.
        let fits = |node: u32| {
            let is_time_for = |more_ms: f64| ms + more_ms <= self.fill_ms;
            is_time_for(wholly_refining_ms(frame, node)) || is_time_for(refining_ms(frame, node))
        };
        let would_be_refined = |&node: &u32| {
            let rank = self.ranks[node as usize];
            rank > 0.0
                && !self.levels.is_refined(node)
                && !frame.can_refine(node)
                && !frame.is_hidden(node)
                && !self.levels.rests(node, rank, least)
                && (makes_way(rank) || fits(node))
        };
        let nodes = self.visited.iter().copied().filter(would_be_refined);
        nodes.map(|node| frame.missing_children(node)).sum()
    }

    /// What is wanted in memory: the children of what is visited. What is there makes way only for what
    /// ranks so much higher, as in the image.
    fn request(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        self.worth.begin_frame(frame.tree.len(), frame.dt_s, &self.options);
        out.requests.extend(frame.tree.roots().iter().map(|&root| (root, f64::MAX)));
        for &node in &self.visited {
            let rank = self.ranks[node as usize];
            let worth = self.worth.in_view(node, rank);
            let is_hidden = frame.is_hidden(node);
            out.requests.extend(frame.tree.children(node).iter().filter_map(|&child| {
                match frame.residents.contains(child) {
                    true => Some((child, worth)),
                    false => (!is_hidden).then_some((child, rank / self.options.hysteresis)),
                }
            }));
        }
        let missing = |&(child, _): &(u32, f64)| !frame.residents.contains(child);
        let leap = self.leap.wanted(frame).filter(missing);
        out.requests.extend(leap.map(|(child, rank)| (child, rank / self.options.hysteresis)));
    }
}

impl Policy for GainOverPrice {
    fn name(&self) -> &'static str {
        NAME
    }

    fn wants_seen_areas(&self) -> bool {
        true
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        self.levels.begin_frame(frame, &self.options);
        self.gain.begin_frame(frame.tree.len(), frame.dt_s);
        self.ranks.resize(frame.tree.len(), 0.0);
        self.upgrades.clear();
        self.downgrades.clear();
        self.walk(frame);
        for at in 0..self.visited.len() {
            let node = self.visited[at];
            if frame.tree.children(node).is_empty() {
                continue;
            }
            self.ranks[node as usize] = self.rank(frame, node);
            match self.levels.is_refined(node) {
                true => self.push_downgrade(frame, node),
                false => self.push_upgrade(frame, node),
            }
        }
        self.front_into(out);
        let before_ms = front_ms(frame, &out.front);
        let mut ms = before_ms;
        self.fill_ms = self.levels.fill_ms(frame.budget_ms, ms);
        if ms < MUCH_LATE * frame.budget_ms || !self.hides_enough(frame, out) {
            ms = self.relieve(frame, ms);
            ms = self.refine(frame, ms);
        }
        // What rests is left out for good where there is no time to speak of.
        let is_full = ms > FULL * self.fill_ms;
        let mut is_done =
            self.upgrades.is_empty() && ms <= frame.budget_ms && (is_full || !self.have_rested);
        let least = self.least(frame);
        if self.levels.have_changed() {
            self.walk(frame);
            self.front_into(out);
            is_done &= !self.relieve_whole(frame, out);
        }
        if is_done {
            self.leap.forget();
        } else if self.leap.is_due(frame.dt_s) {
            self.leap(frame, least, out);
        }
        if self.levels.have_changed() && self.levels.sways() {
            self.levels.change(front_ms(frame, &out.front) - before_ms);
        }
        out.lacking = self.lacking(frame, ms, least);
        self.request(frame, out);
        // Where there is time, whatever comes into view will be refined.
        let least = least.filter(|_| is_full).unwrap_or(0.0);
        self.ahead.request(frame, least, &self.worth, &self.options, out);
        count_culled(frame, out);
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        match frame.tree.node(node).parent {
            Some(parent) => self.worth.away(frame, parent, &self.options),
            None => f64::MAX,
        }
    }
}
