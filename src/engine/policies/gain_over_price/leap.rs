//! Refining what hides the rest.
//!
//! Coarse façades hide nothing for sure, so that all of what is behind them is drawn, in the time in which
//! they would be refined. Node by node there is no way out, though with them refined all of it may take less
//! than before.

use std::collections::{BTreeSet, BinaryHeap};

use super::gain::Gain;
use super::levels::Levels;
use crate::engine::FrameInput;
use crate::engine::policies::ranked::{
    Ranked, added_ms, drawn_ms, visible_children, wholly_refining_ms,
};

/// It is tried so often, seconds.
const EVERY_S: f64 = 0.25;

/// Where less than this part of the budget goes to what is not seen, or is left over, none is tried, nor
/// anything loaded for one. A tenth goes to what is not seen in flights, in streets a half and more.
const LEAST_TO_GAIN: f64 = 0.3;

/// Where more than this part of the budget is left over, whatever the image gains is worth it.
const LEFT_OVER: f64 = 0.1;

/// So many nodes that were refined last are left as they were where, together, they take too long after all.
const MOST_UNDONE: usize = 4;

/// A node is not seen where it was in less than this part of what is under its box.
const SEEN: f64 = 0.1;

/// For so many times the budget nodes are refined to find out what they hide; one after the other.
const STRETCHES: [f64; 4] = [1.2, 1.5, 2.0, 3.0];

/// Which nodes a leap leaves as they are, and which it need not.
pub(super) struct Rests<'a> {
    pub levels: &'a Levels,
    /// The least rank of those that are refined, if any is.
    pub least: Option<f64>,
    /// Refined nodes of which no child is, that may make way: the least rank first.
    pub way: Vec<Ranked>,
}

impl Rests<'_> {
    fn long(&self, node: u32) -> bool {
        self.levels.rests_long(node)
    }

    /// At its rank. A camera that gets on comes to other views than that which made a node rest.
    fn at(&self, node: u32, rank: f64) -> bool {
        self.levels.sways() && self.levels.rests(node, rank, self.least)
    }
}

/// Many nodes that fit into the budget together, though one after the other they do not.
#[derive(Clone, Debug, Default)]
pub(super) struct Leap {
    since_s: f64,
    /// Which stretch is tried next.
    next: usize,
    /// Nodes below the front that would be refined too, were their children in memory, with their ranks.
    wanted: Vec<(u32, f64)>,
}

/// What comes of a leap.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Leapt {
    /// Nodes that are refined by it, coarse to fine.
    pub refined: Vec<u32>,
    /// Nodes that make way for these: coarse again.
    pub coarsened: Vec<u32>,
    /// Nodes of the new front that the rest of it hides.
    pub hidden: Vec<u32>,
}

impl Leap {
    /// Whether it is time to try one.
    pub fn is_due(&mut self, dt_s: f64) -> bool {
        self.since_s += dt_s;
        let is_due = self.since_s >= EVERY_S;
        if is_due {
            self.since_s = 0.0;
        }
        is_due
    }

    /// Tries one from a front of which no node fits into `budget_ms` that could be refined: nodes are refined by
    /// their rank for longer than there is time, and in the time that is left without what they hide. One of them
    /// at least must rank higher than the least of those that are refined, by `hysteresis`, unless there is time
    /// left over. What ranks so much lower makes way.
    pub fn find(
        &mut self,
        frame: &FrameInput<'_>,
        budget_ms: f64,
        front: &[u32],
        rests: &Rests<'_>,
        hysteresis: f64,
        gain: &mut Gain,
    ) -> Option<Leapt> {
        let hidden = frame.hidden?;
        let left_over_ms = budget_ms - drawn_ms(frame, front, &|node| frame.is_hidden(node));
        let least = match left_over_ms > LEFT_OVER * budget_ms {
            true => 0.0,
            false => rests.least.unwrap_or(0.0) * hysteresis,
        };
        if unseen_ms(frame, front) + left_over_ms < LEAST_TO_GAIN * budget_ms {
            self.forget();
            return None;
        }
        let stretch_ms = STRETCHES[self.next % STRETCHES.len()] * budget_ms;
        self.next += 1;
        let is_hidden = |node: u32| frame.is_hidden(node);
        let mut more = Refined::of(frame, front, &is_hidden, rests);
        more.refine(stretch_ms, gain, &mut &[][..], hysteresis);
        // What is drawn has its children asked for already.
        let drawn: BTreeSet<u32> = front.iter().copied().collect();
        self.wanted.clear();
        let is_wanted = |&&(node, rank): &&(u32, f64)| rank > least && !drawn.contains(&node);
        self.wanted.extend(more.lacking.iter().filter(is_wanted));
        let behind = hidden.behind(frame.tree, &more.front, frame.view);
        let is_hidden = |node: u32| behind.hides(node);
        let mut leapt = Refined::of(frame, front, &is_hidden, rests);
        let mut way = &rests.way[..];
        leapt.refine(budget_ms, gain, &mut way, hysteresis);
        if leapt.highest <= least {
            return None;
        }
        // Less is refined now, and may hide less; and boxes may cover more of the image than before.
        for _ in 0..=MOST_UNDONE {
            let below = leapt.nodes.last()?.rank / hysteresis;
            let behind = hidden.behind(frame.tree, &leapt.front, frame.view);
            let is_hidden = |node: u32| behind.hides(node);
            let over_ms = drawn_ms(frame, &leapt.front, &is_hidden) - budget_ms;
            if over_ms <= 0.0 {
                let hidden = leapt.front.iter().copied().filter(|&node| is_hidden(node)).collect();
                let refined = leapt.nodes.iter().map(|ranked| ranked.node).collect();
                return Some(Leapt { refined, coarsened: leapt.coarsened, hidden });
            }
            if leapt.make_way(over_ms, &mut way, below, &is_hidden).is_none() {
                leapt.undo_last();
            }
        }
        None
    }

    /// Wants nothing in memory any more: there is time for all that is to be seen without, or nothing to gain.
    pub fn forget(&mut self) {
        self.wanted.clear();
    }

    /// What is wanted in memory for it, with ranks.
    pub fn wanted<'a>(
        &'a self,
        frame: &'a FrameInput<'_>,
    ) -> impl Iterator<Item = (u32, f64)> + 'a {
        self.wanted.iter().flat_map(|&(node, rank)| {
            frame.tree.children(node).iter().map(move |&child| (child, rank))
        })
    }
}

/// A front that is refined.
struct Refined<'a> {
    frame: &'a FrameInput<'a>,
    is_hidden: &'a dyn Fn(u32) -> bool,
    /// What stays as it is.
    rests: &'a Rests<'a>,
    front: Vec<u32>,
    /// What was refined, coarse to fine.
    nodes: Vec<Ranked>,
    /// What made way.
    coarsened: Vec<u32>,
    /// The highest rank of that, 0 where there is none.
    highest: f64,
    /// What would be refined too, were its children in memory, with ranks.
    lacking: Vec<(u32, f64)>,
}

impl<'a> Refined<'a> {
    fn of(
        frame: &'a FrameInput<'a>,
        front: &[u32],
        is_hidden: &'a dyn Fn(u32) -> bool,
        rests: &'a Rests<'a>,
    ) -> Self {
        Self {
            frame,
            is_hidden,
            rests,
            front: front.to_vec(),
            nodes: Vec::new(),
            coarsened: Vec::new(),
            highest: 0.0,
            lacking: Vec::new(),
        }
    }

    /// Refines by rank what is not hidden until it takes so many milliseconds; the first of `way` makes way
    /// for what ranks higher by `hysteresis`.
    fn refine(&mut self, most_ms: f64, gain: &mut Gain, way: &mut &[Ranked], hysteresis: f64) {
        let &mut Self { frame, is_hidden, rests, .. } = self;
        let mut ms = drawn_ms(frame, &self.front, is_hidden);
        let mut upgrades = BinaryHeap::new();
        let mut push = |upgrades: &mut BinaryHeap<Ranked>, node: u32| {
            if !frame.tree.children(node).is_empty() && !is_hidden(node) && !rests.long(node) {
                let rank = gain.of(frame, node) / wholly_refining_ms(frame, node);
                if rank > 0.0 && !rests.at(node, rank) {
                    upgrades.push(Ranked { rank, node });
                }
            }
        };
        self.front.iter().for_each(|&node| push(&mut upgrades, node));
        while let Some(Ranked { rank, node }) = upgrades.pop() {
            let parent = frame.tree.node(node).parent;
            if parent.is_some_and(|parent| self.coarsened.contains(&parent)) {
                continue;
            }
            let drawn = visible_children(frame, node).filter(|&child| !is_hidden(child));
            ms += added_ms(frame, node, drawn);
            let over_ms = ms - most_ms;
            if !frame.can_refine(node) {
                if over_ms > 0.0 {
                    break;
                }
                self.lacking.push((node, rank));
                continue;
            }
            // What it came from is no way for it.
            self.nodes.push(Ranked { rank, node });
            if over_ms > 0.0 {
                let Some(freed_ms) = self.make_way(over_ms, way, rank / hysteresis, is_hidden)
                else {
                    self.nodes.pop();
                    break;
                };
                ms -= freed_ms;
            }
            self.highest = self.highest.max(rank);
            for child in visible_children(frame, node) {
                self.front.push(child);
                push(&mut upgrades, child);
            }
        }
        let gone: BTreeSet<u32> = self.nodes.iter().map(|ranked| ranked.node).collect();
        self.front.retain(|node| !gone.contains(node));
    }

    /// Leaves the node as it was that was refined last.
    fn undo_last(&mut self) {
        if let Some(Ranked { node, .. }) = self.nodes.pop() {
            self.coarsen(node);
        }
    }

    fn coarsen(&mut self, node: u32) {
        let children = self.frame.tree.children(node);
        self.front.retain(|at| !children.contains(at));
        self.front.push(node);
    }

    /// Coarsens the first of `way`, below a rank, until so many milliseconds are freed; how many. None where
    /// that does not come to as much.
    fn make_way(
        &mut self,
        over_ms: f64,
        way: &mut &[Ranked],
        below: f64,
        is_hidden: &dyn Fn(u32) -> bool,
    ) -> Option<f64> {
        let frame = self.frame;
        let (mut freed_ms, mut coarsened) = (0.0, Vec::new());
        let mut others = *way;
        while freed_ms < over_ms {
            let (&Ranked { rank, node }, after) = others.split_first()?;
            if rank >= below {
                return None;
            }
            others = after;
            let is_refined = |child: u32| self.nodes.iter().any(|ranked| ranked.node == child);
            let is_last = visible_children(frame, node).all(|child| !is_refined(child));
            let drawn = || visible_children(frame, node).filter(|&child| !is_hidden(child));
            if is_last && drawn().next().is_some() {
                freed_ms += added_ms(frame, node, drawn());
                coarsened.push(node);
            }
        }
        coarsened.iter().for_each(|&node| self.coarsen(node));
        self.coarsened.append(&mut coarsened);
        *way = others;
        Some(freed_ms)
    }
}

/// Milliseconds of what is drawn of a front though, by the surfaces of the roots, it is not seen: what coarse
/// surfaces do not hide for sure, and finer ones may.
fn unseen_ms(frame: &FrameInput<'_>, front: &[u32]) -> f64 {
    let is_seen = |node| {
        frame.seen.is_some_and(|seen| seen.part(frame.tree, node).is_none_or(|part| part > SEEN))
    };
    drawn_ms(frame, front, &|node| frame.is_hidden(node) || is_seen(node))
}
