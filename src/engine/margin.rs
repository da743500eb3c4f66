//! How much of a target is kept free, so that frames keep to it although estimates are not exact.

use std::collections::VecDeque;

/// Seconds of frames that are remembered.
const WINDOW_S: f64 = 20.0;

/// And no more frames than this, so that they can be looked through in each frame.
const MOST_FRAMES: usize = 600;

/// The part of frames that are to keep to the target: as many as are less than a deviation above their
/// mean.
const KEPT: f64 = 0.84;

/// The part of frames that are not to be late: no more, since of 300 frames the third longest says how
/// many stalls there were, rather than how wrong estimates are.
const NOT_LATE: f64 = 0.98;

/// A frame is late that takes so many times the target.
const LATE: f64 = 1.1;

/// Frames that take so many times longer than most are stalls, which less detail would not prevent,
const STALL: f64 = 1.6;

/// unless they are a larger part of all than this: then the machine has become slower.
const STALLS: f64 = 0.05;

/// So many stalls in a row were a slow machine,
const RUN: usize = 3;

/// which is fast again, and the run forgotten, once as many frames in a row are no stalls any more.
const AFTER_RUN: usize = 10;

/// How much longer frames take than estimated, before any is known: budgets are approached from below,
/// since what gives way may not return before it has rested.
const FIRST: f64 = 1.05;

/// Of so many frames. Before, those not yet known count as if they took that much longer.
const FEW: usize = 20;

/// Frames that neither take nor are expected to take this part of their budget say nothing of those
/// that fill it: what has no price is most of them.
const FILLED: f64 = 0.5;

/// However wrong estimates were, budgets stay within this of the target.
const RANGE: [f64; 2] = [0.5, 2.0];

/// Compares what frames took with what their prices come to.
///
/// Whatever the cost model has no term for counts. What uploads take does not: time for them is kept free
/// apart ([`Uploads`](super::uploads::Uploads)). By the frames of the last twenty seconds, of those which are expected to take the
/// target over `ratio` 84 of 100 will keep to it, and 98 will be late by less than a tenth of it.
/// Quantiles rather than deviations, since times have long tails: a stall of a second would otherwise
/// cost detail for as long as it is remembered.
#[derive(Clone, Debug, Default)]
pub struct Margin {
    /// When frames were drawn, and what they took over what was expected.
    ratios: VecDeque<(f64, f64)>,
    now_s: f64,
    sorted: Vec<f64>,
}

impl Margin {
    /// By how much the target is divided for what frames may be expected to take.
    pub fn ratio(&mut self) -> f64 {
        self.sorted.clear();
        self.sorted.extend(self.ratios.iter().map(|&(_, ratio)| ratio));
        self.sorted.resize(self.sorted.len().max(FEW), FIRST);
        self.sorted.sort_unstable_by(f64::total_cmp);
        let median = self.sorted[self.sorted.len() / 2];
        let steady = self.sorted.partition_point(|&ratio| ratio <= STALL * median);
        if self.sorted.len() - steady <= (STALLS * self.sorted.len() as f64) as usize {
            self.sorted.truncate(steady);
        }
        let at_most = |part: f64| {
            let above = (self.sorted.len() as f64 * (1.0 - part)) as usize;
            self.sorted[self.sorted.len() - 1 - above]
        };
        at_most(KEPT).max(at_most(NOT_LATE) / LATE).clamp(RANGE[0], RANGE[1])
    }

    /// Whether as many frames are known as are needed, since more than one frame.
    pub fn is_known(&self) -> bool {
        self.ratios.len() > FEW
    }

    /// A frame of a budget, `dt_s` seconds after the one before, took `actual_ms` without what it
    /// uploaded. What is no number, took no time or far less than the budget is passed over.
    pub fn observe(&mut self, expected_ms: f64, actual_ms: f64, budget_ms: f64, dt_s: f64) {
        self.now_s += if dt_s.is_finite() { dt_s.max(0.0) } else { 0.0 };
        let is_old = |at: &(f64, f64)| at.0 < self.now_s - WINDOW_S;
        while self.ratios.len() >= MOST_FRAMES || self.ratios.front().is_some_and(is_old) {
            self.ratios.pop_front();
        }
        let ratio = actual_ms / expected_ms;
        let is_filled = expected_ms.max(actual_ms) >= FILLED * budget_ms;
        if !(is_filled && ratio > 0.0 && ratio.is_finite()) {
            return;
        }
        self.ratios.push_back((self.now_s, ratio));
        self.forget_run();
    }

    /// Forgets a run of stalls that is over. What stalls now and then is remembered.
    fn forget_run(&mut self) {
        let Some(end) = self.ratios.len().checked_sub(AFTER_RUN) else { return };
        let after = self.ratios.iter().skip(end).map(|&(_, ratio)| ratio).fold(0.0, f64::max);
        let before = self.ratios.iter().take(end).rev();
        let run = before.take_while(|&&(_, ratio)| ratio > STALL * after).count();
        if run >= RUN {
            self.ratios.drain(end - run..end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const FRAME_S: f64 = 1.0 / 30.0;

    #[test]
    fn before_any_frame_some_of_the_target_is_kept_free() {
        assert_eq!(Margin::default().ratio(), FIRST);
    }

    #[test]
    fn one_frame_in_fifty_is_late_or_one_in_six_over_the_target() {
        // Errors of both kinds: a part that is always missing, and noise. Of a long tail a fiftieth
        // is late; of a short one a sixth is over the target first. In percent.
        let expected = [
            (1.0, 0.0, 0.0..0.1, 0.0..0.1),
            (0.8, 0.1, 1.0..3.0, 4.0..10.0),
            (1.2, 0.1, 1.0..3.0, 4.0..10.0),
            (1.0, 0.02, 0.0..0.5, 14.0..18.0),
        ];
        for (bias, noise, late, over) in expected {
            let (mut margin, mut random) = (Margin::default(), Random::new(1, 0));
            let mut found = [0; 2];
            for frame in 0..3300 {
                let budget_ms = 30.0 / margin.ratio();
                let tail = -libm::log(1.0 - random.unit());
                let actual_ms = budget_ms * bias * (1.0 + noise * tail);
                for (found, at_least_ms) in found.iter_mut().zip([33.0, 30.0]) {
                    *found += u32::from(frame >= 300 && actual_ms > at_least_ms * (1.0 + 1e-9));
                }
                margin.observe(budget_ms, actual_ms, 30.0, FRAME_S);
            }
            let percent = found.map(|found| f64::from(found) / 30.0);
            let is_right = late.contains(&percent[0]) && over.contains(&percent[1]);
            assert!(is_right, "{percent:?} % late and over, {bias} {noise}");
        }
    }

    #[test]
    fn a_single_stall_costs_nothing_and_a_slow_machine_is_soon_known() {
        let mut margin = Margin::default();
        let mut observe = |ratio: f64, frames: usize| {
            (0..frames).for_each(|_| margin.observe(10.0, 10.0 * ratio, 10.0, FRAME_S));
            margin.ratio()
        };
        observe(1.0, 600);
        assert_eq!(observe(100.0, 30), 1.0, "stalls");
        assert_eq!(observe(100.0, 5), 2.0, "too many, but budgets are never less than half");
        assert_eq!(observe(1.0, AFTER_RUN - 1), 2.0, "it may stall again");
        assert_eq!(observe(1.0, 1), 1.0, "fast again");
        assert_eq!(observe(1.25, 40), 1.25 / LATE, "so that these are just not late");
        assert_eq!(observe(1.25, 80), 1.25);
    }

    #[test]
    fn what_stalls_again_and_again_is_remembered() {
        let mut margin = Margin::default();
        for _ in 0..10 {
            [1.0; 18].iter().for_each(|ratio| margin.observe(10.0, 10.0 * ratio, 10.0, FRAME_S));
            [2.0; 2].iter().for_each(|ratio| margin.observe(10.0, 10.0 * ratio, 10.0, FRAME_S));
        }
        (0..30).for_each(|_| margin.observe(10.0, 10.0, 10.0, FRAME_S));
        assert_eq!(margin.ratio(), 2.0 / LATE);
    }

    #[test]
    fn the_first_frames_are_told_from_noise_once_there_are_enough() {
        let mut margin = Margin::default();
        let mut observe = |ratio: f64| {
            margin.observe(10.0, 10.0 * ratio, 10.0, FRAME_S);
            margin.ratio()
        };
        assert_eq!(observe(0.8), FIRST);
        (0..15).for_each(|_| assert_eq!(observe(1.0), FIRST));
        assert_eq!(observe(1.0), 1.0);
        assert!(!margin.is_known());
        (0..4).for_each(|_| margin.observe(10.0, 10.0, 10.0, FRAME_S));
        assert!(margin.is_known());
    }

    #[test]
    fn frames_that_draw_little_say_nothing_however_long_they_go_on() {
        let mut margin = Margin::default();
        (0..60).for_each(|_| margin.observe(9.0, 9.0, 10.0, FRAME_S));
        (0..300).for_each(|_| margin.observe(0.5, 0.6, 10.0, FRAME_S));
        assert_eq!(margin.ratio(), 1.0);
        (0..300).for_each(|_| margin.observe(0.5, 0.6, 10.0, FRAME_S));
        assert_eq!(margin.ratio(), FIRST, "nothing is known any more");
        (0..600).for_each(|_| margin.observe(2.0, 10.0, 10.0, FRAME_S));
        assert_eq!(margin.ratio(), 2.0, "unless they take all of it");
    }

    #[test]
    fn odd_frames_are_passed_over() {
        let mut margin = Margin::default();
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            margin.observe(odd, 1.0, 1.0, odd);
            margin.observe(1.0, odd, 1.0, odd);
        }
        assert_eq!(margin.ratio(), FIRST);
    }
}
