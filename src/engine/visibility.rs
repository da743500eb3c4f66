//! Which nodes were found to be in view.

use std::cell::Cell;

/// What was found out of which nodes are in view, for a frame: policies ask for the same node again
/// and again, and a look into a table is cheaper than its box against the frustum.
#[derive(Clone, Debug, Default)]
pub struct Visibility {
    /// Twice the number of the frame.
    frame: u32,
    /// By node: the frame in which it was asked for last, one more where it is in view.
    nodes: Vec<Cell<u32>>,
}

impl Visibility {
    /// Forgets what was found; nodes up to this many are remembered from now on.
    pub fn begin_frame(&mut self, nodes: usize) {
        if self.nodes.len() != nodes || self.frame > u32::MAX - 4 {
            self.nodes.clear();
            self.nodes.resize(nodes, Cell::new(0));
            self.frame = 0;
        }
        self.frame += 2;
    }

    /// Whether a node is in view, by `find` where it was not asked for before.
    #[inline]
    pub fn get_or(&self, node: u32, find: impl FnOnce() -> bool) -> bool {
        let Some(known) = self.nodes.get(node as usize) else { return find() };
        if known.get() & !1 != self.frame {
            known.set(self.frame + u32::from(find()));
        }
        known.get() & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_node_is_looked_at_once_a_frame() {
        let mut visibility = Visibility::default();
        assert!(visibility.get_or(1, || true) && !visibility.get_or(1, || false), "no table");
        for in_view in [true, false, true] {
            visibility.begin_frame(3);
            assert_eq!(visibility.get_or(1, || in_view), in_view);
            assert_eq!(visibility.get_or(1, || !in_view), in_view);
            assert_eq!(visibility.get_or(2, || !in_view), !in_view);
        }
    }

    #[test]
    fn numbers_of_frames_may_run_out() {
        let mut visibility = Visibility { frame: u32::MAX - 5, nodes: vec![Cell::new(0); 2] };
        for _ in 0..4 {
            visibility.begin_frame(2);
            assert!(visibility.get_or(0, || true));
            visibility.begin_frame(2);
            assert!(!visibility.get_or(0, || false));
        }
    }
}
