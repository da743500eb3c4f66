//! How much of a target is kept free, so that frames keep to it although estimates are not exact.

use std::collections::VecDeque;

/// Seconds of frames that are remembered.
const WINDOW_S: f64 = 10.0;

/// And no more frames than this, so that they can be looked through in each frame.
const MOST_FRAMES: usize = 600;

/// The part of frames that are to keep to the target.
const KEPT: f64 = 0.95;

/// However wrong estimates were, budgets stay within this of the target.
const RANGE: [f64; 2] = [0.5, 2.0];

/// Compares what frames took with what their prices come to.
///
/// Whatever the cost model has no term for counts: noise, choosing, uploads. Of the frames of the last
/// ten seconds nineteen of twenty took at most `ratio` times what was expected, so that frames which
/// are expected to take the target over `ratio` will keep to it as often. Quantiles rather than
/// deviations, since times have long tails: a stall of a second would otherwise cost detail for
/// as long as it is remembered.
#[derive(Clone, Debug, Default)]
pub struct Margin {
    /// When frames were drawn, and what they took over what was expected.
    ratios: VecDeque<(f64, f64)>,
    now_s: f64,
    sorted: Vec<f64>,
}

impl Margin {
    /// How many times longer than expected 19 of 20 frames take at most; 1 before any.
    pub fn ratio(&mut self) -> f64 {
        self.sorted.clear();
        self.sorted.extend(self.ratios.iter().map(|&(_, ratio)| ratio));
        let above = (self.sorted.len() as f64 * (1.0 - KEPT)) as usize;
        let Some(rank) = self.sorted.len().checked_sub(1 + above) else { return 1.0 };
        let (_, &mut ratio, _) = self.sorted.select_nth_unstable_by(rank, f64::total_cmp);
        ratio.clamp(RANGE[0], RANGE[1])
    }

    /// A frame, `dt_s` seconds after the one before, took `actual_ms`. What is no number or took
    /// no time is passed over.
    pub fn observe(&mut self, expected_ms: f64, actual_ms: f64, dt_s: f64) {
        self.now_s += if dt_s.is_finite() { dt_s.max(0.0) } else { 0.0 };
        let ratio = actual_ms / expected_ms;
        if !(ratio > 0.0 && ratio.is_finite()) {
            return;
        }
        self.ratios.push_back((self.now_s, ratio));
        let is_old = |at: &(f64, f64)| at.0 < self.now_s - WINDOW_S;
        while self.ratios.len() > MOST_FRAMES || self.ratios.front().is_some_and(is_old) {
            self.ratios.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const FRAME_S: f64 = 1.0 / 30.0;

    #[test]
    fn before_any_frame_the_whole_target_is_to_spend() {
        assert_eq!(Margin::default().ratio(), 1.0);
    }

    #[test]
    fn nineteen_of_twenty_frames_keep_to_the_target_whatever_the_noise() {
        // Errors of both kinds: a part that is always missing, and noise with a long tail.
        for (bias, noise) in [(1.0, 0.0), (0.8, 0.1), (1.2, 0.1), (1.0, 0.3)] {
            let (mut margin, mut random) = (Margin::default(), Random::new(1, 0));
            let mut over = 0;
            for frame in 0..3300 {
                let budget_ms = 30.0 / margin.ratio();
                let tail = -libm::log(1.0 - random.unit());
                let actual_ms = budget_ms * bias * (1.0 + noise * tail);
                over += u32::from(frame >= 300 && actual_ms > 30.0 * (1.0 + 1e-9));
                margin.observe(budget_ms, actual_ms, FRAME_S);
            }
            let percent = f64::from(over) / 30.0;
            let expected = if noise > 0.0 { 4.0..7.0 } else { 0.0..0.1 };
            assert!(expected.contains(&percent), "{percent} % over, {bias} {noise}");
        }
    }

    #[test]
    fn a_single_stall_costs_nothing_and_a_slow_machine_is_soon_known() {
        let mut margin = Margin::default();
        let mut observe = |ratio: f64, frames: usize| {
            (0..frames).for_each(|_| margin.observe(10.0, 10.0 * ratio, FRAME_S));
            margin.ratio()
        };
        observe(1.0, 300);
        assert_eq!(observe(100.0, 1), 1.0);
        assert_eq!(observe(1.25, 20), 1.25);
        assert_eq!(observe(1.0, 301), 1.0, "forgotten");
        assert_eq!(observe(1e3, 100), 2.0, "budgets are never less than half");
    }

    #[test]
    fn odd_frames_are_passed_over() {
        let mut margin = Margin::default();
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            margin.observe(odd, 1.0, odd);
            margin.observe(1.0, odd, odd);
        }
        assert_eq!(margin.ratio(), 1.0);
    }
}
