//! The counters that keep levels from switching at every change (thesis, section 4.2,
//! "Hysteresis").

use super::{LakhiaOptions, StartOfHysteresis};

/// One counter a node, by its place in the [tree](crate::runtime::SceneTree).
#[derive(Clone, Debug, Default)]
pub(super) struct Hysteresis {
    /// NaN where a node was never visited.
    counters: Vec<f64>,
}

impl Hysteresis {
    pub fn resize(&mut self, nodes: usize) {
        self.counters.resize(nodes, f64::NAN);
    }

    pub fn is_new(&self, place: u32) -> bool {
        self.counters[place as usize].is_nan()
    }

    /// Where the counter of a node begins that is visited for the first time; `affordable` says
    /// that its siblings' share of time suffices for all of them.
    pub fn start(&mut self, place: u32, affordable: bool, options: &LakhiaOptions) {
        self.counters[place as usize] = match options.hyst_start {
            StartOfHysteresis::Affordable if !affordable => {
                -(2.0 * options.hyst_switch).min(options.hyst_limit)
            }
            _ => 0.0,
        };
    }

    /// `hyst ← hyst + (timeSlice − timeNeeded) / timeNeeded`, kept within ± `c_hystLimit`.
    pub fn update(&mut self, place: u32, time_slice: f64, time_needed: f64, limit: f64) {
        let urgency = match time_slice - time_needed {
            0.0 => 0.0,
            missing_or_left => missing_or_left / time_needed,
        };
        let counter = &mut self.counters[place as usize];
        *counter = (*counter + urgency).clamp(-limit, limit);
    }

    /// `trunc(hyst / c_hystSwitch)`, which siblings sum up to `cumHyst`, once the counter has
    /// moved on by `change`.
    pub fn truncated(&self, place: u32, change: f64, options: &LakhiaOptions) -> f64 {
        let LakhiaOptions { hyst_switch, hyst_limit, .. } = *options;
        let counter = (self.counters[place as usize] + change).clamp(-hyst_limit, hyst_limit);
        // A change of infinitely much times nothing is none.
        if counter.is_nan() { 0.0 } else { trunc(counter / hyst_switch) }
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
        hysteresis.start(0, true, &LakhiaOptions::default());
        hysteresis
    }

    #[test]
    fn counters_move_by_urgency() {
        let mut hysteresis = fresh();
        hysteresis.update(0, 3.0, 2.0, 10.0);
        assert_eq!(hysteresis.counters[0], 0.5);
        hysteresis.update(0, 0.5, 2.0, 10.0);
        assert_eq!(hysteresis.counters[0], -0.25);
    }

    #[test]
    fn counters_stay_within_the_limit() {
        let mut hysteresis = fresh();
        hysteresis.update(0, 1e9, 1.0, 10.0);
        assert_eq!(hysteresis.counters[0], 10.0);
        for _ in 0..100 {
            hysteresis.update(0, 0.0, 1.0, 10.0);
        }
        assert_eq!(hysteresis.counters[0], -10.0);
    }

    #[test]
    fn only_whole_switches_count_and_truncation_is_towards_zero() {
        let mut hysteresis = fresh();
        for (counter, expected) in
            [(1499.0, 0.0), (1500.0, 1.0), (4510.0, 3.0), (-1499.0, 0.0), (-1500.0, -1.0)]
        {
            hysteresis.counters[0] = counter;
            let options = LakhiaOptions::default();
            assert_eq!(hysteresis.truncated(0, 0.0, &options), expected, "{counter}");
            assert_eq!(hysteresis.truncated(0, f64::INFINITY, &options), 3.0);
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
        hysteresis.update(0, 1.0, 0.0, 10.0);
        assert_eq!(hysteresis.counters[0], 10.0);
        hysteresis.update(0, 0.0, 0.0, 10.0);
        assert_eq!(hysteresis.counters[0], 10.0);
    }

    #[test]
    fn siblings_that_cost_too_much_begin_low_unless_told_otherwise() {
        let mut hysteresis = fresh();
        let mut options = LakhiaOptions::default();
        hysteresis.start(0, false, &options);
        assert_eq!(hysteresis.counters[0], -3000.0);
        options.hyst_start = StartOfHysteresis::Zero;
        hysteresis.start(0, false, &options);
        assert_eq!(hysteresis.counters[0], 0.0);
    }
}
