//! A street of any depth, made without files.

use hlod::format::{BlockInfo, Node, NodeId, Scene};
use hlod::mesh::UpAxis;

/// Houses in two rows, each a tree of four children a node.
pub fn street(houses: usize, depth: u32) -> Scene {
    let mut nodes = Vec::new();
    for house in 0..houses {
        let side = if house % 2 == 0 { 15.0 } else { -15.0 };
        add(&mut nodes, [house as f64 * 8.0, side, 0.0], 12.0, None, [0, depth]);
    }
    let block = BlockInfo { name: "street".into(), input: "none".into(), origin: [0.0; 3] };
    Scene {
        nodes,
        shared_textures: Vec::new(),
        blocks: vec![block],
        up: UpAxis::Z,
        fingerprint: [0; 32],
        parameters: serde_json::Value::Null,
    }
}

/// A node that is the same whatever stands below it, and what stands below it.
fn add(
    nodes: &mut Vec<Node>,
    at: [f64; 3],
    size: f64,
    parent: Option<u32>,
    [level, depth]: [u32; 2],
) -> u32 {
    let index = nodes.len() as u32;
    nodes.push(Node {
        id: NodeId(index.into()),
        parent,
        level,
        block: Some(0),
        triangles: 100,
        vertices: 100,
        bbox_min: at.map(|centre| centre - size / 2.0),
        bbox_max: at.map(|centre| centre + size / 2.0),
        cost: 100.0,
        static_benefit: size,
        geometric_error: size * size / 100.0,
        mean_error: size * size / 1000.0,
        file: format!("n{index}.glb"),
        file_bytes: 1000,
        ..Node::default()
    });
    let mut child = |quarter: u32| {
        let [east, up] = [quarter % 2, quarter / 2].map(|part| f64::from(part) * 2.0 - 1.0);
        let at = [at[0] + east * size / 4.0, at[1], at[2] + up * size / 4.0];
        add(nodes, at, size / 2.0, Some(index), [level + 1, depth])
    };
    if level < depth {
        let children = [0, 1, 2, 3].map(&mut child);
        nodes[index as usize].first_child = Some(children[0]);
        for pair in children.windows(2) {
            nodes[pair[0] as usize].next_sibling = Some(pair[1]);
        }
    }
    index
}
