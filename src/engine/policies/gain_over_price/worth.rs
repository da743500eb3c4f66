//! What nodes are worth in memory.

use super::Options;
use super::gain::Gain;
use crate::engine::FrameInput;
use crate::engine::policies::ranked::wholly_refining_ms;

/// How high nodes ranked, of late: what their children are worth in memory.
///
/// Where the camera turns or goes round, other nodes rank highest at every moment. Where memory is short, they
/// would push each other out by that, and be read again each time they come back into view.
#[derive(Clone, Debug)]
pub(super) struct Worth {
    /// How many times what counts now a rank counts that is forgotten as of the beginning: one power of two a frame
    /// instead of one a node.
    scale: f64,
    /// One over that.
    inverse: f64,
    /// The highest rank of each node, times `scale` of then.
    scaled: Vec<f64>,
}

/// Beyond this all ranks are scaled anew, long before numbers overflow.
const LARGEST_SCALE: f64 = 1e60;

impl Default for Worth {
    fn default() -> Self {
        Self { scale: 1.0, inverse: 1.0, scaled: Vec::new() }
    }
}

impl Worth {
    pub fn begin_frame(&mut self, nodes: usize, dt_s: f64, options: &Options) {
        self.scaled.resize(nodes, 0.0);
        self.scale *= libm::exp2(dt_s / options.keep_s);
        if self.scale > LARGEST_SCALE {
            let scale = self.scale;
            self.scaled.iter_mut().for_each(|rank| *rank /= scale);
            self.scale = 1.0;
        }
        self.inverse = 1.0 / self.scale;
    }

    /// What the children of a node that ranks so high now are worth.
    pub fn in_view(&mut self, node: u32, rank: f64) -> f64 {
        let scaled = &mut self.scaled[node as usize];
        let now = rank * self.scale;
        if now < *scaled {
            return *scaled * self.inverse;
        }
        *scaled = now;
        rank
    }

    /// What the children of a node are worth that need not be in view.
    pub fn away(&self, frame: &FrameInput<'_>, node: u32, options: &Options) -> f64 {
        let away = options.away * Gain::anywhere(frame, node) / wholly_refining_ms(frame, node);
        away.max(self.scaled[node as usize] * self.inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::{TestFrame, root};
    use crate::runtime::test_tree::tree;

    #[test]
    fn what_ranked_high_is_forgotten_slowly_down_to_what_it_is_worth_out_of_view() {
        let frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2)]));
        let (input, options) = (frame.input(), Options::default());
        let mut worth = Worth::default();
        worth.begin_frame(frame.tree.len(), 0.0, &options);
        let away = worth.away(&input, 0, &options);
        assert!(away > 0.0);
        let near = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        };
        near(worth.in_view(0, 8.0 * away), 8.0 * away);
        worth.begin_frame(frame.tree.len(), options.keep_s, &options);
        near(worth.away(&input, 0, &options), 4.0 * away);
        near(worth.in_view(0, away), 4.0 * away);
        near(worth.in_view(0, 5.0 * away), 5.0 * away);
        // Also where ranks were scaled anew meanwhile.
        worth.scale = 0.999 * LARGEST_SCALE;
        worth.inverse = 1.0 / worth.scale;
        near(worth.in_view(0, 16.0 * away), 16.0 * away);
        worth.begin_frame(frame.tree.len(), options.keep_s, &options);
        assert_eq!(worth.scale, 1.0);
        near(worth.away(&input, 0, &options), 8.0 * away);
        worth.begin_frame(frame.tree.len(), 60.0 * options.keep_s, &options);
        assert_eq!(worth.away(&input, 0, &options), away);
    }
}
