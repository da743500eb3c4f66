//! The two feedback loops (thesis, section 4.2, "Time slicing" and "Feedback loop").

use super::LakhiaOptions;
use super::options::FRAME_S;

/// `shareTime` stays between these multiples of the target, so that it is a number.
const SHARES: [f64; 2] = [0.01, 1e6];

/// What the feedback loops adjust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feedback {
    /// `v_time`: milliseconds for one unit of cost.
    pub v_time: f64,
    /// The fixed overhead, milliseconds.
    pub fixed_ms: f64,
    /// `shareTime` of the roots, as a multiple of the target.
    pub share: f64,
    /// `v_time` before any feedback.
    first_v_time: f64,
    /// The overhead before any feedback.
    first_fixed_ms: f64,
}

/// What a frame was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drawn {
    /// Sum of the costs of the nodes drawn.
    pub cost: f64,
    /// Some nodes were not drawn because of their counters.
    pub refused: bool,
    /// Milliseconds that it could have taken.
    pub target_ms: f64,
    /// Milliseconds that it took.
    pub actual_ms: f64,
    /// Seconds since the frame before.
    pub dt_s: f64,
}

impl Feedback {
    /// With what a unit of cost, and a frame without nodes, are expected to take.
    pub fn new(v_time: f64, fixed_ms: f64) -> Self {
        Self { v_time, fixed_ms, share: 1.0, first_v_time: v_time, first_fixed_ms: fixed_ms }
    }

    /// Milliseconds of a frame that draws nodes of these costs, with and without feedback.
    pub fn estimate(&self, cost: f64) -> [f64; 2] {
        [self.fixed_ms + self.v_time * cost, self.first_fixed_ms + self.first_v_time * cost]
    }

    /// After a frame.
    pub fn adjust(&mut self, options: &LakhiaOptions, drawn: &Drawn) {
        let &Drawn { cost, refused, target_ms, actual_ms, dt_s } = drawn;
        let frames = dt_s / FRAME_S;
        // The first loop: v_time follows what the frame took.
        let gain = 1.0 - libm::pow(1.0 - options.v_time_gain, frames);
        let observed = (actual_ms - self.fixed_ms) / cost;
        if cost <= 0.0 {
            // Nothing was drawn, which is how the overhead is measured.
            if actual_ms.is_finite() {
                self.fixed_ms += gain * (actual_ms - self.fixed_ms);
            }
        } else if observed.is_finite() {
            // Nothing is free, however noisy a clock is.
            let least = self.first_v_time * 1e-3;
            self.v_time = (self.v_time + gain * (observed.max(0.0) - self.v_time)).max(least);
        }
        // The second: time that is left goes to nodes that could use it.
        let slack_ms = options.share_slack * target_ms;
        let left_ms = target_ms - actual_ms;
        if refused && left_ms > slack_ms {
            self.share *= libm::pow(1.0 + options.share_gain, frames);
        } else if left_ms < -slack_ms {
            self.share *= libm::pow(1.0 - options.share_gain, frames);
        }
        self.share = self.share.clamp(SHARES[0], SHARES[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Drawn =
        Drawn { cost: 100.0, refused: false, target_ms: 30.0, actual_ms: 30.0, dt_s: FRAME_S };

    fn after(frames: usize, mut feedback: Feedback, drawn: Drawn) -> Feedback {
        (0..frames).for_each(|_| feedback.adjust(&LakhiaOptions::DEFAULT, &drawn));
        feedback
    }

    #[test]
    fn v_time_comes_to_what_is_observed() {
        let start = Feedback::new(0.1, 10.0);
        let feedback = after(200, start, FRAME);
        assert!((feedback.v_time - 0.2).abs() < 1e-6, "{}", feedback.v_time);
        // One frame moves it by the gain, no more.
        let feedback = after(1, feedback, Drawn { actual_ms: 130.0, ..FRAME });
        let moved = 0.2 + LakhiaOptions::DEFAULT.v_time_gain * (1.2 - 0.2);
        assert!((feedback.v_time - moved).abs() < 1e-6, "{}", feedback.v_time);
        let [with, without] = feedback.estimate(100.0);
        assert!((with - (10.0 + 100.0 * moved)).abs() < 1e-4 && without == 20.0);
    }

    #[test]
    fn a_frame_without_nodes_tells_the_overhead_and_nothing_of_costs() {
        let start = Feedback::new(0.1, 10.0);
        let feedback = after(600, start, Drawn { cost: 0.0, actual_ms: 14.0, ..FRAME });
        assert!((feedback.fixed_ms - 14.0).abs() < 1e-6, "{}", feedback.fixed_ms);
        assert_eq!(feedback.v_time, 0.1);
    }

    #[test]
    fn the_share_grows_only_where_time_is_left_and_something_was_refused() {
        let share = |refused, actual_ms| {
            after(1, Feedback::new(0.1, 10.0), Drawn { refused, actual_ms, ..FRAME }).share
        };
        assert_eq!(share(false, 12.0), 1.0, "nothing was refused");
        assert!((share(true, 12.0) - 1.01).abs() < 1e-12);
        assert_eq!(share(true, 29.9), 1.0, "not substantially below the target");
        assert_eq!(share(true, 31.0), 1.0, "not substantially above the target");
        assert!((share(false, 40.0) - 0.99).abs() < 1e-12);
    }

    #[test]
    fn rates_are_by_the_second_and_not_by_the_frame() {
        let drawn = Drawn { refused: true, actual_ms: 12.0, ..FRAME };
        let slow = after(10, Feedback::new(0.1, 10.0), drawn);
        let fast = Drawn { dt_s: FRAME_S / 4.0, ..drawn };
        let fast = after(40, Feedback::new(0.1, 10.0), fast);
        assert!((slow.share - fast.share).abs() < 1e-12);
        assert!((slow.v_time - fast.v_time).abs() < 1e-12);
    }

    #[test]
    fn odd_frames_leave_sound_figures() {
        let mut feedback = Feedback::new(0.1, 10.0);
        for actual_ms in [0.0, 1e9, 5.0, f64::INFINITY, f64::NAN] {
            for cost in [0.0, 1e-300, 1e9] {
                feedback = after(2000, feedback, Drawn { refused: true, actual_ms, cost, ..FRAME });
                assert!(feedback.v_time.is_finite() && feedback.v_time > 0.0, "{feedback:?}");
                assert!(feedback.share.is_finite() && feedback.share > 0.0);
                assert!(feedback.fixed_ms.is_finite());
            }
        }
    }
}
