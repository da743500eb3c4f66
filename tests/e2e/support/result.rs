//! Reading `out/` back.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use hlod::format::{NODES_DIR, NodeMesh, REPORT_FILE, Scene, read_glb};
use serde_json::Value;

pub use super::files::contents;

/// `build.json`.
pub fn report(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join(REPORT_FILE)).unwrap()).unwrap()
}

/// All files of a result; of `build.json` what does not depend on clock and machine.
pub fn lasting(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = contents(out);
    let mut report = report(out);
    let object = report.as_object_mut().unwrap();
    for name in ["stages", "seconds", "peak_memory_bytes"] {
        assert!(object.remove(name).is_some(), "{REPORT_FILE} has no {name}");
    }
    files.insert(REPORT_FILE.into(), format!("{report:#}").into_bytes());
    files
}

/// Files whose bytes differ or that only one has; `None` where all are the same.
pub fn difference(
    one: &BTreeMap<String, Vec<u8>>,
    other: &BTreeMap<String, Vec<u8>>,
) -> Option<Vec<String>> {
    let names: std::collections::BTreeSet<_> = one.keys().chain(other.keys()).collect();
    let differ: Vec<String> =
        names.into_iter().filter(|&name| one.get(name) != other.get(name)).cloned().collect();
    (!differ.is_empty()).then_some(differ)
}

/// A scene and the meshes of all its nodes.
pub struct Built {
    pub scene: Scene,
    pub meshes: Vec<NodeMesh>,
    /// The bytes of the nodes' files.
    pub files: Vec<Vec<u8>>,
}

impl Built {
    pub fn read(out: &Path) -> Self {
        let scene = Scene::read(out).unwrap();
        let files: Vec<Vec<u8>> = scene
            .nodes
            .iter()
            .map(|node| fs::read(out.join(NODES_DIR).join(&node.file)).unwrap())
            .collect();
        let meshes = files
            .iter()
            .zip(&scene.nodes)
            .map(|(bytes, node)| read_glb(bytes, Path::new(&node.file)).unwrap())
            .collect();
        Self { scene, meshes, files }
    }

    pub fn is_leaf(&self, node: usize) -> bool {
        self.scene.nodes[node].first_child.is_none()
    }

    /// Indices of the leaves below a node, or the node itself where it is one.
    pub fn leaves_below(&self, node: usize) -> Vec<usize> {
        let mut leaves = Vec::new();
        let mut open = vec![node];
        while let Some(next) = open.pop() {
            if self.is_leaf(next) {
                leaves.push(next);
            }
            open.extend(self.scene.children(next as u32).map(|child| child as usize));
        }
        leaves
    }

    /// Triangles of a node in source coordinates.
    pub fn triangles(&self, node: usize) -> Vec<[glam::DVec3; 3]> {
        let mesh = &self.meshes[node];
        let origin = glam::DVec3::from(mesh.origin);
        mesh.primitives
            .iter()
            .flat_map(|primitive| {
                primitive.indices.chunks_exact(3).map(|corners| {
                    std::array::from_fn(|corner| {
                        let position = primitive.positions[corners[corner] as usize];
                        origin + glam::DVec3::from(position.map(f64::from))
                    })
                })
            })
            .collect()
    }

    /// The area of all leaves.
    pub fn leaf_area(&self) -> f64 {
        (0..self.meshes.len())
            .filter(|&node| self.is_leaf(node))
            .flat_map(|node| self.triangles(node))
            .map(super::geometry::area)
            .sum()
    }
}
