//! What a front asks of a graphics adapter, as far as boxes tell.

use super::Load;
use crate::camera::View;
use crate::runtime::{SceneTree, TreeNode};

/// Sums up what the nodes of a front ask for.
///
/// Fragments are those of the part of the image that the boxes cover, in all never more than the
/// whole image: what is hidden is hardly shaded where near nodes are drawn first. They are divided
/// into textured and plain ones as the triangles are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameLoad {
    geometry: Load,
    /// Sums of the parts of the image under the boxes: with a texture, and without.
    covered: [f64; 2],
}

impl FrameLoad {
    /// What a front asks for.
    pub fn of(tree: &SceneTree, front: &[u32], view: &View) -> Self {
        let mut load = Self::default();
        front.iter().for_each(|&node| load.add(tree.node(node), view));
        load
    }

    /// One node more is drawn.
    pub fn add(&mut self, node: &TreeNode, view: &View) {
        let geometry = geometry_load(node);
        self.geometry.draws += geometry.draws;
        self.geometry.vertices += geometry.vertices;
        self.geometry.triangles += geometry.triangles;
        let covered = view.frustum.covered(node.bbox);
        let textured = match node.triangles {
            0 => 0.0,
            triangles => f64::from(node.textured_triangles) / f64::from(triangles),
        };
        self.covered[0] += covered * textured;
        self.covered[1] += covered * (1.0 - textured);
    }

    /// The part of the image that is covered, 0 to 1.
    pub fn covered(&self) -> f64 {
        self.covered.iter().sum::<f64>().min(1.0)
    }

    /// The load of a frame of a view's size that uploads so many bytes.
    pub fn load(&self, view: &View, uploaded_bytes: u64) -> Load {
        let [width, height] = view.size.map(f64::from);
        let sum = self.covered.iter().sum::<f64>();
        let pixels = width * height / sum.max(1.0);
        Load {
            textured_fragments: self.covered[0] * pixels,
            plain_fragments: self.covered[1] * pixels,
            uploaded_bytes: uploaded_bytes as f64,
            ..self.geometry
        }
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
    fn fragments_are_never_more_than_the_image_and_textures_have_their_part() {
        let ahead = || Sketch { size: 100.0, ..sketch([51.0, 0.0, 0.0], 1.0, vec![]) };
        let tree = tree(vec![ahead(), ahead(), ahead()]);
        let view = view();
        let one = FrameLoad::of(&tree, &[0], &view).load(&view, 0);
        let three = FrameLoad::of(&tree, &[0, 1, 2], &view).load(&view, 7);
        assert_eq!((one.plain_fragments, one.textured_fragments), (10_000.0, 0.0));
        assert!((three.plain_fragments - 10_000.0).abs() < 1e-9);
        assert_eq!((three.triangles, three.draws, three.uploaded_bytes), (30.0, 3.0, 7.0));
    }

    #[test]
    fn what_is_far_covers_little() {
        // A cube of 2 m at 11 m, seen 90° high: its near face is 2 / 20 of either side.
        let tree = tree(vec![sketch([11.0, 0.0, 0.0], 1.0, vec![])]);
        let load = FrameLoad::of(&tree, &[0], &view());
        assert!((load.covered() - 0.01).abs() < 1e-12, "{}", load.covered());
        assert!((load.load(&view(), 0).plain_fragments - 100.0).abs() < 1e-9);
    }
}
