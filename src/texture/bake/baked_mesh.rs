//! A node's mesh with charts and images of its own.

use rustc_hash::FxHashMap;

use super::flat::flat_charts;
use super::light_votes::LightVotes;
use super::nearby::Nearby;
use super::paint::Brushes;
use super::prepared::PreparedBake;
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

/// Owner of a vertex of a baked mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Owner {
    Chart(u32),
    /// Triangles of a lit material and a colour.
    Lit(u32, [u16; 4]),
}

impl BlockTextures<'_> {
    /// Gives the triangles of a node whose materials are of some class charts and images of
    /// their own, or where they stand for what is lit a colour each. `None` where the block keeps nothing to
    /// bake from.
    pub fn bake(&self, mesh: &Mesh, level: usize) -> Option<BakedMesh> {
        let PreparedBake { classes, source, .. } = self.bake_source.as_ref()?;
        let level = self.nearest_level(level);
        let mut members = Vec::new();
        let mut lit = Vec::new();
        let mut votes = LightVotes::new(source, mesh);
        for (number, &triangle) in (0u32..).zip(&mesh.triangles) {
            let Some(class) = classes.of(mesh.triangle_material(triangle)) else { continue };
            let [unlit, lit_material] = classes.by_light(class);
            match lit_material {
                Some(material) if votes.is_lit(triangle) || unlit.is_none() => {
                    lit.push((number, material, votes.color()));
                }
                _ => members.push(number),
            }
        }
        let nearby = Nearby::of(source, mesh, &members);
        let scale_of = |triangles: &[u32]| self.scale_of(&nearby, mesh, triangles, level);
        let charts = flat_charts(mesh, &members, scale_of);
        let area_of = |&member: &u32| mesh.triangle_area(mesh.triangles[member as usize]);
        let factor = self.fitted(members.iter().map(area_of).sum(), &charts, level);
        let mut baked = Baking {
            mesh: mesh.clone(),
            owners: vec![None; mesh.positions.len()],
            copies: FxHashMap::default(),
        };
        for (triangle, material, color) in lit {
            for corner in 0..3 {
                let own = baked.own_vertex(triangle, corner, Owner::Lit(material, color));
                baked.mesh.materials[own] = material;
                if let Some(own) = baked.mesh.colors.get_mut(own) {
                    *own = color;
                }
            }
        }
        let mut images = Vec::with_capacity(charts.len());
        let mut brushes = Brushes::new(nearby);
        for (number, chart) in (0u32..).zip(&charts) {
            let scale = chart.scale * factor;
            let painted = self.paint(source, mesh, chart, scale, level, &mut brushes);
            for (&triangle, texels) in chart.triangles.iter().zip(&painted.corners) {
                let class = classes.of(mesh.triangle_material(mesh.triangles[triangle as usize]));
                let [unlit, _] = class.map(|class| classes.by_light(class)).unwrap_or_default();
                for (corner, texel) in texels.iter().enumerate() {
                    let own = baked.own_vertex(triangle, corner, Owner::Chart(number));
                    baked.mesh.texcoords[own] = texel.as_vec2().into();
                    if let Some(unlit) = unlit {
                        baked.mesh.materials[own] = unlit;
                    }
                }
            }
            images.push(painted.image);
        }
        let chart = |owner: Option<Owner>| match owner {
            Some(Owner::Chart(chart)) => Some(chart),
            _ => None,
        };
        let charts = baked.owners.into_iter().map(chart).collect();
        Some(BakedMesh { mesh: baked.mesh, charts, images })
    }
}

/// A mesh whose vertices become several where their triangles get charts or colours.
struct Baking {
    mesh: Mesh,
    /// By vertex.
    owners: Vec<Option<Owner>>,
    copies: FxHashMap<(u32, Owner), u32>,
}

impl Baking {
    /// The vertex at a corner of a triangle: itself for the first owner that asks, a copy for others.
    fn own_vertex(&mut self, triangle: u32, corner: usize, owner: Owner) -> usize {
        let vertex = self.mesh.triangles[triangle as usize][corner];
        let own = match *self.owners[vertex as usize].get_or_insert(owner) {
            first if first == owner => vertex,
            _ => *self.copies.entry((vertex, owner)).or_insert_with(|| {
                self.owners.push(Some(owner));
                self.mesh.push_copy(vertex as usize)
            }),
        };
        self.mesh.triangles[triangle as usize][corner] = own;
        own as usize
    }
}
