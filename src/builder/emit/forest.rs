//! From trees to the scene: order, links, monotone errors.

use std::collections::BTreeMap;

use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::hierarchy::Tree;
use crate::format::Node;

/// Makes a parent's error no less than its children's, from the leaves up.
pub fn make_errors_monotone(tree: &mut Tree<NodeRecord>) -> f64 {
    let below = tree.children.iter_mut().map(make_errors_monotone).fold(0.0, f64::max);
    tree.record.geometric_error = tree.record.geometric_error.max(below);
    tree.record.geometric_error
}

/// Says of all nodes of a tree which block they are of.
pub fn set_block(tree: &mut Tree<NodeRecord>, block: u32) {
    tree.record.block = Some(block);
    tree.children.iter_mut().for_each(|child| set_block(child, block));
}

/// Appends the nodes of a tree, breadth first, with their links.
pub fn append_nodes(
    nodes: &mut Vec<Node>,
    tree: Tree<NodeRecord>,
    shared_numbers: &BTreeMap<String, u32>,
) {
    let mut families = vec![(None, vec![tree])];
    for level in 0.. {
        if families.is_empty() {
            break;
        }
        let mut next = Vec::new();
        for (parent, siblings) in families {
            let count = siblings.len();
            for (place, Tree { record, children }) in siblings.into_iter().enumerate() {
                let index = nodes.len() as u32;
                if place == 0
                    && let Some(parent) = parent
                {
                    let parent: &mut Node = &mut nodes[parent as usize];
                    parent.first_child = Some(index);
                }
                let next_sibling = (place + 1 < count).then_some(index + 1);
                let node = node_of(record, shared_numbers);
                nodes.push(Node { parent, next_sibling, level, ..node });
                if !children.is_empty() {
                    next.push((Some(index), children));
                }
            }
        }
        families = next;
    }
}

/// A node on its own, as if it were a root without children.
fn node_of(record: NodeRecord, shared_numbers: &BTreeMap<String, u32>) -> Node {
    let mut shared_textures: Vec<u32> =
        record.shared.keys().filter_map(|name| shared_numbers.get(name).copied()).collect();
    shared_textures.sort_unstable();
    shared_textures.dedup();
    Node {
        id: record.id,
        parent: None,
        first_child: None,
        next_sibling: None,
        level: 0,
        block: record.block,
        triangles: record.attributes.triangles,
        textured_triangles: record.attributes.textured_triangles,
        vertices: record.attributes.vertices,
        bbox_min: record.attributes.bbox_min,
        bbox_max: record.attributes.bbox_max,
        cost: record.attributes.cost,
        static_benefit: record.attributes.static_benefit,
        average_normal: record.attributes.average_normal.map(|c| c as f32),
        geometric_error: record.geometric_error,
        mean_error: record.mean_error,
        p95_error: record.p95_error,
        texels: record.own_texels(),
        shared_texels: record.shared.values().sum(),
        origin: record.origin,
        file: record.file,
        file_bytes: record.file_bytes,
        file_crc: record.file_crc,
        shared_textures,
        pictures: record.pictures,
    }
}
