//! From a node's working mesh to what its file holds: primitives by surface, atlases, and
//! texture coordinates that follow the texels.

use std::collections::BTreeMap;

use super::atlas::{Page, Sheet};
use super::block::{BlockTextures, Prepared};
use super::charts::{self, Charts, NO_CHART};
use super::encode;
use super::level::LevelPicture;
use crate::format::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use crate::mesh::{AlphaMode, Mesh, Warnings, Wrap};
use crate::{Error, Result};

/// Texels per cell of an atlas of a node that has a parent: that one replaces it once a texel is
/// about half a pixel, so mip levels 1 and 2 are enough.
const CELL: usize = 4;

/// Texels per cell of a root's atlas: nothing coarser replaces it.
const ROOT_CELL: usize = 8;

/// A node ready to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct TexturedNode {
    /// Geometry and pictures.
    pub mesh: NodeMesh,
    /// Texels of the pictures that are the node's own.
    pub own_texels: u64,
    /// What could not be done as asked.
    pub warnings: Warnings,
}

/// Where the texture coordinates of a chart go, and in which picture they then are.
#[derive(Clone, Copy, Debug)]
struct Mapping {
    image: usize,
    /// `(clamp(uv · scale − offset) + shift) · unit`.
    scale: [f64; 2],
    offset: [f64; 2],
    limit: [f64; 2],
    shift: [f64; 2],
    unit: [f64; 2],
}

impl Mapping {
    /// The position in the level picture.
    fn texel(&self, uv: [f32; 2]) -> [f64; 2] {
        let uv = charts::sane(uv);
        [0, 1].map(|axis| {
            (uv[axis] * self.scale[axis] - self.offset[axis]).clamp(0.0, self.limit[axis])
        })
    }

    fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        let texel = self.texel(uv);
        [0, 1].map(|axis| ((texel[axis] + self.shift[axis]) * self.unit[axis]) as f32)
    }
}

/// What primitives are told apart by, besides their image.
type LookKey = (u8, u32, bool);

/// The triangles of one primitive.
struct Group {
    image: Option<usize>,
    vertices: Vec<u32>,
    indices: Vec<u32>,
    /// Materials in order of first use.
    materials: Vec<u32>,
}

impl BlockTextures<'_> {
    /// The node of a simplified (or original) piece of the block at `level`, 0 being the root's.
    ///
    /// `origin` is the block's, in source coordinates. `alike` are pairs of vertices that belong
    /// to one chart though no triangle joins them, such as a skirt's corner and the border vertex
    /// that it copies. Whatever the mesh names that the model
    /// does not have is drawn plain.
    pub fn node_mesh(
        &self,
        mesh: &Mesh,
        alike: &[[u32; 2]],
        level: usize,
        origin: [f64; 3],
    ) -> Result<TexturedNode> {
        let level = level.min(self.steps.len().saturating_sub(1));
        let mut node = NodeBuilder::new(self, mesh, level);
        node.find_charts(alike);
        for channels in [3, 4] {
            node.build_atlas(channels)?;
        }
        node.find_shared()?;
        let primitives = node.primitives();
        let own_texels = node
            .images
            .iter()
            .filter(|image| matches!(image.data, NodeImageData::Embedded { .. }))
            .map(|image| u64::from(image.width) * u64::from(image.height))
            .sum();
        let mesh = NodeMesh { origin, images: node.images, primitives };
        Ok(TexturedNode { mesh, own_texels, warnings: node.warnings })
    }
}

struct NodeBuilder<'a> {
    block: &'a BlockTextures<'a>,
    mesh: &'a Mesh,
    level: usize,
    charts: Charts,
    /// By chart.
    chart_textures: Vec<u32>,
    /// By chart; `None` until its picture is made.
    mappings: Vec<Option<Mapping>>,
    images: Vec<NodeImage>,
    warnings: Warnings,
}

impl<'a> NodeBuilder<'a> {
    fn new(block: &'a BlockTextures<'a>, mesh: &'a Mesh, level: usize) -> Self {
        Self {
            block,
            mesh,
            level,
            charts: Charts::default(),
            chart_textures: Vec::new(),
            mappings: Vec::new(),
            images: Vec::new(),
            warnings: Warnings::default(),
        }
    }

    /// The texture of a material, where there is a picture for it.
    fn texture_of(&self, material: u32) -> Option<u32> {
        let texture = self.block.material_textures.get(material as usize).copied().flatten()?;
        match self.block.textures.get(texture as usize)? {
            Prepared::Absent => None,
            _ => Some(texture),
        }
    }

    fn find_charts(&mut self, alike: &[[u32; 2]]) {
        if self.mesh.texcoords.len() != self.mesh.positions.len() {
            return;
        }
        let textured: Vec<bool> = (0..self.block.material_textures.len() as u32)
            .map(|material| self.texture_of(material).is_some())
            .collect();
        if !textured.contains(&true) {
            return;
        }
        let triangles = self.mesh.triangles.iter().copied().filter(|triangle| {
            let material = self.mesh.triangle_material(*triangle) as usize;
            textured.get(material).copied().unwrap_or(false)
        });
        // A pair joins charts as a triangle without area does.
        let joined = alike.iter().map(|&[a, b]| [a, b, b]).filter(|[a, _, _]| {
            let material = self.mesh.materials[*a as usize] as usize;
            textured.get(material).copied().unwrap_or(false)
        });
        self.charts = Charts::find(&self.mesh.texcoords, triangles.chain(joined));
        self.chart_textures = vec![0; self.charts.boxes.len()];
        for (vertex, chart) in self.charts.of_vertex.iter().enumerate() {
            if *chart != NO_CHART {
                let texture = self.texture_of(self.mesh.materials[vertex]).unwrap_or(0);
                self.chart_textures[*chart as usize] = texture;
            }
        }
        self.mappings = vec![None; self.charts.boxes.len()];
    }

    /// The chart of a triangle, where it is textured.
    fn chart_of(&self, triangle: [u32; 3]) -> Option<usize> {
        let chart = *self.charts.of_vertex.get(triangle[0] as usize)?;
        (chart != NO_CHART).then_some(chart as usize)
    }

    /// Makes the atlas of all cut-up textures with this many channels.
    fn build_atlas(&mut self, channels: usize) -> Result<()> {
        // By texture: its place among the sheet's pictures.
        let mut pictures: BTreeMap<u32, usize> = BTreeMap::new();
        for texture in &self.chart_textures {
            if let Prepared::Atlas(source) = &self.block.textures[*texture as usize]
                && source.channels == channels
            {
                pictures.insert(*texture, 0);
            }
        }
        if pictures.is_empty() {
            return Ok(());
        }
        for (place, index) in pictures.values_mut().enumerate() {
            *index = place;
        }
        let is_leaf = self.block.steps[self.level] <= 1.0;
        let max_side = (self.block.options.max_atlas as usize).clamp(16, encode::MAX_SIDE) / 4 * 4;
        let mut coarser: Vec<LevelPicture> = Vec::new();
        let mut halvings = 0;
        loop {
            let levels: Vec<&LevelPicture> = if halvings == 0 {
                pictures.keys().filter_map(|texture| self.level_picture(*texture)).collect()
            } else {
                coarser.iter().collect()
            };
            let mappings = self.texel_mappings(&pictures, &levels);
            let sheet = Sheet {
                triangles: self.sheet_triangles(&pictures, &mappings),
                pictures: levels,
                cell: if self.level == 0 { ROOT_CELL } else { CELL },
                max_side,
            };
            let max_pages = if is_leaf && halvings == 0 { usize::MAX } else { 1 };
            if let Some(atlas) = sheet.build(self.charts.boxes.len(), max_pages) {
                let first = self.images.len();
                for (chart, mapping) in mappings.into_iter().enumerate() {
                    let Some(mut mapping) = mapping else { continue };
                    let place = atlas.places[chart];
                    mapping.image = first + place.page;
                    mapping.shift = place.shift;
                    mapping.unit = atlas.pages[place.page].size.map(|side| 1.0 / side as f64);
                    self.mappings[chart] = Some(mapping);
                }
                for page in &atlas.pages {
                    self.images.push(self.encode(page, channels)?);
                }
                break;
            }
            if sheet.pictures.iter().all(|picture| picture.size == [1, 1]) {
                return Err(Error::Internal(format!("no atlas of {max_side} texels a side")));
            }
            coarser = sheet.pictures.iter().map(|picture| picture.halved()).collect();
            halvings += 1;
        }
        if halvings > 0 {
            self.warnings.add(
                format!(
                    "{}: an atlas of level {} was scaled down to fit {max_side} texels a side; \
                     a larger limit keeps its detail",
                    self.block.model.source.display(),
                    self.level
                ),
                1,
            );
        }
        Ok(())
    }

    fn level_picture(&self, texture: u32) -> Option<&'a LevelPicture> {
        match &self.block.textures[texture as usize] {
            Prepared::Atlas(source) => source.levels.get(self.level),
            _ => None,
        }
    }

    /// By chart: from texture coordinates to texels of these level pictures.
    fn texel_mappings(
        &self,
        pictures: &BTreeMap<u32, usize>,
        levels: &[&LevelPicture],
    ) -> Vec<Option<Mapping>> {
        let mapping = |(bounds, texture): (&charts::UvBox, &u32)| {
            let level = levels.get(*pictures.get(texture)?)?;
            let Prepared::Atlas(source) = &self.block.textures[*texture as usize] else {
                return None;
            };
            Some(Mapping {
                image: 0,
                scale: source.size.map(|side| side / level.step),
                offset: [0, 1].map(|axis| {
                    (source.tile(bounds, axis) * source.size[axis] + source.origin[axis])
                        / level.step
                }),
                limit: level.size.map(|side| side as f64),
                shift: [0.0; 2],
                unit: [1.0; 2],
            })
        };
        self.charts.boxes.iter().zip(&self.chart_textures).map(mapping).collect()
    }

    fn sheet_triangles(
        &self,
        pictures: &BTreeMap<u32, usize>,
        mappings: &[Option<Mapping>],
    ) -> Vec<Vec<([[f64; 2]; 3], u32)>> {
        let mut lists = vec![Vec::new(); pictures.len()];
        for triangle in &self.mesh.triangles {
            let Some(chart) = self.chart_of(*triangle) else { continue };
            let Some(mapping) = &mappings[chart] else { continue };
            let corners =
                triangle.map(|vertex| mapping.texel(self.mesh.texcoords[vertex as usize]));
            lists[pictures[&self.chart_textures[chart]]].push((corners, chart as u32));
        }
        lists
    }

    fn encode(&self, page: &Page, channels: usize) -> Result<NodeImage> {
        let quality = self.block.options.jpeg_quality;
        let encoded = encode::encode(&page.pixels, page.size, channels, quality)?;
        Ok(NodeImage {
            width: page.size[0] as u32,
            height: page.size[1] as u32,
            data: NodeImageData::Embedded { mime: encoded.mime, bytes: encoded.bytes },
        })
    }

    /// Finds the shared pictures of the charts that repeat.
    fn find_shared(&mut self) -> Result<()> {
        let mut images: BTreeMap<u32, usize> = BTreeMap::new();
        for chart in 0..self.charts.boxes.len() {
            let texture = self.chart_textures[chart];
            let Prepared::Repeating(decoded) = &self.block.textures[texture as usize] else {
                continue;
            };
            let image = match images.get(&texture) {
                Some(image) => *image,
                None => {
                    self.images.push(self.block.shared.image(
                        &self.block.model.textures[texture as usize].name,
                        decoded,
                        self.block.steps[self.level],
                        self.block.options.jpeg_quality,
                    )?);
                    images.insert(texture, self.images.len() - 1);
                    self.images.len() - 1
                }
            };
            self.mappings[chart] = Some(Mapping {
                image,
                scale: [1.0; 2],
                offset: [0.0; 2],
                limit: [f64::MAX; 2],
                shift: [0.0; 2],
                unit: [1.0; 2],
            });
        }
        // Coordinates are kept, moved by whole periods to where f32 is finest.
        for (vertex, chart) in self.charts.of_vertex.iter().enumerate() {
            if *chart == NO_CHART {
                continue;
            }
            let chart = *chart as usize;
            let Some(mapping) = &mut self.mappings[chart] else { continue };
            if mapping.limit != [f64::MAX; 2] {
                continue;
            }
            let wrap = self.block.model.materials[self.mesh.materials[vertex] as usize].wrap;
            let bounds = &self.charts.boxes[chart];
            for axis in 0..2 {
                let period = match wrap[axis] {
                    Wrap::Repeat => bounds.min[axis].floor(),
                    Wrap::Mirror => 2.0 * (bounds.min[axis] / 2.0).floor(),
                    Wrap::Clamp => 0.0,
                };
                // The clamp at 0 is for atlases; here the range is moved above it and back.
                let base =
                    if wrap[axis] == Wrap::Clamp { bounds.min[axis].floor() } else { period };
                mapping.offset[axis] = base;
                mapping.shift[axis] = base - period;
            }
        }
        Ok(())
    }

    /// Groups the triangles by how they look.
    fn primitives(&self) -> Vec<Primitive> {
        let mut groups: Vec<Group> = Vec::new();
        let mut by_look: BTreeMap<(Option<usize>, [u8; 2], LookKey), usize> = BTreeMap::new();
        let mut last: Option<(u32, Option<usize>, usize)> = None;
        let mut remap = vec![u32::MAX; self.mesh.positions.len()];
        for triangle in &self.mesh.triangles {
            let material = self.mesh.triangle_material(*triangle);
            let image =
                self.chart_of(*triangle).and_then(|chart| self.mappings[chart]).map(|m| m.image);
            let index = match last {
                Some((same, picture, index)) if same == material && picture == image => index,
                _ => {
                    let key = (image, self.wrap_key(material, image), self.look(material));
                    let index = *by_look.entry(key).or_insert_with(|| {
                        groups.push(Group {
                            image,
                            vertices: Vec::new(),
                            indices: Vec::new(),
                            materials: Vec::new(),
                        });
                        groups.len() - 1
                    });
                    if !groups[index].materials.contains(&material) {
                        groups[index].materials.push(material);
                    }
                    last = Some((material, image, index));
                    index
                }
            };
            let group = &mut groups[index];
            for vertex in triangle {
                let slot = &mut remap[*vertex as usize];
                if *slot == u32::MAX {
                    *slot = group.vertices.len() as u32;
                    group.vertices.push(*vertex);
                }
                group.indices.push(*slot);
            }
        }
        groups.into_iter().map(|group| self.primitive(group)).collect()
    }

    /// Alpha and sides of a material, as a key.
    fn look(&self, material: u32) -> LookKey {
        let Some(material) = self.block.model.materials.get(material as usize) else {
            return (0, 0, true);
        };
        let (mode, cutoff) = match material.alpha {
            AlphaMode::Opaque => (0, 0),
            AlphaMode::Mask { cutoff } => (1, cutoff.to_bits()),
            AlphaMode::Blend => (2, 0),
        };
        (mode, cutoff, material.double_sided)
    }

    /// The wrapping of a primitive: the material's where the picture is shared, clamped in atlases.
    fn wrap(&self, material: u32, image: Option<usize>) -> [Wrap; 2] {
        let shared = image
            .is_some_and(|image| matches!(self.images[image].data, NodeImageData::Shared { .. }));
        match self.block.model.materials.get(material as usize) {
            Some(material) if shared => material.wrap,
            _ if image.is_some() => [Wrap::Clamp; 2],
            _ => [Wrap::Repeat; 2],
        }
    }

    fn wrap_key(&self, material: u32, image: Option<usize>) -> [u8; 2] {
        self.wrap(material, image).map(|wrap| wrap as u8)
    }

    fn base_color(&self, material: u32) -> [f32; 4] {
        let material = self.block.model.materials.get(material as usize);
        material.map_or([1.0; 4], |material| material.base_color)
    }

    fn primitive(&self, group: Group) -> Primitive {
        let mesh = self.mesh;
        let first = group.materials.first().copied().unwrap_or(0);
        let (colors, base_color) = self.colors(&group);
        let texcoords = match group.image {
            None => Vec::new(),
            Some(_) => group
                .vertices
                .iter()
                .map(|vertex| {
                    let chart = self.charts.of_vertex[*vertex as usize] as usize;
                    let uv = mesh.texcoords[*vertex as usize];
                    self.mappings[chart].map_or(uv, |mapping| mapping.apply(uv))
                })
                .collect(),
        };
        let source = self.block.model.materials.get(first as usize);
        Primitive {
            positions: group.vertices.iter().map(|v| mesh.positions[*v as usize]).collect(),
            texcoords,
            colors,
            surface: Surface {
                base_color,
                image: group.image,
                wrap: self.wrap(first, group.image),
                alpha: source.map_or(AlphaMode::Opaque, |material| material.alpha),
                double_sided: source.is_none_or(|material| material.double_sided),
            },
            indices: group.indices,
        }
    }

    /// Vertex colours, where there must be some, and the factor of all of them.
    fn colors(&self, group: &Group) -> (Vec<[u16; 4]>, [f32; 4]) {
        let mesh = self.mesh;
        let factors: Vec<[f32; 4]> = group.materials.iter().map(|m| self.base_color(*m)).collect();
        let base = factors.first().copied().unwrap_or([1.0; 4]);
        let uniform = factors.iter().all(|factor| *factor == base);
        let color =
            |vertex: u32| mesh.colors.get(vertex as usize).copied().unwrap_or([u16::MAX; 4]);
        let white =
            mesh.colors.is_empty() || group.vertices.iter().all(|v| color(*v) == [u16::MAX; 4]);
        if uniform {
            let colors =
                if white { Vec::new() } else { group.vertices.iter().map(|v| color(*v)).collect() };
            return (colors, base);
        }
        let colors = group.vertices.iter().map(|vertex| {
            let factor = self.base_color(mesh.materials[*vertex as usize]);
            let own = color(*vertex);
            std::array::from_fn(|channel| {
                (f32::from(own[channel]) * factor[channel].clamp(0.0, 1.0) + 0.5) as u16
            })
        });
        (colors.collect(), [1.0; 4])
    }
}
