//! What nodes were worth lately.

/// Seconds for which a node stays worth what it was, at least; twice as many at most.
const KEPT_S: f64 = 1.0;

/// The highest priority that nodes had lately.
///
/// Where the camera looks to and fro, half of the nodes lose much of their priority with every
/// turn and have it back with the next. By what they were worth lately, none is evicted for
/// another that is not worth more than both.
#[derive(Clone, Debug)]
pub(super) struct RecentPriority {
    /// The span of [`KEPT_S`] seconds at hand.
    span: u64,
    nodes: Vec<Recent>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Recent {
    /// The span in which it was visited last.
    span: u64,
    /// The highest priority in that span, and in the one before.
    highest: [f64; 2],
}

impl Recent {
    /// The highest priorities of a span and of the one before it.
    fn at(&self, span: u64) -> [f64; 2] {
        match span - self.span {
            0 => self.highest,
            1 => [0.0, self.highest[0]],
            _ => [0.0; 2],
        }
    }
}

impl RecentPriority {
    pub fn new(nodes: usize) -> Self {
        Self { span: 0, nodes: vec![Recent::default(); nodes] }
    }

    /// Takes the priorities of the nodes that a frame visited, at a time that is never before the
    /// last.
    pub fn update(&mut self, now_s: f64, visited: &[(u32, f64)]) {
        self.span = self.span.max((now_s / KEPT_S) as u64);
        for &(node, priority) in visited {
            let recent = &mut self.nodes[node as usize];
            let [highest, before] = recent.at(self.span);
            *recent = Recent { span: self.span, highest: [highest.max(priority), before] };
        }
    }

    /// The highest priority that a node had lately; 0 where it was not visited.
    pub fn of(&self, node: u32) -> f64 {
        let [highest, before] = self.nodes[node as usize].at(self.span);
        highest.max(before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_node_was_worth_is_kept_for_a_while_and_not_for_ever() {
        for first in [0.0, 0.03, 0.57, 0.97, 1.0] {
            for frames_per_s in [20, 200] {
                let mut recent = RecentPriority::new(2);
                recent.update(first, &[(0, 5.0), (1, 1.0)]);
                for frame in 1..=3 * frames_per_s {
                    let after_s = f64::from(frame) / f64::from(frames_per_s);
                    recent.update(first + after_s, &[(1, 2.0)]);
                    if after_s < KEPT_S {
                        assert_eq!(recent.of(0), 5.0, "{first} {after_s}");
                    } else if after_s >= 2.0 * KEPT_S {
                        assert_eq!(recent.of(0), 0.0);
                    } else {
                        assert!([0.0, 5.0].contains(&recent.of(0)));
                    }
                    assert_eq!(recent.of(1), 2.0);
                }
                recent.update(first + 3.1 * KEPT_S, &[(0, 1.0)]);
                assert_eq!(recent.of(0), 1.0);
            }
        }
    }
}
