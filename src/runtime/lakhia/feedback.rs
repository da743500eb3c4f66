//! The two feedback loops (thesis, section 4.2, "Time slicing" and "Feedback loop").

use super::LakhiaOptions;

/// `shareTime` stays within these multiples of the time that the target leaves for nodes.
const SHARE_RANGE: [f64; 2] = [0.01, 1000.0];

/// What the feedback loops adjust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feedback {
    /// `v_time`: milliseconds for one unit of cost.
    pub v_time: f64,
    /// `shareTime` of the roots, milliseconds.
    pub share_ms: f64,
}

impl Feedback {
    pub fn new(options: &LakhiaOptions) -> Self {
        Self { v_time: options.time.ms_per_cost, share_ms: for_nodes(options) }
    }

    /// After a frame whose nodes cost `cost`. `refused` says that nodes in memory were kept back
    /// because their cumulative hysteresis was below 0.
    pub fn adjust(&mut self, options: &LakhiaOptions, cost: f64, refused: bool, actual_ms: f64) {
        // The first loop: v_time follows what the frame's nodes took.
        let observed = (actual_ms - options.time.fixed_ms) / cost;
        if cost > 0.0 && observed.is_finite() {
            let step = options.v_time_gain * (observed.max(0.0) - self.v_time);
            // Nothing is free, however noisy a clock is.
            self.v_time = (self.v_time + step).max(options.time.ms_per_cost * 1e-3);
        }
        // The second: time that is left goes to nodes that could use it.
        let slack = options.share_slack * options.target_ms;
        if refused && actual_ms < options.target_ms - slack {
            self.share_ms *= 1.0 + options.share_gain;
        } else if actual_ms > options.target_ms + slack {
            self.share_ms *= 1.0 - options.share_gain;
        }
        let [least, most] = SHARE_RANGE.map(|factor| factor * for_nodes(options));
        self.share_ms = self.share_ms.clamp(least, most);
    }
}

/// What the target leaves for nodes; never nothing at all, so that shares keep their order.
fn for_nodes(options: &LakhiaOptions) -> f64 {
    (options.target_ms - options.time.fixed_ms).max(0.01 * options.target_ms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::lakhia::TimeModel;

    fn options() -> LakhiaOptions {
        let time = TimeModel { fixed_ms: 10.0, ms_per_cost: 0.1 };
        LakhiaOptions { time, ..LakhiaOptions::default() }
    }

    #[test]
    fn v_time_comes_to_what_is_observed() {
        let (options, mut feedback) = (options(), Feedback::new(&options()));
        for _ in 0..200 {
            feedback.adjust(&options, 100.0, false, 10.0 + 100.0 * 0.2);
        }
        assert!((feedback.v_time - 0.2).abs() < 1e-6, "{}", feedback.v_time);
        // One frame moves it by the gain, no more.
        feedback.adjust(&options, 100.0, false, 10.0 + 100.0 * 1.2);
        assert!((feedback.v_time - 0.3).abs() < 1e-6, "{}", feedback.v_time);
    }

    #[test]
    fn the_share_grows_only_where_something_was_refused() {
        let (options, mut feedback) = (options(), Feedback::new(&options()));
        assert_eq!(feedback.share_ms, 20.0);
        feedback.adjust(&options, 100.0, false, 12.0);
        assert_eq!(feedback.share_ms, 20.0);
        feedback.adjust(&options, 100.0, true, 12.0);
        assert!((feedback.share_ms - 20.2).abs() < 1e-12);
        feedback.adjust(&options, 100.0, true, 29.9);
        assert!((feedback.share_ms - 20.2).abs() < 1e-12, "not substantially below the target");
    }

    #[test]
    fn the_share_shrinks_where_the_target_is_exceeded() {
        let (options, mut feedback) = (options(), Feedback::new(&options()));
        feedback.adjust(&options, 100.0, false, 31.0);
        assert_eq!(feedback.share_ms, 20.0, "not substantially above the target");
        feedback.adjust(&options, 100.0, false, 40.0);
        assert!((feedback.share_ms - 19.8).abs() < 1e-12);
    }

    #[test]
    fn odd_frames_leave_sound_figures() {
        let (options, mut feedback) = (options(), Feedback::new(&options()));
        for actual in [0.0, 1e9, 5.0, f64::INFINITY, f64::NAN] {
            for cost in [0.0, 1e-300, 1e9] {
                for _ in 0..2000 {
                    feedback.adjust(&options, cost, true, actual);
                }
                assert!(feedback.v_time.is_finite() && feedback.v_time > 0.0);
                assert!(feedback.share_ms.is_finite() && feedback.share_ms > 0.0);
            }
        }
    }
}
