//! The parts of the picture that were found to be under boxes.

use std::cell::Cell;

use crate::camera::View;
use crate::runtime::SceneTree;

/// The part of the picture under the box of each node, found once a frame: what a node is ranked by and what
/// the frame should take are both summed up from it.
#[derive(Clone, Debug, Default)]
pub struct CoveredParts {
    frame: u32,
    /// By node: the frame in which it was asked for last, and what was found.
    nodes: Vec<Cell<(u32, f64)>>,
}

impl CoveredParts {
    /// Forgets what was found; nodes up to this many are remembered from now on.
    pub fn begin_frame(&mut self, nodes: usize) {
        if self.nodes.len() != nodes || self.frame == u32::MAX {
            self.nodes.clear();
            self.nodes.resize(nodes, Cell::new((0, 0.0)));
            self.frame = 0;
        }
        self.frame += 1;
    }

    /// The part of the picture of the frame's view, 0 to 1, under the box of a node.
    #[inline]
    pub fn of(&self, tree: &SceneTree, node: u32, view: &View) -> f64 {
        let find = || view.frustum.covered(tree.node(node).bbox);
        let Some(known) = self.nodes.get(node as usize) else { return find() };
        let (frame, part) = known.get();
        if frame == self.frame {
            return part;
        }
        let part = find();
        known.set((self.frame, part));
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{sketch, tree, view};

    #[test]
    fn each_box_is_looked_at_once_a_frame() {
        let tree = tree(vec![sketch([11.0, 0.0, 0.0], 1.0, vec![])]);
        let ahead = view();
        let mut pose = ahead.pose;
        pose.position.x -= 10.0;
        let behind = View::new(pose, ahead.velocity, ahead.size);
        let [near, far] = [&ahead, &behind].map(|view| view.frustum.covered(tree.node(0).bbox));
        assert!(near > 2.0 * far && far > 0.0);
        let mut covered = CoveredParts::default();
        let found =
            |covered: &CoveredParts| [&ahead, &behind].map(|view| covered.of(&tree, 0, view));
        assert_eq!(found(&covered), [near, far], "no table");
        for frame in [0, u32::MAX - 1, u32::MAX] {
            covered.frame = frame;
            covered.begin_frame(1);
            assert_eq!(found(&covered), [near; 2]);
            covered.begin_frame(1);
            assert_eq!(covered.of(&tree, 0, &behind), far);
        }
    }
}
