//! The materials and textures of a block as one model, whichever inputs they are of.
//!
//! Materials that look alike are one, whichever input has them. Untextured materials that differ in colour
//! only become one with vertex colours ([`Folding`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::builder::block_setup::Appearances;
use crate::builder::folding::Folding;
use crate::mesh::{Material, Model, Part, TextureData, TextureSource, Warnings};
use crate::texture::{TexturePlan, TextureUsage};

/// The materials and textures of an input, and how all of its triangles use these.
#[derive(Debug)]
pub struct InputAppearance {
    /// Without triangles.
    pub model: Model,
    usage: TextureUsage,
}

impl InputAppearance {
    /// Takes those of a model, which keeps its triangles alone.
    pub fn take(model: &mut Model) -> Self {
        let usage = TextureUsage::of(model);
        let own = Model {
            source: model.source.clone(),
            dependencies: Vec::new(),
            groups: std::mem::take(&mut model.groups),
            parts: Vec::new(),
            materials: std::mem::take(&mut model.materials),
            textures: std::mem::take(&mut model.textures),
            up: model.up,
            warnings: Warnings::default(),
        };
        Self { model: own, usage }
    }
}

/// Materials that are being collected.
#[derive(Debug, Default)]
pub struct Collecting {
    materials: Vec<Material>,
    textures: Vec<TextureSource>,
    /// Material number by appearance (all properties but the name).
    looks: BTreeMap<String, u32>,
    /// Texture number by file and opacity file.
    files: BTreeMap<(PathBuf, Option<PathBuf>), u32>,
    /// The input that each texture was first met in.
    inputs: Vec<PathBuf>,
    usage: TextureUsage,
    is_used: Vec<bool>,
}

impl Collecting {
    /// Adds those of an input, of which a block has some parts, and gives the parts their numbers here.
    pub fn add<'a>(&mut self, looks: &InputAppearance, parts: impl Iterator<Item = &'a mut Part>) {
        let InputAppearance { model, usage } = looks;
        let textures: Vec<u32> =
            model.textures.iter().map(|texture| self.texture(texture, &model.source)).collect();
        self.usage.add(usage, &textures);
        let numbers: Vec<u32> =
            model.materials.iter().map(|material| self.material(material, &textures)).collect();
        for part in parts {
            if let Some(&number) = numbers.get(part.material as usize) {
                part.material = number;
                self.is_used[number as usize] = true;
            }
        }
    }

    fn texture(&mut self, texture: &TextureSource, input: &Path) -> u32 {
        let next = self.textures.len() as u32;
        if let TextureData::File(file) = &texture.data {
            let known = *self.files.entry((file.clone(), texture.opacity.clone())).or_insert(next);
            if known != next {
                return known;
            }
        }
        self.textures.push(texture.clone());
        self.inputs.push(input.to_path_buf());
        next
    }

    fn material(&mut self, material: &Material, textures: &[u32]) -> u32 {
        let texture = material.texture.and_then(|at| textures.get(at as usize).copied());
        let own = Material { texture, ..material.clone() };
        let look = format!("{:?}", Material { name: String::new(), ..own.clone() });
        let next = self.materials.len() as u32;
        let number = *self.looks.entry(look).or_insert(next);
        if number == next {
            self.materials.push(own);
            self.is_used.push(false);
        }
        number
    }

    /// All that there are.
    pub fn finish(mut self) -> BlockMaterials {
        let folding = Folding::new(&mut self.materials, &self.is_used);
        let count = self.textures.len();
        let mut usage = self.usage;
        usage.add(&TextureUsage::default(), &(0..count as u32).collect::<Vec<_>>());
        let model = Model {
            source: PathBuf::new(),
            dependencies: Vec::new(),
            groups: Vec::new(),
            parts: Vec::new(),
            materials: self.materials,
            textures: self.textures,
            up: None,
            warnings: Warnings::default(),
        };
        let looks = Appearances::of(&model, TexturePlan::of_usage(&model, usage));
        BlockMaterials { model, looks, folding, inputs: self.inputs }
    }
}

/// The materials and textures of a block.
#[derive(Debug)]
pub struct BlockMaterials {
    /// Without triangles.
    pub model: Model,
    /// Properties of its materials.
    pub looks: Appearances,
    folding: Folding,
    inputs: Vec<PathBuf>,
}

impl BlockMaterials {
    /// Gives a part what its material has become.
    pub fn fold(&self, part: &mut Part) {
        self.folding.apply(part);
    }

    /// The input that a texture was first met in.
    pub fn input_of(&self, texture: usize) -> &Path {
        self.inputs.get(texture).map_or(Path::new(""), PathBuf::as_path)
    }
}
