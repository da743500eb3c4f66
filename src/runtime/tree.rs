//! The hierarchy as selection needs it: few fields a node, breadth-first.
//!
//! Selection goes down from the roots to some level. Written breadth-first, what it visits stands
//! at the beginning, siblings side by side: however much there is below, it touches the same
//! memory. A scene's own order is depth-first, in which the nodes visited lie the further apart
//! the more there is below them.

use std::ops::Range;

use glam::DVec3;

use crate::camera::View;
use crate::format::{Node, Scene};

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
    /// The error by which viewers choose a level, metres: [`Scene::viewer_errors`].
    pub viewer_error: f64,
    /// Number of triangles.
    pub triangles: u32,
    /// Number of triangles with a texture.
    pub textured_triangles: u32,
    /// Number of vertices.
    pub vertices: u32,
    /// Draw calls, one a texture and one for what has none; at least 1.
    pub draws: u32,
    /// Mean distance to the source, metres.
    pub mean_error: f64,
    /// Steps from the root.
    pub level: u32,
    /// The coarser node, unless this is a root.
    pub parent: Option<u32>,
    /// The places of the finer nodes that together show the same piece.
    pub children: Range<u32>,
}

/// A view shows the scene if the boxes of its roots cover at least this part of the image: 10 × 9
/// pixels of 1280 × 720. Less tells nothing of how the scene is drawn.
const LEAST_COVERED: f64 = 1e-4;

/// The hierarchy as selection needs it.
///
/// Nodes are known by their index in the scene; their *places* are breadth-first, roots first.
#[derive(Clone, Debug)]
pub struct SceneTree {
    /// By place.
    nodes: Vec<TreeNode>,
    /// By place: index in the scene.
    indices: Vec<u32>,
    /// By index in the scene: place.
    places: Vec<u32>,
    roots: u32,
    levels: usize,
    bounds: [DVec3; 2],
    diagonal: f64,
    up: DVec3,
}

impl SceneTree {
    /// The hierarchy of a scene that was [checked](Scene::check).
    pub fn new(scene: &Scene) -> Self {
        let errors = scene.viewer_errors();
        let mut indices: Vec<u32> = scene.roots().collect();
        let roots = indices.len() as u32;
        let mut nodes = Vec::with_capacity(scene.nodes.len());
        let mut places = vec![0; scene.nodes.len()];
        while let Some(&index) = indices.get(nodes.len()) {
            let node = &scene.nodes[index as usize];
            places[index as usize] = nodes.len() as u32;
            let first = indices.len() as u32;
            indices.extend(scene.children(index));
            nodes.push(TreeNode {
                bbox: [node.bbox_min.into(), node.bbox_max.into()],
                cost: node.cost,
                static_benefit: node.static_benefit,
                average_normal: DVec3::from(node.average_normal.map(f64::from)),
                geometric_error: node.geometric_error,
                viewer_error: errors[index as usize],
                triangles: node.triangles,
                textured_triangles: node.textured_triangles,
                vertices: node.vertices,
                draws: draws(node),
                mean_error: node.mean_error,
                level: node.level,
                parent: node.parent,
                children: first..indices.len() as u32,
            });
        }
        let bounds = scene.bounds().unwrap_or_default().map(DVec3::from);
        let levels = scene.level_count();
        let up = scene.up.from_z_up(DVec3::Z);
        let diagonal = bounds[0].distance(bounds[1]);
        Self { nodes, indices, places, roots, levels, bounds, diagonal, up }
    }

    /// Computes costs anew (eq. 3.1) with another `c_textured` than that of the build: how much
    /// more a textured triangle costs than another depends on what draws.
    pub fn with_textured_weight(mut self, scene: &Scene, textured_weight: f64) -> Self {
        for (node, &index) in self.nodes.iter_mut().zip(&self.indices) {
            let entry = &scene.nodes[index as usize];
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

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.levels
    }

    /// True without nodes; no scene that was read is.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// One node, by its index in the scene.
    pub fn node(&self, index: u32) -> &TreeNode {
        &self.nodes[self.places[index as usize] as usize]
    }

    /// The finer nodes that together show the same piece.
    pub fn children(&self, index: u32) -> &[u32] {
        self.at(self.node(index).children.clone()).0
    }

    /// The same themselves.
    pub fn child_nodes(&self, index: u32) -> &[TreeNode] {
        self.at(self.node(index).children.clone()).1
    }

    /// The nodes without parent.
    pub fn roots(&self) -> &[u32] {
        self.at(self.root_places()).0
    }

    /// The places of the nodes without parent.
    pub fn root_places(&self) -> Range<u32> {
        0..self.roots
    }

    /// The nodes at some places: their indices in the scene, and themselves.
    pub fn at(&self, places: Range<u32>) -> (&[u32], &[TreeNode]) {
        let places = places.start as usize..places.end as usize;
        (&self.indices[places.clone()], &self.nodes[places])
    }

    /// The node without parent that a node is below, or is.
    pub fn root_of(&self, mut index: u32) -> u32 {
        while let Some(parent) = self.node(index).parent {
            index = parent;
        }
        index
    }

    /// Pixels that a metre takes in a view, at the nearest point of a node's box.
    pub fn pixels_per_metre(&self, index: u32, view: &View) -> f64 {
        let [min, max] = self.node(index).bbox;
        let eye = view.pose.position;
        let distance = eye.distance(eye.clamp(min, max)).max(self.diagonal() * 1e-6);
        view.pixels_per_metre() / distance
    }

    /// Whether a view shows the scene: the boxes of its roots cover at least a ten-thousandth of
    /// the image.
    pub fn is_in_view(&self, view: &View) -> bool {
        let mut covered = 0.0;
        let (_, roots) = self.at(self.root_places());
        roots.iter().any(|root| {
            covered += view.frustum.covered(root.bbox);
            covered >= LEAST_COVERED
        })
    }

    /// Metres of the nearest that is drawn: a hand's breadth, and less in scenes of a few metres.
    pub fn near_plane(&self) -> f32 {
        ((self.diagonal() * 1e-4) as f32).clamp(1e-6, 0.1)
    }

    /// The direction that is up, of length 1.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Length of the diagonal of the box around everything, metres.
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// Least and greatest coordinates of the box around everything.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The middle of that box.
    pub fn middle(&self) -> DVec3 {
        (self.bounds[0] + self.bounds[1]) / 2.0
    }
}

fn draws(node: &Node) -> u32 {
    let textures = (node.pictures.len() + node.shared_textures.len()) as u32;
    (textures + u32::from(node.textured_triangles < node.triangles)).max(1)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::camera::{Pose, View};
    use crate::runtime::test_tree::{sketch, tree, view};

    #[test]
    fn a_scene_is_in_view_unless_it_is_beside_behind_or_too_far_away() {
        // A cube of 2 m; the camera looks along x, 90° high.
        let tree = tree(vec![sketch([0.0; 3], 1.0, vec![])]);
        let shows = |eye: [f64; 3]| {
            let pose = Pose { position: DVec3::from_array(eye), ..view().pose };
            tree.is_in_view(&View::new(pose, DVec3::ZERO, [1280, 720]))
        };
        assert!(shows([0.0; 3]), "from within");
        assert!(shows([-20.0, 0.0, 0.0]) && shows([-50.0, 0.0, 0.0]));
        for eye in [[20.0, 0.0, 0.0], [-20.0, 90.0, 0.0], [-200.0, 0.0, 0.0], [-1e6, 0.0, 0.0]] {
            assert!(!shows(eye), "{eye:?}");
        }
    }

    #[test]
    fn places_are_breadth_first_and_indices_those_of_the_scene() {
        let leaf = |x: f64| sketch([x, 0.0, 0.0], 1.0, vec![]);
        let pair = |x: f64| sketch([x, 0.0, 0.0], 1.0, vec![leaf(x + 1.0), leaf(x + 2.0)]);
        // 0 (1 (2 3) 4) 5 (6 7)
        let first = sketch([0.0; 3], 1.0, vec![pair(1.0), leaf(4.0)]);
        let tree = tree(vec![first, pair(5.0)]);
        assert_eq!((tree.len(), tree.roots()), (8, &[0, 5][..]));
        assert_eq!(tree.at(0..8).0, [0, 5, 1, 4, 6, 7, 2, 3]);
        for index in 0..8 {
            assert_eq!((tree.node(index).bbox[0].x + 1.0) as u32, index);
            for &child in tree.children(index) {
                assert_eq!(tree.node(child).parent, Some(index));
            }
        }
        assert_eq!([0, 1, 4, 5].map(|node| tree.children(node).len()), [2, 2, 0, 2]);
    }
}
