//! A small sound scene for tests: two trees, one of two blocks' and one of a single node.

use super::node_id::NodeId;
use super::scene::{BlockInfo, Node, Scene, SharedTexture};
use crate::mesh::UpAxis;

/// Node 0 stands above node 1 (block 0), which has the leaves 2 and 3; node 4 is alone (block 1).
pub(crate) fn scene() -> Scene {
    let node = |id: u64, parent, first_child, next_sibling, level, block, error| Node {
        id: NodeId(100 + id),
        parent,
        first_child,
        next_sibling,
        level,
        block,
        triangles: 900,
        textured_triangles: 300,
        vertices: 700,
        bbox_min: [678_016.25, 5_403_456.5, -1.0],
        bbox_max: [678_116.25 + id as f64, 5_403_556.5, 30.0],
        cost: 480.0,
        static_benefit: 0.1,
        average_normal: [0.0, 0.6, -0.8],
        geometric_error: error,
        mean_error: error * 0.25,
        p95_error: error * 0.5,
        texels: 65_536 + 512,
        pictures: vec![[256, 256], [16, 32]],
        shared_texels: 128,
        origin: [678_016.0, 5_403_456.0, 0.0],
        file: format!("n{id}.glb"),
        file_bytes: 12_345 + id,
        file_crc: 0xDEAD_0000 + id as u32,
        shared_textures: vec![0],
    };
    Scene {
        parameters: serde_json::json!({ "level_factor": 4, "desired_tris": 900, "x": 0.1 }),
        fingerprint: std::array::from_fn(|i| i as u8),
        up: UpAxis::Z,
        blocks: ["façade 1", "roof"]
            .map(|name| BlockInfo {
                name: name.into(),
                input: "city.obj".into(),
                origin: [678_016.0, 5_403_456.0, 0.0],
            })
            .to_vec(),
        shared_textures: vec![SharedTexture {
            file_name: "brick-64.jpg".into(),
            width: 16,
            height: 8,
            bytes: 777,
        }],
        nodes: vec![
            node(0, None, Some(1), None, 0, None, 4.0),
            node(1, Some(0), Some(3), None, 1, Some(0), 2.0),
            node(2, Some(1), None, None, 2, Some(0), 0.0),
            node(3, Some(1), None, Some(2), 2, Some(0), 1.0),
            node(4, None, None, None, 0, Some(1), 0.0),
        ],
    }
}
