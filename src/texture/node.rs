//! From a node's working mesh to what its file holds: the atlases that its charts go into, and
//! where each triangle's texels lie then. What is written of the triangles is
//! [`super::primitives`].

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use super::atlas::{Atlas, AtlasImage, AtlasInput, Page, PatchPlacement};
use super::bake::BakedMesh;
use super::block::{BlockTextures, Prepared};
use super::charts::{self, Charts, NO_CHART, UvBox};
use super::encode;
use super::level::LevelImage;
use super::placement::{ImagePlacement, Mapping};
use crate::format::{NodeImage, NodeImageData, NodeMesh};
use crate::mesh::{Mesh, Warnings, Wrap};
use crate::{Error, Result};

/// Texels per cell of an atlas of a node that has a parent: that one replaces it once a texel is
/// about half a pixel, so mip level 1 must be free of neighbours.
const CELL: usize = 2;

/// Texels per cell of a leaf's atlas. Leaves are seen from nearby and at low angles, where mip level 2 is
/// drawn. Cells of 2 leave one and a half to four times as many pixels at borders of nodes that are not as
/// in the source (`scripts/view-compare`); cells of 8 have a fifth more texels.
const LEAF_CELL: usize = 4;

/// Texels per cell of a root's atlas: nothing coarser replaces it.
const ROOT_CELL: usize = 8;

/// Texels per cell of the atlas of a root's baked charts, which are many and small there. They are
/// of one block and mostly alike, so that what mixes beyond mip level 2 is hardly seen.
const BAKED_CELL: usize = 4;

/// A coarse node with more than this many times its share of the block's texels takes them from a
/// level above. Simplification that joins charts leaves triangles that span what the source does
/// not use.
const MAX_SHARE: f64 = 4.0;

/// Atlases with fewer texels than this are left as they are.
const SMALL: usize = 64 * 64;

/// A leaf embeds shared textures of at most this part of its own bytes. A coarser level has fewer
/// bytes by about the ratio of its texels to the source's, so the part grows by that ratio: each
/// level costs about as many bytes, and a view from afar, of few nodes, needs few files.
const EMBEDDED_RATIO: f64 = 0.04;

/// No node embeds shared textures of more than this part of its own bytes.
const MAX_EMBEDDED_RATIO: f64 = 0.5;

/// The skirts at the end of a node's mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AppendedSkirts {
    /// How many of the last triangles they are.
    pub triangles: usize,
    /// Pairs of vertices that belong to one chart though no triangle joins them: a border vertex
    /// and the corner of a skirt that looks like it.
    pub alike: Vec<[u32; 2]>,
}

/// A node ready to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct TexturedNode {
    /// Geometry and images.
    pub mesh: NodeMesh,
    /// Texels of the images that are the node's own.
    pub own_texels: u64,
    /// What could not be done as asked.
    pub warnings: Warnings,
}

/// The placement of triangles without texture.
pub(super) const NO_PLACEMENT: u32 = u32::MAX;

/// The texture of charts that have an image of their own.
const NO_TEXTURE: u32 = u32::MAX;

impl BlockTextures<'_> {
    /// The node of a simplified (or original) part of the block at `level`, 0 being the root's.
    ///
    /// `origin` is the block's, in source coordinates. Whatever the mesh names that the model does
    /// not have is drawn plain.
    pub fn node_mesh(
        &self,
        mesh: &Mesh,
        skirts: &AppendedSkirts,
        level: usize,
        origin: [f64; 3],
    ) -> Result<TexturedNode> {
        self.textured(NodeBuilder::new(self, mesh, skirts, level), origin)
    }

    /// The same of a baked mesh.
    pub fn baked_node_mesh(
        &self,
        baked: &BakedMesh,
        skirts: &AppendedSkirts,
        level: usize,
        origin: [f64; 3],
    ) -> Result<TexturedNode> {
        let mut node = NodeBuilder::new(self, &baked.mesh, skirts, level);
        node.baked = Some(baked);
        self.textured(node, origin)
    }

    /// Embeds the smallest of the shared textures of a node of a level, whose file has this many
    /// bytes without them. Returns whether any was embedded.
    pub fn embed_small(&self, mesh: &mut NodeMesh, file_bytes: usize, level: usize) -> bool {
        let step = self.steps.get(self.nearest_level(level)).copied().unwrap_or(1.0);
        let ratio = (EMBEDDED_RATIO * step * step).min(MAX_EMBEDDED_RATIO);
        self.shared.embed(mesh, (file_bytes as f64 * ratio) as usize)
    }

    pub(super) fn nearest_level(&self, level: usize) -> usize {
        level.min(self.steps.len().saturating_sub(1))
    }

    /// Texels a cell of the atlas of a node's baked charts.
    pub(super) fn baked_cell(&self, level: usize) -> usize {
        self.cell(level).min(BAKED_CELL)
    }

    /// Texels a cell of a node's atlas.
    fn cell(&self, level: usize) -> usize {
        match self.steps[level] {
            step if step <= 1.0 => LEAF_CELL,
            _ if level == 0 => ROOT_CELL,
            _ => CELL,
        }
    }

    fn textured(&self, mut node: NodeBuilder, origin: [f64; 3]) -> Result<TexturedNode> {
        let alike = &node.skirts.alike[..];
        node.find_charts(alike);
        for channels in [3, 4] {
            node.build_atlas(channels)?;
        }
        node.add_baked(alike)?;
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

pub(super) struct NodeBuilder<'a> {
    pub(super) block: &'a BlockTextures<'a>,
    pub(super) mesh: &'a Mesh,
    /// Where it is, the triangles of its charts take their texels from it.
    baked: Option<&'a BakedMesh>,
    /// The images of baked charts.
    pub(super) baked_images: Range<usize>,
    pub(super) level: usize,
    /// The last triangles of the mesh.
    pub(super) skirts: &'a AppendedSkirts,
    pub(super) charts: Charts,
    /// By chart.
    pub(super) chart_textures: Vec<u32>,
    /// By chart; `None` until its image is made.
    pub(super) mappings: Vec<Option<Mapping>>,
    /// By triangle: index into `placements`, or [`NO_PLACEMENT`].
    pub(super) placement_of: Vec<u32>,
    pub(super) placements: Vec<ImagePlacement>,
    pub(super) images: Vec<NodeImage>,
    /// Atlases whose opposite sides meet.
    pub(super) wrapping: Vec<usize>,
    pub(super) warnings: Warnings,
}

impl<'a> NodeBuilder<'a> {
    fn new(
        block: &'a BlockTextures<'a>,
        mesh: &'a Mesh,
        skirts: &'a AppendedSkirts,
        level: usize,
    ) -> Self {
        Self {
            block,
            mesh,
            baked: None,
            baked_images: 0..0,
            level: block.nearest_level(level),
            skirts,
            charts: Charts::default(),
            chart_textures: Vec::new(),
            mappings: Vec::new(),
            placement_of: vec![NO_PLACEMENT; mesh.triangles.len()],
            placements: Vec::new(),
            images: Vec::new(),
            wrapping: Vec::new(),
            warnings: Warnings::default(),
        }
    }

    /// The texture of a material, where there is an image for it.
    fn texture_of(&self, material: u32) -> Option<u32> {
        let texture = self.block.material_textures.get(material as usize).copied().flatten();
        texture.filter(|_| self.block.image_of_material(material).is_some())
    }

    fn find_charts(&mut self, alike: &[[u32; 2]]) {
        if self.mesh.texcoords.len() != self.mesh.positions.len() {
            return;
        }
        let bake = self.block.bake_source.as_ref().filter(|_| self.baked.is_some());
        let is_baked = |material: u32| bake.is_some_and(|bake| bake.classes.of(material).is_some());
        let textured: Vec<bool> = (0..self.block.material_textures.len() as u32)
            .map(|material| self.texture_of(material).is_some() && !is_baked(material))
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

    /// Makes the atlas of the charts that a baked mesh has of its own.
    fn add_baked(&mut self, alike: &[[u32; 2]]) -> Result<()> {
        let Some(baked) = self.baked.filter(|baked| !baked.images.is_empty()) else {
            return Ok(());
        };
        let first = self.charts.boxes.len() as u32;
        self.charts.of_vertex.resize(self.mesh.positions.len(), NO_CHART);
        for (of_vertex, chart) in self.charts.of_vertex.iter_mut().zip(&baked.charts) {
            if let Some(chart) = chart {
                *of_vertex = first + chart;
            }
        }
        // Skirts look like the vertices that they hang on.
        for &[model, copy] in alike {
            self.charts.of_vertex[copy as usize] = self.charts.of_vertex[model as usize];
        }
        self.charts.boxes.resize(first as usize + baked.images.len(), UvBox::EMPTY);
        self.chart_textures.resize(self.charts.boxes.len(), NO_TEXTURE);
        self.mappings.resize(self.charts.boxes.len(), None);
        let mut images: Vec<Cow<LevelImage>> = baked.images.iter().map(Cow::Borrowed).collect();
        let mut mapping = Mapping::TEXELS;
        loop {
            let (sheet_images, members) = self.baked_images(first, &images, mapping);
            let cell = self.block.baked_cell(self.level);
            let sheet = AtlasInput { images: sheet_images, cell, max_side: self.max_side() };
            let is_least = images.iter().all(|image| image.size == [1, 1]);
            if let Some(atlas) = sheet.build(if is_least { usize::MAX } else { 1 }) {
                let mut mappings = vec![None; first as usize];
                mappings.resize(self.charts.boxes.len(), Some(mapping));
                let first = self.images.len();
                self.take_atlas(&atlas, &mappings, &members, 3)?;
                self.baked_images = first..self.images.len();
                return Ok(());
            }
            if is_least {
                let side = self.max_side();
                return Err(Error::Internal(format!("no atlas of {side} texels a side")));
            }
            images = images.iter().map(|image| Cow::Owned(image.halved())).collect();
            mapping.scale = mapping.scale.map(|scale| scale * 0.5);
        }
    }

    /// The charts from `first` on as a sheet's images, and which triangles of the mesh those are.
    fn baked_images<'p>(
        &self,
        first: u32,
        images: &'p [Cow<LevelImage>],
        mapping: Mapping,
    ) -> (Vec<AtlasImage<'p>>, Vec<Vec<u32>>) {
        let empty = |image: &'p Cow<LevelImage>| AtlasImage {
            image,
            corners: Vec::new(),
            charts: Vec::new(),
        };
        let mut lists: Vec<AtlasImage> = images.iter().map(empty).collect();
        let mut members = vec![Vec::new(); images.len()];
        for (index, triangle) in self.mesh.triangles.iter().enumerate() {
            let chart =
                self.chart_of(*triangle).and_then(|chart| chart.checked_sub(first as usize));
            let Some(chart) = chart else { continue };
            let texel = |vertex: u32| mapping.texel(self.mesh.texcoords[vertex as usize]);
            lists[chart].corners.push(triangle.map(texel));
            lists[chart].charts.push(0);
            members[chart].push(index as u32);
        }
        (lists, members)
    }

    /// Makes the atlas of all cut-up textures with this many channels.
    fn build_atlas(&mut self, channels: usize) -> Result<()> {
        // By texture: its index among the sheet's images.
        let mut images: BTreeMap<u32, usize> = BTreeMap::new();
        for texture in &self.chart_textures {
            if let Some(Prepared::Atlas(source)) = self.block.textures.get(*texture as usize)
                && source.channels == channels
            {
                images.insert(*texture, 0);
            }
        }
        if images.is_empty() {
            return Ok(());
        }
        for (number, index) in images.values_mut().enumerate() {
            *index = number;
        }
        let is_leaf = self.block.steps[self.level] <= 1.0;
        let max_side = self.max_side();
        let mut coarser: Vec<Cow<'a, LevelImage>> = Vec::new();
        let mut halvings = 0;
        let mut fitted = false;
        loop {
            let levels: Vec<&LevelImage> = if halvings == 0 && !fitted {
                images.keys().filter_map(|texture| self.level_image(*texture)).collect()
            } else {
                coarser.iter().map(|image| &**image).collect()
            };
            let mappings = self.texel_mappings(&images, &levels);
            let (sheet_images, members) = self.sheet_images(&images, &levels, &mappings);
            let sheet =
                AtlasInput { images: sheet_images, cell: self.block.cell(self.level), max_side };
            // Many pictures may need several however small they are.
            let is_least = levels.iter().all(|image| image.size == [1, 1]);
            let max_pages = if is_leaf && halvings == 0 || is_least { usize::MAX } else { 1 };
            if let Some(atlas) = sheet.build(max_pages) {
                if !is_leaf && !fitted && halvings == 0 && self.exceeds_share(&atlas) {
                    fitted = true;
                    coarser = images.keys().filter_map(|texture| self.coarser(*texture)).collect();
                    continue;
                }
                self.take_atlas(&atlas, &mappings, &members, channels)?;
                break;
            }
            if is_least {
                return Err(Error::Internal(format!("no atlas of {max_side} texels a side")));
            }
            coarser = levels.iter().map(|image| Cow::Owned(image.halved())).collect();
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

    /// Longest side of a page.
    fn max_side(&self) -> usize {
        (self.block.options.max_atlas as usize).clamp(16, encode::MAX_SIDE) / 4 * 4
    }

    /// True where an atlas has far more texels than the node's part of the block's surface.
    fn exceeds_share(&self, atlas: &Atlas) -> bool {
        let texels: usize = atlas.pages.iter().map(|page| page.size[0] * page.size[1]).sum();
        texels > SMALL && texels as f64 > MAX_SHARE * self.block.share_of(self.mesh, self.level)
    }

    /// A texture at the level above, or at half the resolution where there is none.
    fn coarser(&self, texture: u32) -> Option<Cow<'a, LevelImage>> {
        let Prepared::Atlas(source) = &self.block.textures[texture as usize] else { return None };
        match self.level.checked_sub(1) {
            Some(above) => source.level(above, self.block.steps[above]).map(Cow::Borrowed),
            None => source.level(0, self.block.steps[0]).map(|root| Cow::Owned(root.halved())),
        }
    }

    fn level_image(&self, texture: u32) -> Option<&'a LevelImage> {
        match &self.block.textures[texture as usize] {
            Prepared::Atlas(source) => source.level(self.level, self.block.steps[self.level]),
            _ => None,
        }
    }

    /// By chart: from texture coordinates to texels of these level images.
    fn texel_mappings(
        &self,
        images: &BTreeMap<u32, usize>,
        levels: &[&LevelImage],
    ) -> Vec<Option<Mapping>> {
        let mapping = |(bounds, texture): (&charts::UvBox, &u32)| {
            let level = levels.get(*images.get(texture)?)?;
            let Prepared::Atlas(source) = &self.block.textures[*texture as usize] else {
                return None;
            };
            Some(Mapping {
                scale: source.size.map(|side| side / level.step),
                offset: [0, 1].map(|axis| {
                    (source.tile(bounds, axis) * source.size[axis] + source.origin[axis])
                        / level.step
                }),
                limit: level.size.map(|side| side as f64),
            })
        };
        self.charts.boxes.iter().zip(&self.chart_textures).map(mapping).collect()
    }

    /// The sheet's images with their triangles, and which triangles of the mesh those are.
    fn sheet_images<'p>(
        &self,
        images: &BTreeMap<u32, usize>,
        levels: &[&'p LevelImage],
        mappings: &[Option<Mapping>],
    ) -> (Vec<AtlasImage<'p>>, Vec<Vec<u32>>) {
        let mut members = vec![Vec::new(); levels.len()];
        let empty =
            |image: &&'p LevelImage| AtlasImage { image, corners: Vec::new(), charts: Vec::new() };
        let mut lists: Vec<AtlasImage> = levels.iter().map(empty).collect();
        for (index, triangle) in self.mesh.triangles.iter().enumerate() {
            let Some(chart) = self.chart_of(*triangle) else { continue };
            let Some(mapping) = &mappings[chart] else { continue };
            let Some(image) = images.get(&self.chart_textures[chart]) else { continue };
            let list = &mut lists[*image];
            let texel = |vertex: u32| mapping.texel(self.mesh.texcoords[vertex as usize]);
            list.corners.push(triangle.map(texel));
            list.charts.push(chart as u32);
            members[*image].push(index as u32);
        }
        (lists, members)
    }

    /// Takes over where the triangles' texels went, and encodes the pages.
    fn take_atlas(
        &mut self,
        atlas: &Atlas,
        mappings: &[Option<Mapping>],
        members: &[Vec<u32>],
        channels: usize,
    ) -> Result<()> {
        let first_image = self.images.len();
        let first_placement = self.placements.len() as u32;
        self.placements.extend(atlas.placements.iter().map(|patch| ImagePlacement {
            image: first_image + patch.page,
            patch: *patch,
            unit: atlas.pages[patch.page].size.map(|side| 1.0 / side as f64),
        }));
        for (members, patches) in members.iter().zip(&atlas.patches) {
            for (triangle, patch) in members.iter().zip(patches) {
                self.placement_of[*triangle as usize] = first_placement + patch;
            }
        }
        for (own, mapping) in self.mappings.iter_mut().zip(mappings) {
            *own = own.or(*mapping);
        }
        for page in &atlas.pages {
            let image = self.encode(page, channels)?;
            if atlas.wraps {
                self.wrapping.push(self.images.len());
            }
            self.images.push(image);
        }
        Ok(())
    }

    fn encode(&self, page: &Page, channels: usize) -> Result<NodeImage> {
        let asked = self.block.options.jpeg_quality;
        let is_leaf = self.block.steps[self.level] <= 1.0;
        let quality = if is_leaf { asked } else { encode::coarse_quality(asked) };
        let encoded = encode::encode(&page.pixels, page.size, channels, quality)?;
        Ok(NodeImage {
            width: page.size[0] as u32,
            height: page.size[1] as u32,
            data: NodeImageData::Embedded {
                mime: encoded.mime,
                bytes: encoded.bytes,
                file_name: None,
            },
        })
    }

    /// Finds the shared images of the charts that repeat.
    fn find_shared(&mut self) -> Result<()> {
        // By material, as the wrapping is the material's.
        let mut placements: BTreeMap<u32, u32> = BTreeMap::new();
        let mut images: BTreeMap<u32, usize> = BTreeMap::new();
        for (index, triangle) in self.mesh.triangles.iter().enumerate() {
            let Some(chart) = self.chart_of(*triangle) else { continue };
            let texture = self.chart_textures[chart];
            let Some(Prepared::Repeating(decoded)) = self.block.textures.get(texture as usize)
            else {
                continue;
            };
            let material = self.mesh.triangle_material(*triangle);
            let placement = match placements.get(&material) {
                Some(placement) => *placement,
                None => {
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
                    self.placements.push(ImagePlacement {
                        image,
                        patch: PatchPlacement::default(),
                        unit: [1.0; 2],
                    });
                    placements.insert(material, self.placements.len() as u32 - 1);
                    self.placements.len() as u32 - 1
                }
            };
            self.placement_of[index] = placement;
            if self.mappings[chart].is_none() {
                self.mappings[chart] = Some(self.repeating_mapping(chart, material));
            }
        }
        Ok(())
    }

    /// Coordinates are kept, moved by whole periods to where f32 is finest.
    fn repeating_mapping(&self, chart: usize, material: u32) -> Mapping {
        let material = self.block.model.materials.get(material as usize);
        let wrap = material.map_or([Wrap::Repeat; 2], |material| material.wrap);
        let low = self.charts.boxes[chart].min;
        let offset = [0, 1].map(|axis| match wrap[axis] {
            Wrap::Repeat => low[axis].floor(),
            Wrap::Mirror => 2.0 * (low[axis] / 2.0).floor(),
            Wrap::Clamp => 0.0,
        });
        // What lies below 0 is only ever met with `Clamp`, where it looks like 0; but moving a
        // corner would stretch the triangle's texture, so nothing is cut off.
        Mapping { scale: [1.0; 2], offset, limit: [f64::INFINITY; 2] }
    }
}
