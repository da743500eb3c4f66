//! Nodes that nobody has asked for lately.

use std::collections::VecDeque;

use crate::engine::Selection;

/// When nodes were asked for last.
#[derive(Clone, Debug, Default)]
pub(super) struct Unused {
    /// By node, seconds.
    asked_s: Vec<f64>,
    /// Nodes with the times at which they were asked for, in order.
    asked: VecDeque<(f64, u32)>,
}

impl Unused {
    /// Releases what was not requested for `after_s` seconds, of `nodes` nodes, once what a frame
    /// requests is complete.
    pub fn release(&mut self, now_s: f64, after_s: f64, nodes: usize, out: &mut Selection) {
        self.asked_s.resize(nodes, f64::NEG_INFINITY);
        for &(node, _) in &out.requests {
            self.asked_s[node as usize] = now_s;
            self.asked.push_back((now_s, node));
        }
        while let Some(&(asked_s, node)) =
            self.asked.front().filter(|(asked_s, _)| *asked_s < now_s - after_s)
        {
            self.asked.pop_front();
            if self.asked_s[node as usize] == asked_s {
                out.released.push(node);
            }
        }
    }
}
