//! The time at the start in which the first view is loaded.

/// It takes no longer than this, seconds: where memory is short, something always waits.
const LONGEST_S: f64 = 2.0;

/// Whether the first view is in memory.
///
/// Until then every frame uploads as much as it may. How long such frames take says little of those
/// to come, and a camera that has just been put somewhere would be shown less for as long as they are
/// remembered.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Settling {
    since_s: f64,
    is_over: bool,
}

impl Settling {
    /// Whether it was over after the frame before.
    pub fn has_ended(&self) -> bool {
        self.is_over
    }

    /// After a frame, `dt_s` seconds after the one before: how many nodes arrived in it and for how
    /// many it still waits.
    pub fn is_over(&mut self, arrived: u32, waiting: u32, dt_s: f64) -> bool {
        self.since_s += dt_s;
        self.is_over |= arrived == 0 && waiting == 0 || self.since_s > LONGEST_S;
        self.is_over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_over_for_good_once_nothing_arrives_and_nothing_waits() {
        let mut settling = Settling::default();
        assert!(!settling.is_over(0, 3, 0.0));
        assert!(!settling.is_over(3, 0, 0.1));
        assert!(settling.is_over(0, 0, 0.1));
        assert!(settling.is_over(3, 3, 0.1), "whatever is loaded later");
    }

    #[test]
    fn it_is_over_after_two_seconds_where_something_always_waits() {
        let mut settling = Settling::default();
        let over = (0..100).position(|_| settling.is_over(1, 1, 0.125));
        assert_eq!(over, Some(16));
    }
}
