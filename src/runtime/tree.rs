//! The hierarchy as selection needs it: few fields a node, children side by side.

use std::ops::Range;

use glam::DVec3;

use crate::format::Scene;

/// What selection knows of a node. Indices are those of [`Scene::nodes`].
#[derive(Clone, Debug, PartialEq)]
pub struct TreeNode {
    /// Least and greatest source coordinates.
    pub bbox: [DVec3; 2],
    /// Eq. 3.1 of the thesis, for the machine at hand.
    pub cost: f64,
    /// Benefit at a distance of 1 m, metres.
    pub static_benefit: f64,
    /// Of length 1, or zero where the normals cancel.
    pub average_normal: DVec3,
    /// Bound on the distance to the source, metres.
    pub geometric_error: f64,
    /// Number of triangles.
    pub triangles: u32,
    /// Steps from the root.
    pub level: u32,
    /// The coarser node, unless this is a root.
    pub parent: Option<u32>,
    children: Range<u32>,
}

/// The hierarchy as selection needs it.
#[derive(Clone, Debug)]
pub struct SceneTree {
    nodes: Vec<TreeNode>,
    /// Children of all nodes, those of one side by side.
    children: Vec<u32>,
    roots: Vec<u32>,
    bounds: [DVec3; 2],
}

impl SceneTree {
    /// The hierarchy of a scene that was [checked](Scene::check).
    pub fn new(scene: &Scene) -> Self {
        let mut children = Vec::with_capacity(scene.nodes.len());
        let mut nodes = Vec::with_capacity(scene.nodes.len());
        for (node, index) in scene.nodes.iter().zip(0..) {
            let first = children.len() as u32;
            children.extend(scene.children(index));
            nodes.push(TreeNode {
                bbox: [node.bbox_min.into(), node.bbox_max.into()],
                cost: node.cost,
                static_benefit: node.static_benefit,
                average_normal: DVec3::from(node.average_normal.map(f64::from)),
                geometric_error: node.geometric_error,
                triangles: node.triangles,
                level: node.level,
                parent: node.parent,
                children: first..children.len() as u32,
            });
        }
        let bounds = scene.bounds().unwrap_or_default().map(DVec3::from);
        Self { nodes, children, roots: scene.roots().collect(), bounds }
    }

    /// Computes costs anew (eq. 3.1) with another `c_textured` than that of the build: how much
    /// more a textured triangle costs than another depends on what draws.
    pub fn with_textured_weight(mut self, scene: &Scene, textured_weight: f64) -> Self {
        for (node, entry) in self.nodes.iter_mut().zip(&scene.nodes) {
            let textured = f64::from(entry.textured_triangles);
            let untextured = f64::from(entry.triangles) - textured;
            node.cost = textured * textured_weight + untextured * (1.0 - textured_weight);
        }
        self
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// True without nodes; no scene that was read is.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// One node.
    pub fn node(&self, index: u32) -> &TreeNode {
        &self.nodes[index as usize]
    }

    /// The finer nodes that together show the same piece.
    pub fn children(&self, index: u32) -> &[u32] {
        let range = &self.node(index).children;
        &self.children[range.start as usize..range.end as usize]
    }

    /// The nodes without parent.
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// Length of the diagonal of the box around everything, metres.
    pub fn diagonal(&self) -> f64 {
        self.bounds[0].distance(self.bounds[1])
    }

    /// The middle of that box.
    pub fn middle(&self) -> DVec3 {
        (self.bounds[0] + self.bounds[1]) / 2.0
    }
}
