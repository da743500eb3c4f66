//! Why levels toggled.

use super::FrameInput;
use crate::runtime::ToggleCounter;
use crate::runtime::residency::Changes;

/// Toggles of a frame, by what brought them about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ToggleCauses {
    /// The policy chose so, with the same nodes in memory as before.
    pub chosen: u32,
    /// Children became resident in this frame.
    pub arrived: u32,
    /// Children left memory in this frame.
    pub evicted: u32,
    /// A child came into view that is not in memory, so that none of its siblings can be drawn.
    pub came_into_view: u32,
}

impl ToggleCauses {
    /// The causes of the toggles that were counted last.
    pub(super) fn of(frame: &FrameInput<'_>, toggles: &ToggleCounter, changes: &Changes) -> Self {
        let mut causes = Self::default();
        let children = |node: u32| frame.tree.children(node);
        for &node in toggles.refined() {
            match children(node).iter().any(|child| changes.arrived.contains(child)) {
                true => causes.arrived += 1,
                false => causes.chosen += 1,
            }
        }
        for &node in toggles.coarsened() {
            let is_missing =
                |&child: &u32| frame.is_visible(child) && !frame.residents.contains(child);
            if children(node).iter().any(|child| changes.left.contains(child)) {
                causes.evicted += 1;
            } else if children(node).iter().any(is_missing) {
                causes.came_into_view += 1;
            } else {
                causes.chosen += 1;
            }
        }
        causes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::TestFrame;
    use crate::runtime::test_tree::{Sketch, sketch, tree};

    /// A root with two children, of which the second is not in memory.
    fn frame() -> TestFrame {
        let child = |y: f64| sketch([11.0, y, 0.0], 1.0, vec![]);
        let children = vec![child(-2.0), child(2.0)];
        let root = Sketch { size: 8.0, ..sketch([11.0, 0.0, 0.0], 1.0, children) };
        let mut frame = TestFrame::new(tree(vec![root]));
        frame.residents.set(2, false);
        frame
    }

    fn causes(before: &[u32], now: &[u32], changes: &Changes, complete: bool) -> [u32; 4] {
        let mut frame = frame();
        frame.residents.set(2, complete);
        let mut toggles = ToggleCounter::default();
        toggles.count(&frame.tree, before);
        toggles.count(&frame.tree, now);
        let causes = ToggleCauses::of(&frame.input(), &toggles, changes);
        [causes.chosen, causes.arrived, causes.evicted, causes.came_into_view]
    }

    #[test]
    fn each_toggle_has_one_cause() {
        let none = Changes::default();
        let arrived = Changes { arrived: vec![2], ..Changes::default() };
        let left = Changes { left: vec![2], ..Changes::default() };
        assert_eq!(causes(&[0], &[1, 2], &none, true), [1, 0, 0, 0]);
        assert_eq!(causes(&[0], &[1, 2], &arrived, true), [0, 1, 0, 0]);
        assert_eq!(causes(&[1, 2], &[0], &none, true), [1, 0, 0, 0]);
        assert_eq!(causes(&[1, 2], &[0], &left, false), [0, 0, 1, 0]);
        assert_eq!(causes(&[1], &[0], &none, false), [0, 0, 0, 1]);
        assert_eq!(causes(&[0], &[0], &arrived, true), [0; 4]);
    }
}
