//! From a node's working mesh to what its file holds: primitives by surface, atlases, and
//! texture coordinates that follow the texels.

use std::borrow::Cow;
use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::atlas::{Atlas, Page, PatchPlace, Sheet, SheetPicture};
use super::block::{BlockTextures, Prepared};
use super::charts::{self, Charts, NO_CHART};
use super::encode;
use super::level::LevelPicture;
use crate::format::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use crate::mesh::{AlphaMode, Mesh, Warnings, Wrap};
use crate::{Error, Result};

/// Texels per cell of an atlas of a node that has a parent: that one replaces it once a texel is
/// about half a pixel, so mip level 1 must be free of neighbours.
const CELL: usize = 2;

/// Texels per cell of a root's atlas: nothing coarser replaces it.
const ROOT_CELL: usize = 8;

/// A coarse node with more than this many times its share of the block's texels takes them from a
/// level above. Simplification that joins charts leaves triangles that span what the source does
/// not use.
const MAX_SHARE: f64 = 4.0;

/// Atlases with fewer texels than this are left as they are.
const SMALL: usize = 64 * 64;

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

/// From a chart's texture coordinates to a position in its level picture:
/// `clamp(uv · scale − offset)`, clamped to the picture where it has a limit.
#[derive(Clone, Copy, Debug)]
struct Mapping {
    scale: [f64; 2],
    offset: [f64; 2],
    limit: [f64; 2],
}

impl Mapping {
    fn texel(&self, uv: [f32; 2]) -> [f64; 2] {
        let uv = charts::sane(uv);
        let along = |axis: usize| {
            let texel = uv[axis] * self.scale[axis] - self.offset[axis];
            if self.limit[axis].is_finite() { texel.clamp(0.0, self.limit[axis]) } else { texel }
        };
        [along(0), along(1)]
    }
}

/// From a position in a level picture to a texture coordinate of an image.
#[derive(Clone, Copy, Debug)]
struct Place {
    image: usize,
    patch: PatchPlace,
    unit: [f64; 2],
}

impl Place {
    fn texcoord(&self, texel: [f64; 2]) -> [f32; 2] {
        let texel = self.patch.texel(texel);
        [0, 1].map(|axis| (texel[axis] * self.unit[axis]) as f32)
    }
}

/// The place of triangles without texture.
const NO_PLACE: u32 = u32::MAX;

/// What primitives are told apart by, besides their image.
type LookKey = (u8, u32, bool);

/// The triangles of one primitive.
struct Group {
    image: Option<usize>,
    /// Vertices of the mesh and the place of their texels.
    vertices: Vec<(u32, u32)>,
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

/// The vertices that primitives have so far: one of the mesh becomes two where its triangles'
/// texels went to different places.
struct Slots {
    /// By vertex: the place it was first met with and its slot.
    first: Vec<Option<(u32, u32)>>,
    others: FxHashMap<(u32, u32), u32>,
}

impl Slots {
    fn new(vertices: usize) -> Self {
        Self { first: vec![None; vertices], others: FxHashMap::default() }
    }

    fn get(&mut self, vertex: u32, place: u32, add: impl FnOnce() -> u32) -> u32 {
        match &mut self.first[vertex as usize] {
            Some((same, slot)) if *same == place => *slot,
            Some(_) => *self.others.entry((vertex, place)).or_insert_with(add),
            empty => empty.insert((place, add())).1,
        }
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
    /// By triangle: index into `places`, or [`NO_PLACE`].
    place_of: Vec<u32>,
    places: Vec<Place>,
    images: Vec<NodeImage>,
    /// Atlases whose opposite sides meet.
    wrapping: Vec<usize>,
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
            place_of: vec![NO_PLACE; mesh.triangles.len()],
            places: Vec::new(),
            images: Vec::new(),
            wrapping: Vec::new(),
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
        let mut coarser: Vec<Cow<'a, LevelPicture>> = Vec::new();
        let mut halvings = 0;
        let mut fitted = false;
        loop {
            let levels: Vec<&LevelPicture> = if halvings == 0 && !fitted {
                pictures.keys().filter_map(|texture| self.level_picture(*texture)).collect()
            } else {
                coarser.iter().map(|picture| &**picture).collect()
            };
            let mappings = self.texel_mappings(&pictures, &levels);
            let (sheet_pictures, members) = self.sheet_pictures(&pictures, &levels, &mappings);
            let sheet = Sheet {
                pictures: sheet_pictures,
                cell: if self.level == 0 && !is_leaf { ROOT_CELL } else { CELL },
                max_side,
            };
            let max_pages = if is_leaf && halvings == 0 { usize::MAX } else { 1 };
            if let Some(atlas) = sheet.build(max_pages) {
                if !is_leaf && !fitted && halvings == 0 && self.exceeds_share(&atlas) {
                    fitted = true;
                    coarser =
                        pictures.keys().filter_map(|texture| self.coarser(*texture)).collect();
                    continue;
                }
                self.take_atlas(&atlas, &mappings, &members, channels)?;
                break;
            }
            if levels.iter().all(|picture| picture.size == [1, 1]) {
                return Err(Error::Internal(format!("no atlas of {max_side} texels a side")));
            }
            coarser = levels.iter().map(|picture| Cow::Owned(picture.halved())).collect();
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

    /// True where an atlas has far more texels than the node's part of the block's surface.
    fn exceeds_share(&self, atlas: &Atlas) -> bool {
        let texels: usize = atlas.pages.iter().map(|page| page.size[0] * page.size[1]).sum();
        texels > SMALL && texels as f64 > MAX_SHARE * self.block.share_of(self.mesh, self.level)
    }

    /// A texture at the level above, or at half the resolution where there is none.
    fn coarser(&self, texture: u32) -> Option<Cow<'a, LevelPicture>> {
        let Prepared::Atlas(source) = &self.block.textures[texture as usize] else { return None };
        match self.level.checked_sub(1) {
            Some(above) => source.levels.get(above).map(Cow::Borrowed),
            None => source.levels.first().map(|root| Cow::Owned(root.halved())),
        }
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

    /// The sheet's pictures with their triangles, and which triangles of the mesh those are.
    fn sheet_pictures<'p>(
        &self,
        pictures: &BTreeMap<u32, usize>,
        levels: &[&'p LevelPicture],
        mappings: &[Option<Mapping>],
    ) -> (Vec<SheetPicture<'p>>, Vec<Vec<u32>>) {
        let mut members = vec![Vec::new(); levels.len()];
        let empty = |picture: &&'p LevelPicture| SheetPicture {
            picture,
            corners: Vec::new(),
            charts: Vec::new(),
        };
        let mut lists: Vec<SheetPicture> = levels.iter().map(empty).collect();
        for (index, triangle) in self.mesh.triangles.iter().enumerate() {
            let Some(chart) = self.chart_of(*triangle) else { continue };
            let Some(mapping) = &mappings[chart] else { continue };
            let Some(picture) = pictures.get(&self.chart_textures[chart]) else { continue };
            let list = &mut lists[*picture];
            let texel = |vertex: u32| mapping.texel(self.mesh.texcoords[vertex as usize]);
            list.corners.push(triangle.map(texel));
            list.charts.push(chart as u32);
            members[*picture].push(index as u32);
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
        let first_place = self.places.len() as u32;
        self.places.extend(atlas.places.iter().map(|place| Place {
            image: first_image + place.page,
            patch: *place,
            unit: atlas.pages[place.page].size.map(|side| 1.0 / side as f64),
        }));
        for (members, patches) in members.iter().zip(&atlas.patches) {
            for (triangle, patch) in members.iter().zip(patches) {
                self.place_of[*triangle as usize] = first_place + patch;
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
        // By material, as the wrapping is the material's.
        let mut places: BTreeMap<u32, u32> = BTreeMap::new();
        let mut images: BTreeMap<u32, usize> = BTreeMap::new();
        for (index, triangle) in self.mesh.triangles.iter().enumerate() {
            let Some(chart) = self.chart_of(*triangle) else { continue };
            let texture = self.chart_textures[chart];
            let Prepared::Repeating(decoded) = &self.block.textures[texture as usize] else {
                continue;
            };
            let material = self.mesh.triangle_material(*triangle);
            let place = match places.get(&material) {
                Some(place) => *place,
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
                    self.places.push(Place { image, patch: PatchPlace::default(), unit: [1.0; 2] });
                    places.insert(material, self.places.len() as u32 - 1);
                    self.places.len() as u32 - 1
                }
            };
            self.place_of[index] = place;
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

    /// Groups the triangles by how they look.
    fn primitives(&self) -> Vec<Primitive> {
        let mut groups: Vec<Group> = Vec::new();
        let mut by_look: BTreeMap<(Option<usize>, [u8; 2], LookKey), usize> = BTreeMap::new();
        let mut last: Option<(u32, Option<usize>, usize)> = None;
        let mut slots = Slots::new(self.mesh.positions.len());
        for (triangle, place) in self.mesh.triangles.iter().zip(&self.place_of) {
            let material = self.mesh.triangle_material(*triangle);
            let image = self.places.get(*place as usize).map(|place| place.image);
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
                let slot = slots.get(*vertex, *place, || {
                    group.vertices.push((*vertex, *place));
                    group.vertices.len() as u32 - 1
                });
                group.indices.push(slot);
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

    /// The wrapping of a primitive: the material's where the picture is shared; in atlases that of
    /// the page.
    fn wrap(&self, material: u32, image: Option<usize>) -> [Wrap; 2] {
        let shared = image
            .is_some_and(|image| matches!(self.images[image].data, NodeImageData::Shared { .. }));
        match self.block.model.materials.get(material as usize) {
            Some(material) if shared => material.wrap,
            _ if image.is_some_and(|image| !self.wrapping.contains(&image)) => [Wrap::Clamp; 2],
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
                .map(|(vertex, place)| {
                    let uv = mesh.texcoords[*vertex as usize];
                    let chart = self.charts.of_vertex[*vertex as usize] as usize;
                    let mapping = self.mappings.get(chart).copied().flatten();
                    let (Some(mapping), Some(place)) = (mapping, self.places.get(*place as usize))
                    else {
                        return uv;
                    };
                    place.texcoord(mapping.texel(uv))
                })
                .collect(),
        };
        let source = self.block.model.materials.get(first as usize);
        Primitive {
            positions: group.vertices.iter().map(|(v, _)| mesh.positions[*v as usize]).collect(),
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
        let white = mesh.colors.is_empty()
            || group.vertices.iter().all(|(v, _)| color(*v) == [u16::MAX; 4]);
        if uniform {
            let colors = if white {
                Vec::new()
            } else {
                group.vertices.iter().map(|(v, _)| color(*v)).collect()
            };
            return (colors, base);
        }
        let colors = group.vertices.iter().map(|(vertex, _)| {
            let factor = self.base_color(mesh.materials[*vertex as usize]);
            let own = color(*vertex);
            std::array::from_fn(|channel| {
                (f32::from(own[channel]) * factor[channel].clamp(0.0, 1.0) + 0.5) as u16
            })
        });
        (colors.collect(), [1.0; 4])
    }
}
