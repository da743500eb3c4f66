//! Nodes by rank, and what refining them takes.

use std::cmp::Ordering;

use crate::engine::{FrameInput, FrontLoad, Selection};
use crate::runtime::TreeNode;

/// Milliseconds; nothing is free, so that gains can be divided by costs.
const LEAST_MS: f64 = 1e-6;

/// A node by rank; the lower number is first among equals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    pub rank: f64,
    pub node: u32,
}

impl Ord for Ranked {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank.total_cmp(&other.rank).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Ranked {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ranked {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ranked {}

/// The children of a node that are in view.
pub(super) fn visible_children<'a>(
    frame: &'a FrameInput<'_>,
    node: u32,
) -> impl Iterator<Item = u32> + 'a {
    frame.tree.children(node).iter().copied().filter(|&child| frame.is_visible(child))
}

/// Milliseconds that the children of a node that are in view and not hidden take more than the node;
/// more than 0.
pub(super) fn refining_ms(frame: &FrameInput<'_>, node: u32) -> f64 {
    added_ms(frame, node, visible_children(frame, node).filter(|&child| !frame.is_hidden(child)))
}

/// The same of all its children, whatever of them is in view.
pub(super) fn wholly_refining_ms(frame: &FrameInput<'_>, node: u32) -> f64 {
    added_by(frame, node, frame.tree.child_nodes(node).iter())
}

/// Milliseconds that some of the children of a node take more than the node; more than 0.
pub(super) fn added_ms(
    frame: &FrameInput<'_>,
    node: u32,
    children: impl Iterator<Item = u32>,
) -> f64 {
    added_by(frame, node, children.map(|child| frame.tree.node(child)))
}

fn added_by<'a>(
    frame: &FrameInput<'_>,
    node: u32,
    children: impl Iterator<Item = &'a TreeNode>,
) -> f64 {
    let of = |node: &TreeNode| [node.draws, node.vertices, node.triangles].map(i64::from);
    let mut more = of(frame.tree.node(node)).map(|count| -count);
    for child in children.map(of) {
        (0..3).for_each(|at| more[at] += child[at]);
    }
    let [draws, vertices, triangles] = more.map(|count| count as f64);
    frame.costs.geometry_ms(draws, vertices, triangles).max(LEAST_MS)
}

/// Counts what was visited outside of the view, once all requests are made.
pub(super) fn count_culled(frame: &FrameInput<'_>, out: &mut Selection) {
    let culled = out.requests.iter().filter(|&&(node, _)| !frame.is_visible(node));
    out.culled = culled.count() as u32;
}

/// Milliseconds of a frame that draws what of a front is not hidden, as far as that is known.
pub(super) fn front_ms(frame: &FrameInput<'_>, front: &[u32]) -> f64 {
    drawn_ms(frame, front, &|node| frame.is_hidden(node))
}

/// The same where this is hidden.
pub(super) fn drawn_ms(
    frame: &FrameInput<'_>,
    front: &[u32],
    is_hidden: &dyn Fn(u32) -> bool,
) -> f64 {
    let drawn: Vec<u32> = front.iter().copied().filter(|&node| !is_hidden(node)).collect();
    let load = FrontLoad::default().of(frame.tree, &drawn, frame.view, frame.covered, 0);
    frame.costs.priced_ms(&load)
}
