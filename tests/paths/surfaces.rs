//! The surfaces of a scene's leaves, which nobody passes through.

use std::path::Path;

use glam::DVec3;
use hlod::camera::Pose;
use hlod::format::{NODES_DIR, Scene, read_glb};
use hlod::mesh::Mesh;

use crate::rays::Soup;

pub struct Surfaces {
    soup: Soup,
    /// Coordinates are relative to this.
    origin: DVec3,
}

impl Surfaces {
    pub fn read(scene: &Scene, out: &Path) -> Self {
        let origin = DVec3::from(scene.bounds().unwrap()[0]);
        let leaves = scene.nodes.iter().filter(|node| node.first_child.is_none());
        let meshes = leaves.map(|leaf| {
            let path = out.join(NODES_DIR).join(&leaf.file);
            let node = read_glb(&std::fs::read(&path).unwrap(), &path).unwrap();
            let from = DVec3::from(node.origin) - origin;
            let mut mesh = Mesh::<f32>::default();
            for primitive in node.primitives {
                let first = mesh.positions.len() as u32;
                let place = |p: [f32; 3]| (DVec3::from(p.map(f64::from)) + from).as_vec3();
                mesh.positions.extend(primitive.positions.iter().map(|&p| place(p).to_array()));
                let triangles = primitive.indices.as_chunks::<3>().0;
                mesh.triangles.extend(triangles.iter().map(|t| t.map(|vertex| vertex + first)));
            }
            mesh
        });
        Self { soup: Soup::new(meshes), origin }
    }

    /// Frames before which a camera passes through a surface.
    pub fn passed(&self, poses: &[Pose]) -> Vec<usize> {
        let places: Vec<DVec3> = poses.iter().map(|pose| pose.position - self.origin).collect();
        let crosses = |pair: &[DVec3]| {
            let way = pair[1] - pair[0];
            let length = way.length();
            length > 0.0
                && self
                    .soup
                    .crossings([pair[0], way / length])
                    .first()
                    .is_some_and(|&at| at <= length)
        };
        let pairs = places.windows(2).enumerate();
        pairs.filter(|(_, pair)| crosses(pair)).map(|(index, _)| index + 1).collect()
    }

    /// Whether nothing is above a camera.
    pub fn is_open(&self, pose: &Pose, sky: DVec3) -> bool {
        self.soup.crossings([pose.position - self.origin, sky]).is_empty()
    }
}
