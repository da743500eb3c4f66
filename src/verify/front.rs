//! Fronts: sets of nodes that stand for all leaves, each leaf below exactly one of them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::tree::{is_leaf, line};
use crate::format::Scene;

/// Nodes that together are the whole scene, as it would be drawn.
pub(super) struct Front {
    nodes: Vec<u32>,
    is_member: Vec<bool>,
}

impl Front {
    fn new(scene: &Scene, nodes: Vec<u32>) -> Self {
        let mut is_member = vec![false; scene.nodes.len()];
        for &node in &nodes {
            is_member[node as usize] = true;
        }
        Self { nodes, is_member }
    }

    /// All nodes of a level and the leaves above it.
    pub fn level(scene: &Scene, level: u32) -> Self {
        let nodes = (0..)
            .zip(&scene.nodes)
            .filter(|(_, node)| {
                node.level == level || (node.level < level && node.first_child.is_none())
            })
            .map(|(number, _)| number)
            .collect();
        Self::new(scene, nodes)
    }

    /// The front that comes from the roots by replacing the node of the largest stored error by
    /// its children, again and again, as long as it has at most `most_triangles`. The roots stay
    /// where they alone have more.
    pub fn of_size(scene: &Scene, most_triangles: u64) -> Self {
        let triangles = |node: u32| u64::from(scene.nodes[node as usize].triangles);
        let roots = (0..scene.nodes.len() as u32)
            .filter(|&node| scene.nodes[node as usize].parent.is_none());
        let mut open: BinaryHeap<ByError> = roots.map(|node| ByError::of(scene, node)).collect();
        let mut total: u64 = open.iter().map(|entry| triangles(entry.node)).sum();
        let mut nodes = Vec::new();
        while let Some(ByError { node, .. }) = open.pop() {
            let children: Vec<u32> = children(scene, node).collect();
            let more = children.iter().map(|&child| triangles(child)).sum::<u64>();
            if children.is_empty() {
                nodes.push(node);
                continue;
            }
            if total + more > most_triangles + triangles(node) {
                nodes.push(node);
                break;
            }
            total = total + more - triangles(node);
            open.extend(children.into_iter().map(|child| ByError::of(scene, child)));
        }
        nodes.extend(open.into_iter().map(|entry| entry.node));
        nodes.sort_unstable();
        Self::new(scene, nodes)
    }

    /// Its nodes, in order.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        self.nodes.iter().copied()
    }

    /// True for its own nodes.
    pub fn has(&self, node: u32) -> bool {
        self.is_member[node as usize]
    }

    /// The node of the front that stands for a leaf.
    pub fn above(&self, scene: &Scene, leaf: u32) -> Option<u32> {
        line(scene, leaf).find(|&node| self.has(node))
    }
}

fn children(scene: &Scene, node: u32) -> impl Iterator<Item = u32> {
    let first = scene.nodes[node as usize].first_child;
    std::iter::successors(first, |&child| scene.nodes[child as usize].next_sibling)
}

/// A node by its stored error, leaves last; equal ones by number.
struct ByError {
    error: f64,
    node: u32,
}

impl ByError {
    fn of(scene: &Scene, node: u32) -> Self {
        let error =
            if is_leaf(scene, node) { -1.0 } else { scene.nodes[node as usize].geometric_error };
        Self { error, node }
    }
}

impl Ord for ByError {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then_with(|| other.node.cmp(&self.node))
    }
}

impl PartialOrd for ByError {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for ByError {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for ByError {}

#[cfg(test)]
mod tests {
    use super::super::tree::leaves;
    use super::*;
    use crate::format::test_scene::scene;

    fn nodes(front: &Front) -> Vec<u32> {
        front.nodes().collect()
    }

    #[test]
    fn levels_with_the_leaves_above_them() {
        let scene = scene();
        assert_eq!(nodes(&Front::level(&scene, 0)), [0, 4]);
        assert_eq!(nodes(&Front::level(&scene, 2)), [2, 3, 4]);
        assert_eq!(Front::level(&scene, 1).above(&scene, 3), Some(1));
        assert_eq!(Front::level(&scene, 1).above(&scene, 4), Some(4));
    }

    /// Nodes 2 and 3 are leaves below 1, below 0; node 4 is a leaf and a root.
    #[test]
    fn fronts_of_any_size_stand_for_each_leaf_once_and_keep_to_it() {
        let mut scene = scene();
        for (node, triangles) in scene.nodes.iter_mut().zip([10, 20, 30, 30, 7]) {
            node.triangles = triangles;
        }
        for (size, expected) in [
            (0, &[0, 4][..]),
            (26, &[0, 4]),
            (27, &[1, 4]),
            (66, &[1, 4]),
            (67, &[2, 3, 4]),
            (u64::MAX / 2, &[2, 3, 4]),
        ] {
            let front = Front::of_size(&scene, size);
            assert_eq!(nodes(&front), expected, "{size}");
            for leaf in leaves(&scene) {
                let above = line(&scene, leaf).filter(|&node| front.has(node)).count();
                assert_eq!(above, 1, "{size}: {leaf}");
            }
        }
    }
}
