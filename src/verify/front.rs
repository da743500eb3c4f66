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

    /// Returns the front of at most `most_triangles` that viewers refine to: the node with the largest
    /// [error](Scene::viewer_errors) is replaced by its children until they do not fit. The roots are kept
    /// even if they have more.
    pub fn of_size(scene: &Scene, most_triangles: u64) -> Self {
        let errors = scene.viewer_errors();
        let ranked = |node: u32| {
            let error = if is_leaf(scene, node) { -1.0 } else { errors[node as usize] };
            Ranked { error, node }
        };
        let triangles = |node: u32| u64::from(scene.nodes[node as usize].triangles);
        let mut open: BinaryHeap<Ranked> = scene.roots().map(ranked).collect();
        let mut total: u64 = open.iter().map(|entry| triangles(entry.node)).sum();
        let mut nodes = Vec::new();
        while let Some(Ranked { node, .. }) = open.pop() {
            let more = scene.children(node).map(triangles).sum::<u64>();
            if is_leaf(scene, node) {
                nodes.push(node);
                continue;
            }
            if total + more > most_triangles + triangles(node) {
                nodes.push(node);
                break;
            }
            total = total + more - triangles(node);
            open.extend(scene.children(node).map(ranked));
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

/// A node by its error, leaves last; equal ones by number.
struct Ranked {
    error: f64,
    node: u32,
}

impl Ord for Ranked {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then_with(|| other.node.cmp(&self.node))
    }
}

impl PartialOrd for Ranked {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ranked {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ranked {}

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

    #[test]
    fn nodes_are_refined_in_the_order_of_viewers() {
        let mut scene = scene();
        let below = |scene: &Scene, root: u32| scene.children(root).next().unwrap();
        // Two trees of two levels: 0 above 1 and 3 above 4.
        scene.nodes.truncate(4);
        for (number, node) in (0u32..).zip(&mut scene.nodes) {
            let is_root = number % 2 == 0;
            (node.parent, node.first_child) = match is_root {
                true => (None, Some(number + 1)),
                false => (Some(number - 1), None),
            };
            (node.level, node.triangles) = (number % 2, if is_root { 10 } else { 20 });
            let error = if is_root { 1.0 } else { 0.0 };
            (node.mean_error, node.p95_error, node.geometric_error) = (0.0, error, 4.0 * error);
        }
        (scene.nodes[0].next_sibling, scene.nodes[1].next_sibling) = (Some(2), None);
        (scene.nodes[2].next_sibling, scene.nodes[3].next_sibling) = (None, None);
        // One point of the first is far off; most of the second is.
        scene.nodes[0].geometric_error = 50.0;
        (scene.nodes[2].p95_error, scene.nodes[2].geometric_error) = (2.0, 8.0);
        assert_eq!(nodes(&Front::of_size(&scene, 30)), [0, below(&scene, 2)]);
    }
}
