//! The hierarchy of a city: a forest of nodes and what they need to be chosen, loaded and drawn.

use std::collections::BinaryHeap;

use super::node_id::NodeId;
use crate::mesh::UpAxis;

/// The contents of `scene.hlod`.
///
/// A forest of any depth: a root may be a block, a part of one, or something coarser that stands
/// above many blocks. Nodes refer to each other by index into [`Scene::nodes`].
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What the build was asked for, as the build wrote it down.
    pub parameters: serde_json::Value,
    /// BLAKE3 over all that the result depends on; equal fingerprints mean equal results.
    pub fingerprint: [u8; 32],
    /// Which axis of the source, and so of everything here, points at the sky.
    pub up: UpAxis,
    /// The blocks of the city.
    pub blocks: Vec<BlockInfo>,
    /// Repeating pictures stored once in `textures/`.
    pub shared_textures: Vec<SharedTexture>,
    /// All nodes; at least one. A parent need not stand before its children.
    pub nodes: Vec<Node>,
}

/// A block of the city.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockInfo {
    /// Its name, for people: a group of the source, several of them, or a cell of a grid.
    pub name: String,
    /// The input file that it came from, as text.
    pub input: String,
    /// Source coordinates of the origin to which the block's geometry is relative.
    pub origin: [f64; 3],
}

/// A repeating picture that nodes share, at one resolution.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedTexture {
    /// File name inside `textures/`; see [`is_plain_file_name`](super::is_plain_file_name).
    pub file_name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// Size of the file.
    pub bytes: u64,
}

/// One level of detail of one piece of the city: the attributes that Lakhia's thesis lists in
/// section 3.3, and ours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// Unique within the scene, and the same in every build of the same source.
    pub id: NodeId,
    /// Index of the node that shows more than this piece, more coarsely; `None` at a root.
    pub parent: Option<u32>,
    /// Index of the first of the nodes that together show this piece in finer detail.
    pub first_child: Option<u32>,
    /// Index of the next child of the same parent; `None` at the last, and at roots.
    pub next_sibling: Option<u32>,
    /// Steps from the root of its tree, where it is 0.
    pub level: u32,
    /// Index into [`Scene::blocks`]; `None` where the node stands above blocks. Nodes below one
    /// that has a block are of the same block.
    pub block: Option<u32>,
    /// Number of triangles, textured or not.
    pub triangles: u32,
    /// Number of triangles with a picture.
    pub textured_triangles: u32,
    /// Number of vertices in its file, at most three a triangle.
    pub vertices: u32,
    /// Least source coordinates of the node's vertices.
    pub bbox_min: [f64; 3],
    /// Greatest source coordinates of the node's vertices.
    pub bbox_max: [f64; 3],
    /// Proportional to the time that drawing takes (thesis, eq. 3.1):
    /// `cost = textured_triangles × c_textured + untextured triangles × (1 − c_textured)`.
    pub cost: f64,
    /// Benefit seen from 1 m, unforeshortened (thesis, section 3.3):
    /// `static_benefit = sqrt(triangles × Σ area)`, in metres.
    pub static_benefit: f64,
    /// `Σ (normal × area) / |Σ (normal × area)|` over the triangles (thesis, section 3.3);
    /// of length 1, or all zero where the sum is.
    pub average_normal: [f32; 3],
    /// Bound on the distance in metres between this node and the source; never less at a parent
    /// than at its children.
    pub geometric_error: f64,
    /// Mean distance between this node and the source, both ways, metres. Unlike the bound it tells
    /// a node that lost a chimney from one that is bent all over.
    pub mean_error: f64,
    /// The distance that 95 of 100 points are within, both ways, metres.
    pub p95_error: f64,
    /// Texels of the node's own pictures.
    pub texels: u64,
    /// Width and height of each of the node's own pictures, in the order of its file, so that
    /// what it takes in memory is known before it is read.
    pub pictures: Vec<[u32; 2]>,
    /// Texels of the shared pictures that it uses.
    pub shared_texels: u64,
    /// Source coordinates of the origin of the node's file; each fits in an f32.
    pub origin: [f64; 3],
    /// File name inside `nodes/`; see [`is_plain_file_name`](super::is_plain_file_name).
    pub file: String,
    /// Size of that file.
    pub file_bytes: u64,
    /// CRC-32 of that file; see [`file_crc`](super::file_crc).
    pub file_crc: u32,
    /// Indices into [`Scene::shared_textures`] of the shared pictures that the file refers to.
    pub shared_textures: Vec<u32>,
}

/// The build parameter that holds the copyright notice of all inputs.
pub const COPYRIGHT: &str = "copyright";

impl Scene {
    /// The copyright notice of all inputs.
    pub fn copyright(&self) -> Option<&str> {
        self.parameters.get(COPYRIGHT)?.as_str()
    }

    /// Indices of the nodes without a parent, in order.
    pub fn roots(&self) -> impl Iterator<Item = u32> {
        self.nodes.iter().zip(0..).filter(|(node, _)| node.parent.is_none()).map(|(_, index)| index)
    }

    /// Indices of the coarsest nodes of blocks, in order: of those with none above, or a node above blocks.
    pub fn block_roots(&self) -> impl Iterator<Item = u32> {
        let is_root = |node: &Node| {
            let above = node.parent.and_then(|parent| self.nodes.get(parent as usize)?.block);
            node.block.is_some() && above.is_none()
        };
        (0u32..).zip(&self.nodes).filter(move |(_, node)| is_root(node)).map(|(index, _)| index)
    }

    /// Indices of nodes that stand for all of the scene: the coarsest of blocks, or where these have more
    /// than so many triangles together, nodes above blocks of the least errors for so many. In order.
    pub fn coarse_front(&self, most_triangles: u64) -> Vec<u32> {
        let node = |index: u32| &self.nodes[index as usize];
        // Positive floats order as their bits do; equal errors go by index.
        let keyed = |index: u32| (node(index).geometric_error.max(0.0).to_bits(), index);
        let triangles = |index: u32| u64::from(node(index).triangles);
        let mut open: BinaryHeap<(u64, u32)> = self.roots().map(keyed).collect();
        let mut all: u64 = open.iter().map(|&(_, index)| triangles(index)).sum();
        let mut front = Vec::new();
        while let Some((_, index)) = open.pop() {
            let finer: u64 = self.children(index).map(triangles).sum();
            let after = all.saturating_sub(triangles(index)) + finer;
            let is_above_blocks = node(index).block.is_none() && node(index).first_child.is_some();
            if is_above_blocks && after <= most_triangles {
                all = after;
                open.extend(self.children(index).map(keyed));
            } else {
                front.push(index);
            }
        }
        front.sort_unstable();
        front
    }

    /// Indices of the children of a node, from the first to the last.
    pub fn children(&self, node: u32) -> Children<'_> {
        let next = self.nodes.get(node as usize).and_then(|node| node.first_child);
        Children { nodes: &self.nodes, next, left: self.nodes.len() }
    }

    /// The least box around all nodes, as least and greatest corner; `None` without nodes.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let mut nodes = self.nodes.iter();
        let first = nodes.next()?;
        Some(nodes.fold([first.bbox_min, first.bbox_max], |[min, max], node| {
            [
                std::array::from_fn(|axis| min[axis].min(node.bbox_min[axis])),
                std::array::from_fn(|axis| max[axis].max(node.bbox_max[axis])),
            ]
        }))
    }

    /// True where any triangle has a picture.
    pub fn is_textured(&self) -> bool {
        self.nodes.iter().any(|node| node.textured_triangles > 0)
    }

    /// The number of levels: one more than that of the deepest node.
    pub fn level_count(&self) -> usize {
        self.nodes.iter().map(|node| node.level as usize + 1).max().unwrap_or(0)
    }
}

/// Indices of the children of a node; see [`Scene::children`].
#[derive(Clone, Debug)]
pub struct Children<'a> {
    nodes: &'a [Node],
    next: Option<u32>,
    /// Ends the walk where a scene that was never checked has its siblings in a ring.
    left: usize,
}

impl Iterator for Children<'_> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        let index = self.next?;
        self.left = self.left.checked_sub(1)?;
        self.next = self.nodes.get(index as usize)?.next_sibling;
        Some(index)
    }
}

#[cfg(test)]
mod tests {
    use crate::format::test_scene;

    #[test]
    fn a_coarse_front_goes_down_to_blocks_as_far_as_there_are_triangles() {
        let mut scene = test_scene::scene();
        assert_eq!(scene.block_roots().collect::<Vec<_>>(), [1, 4]);
        assert_eq!(scene.coarse_front(1800), [1, 4], "not to what is below them");
        assert_eq!(scene.coarse_front(1_000_000), [1, 4]);
        assert_eq!(scene.coarse_front(1799), [0, 4], "no coarser than the roots");
        scene.nodes[1].triangles = 2000;
        assert_eq!(scene.coarse_front(2899), [0, 4]);
        assert_eq!(scene.coarse_front(2900), [1, 4]);
    }
}
