//! What roofs and walls look like.

use crate::mesh::{Coordinate, Mesh, Normal};

/// What a roof or a wall looks like.
#[derive(Clone, Copy)]
pub(super) struct Appearance {
    /// A vertex with its material.
    pub(super) vertex: u32,
    /// Linear, 0 to 65535.
    pub(super) color: [f64; 4],
}

impl Appearance {
    /// Adds a vertex of this appearance to a mesh that stands for a part of `mesh`. Returns its number.
    pub(super) fn push(&self, result: &mut Mesh, mesh: &Mesh, position: [f32; 3]) -> u32 {
        result.positions.push(position);
        result.materials.push(mesh.materials[self.vertex as usize]);
        if !mesh.texcoords.is_empty() {
            result.texcoords.push([0.0; 2]);
        }
        if !mesh.colors.is_empty() {
            result.colors.push(self.color.map(|channel| channel.round() as u16));
        }
        if !mesh.normals.is_empty() {
            result.normals.push(Normal::NONE);
        }
        result.positions.len() as u32 - 1
    }
}

/// What triangles look like on average.
#[derive(Default)]
pub(super) struct AppearanceSum {
    largest: (f64, u32),
    pub(super) area: f64,
    color: [f64; 4],
}

impl AppearanceSum {
    pub(super) fn add<C: Coordinate>(&mut self, mesh: &Mesh<C>, triangle: [u32; 3], area: f64) {
        if area > self.largest.0 {
            self.largest = (area, triangle[0]);
        }
        self.area += area;
        for vertex in triangle {
            if let Some(color) = mesh.colors.get(vertex as usize) {
                for (sum, &channel) in self.color.iter_mut().zip(color) {
                    *sum += f64::from(channel) * area / 3.0;
                }
            }
        }
    }

    pub(super) fn look(&self) -> Option<Appearance> {
        (self.area > 0.0).then(|| Appearance {
            vertex: self.largest.1,
            color: self.color.map(|sum| sum / self.area),
        })
    }
}
