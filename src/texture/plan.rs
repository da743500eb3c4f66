//! Which textures are cut up and which are kept whole.

use super::charts::{self, Charts};
use crate::mesh::{Model, Wrap};

/// How a texture reaches the nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureUse {
    /// No triangle uses it.
    Unused,
    /// Its texels are used about once: each node gets a copy of those that its triangles use.
    Atlas,
    /// It repeats, or many triangles share its texels: kept whole and shared between nodes.
    Repeating,
}

/// A texture whose triangles' areas in texture space sum up to more than this many times the
/// image is shared: copies of its texels would outgrow it.
const MAX_REUSE: f64 = 1.25;

/// The use of each texture of a [`Model`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TexturePlan {
    uses: Vec<TextureUse>,
    materials: Vec<Option<u32>>,
    alpha: Vec<bool>,
}

/// Statistics of how triangles use textures. They can be summed over models.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureUsage {
    /// Area of each texture's triangles in texture space, in tiles.
    areas: Vec<f64>,
    /// Use of each texture by single triangles.
    uses: Vec<TextureUse>,
}

impl TextureUsage {
    /// Computes the statistics of a model without decoding images.
    pub fn of(model: &Model) -> Self {
        let mut areas = vec![0.0; model.textures.len()];
        let mut uses = vec![TextureUse::Unused; model.textures.len()];
        for part in &model.parts {
            let Some(material) = model.materials.get(part.material as usize) else { continue };
            let Some(texture) = material.texture.map(|texture| texture as usize) else { continue };
            if texture >= uses.len() || part.texcoords.len() != part.positions.len() {
                continue;
            }
            let triangles = part.indices.as_chunks::<3>().0;
            let charts = Charts::find(&part.texcoords, triangles.iter().copied());
            areas[texture] += triangles.iter().map(|t| uv_area(&part.texcoords, *t)).sum::<f64>();
            let whole = charts.boxes.iter().any(|chart| {
                (0..2).any(|axis| match material.wrap[axis] {
                    Wrap::Repeat => chart.exceeds_tile(axis),
                    Wrap::Mirror => true,
                    Wrap::Clamp => chart.crosses_border(axis) || chart.tile(axis) != 0.0,
                })
            });
            if whole {
                uses[texture] = TextureUse::Repeating;
            } else if uses[texture] == TextureUse::Unused {
                uses[texture] = TextureUse::Atlas;
            }
        }
        Self { areas, uses }
    }

    /// Adds that of another model, whose textures have these numbers here.
    pub fn add(&mut self, other: &Self, numbers: &[u32]) {
        let most = numbers.iter().map(|&number| number as usize + 1).max().unwrap_or(0);
        if most > self.uses.len() {
            self.areas.resize(most, 0.0);
            self.uses.resize(most, TextureUse::Unused);
        }
        for ((&number, area), used) in numbers.iter().zip(&other.areas).zip(&other.uses) {
            let number = number as usize;
            self.areas[number] += area;
            self.uses[number] = match (self.uses[number], *used) {
                (TextureUse::Repeating, _) | (_, TextureUse::Repeating) => TextureUse::Repeating,
                (TextureUse::Atlas, _) | (_, TextureUse::Atlas) => TextureUse::Atlas,
                _ => TextureUse::Unused,
            };
        }
    }
}

impl TexturePlan {
    /// Decides from the model's triangles and materials, without looking at any image.
    pub fn new(model: &Model) -> Self {
        Self::of_usage(model, TextureUsage::of(model))
    }

    /// Decides from how triangles use the textures of the model, which need not have them.
    pub fn of_usage(model: &Model, usage: TextureUsage) -> Self {
        let TextureUsage { areas, mut uses } = usage;
        for (texture, area) in uses.iter_mut().zip(areas) {
            if *texture == TextureUse::Atlas && area > MAX_REUSE {
                *texture = TextureUse::Repeating;
            }
        }
        let mut alpha = vec![false; uses.len()];
        for material in &model.materials {
            if let Some(needed) = material.texture.and_then(|index| alpha.get_mut(index as usize)) {
                *needed |= material.alpha != crate::mesh::AlphaMode::Opaque;
            }
        }
        let in_range = |texture: &u32| (*texture as usize) < uses.len();
        let materials = model.materials.iter().map(|m| m.texture.filter(in_range)).collect();
        Self { uses, materials, alpha }
    }

    /// The use of a texture; [`TextureUse::Unused`] where there is no such texture.
    pub fn texture_use(&self, texture: u32) -> TextureUse {
        self.uses.get(texture as usize).copied().unwrap_or(TextureUse::Unused)
    }

    /// The texture of a material, if it has one.
    pub fn texture_of(&self, material: u32) -> Option<u32> {
        self.materials.get(material as usize).copied().flatten()
    }

    /// True where some material that uses the texture looks at its alpha.
    pub(crate) fn needs_alpha(&self, texture: u32) -> bool {
        self.alpha.get(texture as usize).copied().unwrap_or(false)
    }

    /// The number of textures of the model.
    pub fn texture_count(&self) -> usize {
        self.uses.len()
    }

    /// The textures that these materials use, each once, ascending.
    pub fn textures_of(&self, materials: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let mut textures: Vec<u32> =
            materials.into_iter().filter_map(|material| self.texture_of(material)).collect();
        textures.sort_unstable();
        textures.dedup();
        textures
    }
}

/// The area of a triangle in texture space, in tiles.
pub(crate) fn uv_area(texcoords: &[[f32; 2]], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|vertex| charts::sane(texcoords[vertex as usize]));
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
}
