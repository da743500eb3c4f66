//! A view as it would have been without the toggles that led to it.

use std::collections::BTreeSet;

use super::SceneTree;

/// The nodes that show what `front` shows on the levels of the `earlier` front. What has come
/// into view since is as it is now; where one part of a node has, it is as fine as the rest.
pub fn front_before(tree: &SceneTree, earlier: &[u32], front: &[u32]) -> Vec<u32> {
    let drawn: BTreeSet<u32> = earlier.iter().copied().collect();
    let mut refined = BTreeSet::new();
    for &node in earlier {
        let mut at = tree.node(node).parent;
        while let Some(above) = at.filter(|&above| refined.insert(above)) {
            at = tree.node(above).parent;
        }
    }
    let mut before = BTreeSet::new();
    let mut open = Vec::new();
    for &node in front {
        let above = std::iter::successors(Some(node), |&at| tree.node(at).parent);
        match above.into_iter().find(|at| drawn.contains(at)) {
            Some(coarser) => drop(before.insert(coarser)),
            None => open.push(node),
        }
    }
    while let Some(node) = open.pop() {
        if refined.contains(&node) {
            open.extend(tree.children(node));
        } else {
            before.insert(node);
        }
    }
    before.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{sketch, tree};

    /// Node 0 has the children 1 (with 2 and 3) and 4; node 5 is another tree.
    fn small() -> SceneTree {
        let leaf = || sketch([5.0, 0.0, 0.0], 1.0, vec![]);
        let pair = sketch([5.0, 0.0, 0.0], 1.0, vec![leaf(), leaf()]);
        tree(vec![sketch([5.0, 0.0, 0.0], 1.0, vec![pair, leaf()]), leaf()])
    }

    #[test]
    fn toggles_are_undone_in_both_directions_and_over_several_levels() {
        let tree = small();
        for (earlier, front) in [
            (&[0, 5][..], &[1, 4, 5][..]),
            (&[1, 4, 5], &[0, 5]),
            (&[0], &[2, 3, 4]),
            (&[2, 3, 4], &[0]),
            (&[2, 3, 4, 5], &[1, 4, 5]),
            (&[1, 4], &[1, 4]),
        ] {
            assert_eq!(front_before(&tree, earlier, front), earlier, "{front:?}");
        }
    }

    #[test]
    fn what_came_into_view_is_as_it_is_and_what_left_is_left_out() {
        let tree = small();
        assert_eq!(front_before(&tree, &[0], &[1, 4, 5]), [0, 5]);
        assert_eq!(front_before(&tree, &[0, 5], &[1, 4]), [0]);
        assert_eq!(front_before(&tree, &[], &[1, 4]), [1, 4]);
        // Of node 0 only 2 was seen; the rest of it is as fine.
        assert_eq!(front_before(&tree, &[2], &[0, 5]), [2, 3, 4, 5]);
    }
}
