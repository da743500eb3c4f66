//! How much of the picture nodes fill.

use glam::DVec3;

use super::SceneTree;
use crate::camera::View;

/// The part of the picture that nodes cover, as far as their boxes can tell: the sum of the parts
/// under each box, and never more than all of it, since little of what is hidden is shaded when
/// near nodes are drawn first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScreenCoverage(f64);

impl ScreenCoverage {
    /// One node more is drawn.
    pub fn add(&mut self, bbox: [DVec3; 2], view: &View) {
        // Once all of the picture is covered, boxes need not be looked at.
        if self.0 < 1.0 {
            self.0 += view.frustum.covered(bbox);
        }
    }

    /// The part, 0 to 1.
    pub fn part(self) -> f64 {
        self.0.min(1.0)
    }
}

/// The part of the picture that nodes cover, 0 to 1.
pub fn covered(tree: &SceneTree, front: &[u32], view: &View) -> f64 {
    let mut sum = ScreenCoverage::default();
    front.iter().for_each(|&node| sum.add(tree.node(node).bbox, view));
    sum.part()
}
