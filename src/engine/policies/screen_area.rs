//! Projected area: a node is expanded where it takes much of the image, and its children are
//! collapsed where each takes little.
//!
//! Cossutti, "Hierarchical Levels of Detail for Rendering of Large Meshes" (2014), sections 4.1,
//! 4.2 and 5: thresholds of 70 and 15 %, preloading of active nodes (the parents, siblings and
//! children of those in view), what is in view before what is active and the near before the far,
//! and 8 seconds after which a node that nobody asked for leaves memory. How long a frame takes is
//! not considered.

use super::descent::descend;
use super::parameter::{Parameter, info, parameter, with_settings};
use super::unused::Unused;
use super::{PolicyKind, Settings};
use crate::Result;
use crate::engine::{FrameInput, Policy, Selection};

const NAME: &str = "screen-area";

/// How much more useful nodes in view are than active ones.
const IN_VIEW: f64 = 1e6;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Options {
    expand: f64,
    collapse: f64,
    inactive_s: f64,
}

const OPTIONS: Options = Options { expand: 0.70, collapse: 0.15, inactive_s: 8.0 };

const PARAMETERS: [Parameter<Options>; 3] = [
    parameter!(expand, 0.0, 1.0, "part of the image above which a node is expanded"),
    parameter!(collapse, 0.0, 1.0, "part of the image below which siblings are collapsed"),
    parameter!(inactive_s, 0.0, 1e6, "seconds after which what nobody asks for leaves memory"),
];

pub(super) const KIND: PolicyKind = PolicyKind {
    name: NAME,
    summary: "nodes that take much of the image are expanded, whatever the frame takes",
    source: "Cossutti, HLOD Rendering of Large Meshes, 2014, chapter 4",
    parameters: || info(&OPTIONS, &PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(NAME, OPTIONS, &PARAMETERS, settings)?;
        Ok(Box::new(ScreenArea { options, ..ScreenArea::default() }))
    },
};

impl Default for Options {
    fn default() -> Self {
        OPTIONS
    }
}

#[derive(Clone, Debug, Default)]
struct ScreenArea {
    options: Options,
    /// By node: whether its children stand for it.
    expanded: Vec<bool>,
    /// Seconds since the first frame.
    now_s: f64,
    unused: Unused,
    queue: Vec<u32>,
}

/// The part of the image under the rectangle around a node's projected box.
fn area(frame: &FrameInput<'_>, node: u32) -> f64 {
    frame.covered(node)
}

fn utility(frame: &FrameInput<'_>, node: u32) -> f64 {
    let eye = frame.view.pose.position;
    let bbox = frame.tree.node(node).bbox;
    let near = 1.0 / (1.0 + eye.distance(eye.clamp(bbox[0], bbox[1])));
    if frame.is_visible(node) { near * IN_VIEW } else { near }
}

impl Policy for ScreenArea {
    fn name(&self) -> &'static str {
        NAME
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        self.expanded.resize(frame.tree.len(), false);
        self.now_s += frame.dt_s;
        let Options { expand, collapse, .. } = self.options;
        let expanded = &mut self.expanded;
        let refine = |node: u32| {
            if !expanded[node as usize] {
                expanded[node as usize] = area(frame, node) > expand;
            } else {
                let is_small =
                    |&child: &u32| !expanded[child as usize] && area(frame, child) < collapse;
                expanded[node as usize] = !frame.tree.children(node).iter().all(is_small);
            }
            expanded[node as usize]
        };
        descend(frame, &mut self.queue, out, refine, |node| utility(frame, node));
        // Active nodes: the parents and siblings of those drawn were visited on the way.
        let children = out.front.iter().flat_map(|&node| frame.tree.children(node));
        let visited = out.requests.len();
        let active = children.map(|&child| (child, utility(frame, child) / IN_VIEW));
        out.requests.extend(active);
        dedup(&mut out.requests, visited);
        let (now_s, after_s) = (self.now_s, self.options.inactive_s);
        self.unused.release(now_s, after_s, frame.tree.len(), out);
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        utility(frame, node) / IN_VIEW
    }
}

/// Drops from `requests[from..]` what is before it: children that were wanted in place of a node
/// that is drawn because not all of them were in memory.
fn dedup(requests: &mut Vec<(u32, f64)>, from: usize) {
    let mut wanted: Vec<u32> = requests[..from].iter().map(|&(node, _)| node).collect();
    wanted.sort_unstable();
    let mut at = 0;
    requests.retain(|&(node, _)| {
        at += 1;
        at <= from || wanted.binary_search(&node).is_err()
    });
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::test_frame::TestFrame;
    use crate::runtime::test_tree::{Sketch, sketch, tree};

    /// A wall of 10 × 10 m across the view at 10 m, and its two halves; half of each is behind.
    fn wall() -> TestFrame {
        let half = |y: f64| Sketch { size: 5.0, ..sketch([12.5, y, 0.0], 1.0, vec![]) };
        let children = vec![half(-2.5), half(2.5)];
        TestFrame::new(tree(vec![Sketch { size: 10.0, ..sketch([15.0, 0.0, 0.0], 1.0, children) }]))
    }

    fn from(frame: &mut TestFrame, x: f64) {
        let mut pose = frame.view.pose;
        pose.position = DVec3::new(x, 0.0, 0.0);
        frame.view = crate::camera::View::new(pose, DVec3::ZERO, frame.view.size);
    }

    #[test]
    fn nodes_expand_above_70_percent_and_collapse_below_15() {
        let (mut frame, mut policy) = (wall(), KIND.make(&Settings::new()).unwrap());
        // The near side is at 10 m, so that it is (5 / d)² of the image from d metres.
        for (d, front) in [
            (6.1, &[0][..]), // 67 %
            (5.9, &[1, 2]),  // 72 %
            (6.1, &[1, 2]),  // stays
            (6.4, &[1, 2]),  // each half is 15.3 %
            (6.5, &[0]),     // and 14.8 %
            (6.4, &[0]),     // stays
        ] {
            from(&mut frame, 10.0 - d);
            assert_eq!(frame.front(&mut *policy), front, "from {d} m");
        }
    }

    #[test]
    fn children_of_what_is_drawn_are_preloaded_after_what_is_in_view() {
        let (frame, mut policy) = (wall(), KIND.make(&Settings::new()).unwrap());
        let selection = frame.select(&mut *policy);
        assert_eq!(selection.front, [0]);
        let of = |node| selection.requests.iter().find(|request| request.0 == node).unwrap().1;
        assert!(of(1) > 0.0 && of(0) > 1e3 * of(1));
        assert_eq!(selection.requests.len(), 3, "each once");
    }

    #[test]
    fn what_nobody_asks_for_leaves_after_eight_seconds() {
        let (mut frame, mut policy) = (wall(), KIND.make(&Settings::new()).unwrap());
        frame.dt_s = 1.0;
        from(&mut frame, 5.0);
        assert_eq!(frame.front(&mut *policy), [1, 2]);
        // Behind the camera only the root is asked for.
        from(&mut frame, 100.0);
        let released: Vec<Vec<u32>> =
            (0..10).map(|_| frame.select(&mut *policy).released).collect();
        let first = released.iter().position(|nodes| !nodes.is_empty());
        assert_eq!(first, Some(8), "{released:?}");
        assert_eq!(released[8], [1, 2]);
    }
}
