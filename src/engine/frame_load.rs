//! What a front asks of a graphics adapter, as far as boxes tell.

use super::{CoveredParts, Load};
use crate::camera::View;
use crate::runtime::{SceneTree, TreeNode};

/// Sums up what fronts ask for; keeps its memory from one to the next.
///
/// Fragments are those of the part of the image under each box. The more of the image is under the
/// boxes of nearer nodes, the more of a node's fragments are hidden: near nodes are drawn first, so
/// that these are rejected before they are shaded. Those that are shaded are textured or plain as
/// the triangles are.
#[derive(Clone, Debug, Default)]
pub struct FrontLoad {
    /// Squared distance, the part of the image under the box, and that of textured triangles.
    by_distance: Vec<(f64, f64, f64)>,
}

impl FrontLoad {
    /// The load of a frame that draws a front and uploads so many bytes.
    pub fn of(
        &mut self,
        tree: &SceneTree,
        front: &[u32],
        view: &View,
        covered: &CoveredParts,
        uploaded_bytes: u64,
    ) -> Load {
        let eye = view.pose.position;
        let mut load = Load { uploaded_bytes: uploaded_bytes as f64, ..Load::default() };
        self.by_distance.clear();
        for (index, node) in front.iter().map(|&node| (node, tree.node(node))) {
            let geometry = geometry_load(node);
            load.draws += geometry.draws;
            load.vertices += geometry.vertices;
            load.triangles += geometry.triangles;
            let [min, max] = node.bbox;
            let textured = match node.triangles {
                0 => 0.0,
                triangles => f64::from(node.textured_triangles) / f64::from(triangles),
            };
            let distance = eye.distance_squared(eye.clamp(min, max));
            self.by_distance.push((distance, covered.of(tree, index, view), textured));
        }
        // Nodes in the same place hide each other alike, whatever their order.
        self.by_distance.sort_unstable_by(|a, b| {
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
        });
        let [width, height] = view.size.map(f64::from);
        let pixels = width * height;
        let mut under_nearer = 0.0;
        for &(_, under, textured) in &self.by_distance {
            let shaded = under * (1.0 - under_nearer);
            under_nearer += shaded;
            load.textured_fragments += shaded * textured * pixels;
            load.plain_fragments += shaded * (1.0 - textured) * pixels;
            load.hidden_fragments += (under - shaded) * pixels;
        }
        load
    }
}

/// What a node asks for wherever it is seen from.
pub fn geometry_load(node: &TreeNode) -> Load {
    Load {
        draws: f64::from(node.draws),
        vertices: f64::from(node.vertices),
        triangles: f64::from(node.triangles),
        ..Load::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{Sketch, sketch, tree, view};

    #[test]
    fn what_is_behind_others_is_hidden_and_shaded_only_once() {
        let ahead = |x: f64| Sketch { size: 100.0, ..sketch([x, 0.0, 0.0], 1.0, vec![]) };
        let tree = tree(vec![ahead(251.0), ahead(51.0), ahead(151.0)]);
        let view = view();
        let near = FrontLoad::default().of(&tree, &[1], &view, &CoveredParts::default(), 0);
        assert_eq!((near.plain_fragments, near.hidden_fragments), (10_000.0, 0.0));
        // The others are a quarter and a sixteenth of the image, wholly behind the near one.
        let all = FrontLoad::default().of(&tree, &[0, 1, 2], &view, &CoveredParts::default(), 7);
        let under = [0, 2].map(|node| view.frustum.covered(tree.node(node).bbox) * 1e4);
        assert!((all.plain_fragments - 10_000.0).abs() < 1e-6);
        assert!((all.hidden_fragments - under.iter().sum::<f64>()).abs() < 1e-6);
        assert_eq!((all.triangles, all.draws, all.uploaded_bytes), (30.0, 3.0, 7.0));
        assert_eq!(all.textured_fragments, 0.0);
    }

    #[test]
    fn what_is_far_covers_little() {
        // A cube of 2 m at 11 m, seen 90° high: its near face is 2 / 20 of either side.
        let tree = tree(vec![sketch([11.0, 0.0, 0.0], 1.0, vec![])]);
        let load = FrontLoad::default().of(&tree, &[0], &view(), &CoveredParts::default(), 0);
        assert!((load.plain_fragments - 100.0).abs() < 1e-9);
    }
}
