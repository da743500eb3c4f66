//! The primitives of a node's file: its triangles grouped by appearance, vertices that become
//! two where their texels went to different positions, and colours and texture coordinates of each.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::face_normals::face_normals;
use super::node::{NO_PLACEMENT, NodeBuilder};
use crate::format::{Primitive, Surface};
use crate::mesh::{AlphaMode, Normal, Wrap};

/// What primitives are told apart by, besides their image.
type AppearanceKey = (u8, u32, bool, bool);

/// The triangles of one primitive.
struct Group {
    image: Option<usize>,
    /// Vertices of the mesh and the placement of their texels.
    vertices: Vec<(u32, u32)>,
    indices: Vec<u32>,
    /// One per corner, or empty.
    normals: Vec<Normal>,
    skirt_triangles: usize,
    /// Materials in order of first use.
    materials: Vec<u32>,
}

/// The vertices that primitives have so far: one of the mesh becomes two where its triangles'
/// texels went to different positions.
struct Slots {
    /// By vertex: the placement it was first met with and its slot.
    first: Vec<Option<(u32, u32)>>,
    others: FxHashMap<(u32, u32), u32>,
}

impl Slots {
    fn new(vertices: usize) -> Self {
        Self { first: vec![None; vertices], others: FxHashMap::default() }
    }

    fn get(&mut self, vertex: u32, placement: u32, add: impl FnOnce() -> u32) -> u32 {
        match &mut self.first[vertex as usize] {
            Some((same, slot)) if *same == placement => *slot,
            Some(_) => *self.others.entry((vertex, placement)).or_insert_with(add),
            empty => empty.insert((placement, add())).1,
        }
    }
}

impl NodeBuilder<'_> {
    /// Groups the triangles by appearance.
    pub(super) fn primitives(&self) -> Vec<Primitive> {
        let mut groups: Vec<Group> = Vec::new();
        let mut by_appearance: BTreeMap<(Option<usize>, [u8; 2], AppearanceKey), usize> =
            BTreeMap::new();
        let mut last: Option<(u32, Option<usize>, usize)> = None;
        let mut slots = Slots::new(self.mesh.positions.len());
        let first_skirt = self.mesh.triangles.len() - self.skirts.triangles;
        // What has a picture is unlit.
        let is_lit = self.block.options.normals && self.placement_of.contains(&NO_PLACEMENT);
        let face_normals = if is_lit { face_normals(self.mesh, self.skirts) } else { Vec::new() };
        for (number, (triangle, placement)) in
            self.mesh.triangles.iter().zip(&self.placement_of).enumerate()
        {
            let material = self.mesh.triangle_material(*triangle);
            let image = self.placements.get(*placement as usize).map(|placement| placement.image);
            let index = match last {
                Some((same, same_image, index)) if same == material && same_image == image => index,
                _ => {
                    let key =
                        (image, self.wrap_key(material, image), self.appearance(material, image));
                    let index = *by_appearance.entry(key).or_insert_with(|| {
                        groups.push(Group {
                            image,
                            vertices: Vec::new(),
                            indices: Vec::new(),
                            normals: Vec::new(),
                            skirt_triangles: 0,
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
            group.skirt_triangles += usize::from(number >= first_skirt);
            for vertex in triangle {
                let slot = slots.get(*vertex, *placement, || {
                    group.vertices.push((*vertex, *placement));
                    group.vertices.len() as u32 - 1
                });
                group.indices.push(slot);
            }
            if image.is_none() && is_lit && !self.is_unlit(material, image) {
                let face = face_normals[number];
                group.normals.extend(triangle.map(|vertex| {
                    let own = self.mesh.normals.get(vertex as usize);
                    own.copied().filter(|own| *own != Normal::NONE).unwrap_or(face)
                }));
            }
        }
        groups.into_iter().map(|group| self.primitive(group)).collect()
    }

    /// True if a material is shown without light where it has no image.
    fn is_unlit(&self, material: u32, image: Option<usize>) -> bool {
        let material = self.block.model.materials.get(material as usize);
        image.is_none() && material.is_some_and(|material| material.is_unlit)
    }

    /// Alpha, sides and light of a material with an image, as a key.
    fn appearance(&self, material: u32, image: Option<usize>) -> AppearanceKey {
        let is_unlit = self.is_unlit(material, image);
        let Some(material) = self.block.model.materials.get(material as usize) else {
            return (0, 0, true, is_unlit);
        };
        let (mode, cutoff) = match material.alpha {
            AlphaMode::Opaque => (0, 0),
            AlphaMode::Mask { cutoff } => (1, cutoff.to_bits()),
            AlphaMode::Blend => (2, 0),
        };
        (mode, cutoff, material.double_sided, is_unlit)
    }

    /// The wrapping of a primitive: the material's where the image is a repeating texture; in
    /// atlases that of the page.
    fn wrap(&self, material: u32, image: Option<usize>) -> [Wrap; 2] {
        let repeats = image.is_some_and(|image| self.images[image].repeating().is_some());
        match self.block.model.materials.get(material as usize) {
            Some(material) if repeats => material.wrap,
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
                .map(|(vertex, placement)| {
                    let uv = mesh.texcoords[*vertex as usize];
                    let chart = self.charts.of_vertex[*vertex as usize] as usize;
                    let mapping = self.mappings.get(chart).copied().flatten();
                    let (Some(mapping), Some(placement)) =
                        (mapping, self.placements.get(*placement as usize))
                    else {
                        return uv;
                    };
                    placement.texcoord(mapping.texel(uv))
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
                is_unlit: self.is_unlit(first, group.image),
            },
            normals: group.normals,
            indices: group.indices,
            skirt_triangles: group.skirt_triangles,
        }
    }

    /// Vertex colours, where there must be some, and the factor of all of them.
    fn colors(&self, group: &Group) -> (Vec<[u16; 4]>, [f32; 4]) {
        let mesh = self.mesh;
        // Baked texels have them.
        if group.image.is_some_and(|image| self.baked_images.contains(&image)) {
            return (Vec::new(), [1.0; 4]);
        }
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
