//! Coarse geometry that hides what is behind it.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::camera::View;
use crate::format::NodeMesh;
use crate::mesh::AlphaMode;
use crate::runtime::SceneTree;

/// The opaque surface of a node.
#[derive(Clone, Debug)]
pub(super) struct Occluder {
    /// Least and greatest source coordinates.
    pub bbox: [DVec3; 2],
    /// Source coordinates from which positions are metres away.
    pub origin: DVec3,
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// The opaque surfaces of the coarsest nodes, in memory for as long as a scene is.
#[derive(Clone, Debug, Default)]
pub struct Occluders {
    pub(super) surfaces: Vec<Occluder>,
    /// By node: its place among these.
    pub(super) of: FxHashMap<u32, u32>,
}

impl Occluders {
    /// Most bytes that a node with so many vertices and triangles takes here.
    pub fn most_bytes(vertices: u32, triangles: u32) -> u64 {
        let points = u64::from(vertices) * size_of::<Vec3>() as u64;
        let corners = u64::from(triangles) * size_of::<[u32; 3]>() as u64;
        size_of::<Occluder>() as u64 + points + corners
    }

    /// The surface of a node, where there is one.
    pub(super) fn get(&self, node: u32) -> Option<&Occluder> {
        self.of.get(&node).map(|&at| &self.surfaces[at as usize])
    }

    /// The nodes in a view that stand for all that is there, of which `is_fine` says that none finer
    /// need do so, as far as there are surfaces.
    pub(super) fn front(
        &self,
        tree: &SceneTree,
        view: &View,
        is_fine: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        let mut open: Vec<u32> = tree.roots().to_vec();
        let mut front = Vec::new();
        while let Some(node) = open.pop() {
            let Some(surface) = self.get(node) else { continue };
            let children = tree.children(node);
            if view.frustum.outside(surface.bbox) > 0.0 {
                continue;
            }
            let can_be_finer = children.iter().any(|child| self.of.contains_key(child));
            match can_be_finer && !is_fine(node) {
                true => open.extend(children),
                false => front.push(node),
            }
        }
        front
    }

    /// Adds what of a node is opaque, and within the box `bbox`.
    pub fn add(&mut self, node: u32, bbox: [DVec3; 2], mesh: &NodeMesh) {
        let is_opaque = |alpha: &AlphaMode| matches!(alpha, AlphaMode::Opaque);
        let opaque = || mesh.primitives.iter().filter(|at| is_opaque(&at.surface.alpha));
        let mut positions = Vec::with_capacity(opaque().map(|at| at.positions.len()).sum());
        let mut triangles = Vec::with_capacity(opaque().map(|at| at.indices.len() / 3).sum());
        for primitive in opaque() {
            let first = positions.len() as u32;
            positions.extend(primitive.positions.iter().map(|&at| Vec3::from(at)));
            let triples = primitive.indices.as_chunks().0;
            triangles.extend(triples.iter().map(|triple: &[u32; 3]| triple.map(|at| first + at)));
        }
        let origin = DVec3::from(mesh.origin);
        self.of.insert(node, self.surfaces.len() as u32);
        self.surfaces.push(Occluder { bbox, origin, positions, triangles });
    }
}
