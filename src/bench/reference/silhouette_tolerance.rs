//! How far within the outline of the leaves the outline of coarser levels may be.

use glam::DVec3;

use crate::camera::View;
use crate::runtime::SceneTree;

/// How many pixels an outline may be off without being taken for a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SilhouetteTolerance {
    /// Pixels whatever is drawn, 0 or more; default 2, since rasterisation alone may differ so.
    pub pixels: f64,
    /// Most pixels that the errors of the nodes drawn there add, 0 or more; default 8.
    pub most_error_pixels: f64,
}

impl Default for SilhouetteTolerance {
    fn default() -> Self {
        Self { pixels: 2.0, most_error_pixels: 8.0 }
    }
}

/// For pixels of one view, how many pixels the levels drawn there may be off.
pub(super) struct OutlineTolerance {
    tolerance: SilhouetteTolerance,
    view: View,
    /// Boxes of the nodes drawn, each as much larger as its node may be off, and by how much.
    boxes: Vec<([DVec3; 2], f64)>,
    /// From the middle of the picture, at one metre: a pixel to the right, and one down.
    steps: [DVec3; 2],
}

impl OutlineTolerance {
    pub fn new(
        tree: &SceneTree,
        front: &[u32],
        view: &View,
        tolerance: SilhouetteTolerance,
    ) -> Self {
        let boxes = front.iter().map(|&node| {
            let node = tree.node(node);
            let [low, high] = node.bbox;
            ([low - node.geometric_error, high + node.geometric_error], node.geometric_error)
        });
        let pixel = 1.0 / view.pixels_per_metre();
        let steps = [view.pose.right() * pixel, -view.pose.up() * pixel];
        Self { tolerance, view: *view, boxes: boxes.collect(), steps }
    }

    /// Pixels from the outline within which a gap at a pixel is explained: the most that any node
    /// there may be off, as large as it is seen, but no more than the tolerance says. Nodes that end
    /// before what the leaves show there, `depth` metres along the view, do not count.
    pub fn at(&self, [x, y]: [u32; 2], depth: f64) -> f64 {
        let [width, height] = self.view.size.map(f64::from);
        let [across, down] = [f64::from(x) + 0.5 - width / 2.0, f64::from(y) + 0.5 - height / 2.0];
        let ray = self.view.pose.forward() + self.steps[0] * across + self.steps[1] * down;
        // What moves towards the eye moves in the picture too, and the more the further from the
        // middle.
        let slant = ray.length();
        let eye = self.view.pose.position;
        let off = self.boxes.iter().filter_map(|&([low, high], error)| {
            let times = |corner: DVec3| (corner - eye) / ray;
            let (a, b) = (times(low), times(high));
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element();
            if enter > leave || leave < depth {
                return None;
            }
            let nearest = enter.max(depth - error * slant);
            Some(error * slant / nearest.max(f64::MIN_POSITIVE))
        });
        let off = off.fold(0.0, f64::max) * self.view.pixels_per_metre();
        self.tolerance.pixels + off.min(self.tolerance.most_error_pixels)
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::camera::Pose;
    use crate::format::Scene;
    use crate::runtime::test_tree::{scene, sketch};

    /// Cubes of 2 m at 10 m and at 100 m ahead, each 0.1 m off, and one at 5 m to the side.
    fn cubes() -> Scene {
        let cube = |x: f64, z: f64| sketch([x, 0.0, z], 1.0, vec![]);
        let mut scene = scene(vec![cube(0.0, -10.0), cube(0.0, -100.0), cube(50.0, -5.0)]);
        scene.nodes.iter_mut().for_each(|node| node.geometric_error = 0.1);
        scene
    }

    #[test]
    fn what_is_off_counts_as_large_as_it_is_seen() {
        let tree = SceneTree::new(&cubes());
        let pose = Pose { position: DVec3::ZERO, rotation: DQuat::IDENTITY, fov_y_deg: 90.0 };
        let view = View::new(pose, DVec3::ZERO, [400, 200]);
        let tolerance = SilhouetteTolerance { most_error_pixels: 1.12, ..Default::default() };
        let outline = OutlineTolerance::new(&tree, &[0, 1, 2], &view, tolerance);
        // 100 pixels a metre at one metre; the near cube's front is at 9 m less what it is off.
        let uncapped =
            OutlineTolerance::new(&tree, &[0, 1, 2], &view, SilhouetteTolerance::default());
        let near = uncapped.at([200, 100], 9.0) - 2.0;
        assert!((near - 10.0 / 8.9).abs() < 0.01, "{near}");
        assert_eq!(outline.at([200, 100], 9.0), 2.0 + 1.12);
        // Behind it only the far one counts.
        let far = outline.at([200, 100], 99.0) - 2.0;
        assert!((far - 10.0 / 98.9).abs() < 0.001, "{far}");
        // Where there is none, nothing is off.
        assert_eq!(outline.at([200, 10], 9.0), 2.0);
        assert_eq!(outline.at([10, 100], 9.0), 2.0);
    }
}
