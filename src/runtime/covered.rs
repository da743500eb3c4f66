//! How much of the picture nodes fill.

use super::SceneTree;
use crate::camera::View;

/// The part of the picture that nodes cover, 0 to 1, as far as their boxes can tell: the sum of
/// the parts under each box, and never more than all of it, since little of what is hidden is
/// shaded when near nodes are drawn first.
pub fn covered(tree: &SceneTree, front: &[u32], view: &View) -> f64 {
    let mut sum = 0.0;
    for &node in front {
        sum += view.frustum.covered(tree.node(node).bbox);
        if sum >= 1.0 {
            return 1.0;
        }
    }
    sum
}
