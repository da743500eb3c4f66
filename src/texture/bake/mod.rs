//! Textures for nodes that were simplified without regard to texture seams.
//!
//! Such a node has no texture coordinates. Its triangles are gathered to planar charts
//! ([`planar`]), laid flat ([`flat`]), and each texel takes the colour of the place on the
//! original that is nearest to it ([`source`]), at the resolution of the node's level. The charts'
//! pictures then go the way of all others, into an atlas with gutters.

mod classes;
mod flat;
mod paint;
mod plan;
mod planar;
mod source;
#[cfg(test)]
mod tests;

use rustc_hash::FxHashMap;

pub use classes::BakeClasses;
pub use plan::{BakePlan, BakeReason, Seams};
pub(crate) use source::Source;

use self::flat::flat_charts;
use super::block::BlockTextures;
use super::level::LevelPicture;
use crate::mesh::Mesh;

/// A node's mesh with charts of its own.
#[derive(Debug)]
pub struct BakedMesh {
    /// Vertices are doubled where charts meet; texture coordinates are texels of the chart's
    /// picture.
    pub mesh: Mesh,
    /// By vertex of the mesh: its chart, or `None` where it keeps the source's texture.
    pub(super) charts: Vec<Option<u32>>,
    /// By chart.
    pub(super) pictures: Vec<LevelPicture>,
}

impl BlockTextures<'_> {
    /// Gives the triangles of a node whose materials are of some class charts and pictures of
    /// their own. `None` where the block keeps nothing to bake from.
    pub fn bake(&self, mesh: &Mesh, level: usize) -> Option<BakedMesh> {
        let source = self.source.as_ref()?;
        let level = self.nearest_level(level);
        let members: Vec<u32> = (0..)
            .zip(&mesh.triangles)
            .filter(|(_, triangle)| self.classes.of(mesh.triangle_material(**triangle)).is_some())
            .map(|(number, _)| number)
            .collect();
        let charts =
            flat_charts(mesh, &members, |triangles| self.scale_of(source, mesh, triangles, level));
        let factor = self.fitted(mesh, &charts, level);
        let mut baked = BakedMesh {
            mesh: mesh.clone(),
            charts: vec![None; mesh.positions.len()],
            pictures: Vec::with_capacity(charts.len()),
        };
        let mut copies: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        for (number, chart) in (0u32..).zip(&charts) {
            let painted = self.paint(source, mesh, chart, chart.scale * factor, level);
            for (&triangle, texels) in chart.triangles.iter().zip(&painted.corners) {
                for (corner, texel) in texels.iter().enumerate() {
                    let vertex = baked.mesh.triangles[triangle as usize][corner];
                    let own = baked.own_vertex(vertex, number, &mut copies);
                    baked.mesh.texcoords[own as usize] = texel.as_vec2().into();
                    baked.mesh.triangles[triangle as usize][corner] = own;
                }
            }
            baked.pictures.push(painted.picture);
        }
        Some(baked)
    }
}

impl BakedMesh {
    /// The vertex itself for the first chart that asks, a copy for others.
    fn own_vertex(
        &mut self,
        vertex: u32,
        chart: u32,
        copies: &mut FxHashMap<(u32, u32), u32>,
    ) -> u32 {
        match self.charts[vertex as usize] {
            None => {
                self.charts[vertex as usize] = Some(chart);
                vertex
            }
            Some(first) if first == chart => vertex,
            Some(_) => *copies.entry((vertex, chart)).or_insert_with(|| {
                self.charts.push(Some(chart));
                self.mesh.push_copy(vertex as usize)
            }),
        }
    }
}
