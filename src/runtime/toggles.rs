//! Counts switches between levels of detail, as the thesis does in section 6.5.

use super::SceneTree;

/// Switches between one frame and the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Toggles {
    /// Nodes that were replaced by their children.
    pub up: u32,
    /// Nodes that replaced their children.
    pub down: u32,
}

/// Compares each front with the one before.
///
/// A node that gives way to its children is one toggle, however many they are; where a change
/// passes several levels, every node passed counts. What was not drawn in one of the two frames,
/// because it was culled, does not count.
#[derive(Clone, Debug, Default)]
pub struct ToggleCounter {
    before: Front,
    now: Front,
    frame: u32,
    /// Nodes that gave way to their children in the last call.
    refined: Vec<u32>,
    /// Nodes that replaced their children in the last call.
    coarsened: Vec<u32>,
}

/// A front and all that is above it.
#[derive(Clone, Debug, Default)]
struct Front {
    /// The frame in which a node was last in it.
    drawn: Vec<u32>,
    /// The frame in which a node was last above it.
    refined: Vec<u32>,
    /// Those above it.
    above: Vec<u32>,
    frame: u32,
}

impl Front {
    fn set(&mut self, tree: &SceneTree, front: &[u32], frame: u32) {
        self.drawn.resize(tree.len(), 0);
        self.refined.resize(tree.len(), 0);
        self.above.clear();
        self.frame = frame;
        for &node in front {
            self.drawn[node as usize] = frame;
            let mut at = tree.node(node).parent;
            while let Some(above) = at.filter(|&above| self.refined[above as usize] != frame) {
                self.refined[above as usize] = frame;
                self.above.push(above);
                at = tree.node(above).parent;
            }
        }
    }

    /// Nodes of `other` that are above its front and stand in or below this one.
    fn deepened_by(&self, tree: &SceneTree, other: &Front, nodes: &mut Vec<u32>) {
        let covered = |&&node: &&u32| -> bool {
            let mut at = Some(node);
            while let Some(above) = at {
                if self.drawn[above as usize] == self.frame {
                    return true;
                }
                at = tree.node(above).parent;
            }
            false
        };
        nodes.clear();
        nodes.extend(other.above.iter().filter(covered));
    }
}

impl ToggleCounter {
    /// Toggles from the front of the last call to this one; none in the first call.
    pub fn count(&mut self, tree: &SceneTree, front: &[u32]) -> Toggles {
        std::mem::swap(&mut self.before, &mut self.now);
        self.frame += 1;
        self.now.set(tree, front, self.frame);
        if self.frame == 1 {
            return Toggles::default();
        }
        self.before.deepened_by(tree, &self.now, &mut self.refined);
        self.now.deepened_by(tree, &self.before, &mut self.coarsened);
        Toggles { up: self.refined.len() as u32, down: self.coarsened.len() as u32 }
    }

    /// Nodes that gave way to their children in the last call.
    pub fn refined(&self) -> &[u32] {
        &self.refined
    }

    /// Nodes that replaced their children in the last call.
    pub fn coarsened(&self) -> &[u32] {
        &self.coarsened
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{sketch, tree};

    /// Node 0 has the children 1 (with 2 and 3) and 4; node 5 is another tree.
    fn small() -> SceneTree {
        let leaf = || sketch([5.0, 0.0, 0.0], 1.0, vec![]);
        tree(vec![
            sketch(
                [5.0, 0.0, 0.0],
                1.0,
                vec![sketch([5.0, 0.0, 0.0], 1.0, vec![leaf(), leaf()]), leaf()],
            ),
            leaf(),
        ])
    }

    fn toggles(fronts: &[&[u32]]) -> Vec<(u32, u32)> {
        let (tree, mut counter) = (small(), ToggleCounter::default());
        fronts
            .iter()
            .map(|front| counter.count(&tree, front))
            .map(|toggles| (toggles.up, toggles.down))
            .collect()
    }

    #[test]
    fn one_switch_is_one_toggle_however_many_children() {
        let found = toggles(&[&[0, 5], &[1, 4, 5], &[1, 4, 5], &[0, 5]]);
        assert_eq!(found, [(0, 0), (1, 0), (0, 0), (0, 1)]);
    }

    #[test]
    fn every_level_that_is_passed_counts() {
        assert_eq!(toggles(&[&[0], &[2, 3, 4], &[0]]), [(0, 0), (2, 0), (0, 2)]);
    }

    #[test]
    fn siblings_that_are_culled_do_not_matter() {
        assert_eq!(toggles(&[&[0, 5], &[4], &[4, 1], &[0]]), [(0, 0), (1, 0), (0, 0), (0, 1)]);
    }

    #[test]
    fn what_was_culled_in_between_does_not_count() {
        assert_eq!(toggles(&[&[0, 5], &[5], &[1, 4, 5], &[5], &[0, 5]]), [(0, 0); 5]);
    }

    #[test]
    fn up_and_down_in_one_frame_are_told_apart() {
        let leaf = || sketch([5.0, 0.0, 0.0], 1.0, vec![]);
        let pair = || sketch([5.0, 0.0, 0.0], 1.0, vec![leaf(), leaf()]);
        let tree = tree(vec![pair(), pair()]);
        let mut counter = ToggleCounter::default();
        counter.count(&tree, &[0, 4, 5]);
        assert_eq!(counter.count(&tree, &[1, 2, 3]), Toggles { up: 1, down: 1 });
    }
}
