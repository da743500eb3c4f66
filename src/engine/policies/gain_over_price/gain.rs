//! What the image gains where a node gives way to its children.

use crate::camera::View;
use crate::engine::{FrameInput, NodeScale, SeenAreas};
use crate::runtime::SceneTree;

/// What was seen of a node is half forgotten after so many seconds.
const HALF_LIFE_S: f64 = 5.0;

/// Children that are no better than their parent gain this share of how wrong it is: what is below them may be better,
/// and would never be drawn otherwise, however much time there is.
const LEAST: f64 = 0.01;

/// How large nodes were seen, of late.
///
/// What is seen of a node changes with every turn of the camera, at the picture's edges most. So that
/// levels need not, what counts is the most that was seen of it, forgotten slowly.
#[derive(Clone, Debug, Default)]
pub(super) struct Gain {
    now_s: f64,
    nodes: Vec<Seen>,
}

/// What was seen of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Square metres across the line of sight, over the pixels of a picture.
    area: f64,
    /// When that was found.
    then_s: f64,
    /// In which picture of depths.
    picture: u32,
}

impl Gain {
    pub fn begin_frame(&mut self, nodes: usize, dt_s: f64) {
        self.now_s += dt_s;
        self.nodes.resize(nodes, Seen::default());
    }

    /// What the image gains by the children of a node: the part of it in which the node is seen, times
    /// how much less wrong its pixels are.
    pub fn of(&mut self, frame: &FrameInput<'_>, node: u32) -> f64 {
        let scale = NodeScale::of(frame.tree, node, frame.view);
        let area = self.seen(frame, node, scale);
        scale.part_of_picture(area) * removed(frame.tree, node, scale.nearest)
    }

    /// The most that was seen of a node, of late.
    fn seen(&mut self, frame: &FrameInput<'_>, node: u32, scale: NodeScale) -> f64 {
        let &FrameInput { tree, seen, .. } = frame;
        let picture = seen.map_or(0, SeenAreas::picture);
        let before = self.nodes[node as usize];
        let usual = || SeenAreas::usual(scale, frame.covered(node));
        let found = match seen {
            _ if !frame.is_visible(node) => 0.0,
            None => usual(),
            Some(_) if before.picture == picture => 0.0,
            Some(seen) => seen.of(tree, node).unwrap_or_else(usual),
        };
        let kept = || before.area * libm::exp2((before.then_s - self.now_s) / HALF_LIFE_S);
        let area = if found >= before.area { found } else { found.max(kept()) };
        self.nodes[node as usize] = Seen { area, then_s: self.now_s, picture };
        area
    }

    /// The same from another view, as far as is seen of nodes as a rule.
    pub fn expected(tree: &SceneTree, node: u32, view: &View) -> f64 {
        let scale = NodeScale::of(tree, node, view);
        let covered = view.frustum.covered(tree.node(node).bbox);
        let area = SeenAreas::usual(scale, covered);
        scale.part_of_picture(area) * removed(tree, node, scale.nearest)
    }

    /// The same of what need not be in view, where all of it would be seen.
    pub fn anywhere(frame: &FrameInput<'_>, node: u32) -> f64 {
        let per_metre = frame.tree.pixels_per_metre(node, frame.view);
        let [min, max] = frame.tree.node(node).bbox;
        let [width, height] = frame.view.size.map(f64::from);
        let pixels = (max - min).length() / 2.0 * per_metre;
        (pixels * pixels / (width * height)).min(1.0) * removed(frame.tree, node, per_metre)
    }
}

/// Returns by how much its children lower the error of each pixel of a node: at least [`LEAST`] of its error.
pub(in crate::engine) fn removed(tree: &SceneTree, node: u32, per_metre: f64) -> f64 {
    let (at, children) = (tree.node(node), tree.child_nodes(node));
    let wrong = |error: f64| (error * per_metre).sqrt();
    let errors = children.iter().map(|child| wrong(child.mean_error));
    let own = wrong(at.mean_error);
    (own - errors.sum::<f64>() / children.len().max(1) as f64).max(LEAST * own)
}

/// The part of the picture in which a node is seen now, 0 to 1.
pub(in crate::engine) fn part_of_picture(frame: &FrameInput<'_>, node: u32) -> f64 {
    let &FrameInput { tree, view, seen, .. } = frame;
    let scale = NodeScale::of(tree, node, view);
    let area = seen.and_then(|seen| seen.of(tree, node));
    scale.part_of_picture(area.unwrap_or_else(|| SeenAreas::usual(scale, frame.covered(node))))
}
