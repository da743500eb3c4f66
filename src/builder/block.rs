//! From one imported model to the trees of its blocks.

use std::path::Path;

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::Result;
use crate::builder::block_setup::{BlockPlace, BlockSetup, Looks, Target};
use crate::builder::blocks::block_plan::{BlockPlan, Division};
use crate::builder::blocks::gather::{divide, gather, localise};
use crate::builder::blocks::merge_adjacent::plan_of_parts;
use crate::builder::blocks::merge_untextured::merge_untextured;
use crate::builder::blocks::outliers::set_outliers_aside;
use crate::builder::blocks::plan::plan;
use crate::builder::border::shared::{
    Bounds, bounds_of, is_of_shared, keep_shared, shared_positions,
};
use crate::builder::cut::split::Chunk;
use crate::builder::emit::disk_sink::{NodeRecord, file_name};
use crate::builder::hierarchy::{BorderMode, Forest, HierarchyOptions, LeftOut, Resolutions, Tree};
use crate::builder::options::BuildOptions;
use crate::builder::simplify::aggregate::BodyRules;
use crate::builder::stages::{Stage, Stages};
use crate::builder::stitch::{OpenEdge, Stitch, stitches};
use crate::builder::threads::in_parallel;
use crate::builder::tiles::border::InputBorder;
use crate::format::BlockInfo;
use crate::lattice::Lattice;
use crate::lattice::Quantization;
use crate::mesh::{Material, Model, Part, PositionKey, UpAxis, Warnings, key};
use crate::report::build_report::{BlockCut, LeftOutNode};
use crate::texture::TextureCache;

/// A block whose nodes are written.
#[derive(Clone, Debug)]
pub struct BuiltBlock {
    /// For `scene.hlod`.
    pub info: BlockInfo,
    /// Its nodes: one tree, or several where roots are left out.
    pub trees: Vec<Tree<NodeRecord>>,
}

impl BuiltBlock {
    /// Visits all records, parents first.
    pub fn for_each<'a>(&'a self, visit: &mut impl FnMut(&'a NodeRecord)) {
        self.trees.iter().for_each(|tree| tree.for_each(visit));
    }
}

/// The blocks of one input.
pub struct BuiltInput {
    /// In the order of the source.
    pub blocks: Vec<BuiltBlock>,
    /// Coarse nodes that are not written, by file.
    pub left_out: Vec<LeftOutNode>,
    /// Different source texels that its triangles use, repeating textures aside.
    pub used_texels: u64,
    /// Open edges between which there are stitches ([`crate::builder::stitch`]).
    pub stitched_edges: u64,
    /// The planes that divided it, in order.
    pub cuts: Vec<BlockCut>,
    /// What was imperfect.
    pub warnings: Warnings,
}

/// A block about to be gathered.
struct Draft {
    name: String,
    /// Strays, on a lattice of their own.
    far: bool,
    source: DraftSource,
    materials: Vec<u32>,
}

enum DraftSource {
    Parts(Vec<Part>, Vec<Stitch>),
    Chunk(Box<Chunk<f64>>),
}

impl DraftSource {
    fn positions(&self) -> Box<dyn Iterator<Item = [f64; 3]> + '_> {
        match self {
            Self::Parts(parts, _) => {
                Box::new(parts.iter().flat_map(|part| part.positions.iter().copied()))
            }
            Self::Chunk(chunk) => Box::new(chunk.mesh.positions.iter().copied()),
        }
    }

    /// Positions that no cut made: those on a cutting plane are the plane's business.
    fn uncut_positions(&self) -> Box<dyn Iterator<Item = [f64; 3]> + '_> {
        match self {
            Self::Parts(..) => self.positions(),
            Self::Chunk(chunk) => {
                let bits = 0..chunk.path.len() as u32;
                let shared = bits.filter(|&bit| is_of_shared(chunk.path.plane(bit)));
                let shared = shared.fold(0u64, |bits, bit| bits | 1 << bit);
                let of_plane = chunk.mesh.positions.iter().zip(&chunk.border.planes);
                let uncut = of_plane.filter(move |&(_, &on)| on == 0 || on & shared != 0);
                Box::new(uncut.map(|(position, _)| *position))
            }
        }
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        bounds_of(self.positions())
    }
}

/// Builds all blocks of a model and writes their nodes.
pub fn build_input(
    mut model: Model,
    up: UpAxis,
    border: &InputBorder,
    target: Target,
) -> Result<BuiltInput> {
    let Target { options, stages, progress, .. } = target;
    let mut warnings = std::mem::take(&mut model.warnings);
    let quantization = options.quantization();
    let of_tile = border.bounds.map(|_| Lattice::for_tile(model.bounds()));
    merge_untextured(&mut model);
    let HierarchyOptions { desired_tris, constants, .. } = &options.hierarchy;
    let looks = Looks::new(&model);
    let kinds = looks.kinds(&model.parts);
    let stitches = stages.time(Stage::Gather, || {
        let shared = border.positions();
        let goes_on = |edge: &OpenEdge| edge.ends.iter().all(|end| shared.contains(&key(*end)));
        stitches(&model.parts, kinds, &constants.stitch, goes_on)
    });
    let Looks { textures: texture_plan, extrudable, .. } = looks;
    // Where textures are many and small enough to keep a root from being what it should, they are
    // baked anew.
    let rules =
        BodyRules { up, extrudable: extrudable.materials(true), constants: &constants.prisms };
    let plans = plan(&model, options.blocks, *desired_tris, &stitches, &constants.blocks, &rules);
    let stitched_edges = stitches.len() as u64;
    let (stitches, across) = by_plan(&plans, stitches, model.parts.len());
    let drafts = drafts(&mut model, plans, stitches, border, options, &rules, stages);
    let lattice_of = |drafts: &mut dyn Iterator<Item = &Draft>| {
        let fine = lattice_of(drafts);
        let fine = of_tile.map_or(fine, |of_tile| fine.coarser(of_tile));
        if let Some(Quantization { step }) = quantization.filter(|coarse| coarse.step < fine.step) {
            let what = format!(
                "{}: blocks too large for steps of {step} m; rounded to {} m",
                model.source.display(),
                fine.step
            );
            return (fine, Some(what));
        }
        (fine.or_coarser(quantization), None)
    };
    let (common, coarse) = lattice_of(&mut drafts.iter().filter(|draft| !draft.far));
    if let Some(what) = coarse {
        warnings.add(what, 1);
    }
    let cuts = cuts(&drafts, border, common);
    let shared_vertices = stages.time(Stage::Gather, || {
        let bounds: Vec<_> = drafts.iter().map(|draft| draft.source.bounds()).collect();
        let mut shared = shared_positions(&bounds, |block| drafts[block].source.uncut_positions());
        shared.extend(across);
        shared
    });
    let cache = TextureCache::new(
        &model,
        &texture_plan,
        drafts.iter().map(|draft| draft.materials.iter().copied()),
    );
    let prefix = file_prefix(&model.source);
    let setup = BlockSetup::new(target, up, &cache, &extrudable);
    let built = in_parallel(drafts, |number, draft| {
        let (lattice, coarse) =
            if draft.far { lattice_of(&mut [&draft].into_iter()) } else { (common, None) };
        let Draft { name, source, .. } = draft;
        let (low, high) = source.bounds();
        let origin = lattice.origin_near(std::array::from_fn(|i| (low[i] + high[i]) * 0.5));
        let (chunk, collapsed) = stages.time(Stage::Gather, || {
            let mut chunk = match source {
                DraftSource::Parts(parts, stitches) => {
                    let mut chunk = gather(&model.materials, &parts, &stitches);
                    border.mark(&mut chunk);
                    chunk
                }
                DraftSource::Chunk(chunk) => *chunk,
            };
            keep_shared(&mut chunk, &shared_vertices);
            localise(chunk, origin, lattice, quantization.is_some())
        });
        let mut warnings = Warnings::default();
        if let Some(what) = coarse {
            warnings.add(what, 1);
        }
        warnings.add(
            format!(
                "{}: triangle thinner than the precision of its block ({:e} m) left out",
                model.source.display(),
                lattice.step
            ),
            collapsed,
        );
        if chunk.mesh.triangles.is_empty() {
            progress.built(collapsed);
            return Ok((None, warnings, 0));
        }
        let resolutions = Resolutions::new(chunk.mesh.triangles.len(), &options.hierarchy);
        let place = BlockPlace { prefix: format!("{prefix}-{number:04}"), origin, lattice };
        let textures = setup.textures(&chunk.mesh, &resolutions);
        let sink = setup.sink(&textures, &place);
        let builder = setup.builder(&sink, resolutions, lattice);
        let Forest { trees, left_out } = builder.build(chunk)?;
        let left_out = left_out.into_iter().map(|LeftOut { child_path, triangles, kept }| {
            LeftOutNode { file: file_name(&sink.prefix, &child_path), triangles, kept }
        });
        let info =
            BlockInfo { name, input: crate::builder::inputs::text_of(&model.source), origin };
        let block = BuiltBlock { info, trees };
        Ok((Some((block, left_out.collect())), warnings, textures.used_texels()))
    })?;
    let mut blocks = Vec::with_capacity(built.len());
    let mut left_out: Vec<LeftOutNode> = Vec::new();
    let mut used_texels = 0;
    for (block, block_warnings, texels) in built {
        if let Some((block, of_block)) = block {
            blocks.push(block);
            left_out.extend::<Vec<_>>(of_block);
        }
        warnings.extend(block_warnings);
        used_texels += texels;
    }
    warnings.extend(cache.warnings());
    left_out.sort_by(|a, b| a.file.cmp(&b.file));
    Ok(BuiltInput { blocks, left_out, used_texels, stitched_edges, cuts, warnings })
}

/// The planes that divided drafts and those along which they meet other inputs, as their nodes have them.
fn cuts(drafts: &[Draft], border: &InputBorder, lattice: Lattice) -> Vec<BlockCut> {
    let chunks = drafts.iter().filter_map(|draft| match &draft.source {
        DraftSource::Chunk(chunk) => Some(chunk),
        DraftSource::Parts(..) => None,
    });
    let planes =
        chunks.flat_map(|chunk| (0..chunk.path.len() as u32).map(|bit| chunk.path.plane(bit)));
    let planes = planes.filter(|plane| !is_of_shared(plane));
    let mut cuts: Vec<BlockCut> = planes
        .map(|plane| (plane.axis, plane.coordinate))
        .chain(border.planes())
        .map(|(axis, coordinate)| BlockCut { axis, coordinate: lattice.round(coordinate) + 0.0 })
        .collect();
    cuts.sort_by(|a, b| a.axis.cmp(&b.axis).then(a.coordinate.total_cmp(&b.coordinate)));
    cuts.dedup();
    cuts
}

/// The stitches within each plan, and the positions between which there are stitches from one plan
/// to another. These stay at every level, as those do that blocks have in common.
fn by_plan(
    plans: &[BlockPlan],
    stitches: Vec<Stitch>,
    parts: usize,
) -> (Vec<Vec<Stitch>>, FxHashSet<PositionKey<f64>>) {
    let plan_of = plan_of_parts(plans, parts);
    let mut within = vec![Vec::new(); plans.len()];
    let mut across = FxHashSet::default();
    for stitch in stitches {
        let [a, b] = stitch.parts.map(|part| plan_of[part as usize]);
        if a == b {
            within[a].push(stitch);
        } else {
            across.extend([stitch.edge[0], stitch.edge[1], stitch.apex].map(key));
        }
    }
    (within, across)
}

/// Takes the parts out of the model and divides those blocks that are to be divided.
fn drafts(
    model: &mut Model,
    plans: Vec<BlockPlan>,
    stitches: Vec<Vec<Stitch>>,
    border: &InputBorder,
    options: &BuildOptions,
    rules: &BodyRules,
    stages: &Stages,
) -> Vec<Draft> {
    let mut parts: Vec<Option<Part>> =
        std::mem::take(&mut model.parts).into_iter().map(Some).collect();
    let planned: Vec<(BlockPlan, Vec<Part>)> = plans
        .into_iter()
        .map(|plan| {
            let parts = plan.parts.iter().filter_map(|&number| parts[number].take()).collect();
            (plan, parts)
        })
        .collect();
    // Edges that a plan shares with another are not divided where it is: the other would not know.
    let any_divided = planned.iter().any(|(plan, _)| plan.divide != Division::Whole);
    let shared = match any_divided && planned.len() > 1 {
        true => stages.time(Stage::Gather, || shared_by_parts(&planned)),
        false => FxHashSet::default(),
    };
    let materials = &model.materials;
    let drafting = Drafting { materials, shared: &shared, border, options, rules, stages };
    let drafts_of = |((plan, parts), stitches)| drafting.drafts(plan, parts, stitches);
    let drafts: Vec<Vec<Draft>> = planned.into_par_iter().zip(stitches).map(drafts_of).collect();
    drafts.into_iter().flatten().collect()
}

/// Positions that the parts of several plans use.
fn shared_by_parts(planned: &[(BlockPlan, Vec<Part>)]) -> FxHashSet<PositionKey<f64>> {
    let positions = |plan: usize| {
        let parts: &[Part] = &planned[plan].1;
        parts.iter().flat_map(|part| &part.positions).copied()
    };
    let bounds: Vec<Bounds> = (0..planned.len()).map(|plan| bounds_of(positions(plan))).collect();
    shared_positions(&bounds, positions)
}

/// What dividing a plan needs to know.
struct Drafting<'a> {
    materials: &'a [Material],
    /// Positions that several plans use.
    shared: &'a FxHashSet<PositionKey<f64>>,
    border: &'a InputBorder,
    options: &'a BuildOptions,
    rules: &'a BodyRules<'a>,
    stages: &'a Stages,
}

impl Drafting<'_> {
    fn drafts(&self, plan: BlockPlan, parts: Vec<Part>, stitches: Vec<Stitch>) -> Vec<Draft> {
        let &Self { materials, shared, border, options, rules, stages } = self;
        let BlockPlan { name, divide: division, .. } = plan;
        let mut drafts = Vec::new();
        let stray = stages.time(Stage::Gather, || set_outliers_aside(&parts));
        let (parts, far) = stray.unwrap_or((parts, Vec::new()));
        if !far.is_empty() {
            let name = format!("{name} (far off)");
            let materials = materials_of(far.iter().map(|part| part.material).collect());
            drafts.push(Draft {
                name,
                far: true,
                source: DraftSource::Parts(far, Vec::new()),
                materials,
            });
        }
        if division == Division::Whole {
            let materials = materials_of(parts.iter().map(|part| part.material).collect());
            let source = DraftSource::Parts(parts, stitches);
            drafts.push(Draft { name, far: false, source, materials });
            return drafts;
        }
        let mut chunk = stages.time(Stage::Gather, || gather(materials, &parts, &stitches));
        drop(stitches);
        drop(parts);
        border.mark(&mut chunk);
        keep_shared(&mut chunk, shared);
        chunk.moved = options.quantize.map(|_| vec![0.0; chunk.mesh.positions.len()]);
        let most = match division {
            Division::Halves(most) => {
                let bodies = stages.time(Stage::Gather, || rules.crowd(&chunk.mesh)).max(1);
                let share = most.bodies as f64 / bodies as f64;
                most.triangles.min((chunk.mesh.triangles.len() as f64 * share) as usize)
            }
            Division::Whole | Division::Grid { .. } => chunk.mesh.triangles.len(),
        };
        // The blocks' own factors are not known yet; those of the largest serve all.
        let resolutions =
            Resolutions::new(most.min(chunk.mesh.triangles.len()), &options.hierarchy);
        let shares: Vec<f64> = match options.hierarchy.borders {
            BorderMode::Locked => vec![1.0],
            BorderMode::Skirts => {
                resolutions.factors().iter().map(|factor| 1.0 / factor.sqrt()).collect()
            }
        };
        let constants = &options.hierarchy.constants;
        let chunks =
            divide(chunk, division, &shares, options.quantization(), constants, rules, stages);
        let several = chunks.len() > 1;
        for (number, chunk) in chunks.into_iter().enumerate() {
            let materials = materials_of(chunk.mesh.materials.clone());
            let name = if several { format!("{name} {}", number + 1) } else { name.clone() };
            let source = DraftSource::Chunk(Box::new(chunk));
            drafts.push(Draft { name, far: false, source, materials });
        }
        drafts
    }
}

/// Each material once.
fn materials_of(mut materials: Vec<u32>) -> Vec<u32> {
    materials.sort_unstable();
    materials.dedup();
    materials
}

/// One lattice for all blocks of an input, so that blocks that touch agree on where.
fn lattice_of<'a>(drafts: impl IntoIterator<Item = &'a Draft>) -> Lattice {
    let (mut extent, mut magnitude) = (0f64, 0f64);
    for draft in drafts {
        let (low, high) = draft.source.bounds();
        for i in 0..3 {
            extent = extent.max(high[i] - low[i]);
            magnitude = magnitude.max(low[i].abs()).max(high[i].abs());
        }
    }
    Lattice::for_extent(extent, magnitude)
}

/// The beginning of an input's file names: its name for people, a hash of its path for programs.
fn file_prefix(input: &Path) -> String {
    let stem = input.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let plain: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(40).collect();
    let hash = blake3::hash(crate::builder::inputs::text_of(input).as_bytes()).to_hex();
    format!("{plain}-{}", &hash.as_str()[..6])
}
