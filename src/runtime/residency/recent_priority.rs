//! What nodes were worth lately.

/// Seconds for which a node stays worth what it was, at least; twice as many at most.
const KEPT_S: f64 = 1.0;

/// The highest priority that a node had lately.
///
/// Where the camera looks to and fro, half of the nodes lose much of their priority with every
/// turn and have it back with the next. By what they were worth lately, none is evicted for
/// another that is not worth more than both.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecentPriority {
    /// The span in which it was visited last.
    span: u32,
    /// The highest priority in that span, and in the one before.
    highest: [f64; 2],
}

impl RecentPriority {
    /// The span of [`KEPT_S`] seconds that a time is in.
    pub fn span(now_s: f64) -> u32 {
        (now_s / KEPT_S) as u32
    }

    /// Takes the priority of a node that a frame visited, in a span that is never before the last.
    pub fn update(&mut self, span: u32, priority: f64) {
        let [highest, before] = self.at(span);
        *self = Self { span, highest: [highest.max(priority), before] };
    }

    /// The highest priority that a node had up to a span; 0 where it was not visited.
    pub fn of(&self, span: u32) -> f64 {
        let [highest, before] = self.at(span);
        highest.max(before)
    }

    /// The highest priorities of a span and of the one before it.
    fn at(&self, span: u32) -> [f64; 2] {
        match span.saturating_sub(self.span) {
            0 => self.highest,
            1 => [0.0, self.highest[0]],
            _ => [0.0; 2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_node_was_worth_is_kept_for_a_while_and_not_for_ever() {
        for first in [0.0, 0.03, 0.57, 0.97, 1.0] {
            for frames_per_s in [20, 200] {
                let mut recent = [RecentPriority::default(); 2];
                let span = RecentPriority::span(first);
                recent[0].update(span, 5.0);
                recent[1].update(span, 1.0);
                for frame in 1..=3 * frames_per_s {
                    let after_s = f64::from(frame) / f64::from(frames_per_s);
                    let span = RecentPriority::span(first + after_s);
                    recent[1].update(span, 2.0);
                    if after_s < KEPT_S {
                        assert_eq!(recent[0].of(span), 5.0, "{first} {after_s}");
                    } else if after_s >= 2.0 * KEPT_S {
                        assert_eq!(recent[0].of(span), 0.0);
                    } else {
                        assert!([0.0, 5.0].contains(&recent[0].of(span)));
                    }
                    assert_eq!(recent[1].of(span), 2.0);
                }
                let span = RecentPriority::span(first + 3.1 * KEPT_S);
                recent[0].update(span, 1.0);
                assert_eq!(recent[0].of(span), 1.0);
            }
        }
    }
}
