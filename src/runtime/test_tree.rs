//! Small hierarchies written by hand, for tests of selection and residency.

use glam::DVec3;

use super::SceneTree;
use crate::camera::{Pose, View, from_angles};
use crate::format::{BlockInfo, Node, NodeId, Scene};
use crate::mesh::UpAxis;

/// A node of a scene to be: where it is, what it costs, and what it consists of.
pub(crate) struct Sketch {
    pub centre: [f64; 3],
    pub size: f64,
    pub cost: f64,
    pub benefit: f64,
    pub normal: [f32; 3],
    /// As a bound and as a mean, metres.
    pub error: f64,
    /// As many vertices too.
    pub triangles: u32,
    pub children: Vec<Sketch>,
}

/// A cube of 2 m about `centre`.
pub(crate) fn sketch(centre: [f64; 3], cost: f64, children: Vec<Sketch>) -> Sketch {
    Sketch {
        centre,
        size: 2.0,
        cost,
        benefit: 1.0,
        normal: [0.0; 3],
        error: 0.0,
        triangles: 10,
        children,
    }
}

/// The scene of some trees: nodes are numbered as they are met, parents first, each tree in full
/// before the next. Every node has a file of 1000 bytes.
pub(crate) fn scene(trees: Vec<Sketch>) -> Scene {
    let mut nodes = Vec::new();
    for tree in trees {
        add(&mut nodes, tree, None, 0);
    }
    for node in (0..nodes.len()).rev() {
        if let Some(parent) = nodes[node].parent {
            nodes[node].next_sibling = nodes[parent as usize].first_child.replace(node as u32);
        }
    }
    Scene {
        parameters: serde_json::json!({}),
        fingerprint: [7; 32],
        up: UpAxis::Z,
        blocks: vec![BlockInfo { name: "b".into(), input: "b.obj".into(), origin: [0.0; 3] }],
        shared_textures: Vec::new(),
        nodes,
    }
}

fn add(nodes: &mut Vec<Node>, sketch: Sketch, parent: Option<u32>, level: u32) {
    let index = nodes.len() as u32;
    let corner = |sign: f64| sketch.centre.map(|c| c + sign * sketch.size / 2.0);
    nodes.push(Node {
        id: NodeId(index.into()),
        parent,
        level,
        block: Some(0),
        triangles: sketch.triangles,
        vertices: sketch.triangles,
        geometric_error: sketch.error,
        mean_error: sketch.error,
        bbox_min: corner(-1.0),
        bbox_max: corner(1.0),
        cost: sketch.cost,
        static_benefit: sketch.benefit,
        average_normal: sketch.normal,
        file: format!("n{index}.glb"),
        file_bytes: 1000,
        ..Node::default()
    });
    for child in sketch.children {
        add(nodes, child, Some(index), level + 1);
    }
}

pub(crate) fn tree(trees: Vec<Sketch>) -> SceneTree {
    let scene = scene(trees);
    assert_eq!(scene.check(), []);
    SceneTree::new(&scene)
}

/// A camera at the origin that looks along +x, 90° high and wide.
pub(crate) fn view() -> View {
    let rotation = from_angles(UpAxis::Z, 0.0, 0.0, 0.0);
    View::new(Pose { position: DVec3::ZERO, rotation, fov_y_deg: 90.0 }, DVec3::ZERO, [100, 100])
}
