//! How far within the outline of the leaves the outline of coarser levels may be.

use glam::DVec3;

use crate::camera::View;
use crate::runtime::SceneTree;

/// Pixels by which an outline may be off through rasterisation alone.
const RASTER: f64 = 2.0;

/// For pixels of one view, how many pixels the levels drawn there may be off.
pub(super) struct Reach {
    view: View,
    /// Boxes of the nodes drawn, each as much larger as its node may be off, and by how much.
    boxes: Vec<([DVec3; 2], f64)>,
    /// From the middle of the picture, at one metre: a pixel to the right, and one down.
    steps: [DVec3; 2],
}

impl Reach {
    pub fn new(tree: &SceneTree, front: &[u32], view: &View) -> Self {
        let boxes = front.iter().map(|&node| {
            let node = tree.node(node);
            let [low, high] = node.bbox;
            ([low - node.geometric_error, high + node.geometric_error], node.geometric_error)
        });
        let pixel = 1.0 / view.pixels_per_metre();
        let steps = [view.pose.right() * pixel, -view.pose.up() * pixel];
        Self { view: *view, boxes: boxes.collect(), steps }
    }

    /// Pixels from the outline within which a gap at a pixel is explained: the most that any node
    /// there may be off, as large as it is seen. Nodes that end before what the leaves show there,
    /// `depth` metres along the view, do not count.
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
        RASTER + off.fold(0.0, f64::max) * self.view.pixels_per_metre()
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
        let reach = Reach::new(&tree, &[0, 1, 2], &view);
        // 100 pixels a metre at one metre; the near cube's front is at 9 m less what it is off.
        let near = reach.at([200, 100], 9.0) - RASTER;
        assert!((near - 10.0 / 8.9).abs() < 0.01, "{near}");
        // Behind it only the far one counts.
        let far = reach.at([200, 100], 99.0) - RASTER;
        assert!((far - 10.0 / 98.9).abs() < 0.001, "{far}");
        // Where there is none, nothing is off.
        assert_eq!(reach.at([200, 10], 9.0), RASTER);
        assert_eq!(reach.at([10, 100], 9.0), RASTER);
    }
}
