//! A scene in another order of its nodes.

use super::Scene;

impl Scene {
    /// The same scene with its nodes breadth-first: roots, then their children, and so on, siblings
    /// side by side. Frames visit nodes from the roots down to some level, and find all that is known
    /// of them at the beginning of every table, however much there is below; a file has them
    /// depth-first, in which they lie the further apart the more there is below them.
    ///
    /// The scene must have been [checked](Scene::check).
    pub fn breadth_first(mut self) -> Self {
        let mut order: Vec<u32> = self.roots().collect();
        let mut at = 0;
        while let Some(&node) = order.get(at) {
            order.extend(self.children(node));
            at += 1;
        }
        let mut places = vec![0; self.nodes.len()];
        for (place, &node) in (0..).zip(&order) {
            places[node as usize] = place;
        }
        let place = |node: Option<u32>| node.map(|node| places[node as usize]);
        let moved = |&node: &u32| {
            let mut node = std::mem::take(&mut self.nodes[node as usize]);
            node.parent = place(node.parent);
            node.first_child = place(node.first_child);
            node.next_sibling = place(node.next_sibling);
            node
        };
        self.nodes = order.iter().map(moved).collect();
        self
    }
}

#[cfg(test)]
mod tests {
    use crate::format::{Node, NodeId, Scene};

    fn node(id: u64, links: [Option<u32>; 3]) -> Node {
        let [parent, first_child, next_sibling] = links;
        Node { id: NodeId(id), parent, first_child, next_sibling, ..Node::default() }
    }

    #[test]
    fn levels_follow_each_other_and_links_go_along() {
        // 0 (1 (2 3) 4 (5)), 6
        let scene = Scene {
            nodes: vec![
                node(0, [None, Some(1), None]),
                node(1, [Some(0), Some(2), Some(4)]),
                node(2, [Some(1), None, Some(3)]),
                node(3, [Some(1), None, None]),
                node(4, [Some(0), Some(5), None]),
                node(5, [Some(4), None, None]),
                node(6, [None, None, None]),
            ],
            ..crate::format::test_scene::scene()
        };
        let found = scene.breadth_first();
        let ids = |nodes: &mut dyn Iterator<Item = u32>| {
            nodes.map(|node| found.nodes[node as usize].id.0).collect::<Vec<_>>()
        };
        assert_eq!(ids(&mut (0..7)), [0, 6, 1, 4, 2, 3, 5]);
        assert_eq!(ids(&mut found.roots()), [0, 6]);
        for (above, children) in [(0, &[1, 4][..]), (1, &[2, 3]), (4, &[5]), (6, &[]), (5, &[])] {
            let place = found.nodes.iter().position(|node| node.id.0 == above).unwrap() as u32;
            assert_eq!(ids(&mut found.children(place)), children, "{above}");
            assert!(found.children(place).all(|c| found.nodes[c as usize].parent == Some(place)));
        }
    }
}
