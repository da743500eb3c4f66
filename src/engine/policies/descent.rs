//! Traversal for policies that decide node by node.

use crate::engine::{FrameInput, Selection};

/// Goes down from the roots, breadth-first, and draws the nodes that `refine` does not want
/// refined, or whose children in view are not all resident.
///
/// `utility` is asked for every node that is visited: the roots, and the children of nodes that
/// `refine` wants refined.
pub(super) fn descend(
    frame: &FrameInput<'_>,
    queue: &mut Vec<u32>,
    out: &mut Selection,
    mut refine: impl FnMut(u32) -> bool,
    mut utility: impl FnMut(u32) -> f64,
) {
    queue.clear();
    for &root in frame.tree.roots() {
        out.requests.push((root, utility(root)));
        // A root whose file is broken is not there.
        queue.extend(frame.residents.contains(root).then_some(root));
    }
    let mut at = 0;
    while let Some(&node) = queue.get(at) {
        at += 1;
        if !frame.is_visible(node) {
            out.culled += 1;
            continue;
        }
        let children = frame.tree.children(node);
        if !children.is_empty() && refine(node) {
            out.requests.extend(children.iter().map(|&child| (child, utility(child))));
            if frame.can_refine(node) {
                queue.extend(children);
                continue;
            }
            out.lacking += frame.missing_children(node);
        }
        out.front.push(node);
    }
}
