//! What a picture shows of the model.

use glam::DVec3;
use hlod::bench::ReferenceRenderer;
use hlod::camera::{Pose, View};
use hlod::runtime::SceneTree;

pub const SIZE: [u32; 2] = [160, 90];

/// The part of the picture that shows the model, 0 to 1.
pub fn part_with_model(renderer: &mut ReferenceRenderer, tree: &SceneTree, pose: &Pose) -> f64 {
    let front = front(tree, pose);
    let picture = renderer.render(&front, pose).unwrap();
    let shown = picture.pixels().filter(|pixel| pixel.0[3] > 0).count();
    shown as f64 / f64::from(SIZE[0] * SIZE[1])
}

/// Nodes in view whose mean error is seen as less than an eighth of a pixel.
fn front(tree: &SceneTree, pose: &Pose) -> Vec<u32> {
    let view = View::new(*pose, DVec3::ZERO, SIZE);
    let mut waiting = tree.roots().to_vec();
    let mut front = Vec::new();
    while let Some(index) = waiting.pop() {
        let node = tree.node(index);
        if view.frustum.outside(node.bbox) > 0.0 {
            continue;
        }
        let away = pose.position.distance(pose.position.clamp(node.bbox[0], node.bbox[1]));
        let is_fine = node.mean_error * view.pixels_per_metre() * 8.0 <= away;
        let children = tree.children(index);
        if is_fine || children.is_empty() {
            front.push(index);
        } else {
            waiting.extend(children);
        }
    }
    front
}
