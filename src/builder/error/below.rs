//! The surface that a node is measured against.
//!
//! The distance from the source itself would cost time in proportion to the source at every level.
//! Instead a node is measured against nodes below it, each with the bound of its own distance from the
//! source, and the two are added up place by place (the triangle inequality). The sum is close to
//! the true distance if the bounds are small against it. One level below they are not: a node is
//! not much farther from the source than its children are. The mean and the percentile are averages
//! of points, and sampled against the source.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use super::searchable_surface::SearchableSurface;
use super::stored::SurfaceError;

/// A node whose bound exceeds this share of the largest bound among the children of the node that
/// is measured is replaced by its children. A larger share is faster, and bounds are looser: with 0.5
/// those of a city of houses were 1.6 times the measured distance in the median of the nodes above blocks.
const LARGE: f64 = 0.0625;

/// Beyond this number of triangles no more nodes are replaced by their children: otherwise memory
/// and time for one node could grow with the source. The bound is looser then, but holds.
const MOST_TRIANGLES: usize = 1 << 17;

/// The surfaces below a node.
#[derive(Debug)]
pub struct Below {
    /// The source, or the surfaces nearest to it that are at hand.
    pub source: Arc<SearchableSurface>,
    /// The distance of `source` from the source itself, to be added to what is measured.
    pub off: SurfaceError,
    /// The node's children.
    pub nodes: Vec<Surface>,
}

/// The surface of a node, with those below it.
#[derive(Debug)]
pub struct Surface {
    original: Arc<SearchableSurface>,
    /// Upper bound of the distance to the source, metres.
    bound: f64,
    children: Vec<Self>,
}

impl Surface {
    /// One that has no children.
    pub fn new(original: Arc<SearchableSurface>, bound: f64) -> Self {
        Self { original, bound, children: Vec::new() }
    }
}

impl Below {
    /// Source triangles without nodes, which rounding moved by `moved` metres at most.
    pub fn source(source: SearchableSurface, moved: f64) -> Self {
        let source = Arc::new(source);
        let nodes = vec![Surface::new(Arc::clone(&source), 0.0)];
        Self { source, off: SurfaceError::everywhere(moved), nodes }
    }

    /// Joins those of siblings: what their parent is measured against.
    pub fn join(siblings: Vec<Self>) -> Self {
        let sources: Vec<_> = siblings.iter().map(|below| Arc::clone(&below.source)).collect();
        let moved = siblings.iter().map(|below| below.off.bound).fold(0.0, f64::max);
        Self {
            source: Arc::new(SearchableSurface::union(&sources)),
            off: SurfaceError::everywhere(moved),
            nodes: siblings.into_iter().flat_map(|below| below.nodes).collect(),
        }
    }

    /// One level further up: below the parent of a node with this surface and bound.
    pub fn above(self, node: SearchableSurface, bound: f64) -> Self {
        let original = Arc::new(node.with_surface_offset(bound));
        Self { nodes: vec![Surface { original, bound, children: self.nodes }], ..self }
    }

    /// The triangles of the children, which are drawn where the node is not.
    pub fn triangles(&self) -> usize {
        self.nodes.iter().map(BoundedNode::triangles).sum()
    }

    /// The largest bound of the children, metres: that of the node is no less.
    pub(super) fn bound(&self) -> f64 {
        largest_bound(&self.nodes)
    }

    /// Returns the surface that the node is measured against.
    pub(super) fn surface(&self) -> SearchableSurface {
        let nodes = measured_against(&self.nodes);
        let originals: Vec<_> = nodes.iter().map(|node| Arc::clone(&node.original)).collect();
        SearchableSurface::union(&originals)
    }
}

/// A node of which a bound is known.
pub trait BoundedNode: Sized {
    /// No point of it or of the source below it is farther from the other, metres.
    fn bound(&self) -> f64;

    /// The number of its triangles.
    fn triangles(&self) -> usize;

    /// The nodes one level below; none below the source.
    fn children(&self) -> &[Self];
}

impl BoundedNode for Surface {
    fn bound(&self) -> f64 {
        self.bound
    }

    fn triangles(&self) -> usize {
        self.original.triangle_count()
    }

    fn children(&self) -> &[Self] {
        &self.children
    }
}

fn largest_bound<N: BoundedNode>(nodes: &[N]) -> f64 {
    nodes.iter().map(N::bound).fold(0.0, f64::max)
}

/// The nodes that a node with these children is measured against: two levels below it, and further
/// down where their bounds are large.
pub fn measured_against<N: BoundedNode>(children: &[N]) -> Vec<&N> {
    let most = LARGE * largest_bound(children);
    let mut nodes: Vec<&N> = Vec::new();
    for child in children {
        match child.children() {
            [] => nodes.push(child),
            below => nodes.extend(below),
        }
    }
    let mut triangles: usize = nodes.iter().map(|node| node.triangles()).sum();
    // Sorted by bound, which is not negative, then by number.
    let entry = |number: usize, node: &N| (node.bound().to_bits(), Reverse(number));
    let entries = nodes.iter().enumerate().map(|(number, node)| entry(number, node));
    let mut largest: BinaryHeap<_> = entries.collect();
    while let Some((bound, Reverse(number))) = largest.pop() {
        if f64::from_bits(bound) <= most || triangles > MOST_TRIANGLES {
            break;
        }
        let Some((first, others)) = nodes[number].children().split_first() else { continue };
        triangles = triangles - nodes[number].triangles() + first.triangles();
        nodes[number] = first;
        largest.push(entry(number, first));
        for node in others {
            largest.push(entry(nodes.len(), node));
            triangles += node.triangles();
            nodes.push(node);
        }
    }
    nodes
}

#[cfg(test)]
mod tests;
