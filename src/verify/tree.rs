//! Who stands above whom.

use crate::format::Scene;

/// True for a node without children.
pub(super) fn is_leaf(scene: &Scene, node: u32) -> bool {
    scene.nodes[node as usize].first_child.is_none()
}

/// Numbers of all leaves, in order.
pub(super) fn leaves(scene: &Scene) -> Vec<u32> {
    (0..scene.nodes.len() as u32).filter(|&node| is_leaf(scene, node)).collect()
}

/// A node and those above it, from the node up.
pub(super) fn line(scene: &Scene, node: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(node), |&node| scene.nodes[node as usize].parent)
}

/// The levels that have nodes other than leaves: from the roots' down to the last but one.
pub(super) fn coarse_levels(scene: &Scene) -> u32 {
    scene
        .nodes
        .iter()
        .filter(|node| node.first_child.is_some())
        .map(|node| node.level + 1)
        .max()
        .unwrap_or(0)
}

/// For two leaves, the lines above each up to where they meet, that excluded.
pub(super) fn apart(scene: &Scene, a: u32, b: u32) -> [Vec<u32>; 2] {
    let mut lines = [a, b].map(|leaf| line(scene, leaf).collect::<Vec<_>>());
    while let ([.., a], [.., b]) = (&lines[0][..], &lines[1][..])
        && a == b
    {
        for line in &mut lines {
            line.pop();
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::test_scene::scene;

    #[test]
    fn leaves_and_lines() {
        let scene = scene();
        assert_eq!(coarse_levels(&scene), 2);
        assert_eq!(leaves(&scene), [2, 3, 4]);
        assert_eq!(apart(&scene, 2, 3), [vec![2], vec![3]]);
        assert_eq!(apart(&scene, 2, 4), [vec![2, 1, 0], vec![4]]);
    }
}
