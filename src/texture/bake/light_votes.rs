//! Votes on whether a triangle of a node stands for lit surface, and on its colour.

use glam::DVec3;

use super::source::{BakeSource, SurfacePoint};
use crate::mesh::Mesh;

/// Weights of the second and third corner of a triangle at points spread evenly over it.
const POINTS: [[f64; 2]; 7] = [
    [1.0 / 3.0, 1.0 / 3.0],
    [0.2, 0.2],
    [0.6, 0.2],
    [0.2, 0.6],
    [0.07, 0.465],
    [0.465, 0.07],
    [0.465, 0.465],
];

/// A triangle is lit where so many of its points show what is lit: others would hide what is textured.
const MOSTLY: usize = 6;

/// Asks the source nearest to some points of each triangle.
pub(super) struct LightVotes<'a> {
    source: &'a BakeSource,
    mesh: &'a Mesh,
    before: Option<SurfacePoint>,
    /// The colours of what is lit near the triangle that was asked for last.
    colors: Vec<[u16; 4]>,
}

impl<'a> LightVotes<'a> {
    /// Prepares to ask about triangles of a mesh.
    pub fn new(source: &'a BakeSource, mesh: &'a Mesh) -> Self {
        Self { source, mesh, before: None, colors: Vec::new() }
    }

    /// Returns true where hardly anything but lit surface is near a triangle.
    pub fn is_lit(&mut self, triangle: [u32; 3]) -> bool {
        self.colors.clear();
        for weights in POINTS {
            let (point, normal) = point_on(self.mesh, triangle, weights);
            let Some(near) = self.source.nearest(point, normal, self.before, 0.0) else { continue };
            self.before = Some(near);
            let shown = self.source.triangle(near.triangle);
            if shown.is_lit {
                self.colors.push(shown.colors.map_or([u16::MAX; 4], |[color, ..]| color));
            }
        }
        self.colors.len() >= MOSTLY
    }

    /// The most frequent colour of what is lit near that triangle.
    pub fn color(&self) -> [u16; 4] {
        let count = |color: &[u16; 4]| self.colors.iter().filter(|&other| other == color).count();
        let most = self.colors.iter().max_by_key(|&color| (count(color), *color));
        most.copied().unwrap_or([u16::MAX; 4])
    }
}

/// The point of a triangle where the second and third corner have these weights, and the unit normal.
pub(super) fn point_on(mesh: &Mesh, triangle: [u32; 3], [v, w]: [f64; 2]) -> (DVec3, DVec3) {
    let [a, b, c] = mesh.corners(triangle);
    let (ab, ac) = (b - a, c - a);
    (a + ab * v + ac * w, ab.cross(ac).normalize_or_zero())
}
