//! Which nodes are refined, since when, and how soon that may change.

use super::Options;
use crate::camera::Pose;
use crate::engine::FrameInput;

/// A node that is brought back to the level that it had within so many seconds rests longer each time.
const BACK_WITHIN_S: f64 = 15.0;

/// Unless the budget is less than this part of what it was of late: the machine has become slower, and
/// no node is to blame,
const SLOW: f64 = 0.7;

/// nor for as many seconds after, in which what gave way returns all at once.
const AFTER_SLOW_S: f64 = 1.0;

/// What the budget was of late is half forgotten after so many seconds.
const OF_LATE_S: f64 = 15.0;

/// By how much longer.
const LONGER: f64 = 16.0;

/// No longer than this.
const LONGEST_S: f64 = 600.0;

/// A node whose rank is so many times what it was need not rest any longer.
const RISEN: f64 = 2.0;

/// What is known of one node.
#[derive(Clone, Copy, Debug)]
struct Level {
    /// Whether its children stand for it when it is in view.
    is_refined: bool,
    /// When that was last chosen to change, seconds.
    changed_s: f64,
    /// How long it rests from then on.
    rest_s: f64,
    /// Its rank at that time.
    rank: f64,
    /// Whether the camera stood still then.
    was_still: bool,
}

const UNTOUCHED: Level = Level {
    is_refined: false,
    changed_s: f64::NEG_INFINITY,
    rest_s: 0.0,
    rank: 0.0,
    was_still: false,
};

/// The levels of all nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Levels {
    now_s: f64,
    dwell_s: f64,
    /// In the frame at hand.
    have_changed: bool,
    /// The highest budget of late, milliseconds.
    highest_ms: f64,
    /// When the budget was much less than that last, or another part of the scene was to be drawn.
    slow_s: Option<f64>,
    /// Whether what is far is not to be drawn.
    is_within: bool,
    /// When that changed last.
    within_s: f64,
    pose: Option<Pose>,
    /// When the camera moved last.
    moved_s: f64,
    nodes: Vec<Level>,
}

impl Levels {
    pub fn begin_frame(&mut self, frame: &FrameInput<'_>, options: &Options) {
        self.nodes.resize(frame.tree.len(), UNTOUCHED);
        self.now_s += frame.dt_s;
        if self.pose.replace(frame.view.pose) != Some(frame.view.pose) {
            self.moved_s = self.now_s;
        }
        self.have_changed = false;
        let kept = libm::exp2(-frame.dt_s / OF_LATE_S);
        self.highest_ms = (self.highest_ms * kept).max(frame.budget_ms);
        if frame.budget_ms < SLOW * self.highest_ms {
            self.slow_s = Some(self.now_s);
        }
        let is_within = frame.view.frustum.box_within().is_some();
        if std::mem::replace(&mut self.is_within, is_within) != is_within {
            // What gave way to what is far, or gives way now, is not to blame either.
            (self.within_s, self.slow_s) = (self.now_s, Some(self.now_s));
        }
        self.dwell_s = options.dwell_s;
    }

    /// Whether the camera has not moved for as long as nodes dwell.
    fn is_still(&self) -> bool {
        self.now_s - self.moved_s >= self.dwell_s
    }

    /// Whether any was chosen to change in this frame.
    pub fn have_changed(&self) -> bool {
        self.have_changed
    }

    pub fn is_refined(&self, node: u32) -> bool {
        self.nodes[node as usize].is_refined
    }

    /// Its children stand for it.
    pub fn refine(&mut self, node: u32) {
        self.have_changed = true;
        let level = &mut self.nodes[node as usize];
        (level.is_refined, level.changed_s) = (true, self.now_s);
    }

    /// It stands for itself, without having been chosen to.
    pub fn lose(&mut self, node: u32) {
        self.nodes[node as usize].is_refined = false;
    }

    /// It stands for itself again, at a rank.
    pub fn coarsen(&mut self, node: u32, rank: f64, options: &Options) {
        self.have_changed = true;
        let was_still = self.is_still();
        let level = &mut self.nodes[node as usize];
        let is_to_blame = self.slow_s.is_none_or(|slow_s| self.now_s - slow_s > AFTER_SLOW_S);
        let is_back = is_to_blame && self.now_s - level.changed_s < BACK_WITHIN_S;
        // What was refined in this very frame was never seen so.
        let was_seen = level.changed_s < self.now_s;
        level.rest_s = match is_back && was_seen {
            true => (level.rest_s * LONGER).clamp(options.backoff_s, LONGEST_S),
            false => options.dwell_s,
        };
        (level.is_refined, level.changed_s) = (false, self.now_s);
        (level.rank, level.was_still) = (rank, was_still);
    }

    /// Whether a node that is refined was not long ago.
    pub fn is_fresh(&self, node: u32) -> bool {
        self.now_s - self.nodes[node as usize].changed_s < self.dwell_s
    }

    /// Whether a node of this rank is not to be refined yet, where the least rank of those that are
    /// is `least`. Once a camera that moved stands still, what it takes to draw does not change, and
    /// nothing need rest; nor once there is more or less to draw beside it.
    pub fn rests(&self, node: u32, rank: f64, least: f64) -> bool {
        let Level { changed_s, rest_s, rank: then, was_still, .. } = self.nodes[node as usize];
        let since_s = self.now_s - changed_s;
        let may_rest = (was_still || !self.is_still()) && changed_s >= self.within_s;
        since_s < self.dwell_s || may_rest && since_s < rest_s && rank < RISEN * then.min(least)
    }

    /// Whether a node rests that was brought back to its level again and again: not even a leap refines it.
    pub fn rests_long(&self, node: u32, options: &Options) -> bool {
        let Level { changed_s, rest_s, .. } = self.nodes[node as usize];
        rest_s > options.backoff_s && self.now_s - changed_s < rest_s
    }
}
