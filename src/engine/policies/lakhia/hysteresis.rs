//! Hysteresis counters (thesis, section 4.2, "Hysteresis").

use super::LakhiaOptions;
use super::options::FRAME_S;

/// `hysteresis_n` of every node, by its place in a [`SceneTree`](crate::runtime::SceneTree).
#[derive(Clone, Debug, Default)]
pub(super) struct Hysteresis(Vec<f64>);

impl Hysteresis {
    /// Counters begin at 0.
    pub fn resize(&mut self, nodes: usize) {
        self.0.resize(nodes, 0.0);
    }

    /// `hysteresis ← hysteresis + (timeSlice − timeNeeded) / timeNeeded`, kept within
    /// ± `c_hystLimit`; `dt_s` seconds after the last time.
    #[inline(always)] // asked for every node
    pub fn update(&mut self, place: u32, time_slice: f64, time_needed: f64, dt_s: f64, limit: f64) {
        let urgency = match time_slice - time_needed {
            0.0 => 0.0,
            missing_or_left => missing_or_left / time_needed,
        };
        let counter = &mut self.0[place as usize];
        // Infinite urgency in no time is none.
        let change = urgency * (dt_s / FRAME_S);
        let change = if change.is_nan() { 0.0 } else { change };
        *counter = (*counter + change).clamp(-limit, limit);
    }

    /// `trunc(hysteresis / c_hystSwitch)`, which siblings sum up to `cumHyst`.
    pub fn truncated(&self, place: u32, options: &LakhiaOptions) -> f64 {
        trunc(self.0[place as usize] / options.hyst_switch)
    }
}

/// [`f64::trunc`] without a call, which it is where a processor need not know how to round.
fn trunc(number: f64) -> f64 {
    /// From here on, numbers are whole.
    const WHOLE: f64 = (1u64 << 52) as f64;
    if number.abs() < WHOLE { number as i64 as f64 } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fresh() -> Hysteresis {
        let mut hysteresis = Hysteresis::default();
        hysteresis.resize(1);
        hysteresis
    }

    #[test]
    fn counters_move_by_urgency_and_time() {
        let mut hysteresis = fresh();
        hysteresis.update(0, 3.0, 2.0, FRAME_S, 10.0);
        assert_eq!(hysteresis.0[0], 0.5);
        hysteresis.update(0, 0.5, 2.0, FRAME_S, 10.0);
        assert_eq!(hysteresis.0[0], -0.25);
        hysteresis.update(0, 3.0, 2.0, 2.0 * FRAME_S, 10.0);
        assert_eq!(hysteresis.0[0], 0.75);
    }

    #[test]
    fn counters_stay_within_the_limit() {
        let mut hysteresis = fresh();
        hysteresis.update(0, 1e9, 1.0, FRAME_S, 10.0);
        assert_eq!(hysteresis.0[0], 10.0);
        for _ in 0..100 {
            hysteresis.update(0, 0.0, 1.0, FRAME_S, 10.0);
        }
        assert_eq!(hysteresis.0[0], -10.0);
    }

    #[test]
    fn only_whole_switches_count_and_truncation_is_towards_zero() {
        let mut hysteresis = fresh();
        for (counter, expected) in
            [(1499.0, 0.0), (1500.0, 1.0), (4510.0, 3.0), (-1499.0, 0.0), (-1500.0, -1.0)]
        {
            hysteresis.0[0] = counter;
            let found = hysteresis.truncated(0, &LakhiaOptions::DEFAULT);
            assert_eq!(found, expected, "{counter}");
        }
    }

    #[test]
    fn truncation_is_that_of_the_language() {
        let whole = (1u64 << 52) as f64;
        for number in [0.0, 0.3, 1.0, 2.9, 4503.7, whole - 0.5, whole, 3.0 * whole, 1e300] {
            assert_eq!(trunc(number), number.trunc(), "{number}");
            assert_eq!(trunc(-number), -number.trunc(), "{number}");
        }
        assert_eq!(trunc(f64::INFINITY), f64::INFINITY);
    }

    #[test]
    fn nodes_that_take_no_time_never_make_a_counter_meaningless() {
        let mut hysteresis = fresh();
        hysteresis.update(0, 1.0, 0.0, 0.0, 10.0);
        assert_eq!(hysteresis.0[0], 0.0);
        hysteresis.update(0, 1.0, 0.0, FRAME_S, 10.0);
        assert_eq!(hysteresis.0[0], 10.0);
        hysteresis.update(0, 0.0, 0.0, FRAME_S, 10.0);
        assert_eq!(hysteresis.0[0], 10.0);
    }
}
