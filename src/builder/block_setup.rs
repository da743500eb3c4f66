//! Prepares building nodes from a chunk of a model: of a block, or of a node above blocks.

use std::collections::BTreeMap;

use crate::builder::emit::disk_sink::DiskSink;
use crate::builder::hierarchy::{BlockBuilder, HierarchyOptions, Resolutions};
use crate::builder::options::BuildOptions;
use crate::builder::progress::Progress;
use crate::builder::simplify::aggregate::Extrudable;
use crate::builder::simplify::orient::reorientable;
use crate::builder::stages::{Stage, Stages};
use crate::format::{Encoding, OutputDir};
use crate::lattice::Lattice;
use crate::mesh::{AlphaMode, Material, Mesh, Model, Part, UpAxis};
use crate::texture::{
    BakeClasses, BlockTextures, SharedTextures, TextureCache, TextureOptions, TexturePlan,
    TextureUse, texture_factors,
};

/// Where nodes go, and how they are built.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// Build options.
    pub options: &'a BuildOptions,
    /// The output folder.
    pub out: &'a OutputDir,
    /// Repeating textures of the whole build.
    pub shared: &'a SharedTextures,
    /// Timers of the stages.
    pub stages: &'a Stages,
    /// Told of finished leaves.
    pub progress: &'a dyn Progress,
}

/// Rules for the materials of a model.
#[derive(Debug)]
pub struct Appearances {
    /// Which textures are cut up.
    pub textures: TexturePlan,
    /// Holds by material what [`Self::kinds`] returns.
    kinds: Vec<Option<u32>>,
    /// Which materials prisms may have.
    pub extrudable: Extrudable,
}

impl Appearances {
    /// Decides for a model whose untextured materials are merged.
    pub fn new(model: &Model) -> Self {
        Self::of(model, TexturePlan::new(model))
    }

    /// Decides for the materials of a model; `textures` says how its textures are used.
    pub fn of(model: &Model, textures: TexturePlan) -> Self {
        let is_textured = |material: u32| textures.texture_of(material).is_some();
        let classes = BakeClasses::new(&model.materials, is_textured, |_| true);
        let extrudable = Extrudable::new(model.materials.len(), is_textured, &classes);
        let kinds = kinds(&model.materials, &textures);
        Self { textures, kinds, extrudable }
    }

    /// Returns for each part the material that stands for its appearance; `None` where its colours may not
    /// leave its triangles.
    pub fn kinds(&self, parts: &[Part]) -> Vec<Option<u32>> {
        let kind = |part: &Part| self.kinds.get(part.material as usize).copied().flatten();
        parts.iter().map(kind).collect()
    }
}

/// Returns by material the first that differs from it in nothing but an image that is cut up; `None` for images
/// that repeat, and for cut-outs.
fn kinds(materials: &[Material], textures: &TexturePlan) -> Vec<Option<u32>> {
    let mut first_alike = BTreeMap::new();
    let kind = |(number, material): (u32, &Material)| {
        let Some(texture) = textures.texture_of(number) else { return Some(number) };
        let is_cut_up = textures.texture_use(texture) == TextureUse::Atlas;
        if material.alpha != AlphaMode::Opaque || !is_cut_up {
            return None;
        }
        // Zeros of either sign are one colour.
        let color = material.base_color.map(|part| (part + 0.0).to_bits());
        Some(*first_alike.entry((color, material.double_sided)).or_insert(number))
    };
    (0..).zip(materials).map(kind).collect()
}

/// Where a block is, and what its files are called.
pub struct BlockPlace {
    /// Beginning of its file names; unique in the output.
    pub prefix: String,
    /// Source coordinates of its origin.
    pub origin: [f64; 3],
    /// Of its vertices.
    pub lattice: Lattice,
}

/// What all blocks of a model have in common.
pub struct BlockSetup<'a> {
    target: Target<'a>,
    up: UpAxis,
    cache: &'a TextureCache<'a>,
    extrudable: &'a Extrudable,
    reorientable: Vec<bool>,
    /// The alpha mode of each material.
    alpha: Vec<AlphaMode>,
    hierarchy: HierarchyOptions,
}

impl<'a> BlockSetup<'a> {
    /// For the model whose textures are in `cache`.
    pub fn new(
        target: Target<'a>,
        up: UpAxis,
        cache: &'a TextureCache<'a>,
        extrudable: &'a Extrudable,
    ) -> Self {
        let mut hierarchy = target.options.hierarchy.clone();
        if target.options.quantize.is_some() {
            // Vertices are beside their planes by steps that show.
            hierarchy.tolerance.sliver_steps = hierarchy.tolerance.sliver_steps.min(1.0);
        }
        let reorientable = cache.model().materials.iter().map(reorientable).collect();
        let alpha = cache.model().materials.iter().map(|material| material.alpha).collect();
        Self { target, up, cache, extrudable, reorientable, alpha, hierarchy }
    }

    /// Returns where nodes are written.
    pub fn target(&self) -> &Target<'a> {
        &self.target
    }

    /// The pictures of a block of this mesh at all its levels.
    pub fn textures(&self, mesh: &Mesh, resolutions: &Resolutions) -> BlockTextures<'a> {
        let Target { options, shared, stages, .. } = self.target;
        let factors = resolutions.factors();
        let texture_options = TextureOptions {
            jpeg_quality: options.jpeg_quality,
            max_atlas: options.max_atlas,
            normals: options.normals,
            root_triangles: (mesh.triangles.len() as f64 / factors[0]) as usize,
        };
        stages.time(Stage::Pictures, || {
            let level_factor = f64::from(options.hierarchy.level_factor);
            let texel_factors = texture_factors(factors, level_factor);
            BlockTextures::prepare(self.cache, shared, mesh, &texel_factors, texture_options)
        })
    }

    /// Where the nodes of a block go.
    pub fn sink<'b>(&self, textures: &'b BlockTextures<'a>, place: &BlockPlace) -> DiskSink<'b>
    where
        'a: 'b,
    {
        let Target { options, out, stages, progress, .. } = self.target;
        let step = options.quantization().map(|quantization| quantization.step);
        DiskSink {
            textures,
            out,
            prefix: place.prefix.clone(),
            origin: place.origin,
            up: self.up,
            encoding: Encoding { step, compress: options.compress },
            copyright: options.copyright.as_deref(),
            textured_weight: options.textured_weight,
            stages,
            progress,
        }
    }

    /// Builds the nodes of a block.
    pub fn builder<'b>(
        &'b self,
        sink: &'b DiskSink<'b>,
        resolutions: Resolutions,
        lattice: Lattice,
    ) -> BlockBuilder<'b, DiskSink<'b>> {
        let Target { options, stages, .. } = self.target;
        BlockBuilder {
            options: &self.hierarchy,
            resolutions,
            bake: sink.textures.bake_plan().filter(|_| has_room_for_charts(options)),
            lattice,
            quantization: options.quantization(),
            up: self.up,
            reorientable: &self.reorientable,
            alpha: &self.alpha,
            repeats: sink.textures.repeats(),
            extrudable: self.extrudable,
            sink,
            stages,
        }
    }
}

/// Whether charts of their own fit into the atlases of nodes: each takes cells of up to 8 by 8
/// texels, and a node has hardly more charts than triangles.
fn has_room_for_charts(options: &BuildOptions) -> bool {
    let cells = (u64::from(options.max_atlas) / 8).pow(2);
    cells >= 4 * u64::from(options.hierarchy.desired_tris).max(1000)
}
