//! Which nodes are refined, since when, and how soon that may change.

use super::Options;
use super::sway::Sway;
use crate::camera::Pose;
use crate::engine::FrameInput;

/// A node that is brought back to the level that it had within so many seconds rests longer each time.
pub(super) const BACK_WITHIN_S: f64 = 15.0;

/// Unless the budget is less than this part of what it was of late: the machine has become slower, and
/// no node is to blame,
const SLOW: f64 = 0.7;

/// nor for as many seconds after, in which what gave way returns all at once.
const AFTER_SLOW_S: f64 = 1.0;

/// What the budget was of late is half forgotten after so many seconds.
const OF_LATE_S: f64 = 15.0;

/// By how much longer.
const LONGER: f64 = 16.0;

/// So many returns are counted at most.
const MOST_RETURNS: u8 = 8;

/// No longer than this.
const LONGEST_S: f64 = 600.0;

/// A node whose rank is so many times what it was need not rest any longer; before a camera that sways so many
/// times as much for each time that it had come back before.
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
    /// How often, one time after the other, it was soon brought back to this level.
    returns: u8,
    /// Its rank at that time.
    rank: f64,
    /// Whether the camera stood still then.
    was_still: bool,
}

/// Why a node is coarsened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// Its frame would be late.
    Late,
    /// What ranks higher needs its time.
    MakesWay,
}

const UNTOUCHED: Level = Level {
    is_refined: false,
    changed_s: f64::NEG_INFINITY,
    rest_s: 0.0,
    returns: 0,
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
    sway: Sway,
    /// When the camera moved last.
    moved_s: f64,
    nodes: Vec<Level>,
}

impl Levels {
    pub fn begin_frame(&mut self, frame: &FrameInput<'_>, options: &Options) {
        self.nodes.resize(frame.tree.len(), UNTOUCHED);
        self.now_s += frame.dt_s;
        if let Some(before) = self.pose.replace(frame.view.pose) {
            if before != frame.view.pose {
                self.moved_s = self.now_s;
            }
            self.sway.go(&before, &frame.view.pose, frame.dt_s);
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

    /// Whether the camera goes to and fro.
    pub fn sways(&self) -> bool {
        !self.is_still() && self.sway.is_to_and_fro()
    }

    /// What was refined of late was coarsened for want of time.
    pub fn take_back(&mut self) {
        self.sway.take_back();
    }

    /// Milliseconds that a frame is filled up to whose front takes `ms`, of a budget.
    pub fn fill_ms(&mut self, budget_ms: f64, ms: f64) -> f64 {
        let more_ms = self.sway.takes_more(ms);
        match self.sways() {
            true => budget_ms * (1.0 - self.sway.reserve()) - more_ms,
            false => budget_ms,
        }
    }

    /// What was changed in a frame takes so many milliseconds more.
    pub fn change(&mut self, ms: f64) {
        self.sway.change(ms);
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

    /// It stands for itself again, at a rank. Whether it had been refined of late, and seen so.
    pub fn coarsen(&mut self, node: u32, rank: f64, cause: Cause, options: &Options) -> bool {
        self.have_changed = true;
        let (was_still, sways) = (self.is_still(), self.sways());
        let level = &mut self.nodes[node as usize];
        let is_slow = self.slow_s.is_some_and(|slow_s| self.now_s - slow_s <= AFTER_SLOW_S);
        // Before a camera that stands only what has arrived ranks higher, and that happens once.
        let is_excused = is_slow || was_still && cause == Cause::MakesWay;
        let is_back = !is_excused && self.now_s - level.changed_s < BACK_WITHIN_S;
        // What was refined in this very frame was never seen so; in a sway it rests as it did.
        let was_seen = level.changed_s < self.now_s;
        level.returns = match (was_seen, is_back) {
            (true, true) => (level.returns + 1).min(MOST_RETURNS),
            (false, _) if sways => level.returns,
            _ => 0,
        };
        level.rest_s = match level.returns {
            0 => options.dwell_s,
            returns => (options.backoff_s * LONGER.powi(i32::from(returns) - 1)).min(LONGEST_S),
        };
        (level.is_refined, level.changed_s) = (false, self.now_s);
        (level.rank, level.was_still) = (rank, was_still);
        is_back && was_seen
    }

    /// Whether a node that is refined was not long ago.
    pub fn is_fresh(&self, node: u32) -> bool {
        self.now_s - self.nodes[node as usize].changed_s < self.dwell_s
    }

    /// Whether a node of this rank is not to be refined yet, where the least rank of those that are
    /// is `least`, if any is. Once a camera that moved stands still, what it takes to draw does not change, and
    /// nothing need rest; nor once there is more or less to draw beside it. Before a camera that sways, what
    /// comes back again and again waits for ever higher ranks, also where nothing else is refined.
    pub fn rests(&self, node: u32, rank: f64, least: Option<f64>) -> bool {
        let level = self.nodes[node as usize];
        let Level { changed_s, rest_s, returns, was_still, .. } = level;
        let since_s = self.now_s - changed_s;
        let may_rest = (was_still || !self.is_still()) && changed_s >= self.within_s;
        let (risen, of_none) = match self.sways() {
            true => (RISEN.powi(i32::from(returns)), f64::INFINITY),
            false => (RISEN, 0.0),
        };
        let is_low = rank < risen * level.rank.min(least.unwrap_or(of_none));
        since_s < self.dwell_s || may_rest && since_s < rest_s && is_low
    }

    /// Whether a node rests that was brought back to its level again and again: not even a leap refines it.
    pub fn rests_long(&self, node: u32) -> bool {
        let Level { changed_s, rest_s, returns, .. } = self.nodes[node as usize];
        returns > 1 && self.now_s - changed_s < rest_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;
    use crate::engine::test_frame::{TestFrame, root};
    use crate::runtime::test_tree::tree;

    /// Levels of one node that can be refined, and a camera that sways unless it stands.
    struct Swaying {
        frame: TestFrame,
        levels: Levels,
        options: Options,
        stands: bool,
    }

    impl Swaying {
        fn new() -> Self {
            let mut swaying = Self {
                frame: TestFrame::new(tree(vec![root(10.0, 0.1, 2)])),
                levels: Levels::default(),
                options: Options::default(),
                stands: false,
            };
            swaying.pass(100);
            swaying
        }

        fn pass(&mut self, seconds: u32) {
            for _ in 0..seconds {
                if !self.stands {
                    let mut pose = self.frame.view.pose;
                    pose.position.x = 1.0 - pose.position.x;
                    self.frame.view =
                        View::new(pose, self.frame.view.velocity, self.frame.view.size);
                }
                let input = FrameInput { dt_s: 1.0, ..self.frame.input() };
                self.levels.begin_frame(&input, &self.options);
            }
        }

        /// Refines the node, and coarsens it after some seconds at a rank of 1.
        fn refine_until(&mut self, seconds: u32, cause: Cause) -> bool {
            self.levels.refine(0);
            self.pass(seconds);
            self.levels.coarsen(0, 1.0, cause, &self.options)
        }

        fn refine_for(&mut self, seconds: u32) -> bool {
            self.refine_until(seconds, Cause::Late)
        }

        /// Seconds until it rests no longer.
        fn rests_s(&mut self, rests: impl Fn(&Levels) -> bool) -> u32 {
            let mut seconds = 0;
            while rests(&self.levels) {
                self.pass(1);
                seconds += 1;
            }
            seconds
        }
    }

    #[test]
    fn a_leap_leaves_alone_what_was_brought_back_again() {
        let mut swaying = Swaying::new();
        let rests_long = |levels: &Levels| levels.rests_long(0);
        assert!(swaying.refine_for(10));
        assert_eq!(swaying.rests_s(rests_long), 0, "once");
        assert!(swaying.refine_for(10));
        assert_eq!(swaying.rests_s(rests_long), 256);
        assert!(swaying.refine_for(10));
        assert_eq!(swaying.rests_s(rests_long), 600);
        assert!(!swaying.refine_for(20), "not soon");
        assert_eq!(swaying.rests_s(rests_long), 0);
    }

    /// Only what has arrived can rank higher there, and it does so once.
    #[test]
    fn what_makes_way_before_a_camera_that_stands_is_not_to_blame() {
        let mut swaying = Swaying::new();
        let rests = |levels: &Levels| levels.rests(0, 1.0, Some(1.0));
        assert!(swaying.refine_until(5, Cause::MakesWay), "it moves");
        assert_eq!(swaying.rests_s(rests), 16);
        swaying.stands = true;
        swaying.pass(2);
        assert!(!swaying.refine_until(5, Cause::MakesWay));
        assert_eq!(swaying.rests_s(rests), 1, "as long as all that has changed");
        assert!(swaying.refine_until(5, Cause::Late));
        assert_eq!(swaying.rests_s(rests), 16);
    }

    #[test]
    fn what_was_never_seen_refined_rests_as_it_did() {
        let mut swaying = Swaying::new();
        let rests = |levels: &Levels| levels.rests(0, 1.0, None);
        assert!(swaying.refine_for(10));
        assert_eq!(swaying.rests_s(rests), 16);
        assert!(!swaying.refine_for(0));
        assert_eq!(swaying.rests_s(rests), 16);
    }

    #[test]
    fn the_more_often_it_was_brought_back_the_higher_it_must_rank_to_rest_no_longer() {
        let mut swaying = Swaying::new();
        for (times, rank) in [(1, 2.0), (2, 4.0), (3, 8.0)] {
            swaying.refine_for(5);
            swaying.pass(1);
            let rests = |rank: f64| swaying.levels.rests(0, rank, Some(2.0));
            assert_eq!([0.99, 1.01].map(|part| rests(part * rank)), [true, false], "{times}");
        }
        swaying.stands = true;
        swaying.pass(2);
        assert!(!swaying.levels.rests(0, 1.0, Some(2.0)));
    }
}
