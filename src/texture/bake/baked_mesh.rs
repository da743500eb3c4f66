//! A node's mesh with charts and images of its own.

use rustc_hash::FxHashMap;

use super::flat::flat_charts;
use super::nearby::Nearby;
use super::paint::Brushes;
use crate::mesh::Mesh;
use crate::texture::block::BlockTextures;
use crate::texture::level::LevelImage;

/// A node's mesh with charts of its own.
#[derive(Debug)]
pub struct BakedMesh {
    /// Vertices are doubled where charts meet; texture coordinates are texels of the chart's
    /// image.
    pub mesh: Mesh,
    /// By vertex of the mesh: its chart, or `None` where it keeps the source's texture.
    pub(in crate::texture) charts: Vec<Option<u32>>,
    /// By chart.
    pub(in crate::texture) images: Vec<LevelImage>,
}

impl BlockTextures<'_> {
    /// Gives the triangles of a node whose materials are of some class charts and images of
    /// their own. `None` where the block keeps nothing to bake from.
    pub fn bake(&self, mesh: &Mesh, level: usize) -> Option<BakedMesh> {
        let source = self.source.as_ref()?;
        let level = self.nearest_level(level);
        let members: Vec<u32> = (0..)
            .zip(&mesh.triangles)
            .filter(|(_, triangle)| self.classes.of(mesh.triangle_material(**triangle)).is_some())
            .map(|(number, _)| number)
            .collect();
        let nearby = Nearby::of(source, mesh, &members);
        let scale_of = |triangles: &[u32]| self.scale_of(&nearby, mesh, triangles, level);
        let charts = flat_charts(mesh, &members, scale_of);
        let factor = self.fitted(mesh, &charts, level);
        let mut baked = BakedMesh {
            mesh: mesh.clone(),
            charts: vec![None; mesh.positions.len()],
            images: Vec::with_capacity(charts.len()),
        };
        let mut copies: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        let mut brushes = Brushes::new(nearby);
        for (number, chart) in (0u32..).zip(&charts) {
            let scale = chart.scale * factor;
            let painted = self.paint(source, mesh, chart, scale, level, &mut brushes);
            for (&triangle, texels) in chart.triangles.iter().zip(&painted.corners) {
                for (corner, texel) in texels.iter().enumerate() {
                    let vertex = baked.mesh.triangles[triangle as usize][corner];
                    let own = baked.own_vertex(vertex, number, &mut copies);
                    baked.mesh.texcoords[own as usize] = texel.as_vec2().into();
                    baked.mesh.triangles[triangle as usize][corner] = own;
                }
            }
            baked.images.push(painted.image);
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
