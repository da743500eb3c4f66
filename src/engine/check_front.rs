//! What every front must be, whoever chose it.

use std::fmt;

use crate::camera::View;
use crate::engine::Residents;
use crate::runtime::SceneTree;

/// A rule that a front breaks, and the node at which it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrontFault {
    /// Index in the scene.
    pub node: u32,
    /// What is wrong with it.
    pub rule: FrontRule,
}

/// A rule for fronts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrontRule {
    /// It is in memory.
    Resident,
    /// It is in the front once, and none above it is.
    NoneAbove,
    /// What is in view is drawn: this node or one above it, or all of its children in view.
    Covered,
}

impl fmt::Display for FrontFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let node = self.node;
        match self.rule {
            FrontRule::Resident => write!(f, "node {node} is drawn and not in memory"),
            FrontRule::NoneAbove => write!(f, "node {node} is drawn, and so is one above it"),
            FrontRule::Covered => {
                write!(
                    f,
                    "node {node} is in view, and neither it nor one above or below it is drawn"
                )
            }
        }
    }
}

/// Checks fronts of one tree, in the time of a traversal of what they draw.
#[derive(Clone, Debug, Default)]
pub struct FrontCheck {
    /// The check in which a node was drawn last.
    drawn: Vec<u32>,
    checks: u32,
    open: Vec<u32>,
}

impl FrontCheck {
    /// Checks that all of a front is resident, that none of it is above another, and that all that
    /// is in view is covered, roots that are not resident excepted: their files are broken.
    pub fn check(
        &mut self,
        tree: &SceneTree,
        front: &[u32],
        view: &View,
        residents: &Residents,
    ) -> Result<(), FrontFault> {
        self.drawn.resize(tree.len(), 0);
        self.checks += 1;
        let (checks, drawn) = (self.checks, &mut self.drawn);
        for &node in front {
            if !residents.contains(node) {
                return Err(FrontFault { node, rule: FrontRule::Resident });
            }
            if std::mem::replace(&mut drawn[node as usize], checks) == checks {
                return Err(FrontFault { node, rule: FrontRule::NoneAbove });
            }
        }
        for &node in front {
            let above = |&at: &u32| tree.node(at).parent;
            let mut all_above = std::iter::successors(above(&node), above);
            if all_above.any(|at| drawn[at as usize] == checks) {
                return Err(FrontFault { node, rule: FrontRule::NoneAbove });
            }
        }
        self.open.clear();
        let roots = tree.roots().iter().rev();
        self.open.extend(roots.filter(|&&root| residents.contains(root)));
        while let Some(node) = self.open.pop() {
            let is_visible = view.frustum.outside(tree.node(node).bbox) <= 0.0;
            if drawn[node as usize] == checks || !is_visible {
                continue;
            }
            let children = tree.children(node);
            if children.is_empty() {
                return Err(FrontFault { node, rule: FrontRule::Covered });
            }
            self.open.extend(children.iter().rev());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{sketch, tree, view};

    /// Node 0 in view has the children 1 (with 2 and 3) and 4; node 5 is behind the camera.
    fn small() -> SceneTree {
        let leaf = || sketch([5.0, 0.0, 0.0], 1.0, vec![]);
        let pair = sketch([5.0, 0.0, 0.0], 1.0, vec![leaf(), leaf()]);
        let behind = sketch([-5.0, 0.0, 0.0], 1.0, vec![]);
        tree(vec![sketch([5.0, 0.0, 0.0], 1.0, vec![pair, leaf()]), behind])
    }

    fn fault(front: &[u32], missing: &[u32]) -> Option<(u32, FrontRule)> {
        let tree = small();
        let mut residents = Residents::all(tree.len());
        missing.iter().for_each(|&node| residents.set(node, false));
        let found = FrontCheck::default().check(&tree, front, &view(), &residents);
        found.err().map(|fault| (fault.node, fault.rule))
    }

    #[test]
    fn covers_without_overlap_are_sound() {
        for front in [&[0][..], &[0, 5], &[1, 4], &[2, 3, 4], &[4, 3, 2, 5]] {
            assert_eq!(fault(front, &[]), None, "{front:?}");
        }
        assert_eq!(fault(&[], &[0]), None, "a broken root cannot be drawn");
    }

    #[test]
    fn each_rule_is_told_with_its_node() {
        assert_eq!(fault(&[1, 4], &[4]), Some((4, FrontRule::Resident)));
        assert_eq!(fault(&[0, 3], &[]), Some((3, FrontRule::NoneAbove)));
        assert_eq!(fault(&[0, 0], &[]), Some((0, FrontRule::NoneAbove)));
        assert_eq!(fault(&[1], &[]), Some((4, FrontRule::Covered)));
        assert_eq!(fault(&[2, 4], &[]), Some((3, FrontRule::Covered)));
        assert_eq!(fault(&[5], &[]), Some((2, FrontRule::Covered)));
    }
}
