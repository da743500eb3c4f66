//! The two feedback loops (thesis, section 4.2, "Time slicing" and "Feedback loop").

use super::{LakhiaOptions, ShareFeedback};

/// `shareTime` is never less than this part of the time that the target leaves for nodes.
const LEAST_SHARE: f64 = 0.01;

/// What a frame's siblings will do to the time of later frames, if nothing else changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PendingChange {
    /// Milliseconds that siblings will add that are refused by their counters, which rise.
    pub refining_ms: f64,
    /// Milliseconds that the cheapest of the other refused siblings would add; infinite where
    /// there are none.
    pub cheapest_refused_ms: f64,
    /// Milliseconds that siblings will give back whose counters fall.
    pub coarsening_ms: f64,
}

impl PendingChange {
    /// Before any siblings were visited.
    pub const NONE: Self =
        Self { refining_ms: 0.0, cheapest_refused_ms: f64::INFINITY, coarsening_ms: 0.0 };

    /// Siblings in memory were refused that take `more_ms` more than their parent; `rising` says
    /// that their counters are on their way to let them in.
    pub fn refused(&mut self, more_ms: f64, rising: bool) {
        let more_ms = more_ms.max(0.0);
        if rising {
            self.refining_ms += more_ms;
        } else {
            self.cheapest_refused_ms = self.cheapest_refused_ms.min(more_ms);
        }
    }

    /// Siblings were drawn or passed that take `more_ms` more than their parent; `falling` says
    /// that their counters are on their way to shut them out.
    pub fn accepted(&mut self, more_ms: f64, falling: bool) {
        if falling {
            self.coarsening_ms += more_ms.max(0.0);
        }
    }
}

/// What the feedback loops adjust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feedback {
    /// `v_time`: milliseconds for one unit of cost.
    pub v_time: f64,
    /// `shareTime` of the roots, as a multiple of the time that the target leaves for nodes.
    share: f64,
    /// The fixed overhead, milliseconds.
    pub fixed_ms: f64,
}

impl Feedback {
    pub fn new(options: &LakhiaOptions) -> Self {
        Self { v_time: options.time.ms_per_cost, share: 1.0, fixed_ms: options.time.fixed_ms }
    }

    /// `shareTime` of the roots, milliseconds.
    pub fn share_ms(&self, options: &LakhiaOptions, target_ms: f64) -> f64 {
        self.share * for_nodes(options, target_ms)
    }

    /// After a frame that took `load` units of cost beside the fixed overhead.
    pub fn adjust(
        &mut self,
        options: &LakhiaOptions,
        target_ms: f64,
        load: f64,
        pending: &PendingChange,
        actual_ms: f64,
    ) {
        // The first loop: v_time follows what the frame took.
        let observed = (actual_ms - self.fixed_ms) / load;
        if load <= 0.0 {
            // Nothing was drawn, which is how the overhead is measured.
            self.fixed_ms += options.v_time_gain * (actual_ms - self.fixed_ms);
        } else if observed.is_finite() {
            let step = options.v_time_gain * (observed.max(0.0) - self.v_time);
            // Nothing is free, however noisy a clock is.
            self.v_time = (self.v_time + step).max(options.time.ms_per_cost * 1e-3);
        }
        // The second: time that is left goes to nodes that could use it.
        let slack = options.share_slack * target_ms;
        let left_ms = target_ms - actual_ms;
        let refused = pending.cheapest_refused_ms.is_finite() || pending.refining_ms > 0.0;
        let (more, less) = match options.share_feedback {
            ShareFeedback::Plain => (refused && left_ms > slack, left_ms < -slack),
            ShareFeedback::Damped => (
                pending.refining_ms + pending.cheapest_refused_ms <= left_ms,
                left_ms + pending.coarsening_ms < -slack,
            ),
        };
        if more {
            self.share *= 1.0 + options.share_gain;
        } else if less {
            self.share *= 1.0 - options.share_gain;
        }
        self.share = self.share.clamp(LEAST_SHARE, options.share_limit);
    }
}

/// What the target leaves for nodes once the picture is filled; never nothing at all, so that
/// shares keep their order.
fn for_nodes(options: &LakhiaOptions, target_ms: f64) -> f64 {
    let time = &options.time;
    let fixed_ms = time.fixed_ms + time.ms_per_cost * time.fill_cost;
    (target_ms - fixed_ms).max(0.01 * target_ms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::policies::lakhia::TimeModel;

    fn options() -> LakhiaOptions {
        let time = TimeModel { fixed_ms: 10.0, ms_per_cost: 0.1, fill_cost: 0.0 };
        LakhiaOptions { time, ..LakhiaOptions::default() }
    }

    const TARGET_MS: f64 = 30.0;

    const CALM: PendingChange = PendingChange::NONE;
    const REFUSED: PendingChange =
        PendingChange { cheapest_refused_ms: 2.0, ..PendingChange::NONE };

    #[test]
    fn v_time_comes_to_what_is_observed() {
        let (options, mut feedback) = (options(), Feedback::new(&options()));
        for _ in 0..200 {
            feedback.adjust(&options, TARGET_MS, 100.0, &CALM, 10.0 + 100.0 * 0.2);
        }
        assert!((feedback.v_time - 0.2).abs() < 1e-6, "{}", feedback.v_time);
        // One frame moves it by the gain, no more.
        feedback.adjust(&options, TARGET_MS, 100.0, &CALM, 10.0 + 100.0 * 1.2);
        let moved = 0.2 + options.v_time_gain * (1.2 - 0.2);
        assert!((feedback.v_time - moved).abs() < 1e-6, "{}", feedback.v_time);
    }

    #[test]
    fn a_frame_without_nodes_tells_the_overhead_and_nothing_of_costs() {
        let (options, mut feedback) = (options(), Feedback::new(&options()));
        for _ in 0..600 {
            feedback.adjust(&options, TARGET_MS, 0.0, &CALM, 14.0);
        }
        assert!((feedback.fixed_ms - 14.0).abs() < 1e-6, "{}", feedback.fixed_ms);
        assert_eq!(feedback.v_time, 0.1);
        feedback.adjust(&options, TARGET_MS, 100.0, &CALM, 24.0);
        assert_eq!(feedback.v_time, 0.1, "what is above that overhead is the nodes'");
    }

    /// `shareTime` after a frame, from 20.
    fn share(share_feedback: ShareFeedback, pending: PendingChange, actual_ms: f64) -> f64 {
        let options = LakhiaOptions { share_feedback, ..options() };
        let mut feedback = Feedback::new(&options);
        assert_eq!(feedback.share_ms(&options, TARGET_MS), 20.0);
        feedback.adjust(&options, TARGET_MS, 100.0, &pending, actual_ms);
        feedback.share_ms(&options, TARGET_MS)
    }

    #[test]
    fn the_plain_share_follows_the_thesis() {
        use ShareFeedback::Plain;
        assert_eq!(share(Plain, CALM, 12.0), 20.0, "nothing was refused");
        assert_eq!(share(Plain, REFUSED, 12.0), 20.2);
        assert_eq!(share(Plain, REFUSED, 29.9), 20.0, "not substantially below the target");
        assert_eq!(share(Plain, CALM, 31.0), 20.0, "not substantially above the target");
        assert_eq!(share(Plain, CALM, 40.0), 19.8);
    }

    #[test]
    fn the_damped_share_waits_for_what_is_on_its_way() {
        use ShareFeedback::Damped;
        assert_eq!(share(Damped, CALM, 12.0), 20.0, "nothing was refused");
        assert_eq!(share(Damped, REFUSED, 27.9), 20.2);
        assert_eq!(share(Damped, REFUSED, 28.1), 20.0, "it would not fit");
        let coming = PendingChange { refining_ms: 5.0, ..REFUSED };
        assert_eq!(share(Damped, coming, 22.9), 20.2, "there is room for both");
        assert_eq!(share(Damped, coming, 23.1), 20.0, "what is coming takes the room");
        assert_eq!(share(Damped, CALM, 40.0), 19.8);
        let going = PendingChange { coarsening_ms: 9.0, ..CALM };
        assert_eq!(share(Damped, going, 40.0), 20.0, "what is going suffices");
        assert_eq!(share(Damped, going, 41.0), 19.8, "what is going does not suffice");
    }

    #[test]
    fn odd_frames_leave_sound_figures() {
        for share_feedback in [ShareFeedback::Plain, ShareFeedback::Damped] {
            let options = LakhiaOptions { share_feedback, ..options() };
            let mut feedback = Feedback::new(&options);
            for actual in [0.0, 1e9, 5.0, f64::INFINITY, f64::NAN] {
                for cost in [0.0, 1e-300, 1e9] {
                    for _ in 0..2000 {
                        feedback.adjust(&options, TARGET_MS, cost, &REFUSED, actual);
                    }
                    assert!(feedback.v_time.is_finite() && feedback.v_time > 0.0);
                    let share_ms = feedback.share_ms(&options, TARGET_MS);
                    assert!(share_ms.is_finite() && share_ms > 0.0);
                }
            }
        }
    }
}
