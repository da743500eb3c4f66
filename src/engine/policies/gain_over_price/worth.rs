//! What nodes are worth in memory.

use super::Options;
use super::gain::Gain;
use crate::engine::FrameInput;
use crate::engine::policies::ranked::wholly_refining_ms;

/// How high nodes ranked, of late: what their children are worth in memory.
///
/// Where the camera turns or goes round, other nodes rank highest at every moment. Where memory is short, they
/// would push each other out by that, and be read again each time they come back into view.
#[derive(Clone, Debug, Default)]
pub(super) struct Worth {
    now_s: f64,
    nodes: Vec<Ranked>,
}

/// The highest rank of a node, as far as it was not forgotten at a time.
#[derive(Clone, Copy, Debug, Default)]
struct Ranked {
    rank: f64,
    then_s: f64,
}

impl Worth {
    pub fn begin_frame(&mut self, nodes: usize, dt_s: f64) {
        self.now_s += dt_s;
        self.nodes.resize(nodes, Ranked::default());
    }

    /// What the children of a node that ranks so high now are worth.
    pub fn in_view(&mut self, node: u32, rank: f64, options: &Options) -> f64 {
        let rank = rank.max(self.of_late(node, options));
        self.nodes[node as usize] = Ranked { rank, then_s: self.now_s };
        rank
    }

    /// What the children of a node are worth that need not be in view.
    pub fn away(&self, frame: &FrameInput<'_>, node: u32, options: &Options) -> f64 {
        let away = options.away * Gain::anywhere(frame, node) / wholly_refining_ms(frame, node);
        away.max(self.of_late(node, options))
    }

    fn of_late(&self, node: u32, options: &Options) -> f64 {
        let Ranked { rank, then_s } = self.nodes[node as usize];
        rank * libm::exp2((then_s - self.now_s) / options.keep_s)
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
        worth.begin_frame(frame.tree.len(), 0.0);
        let away = worth.away(&input, 0, &options);
        assert!(away > 0.0);
        assert_eq!(worth.in_view(0, 8.0 * away, &options), 8.0 * away);
        worth.begin_frame(frame.tree.len(), options.keep_s);
        assert_eq!(worth.away(&input, 0, &options), 4.0 * away);
        assert_eq!(worth.in_view(0, away, &options), 4.0 * away);
        assert_eq!(worth.in_view(0, 5.0 * away, &options), 5.0 * away);
        worth.begin_frame(frame.tree.len(), 60.0 * options.keep_s);
        assert_eq!(worth.away(&input, 0, &options), away);
    }
}
