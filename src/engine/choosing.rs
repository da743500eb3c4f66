//! What choosing takes of a frame.

/// Seconds after which what it took counts half: it changes with the view, and from frame to frame.
const HALF_LIFE_S: f64 = 0.5;

/// A single time counts as at most this many times what was expected: a stall says nothing of the next.
const MOST: f64 = 2.0;

/// Expects choosing to take what it took of late.
///
/// Apart from what drawing takes, which it does not change with: where most of a frame were choosing, and
/// that counted as a part of the price of drawing, less and less would be drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Choosing {
    expected_ms: Option<f64>,
}

impl Choosing {
    /// Milliseconds that it should take in the next frame; 0 before the first.
    pub fn expected_ms(&self) -> f64 {
        self.expected_ms.unwrap_or(0.0)
    }

    /// It took `ms`, `dt_s` seconds after the time before. What is no time is passed over.
    pub fn observe(&mut self, ms: f64, dt_s: f64) {
        if !(ms.is_finite() && ms >= 0.0) {
            return;
        }
        let dt_s = if dt_s.is_finite() { dt_s.max(0.0) } else { 0.0 };
        let expected_ms = self.expected_ms.get_or_insert(ms);
        let is_known = *expected_ms > 0.0;
        let ms = if is_known { ms.min(MOST * *expected_ms) } else { ms };
        *expected_ms += (1.0 - libm::exp2(-dt_s / HALF_LIFE_S)) * (ms - *expected_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_expected_to_take_what_it_took_of_late() {
        let mut choosing = Choosing::default();
        assert_eq!(choosing.expected_ms(), 0.0);
        choosing.observe(3.0, 0.03);
        assert_eq!(choosing.expected_ms(), 3.0);
        choosing.observe(1.0, HALF_LIFE_S);
        assert_eq!(choosing.expected_ms(), 2.0);
        choosing.observe(1000.0, HALF_LIFE_S);
        assert_eq!(choosing.expected_ms(), 3.0, "a stall");
        for (ms, dt_s) in [(f64::NAN, 1.0), (-1.0, 1.0), (1.0, f64::NAN), (f64::INFINITY, 1.0)] {
            choosing.observe(ms, dt_s);
        }
        assert_eq!(choosing.expected_ms(), 3.0);
    }

    #[test]
    fn what_took_no_time_may_take_some() {
        let mut choosing = Choosing::default();
        choosing.observe(0.0, 1.0);
        (0..100).for_each(|_| choosing.observe(2.0, 0.1));
        assert!((choosing.expected_ms() - 2.0).abs() < 1e-3);
    }
}
