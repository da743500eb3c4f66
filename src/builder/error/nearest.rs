//! Which triangle of a mesh is the nearest to a point.

use glam::Vec3;

use super::bvh::Bvh;
use super::searchable_surface::{Search, SearchableSurface};
use super::triangle::LANES;
use crate::builder::constants::MeasureConstants;
use crate::mesh::Mesh;

/// A mesh to be searched.
#[derive(Debug)]
pub struct NearestTriangle {
    surface: SearchableSurface,
    /// The mesh's triangle in each slot.
    numbers: Vec<u32>,
}

impl NearestTriangle {
    /// Of a mesh with at least one triangle; `None` of others.
    pub fn of(mesh: &Mesh) -> Option<Self> {
        if mesh.triangles.is_empty() {
            return None;
        }
        let (bvh, leaves) = Bvh::new(mesh);
        let mut numbers = vec![0; leaves.len() * LANES];
        for (leaf, members) in leaves.iter().enumerate() {
            numbers[leaf * LANES..][..members.len()].copy_from_slice(members);
            // Lanes that are left over hold the first triangle again.
            numbers[leaf * LANES + members.len()..(leaf + 1) * LANES].fill(members[0]);
        }
        Some(Self { surface: SearchableSurface::of_bvh(bvh, MeasureConstants::default()), numbers })
    }

    /// Answers one question after another, faster where points are near each other.
    pub fn search(&self) -> impl FnMut(Vec3) -> u32 {
        let mut search = Search::new(&self.surface);
        move |point| self.numbers[search.nearest(point, 0.0).id.slot() as usize]
    }
}
