//! Writes the results that belong to no block: upper levels, shared textures, tileset, scene and report.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use crate::builder::block_setup::Target;
use crate::builder::built::BuiltBlock;
use crate::builder::built::BuiltBlocks;
use crate::builder::emit::disk_sink::{NodeRecord, check_unique};
use crate::builder::emit::forest::{append_nodes, make_errors_monotone, set_block};
use crate::builder::emit::shared_textures::write_textures;
use crate::builder::hierarchy::Tree;
use crate::builder::inputs::fingerprint;
use crate::builder::options::BuildOptions;
use crate::builder::plan::{KnownInput, Plan};
use crate::builder::progress::Progress;
use crate::builder::reuse::PreviousBuild;
use crate::builder::scans::scans_to_bytes;
use crate::builder::simplify::ladder::BUDGET_TOLERANCE;
use crate::builder::stages::{Stage, Stages};
use crate::builder::upper::{BlockTrees, UpperBuilder, Uppers};
use crate::format::{
    BlockInfo, Node, OutputDir, REPORT_FILE, SCANS_FILE, SCENE_FILE, Scene, SharedTexture,
    fits_in_steps,
};
use crate::lattice::Quantization;
use crate::mesh::{UpAxis, Warnings};
use crate::place::{Globe, placement_of};
use crate::report::build_report::{
    Baked, BlockReport, BuildReport, Count, FileReport, InputReport, OverBudget, Quantized,
    SharedTexturesReport, StageReport, SubsetReport, level_reports, most_frequent,
};
use crate::texture::SharedTextures;
use crate::{Error, Result, tileset};

/// Finishes a build.
pub struct Finishing<'a> {
    /// Options of the build.
    pub options: &'a BuildOptions,
    /// Position of the city on the globe.
    pub globe: Option<&'a Globe>,
    /// The output in the making.
    pub output: &'a OutputDir,
    /// Timers of the stages.
    pub stages: &'a Stages,
    /// Is told of it.
    pub progress: &'a dyn Progress,
    /// A result whose nodes above blocks are taken over where they are made of the same.
    pub earlier: Option<&'a PreviousBuild>,
    /// The options, as the result has them.
    pub parameters: serde_json::Value,
    /// Which share of a build it is.
    pub subset: Option<SubsetReport>,
    /// When it began.
    pub begin: Instant,
}

impl Finishing<'_> {
    /// Writes what belongs to no block. The output is committed by the caller.
    pub fn finish(
        self,
        inputs: Vec<KnownInput>,
        plan: &Plan,
        made: BuiltBlocks,
    ) -> Result<BuildReport> {
        let Self { options, output, stages, progress, earlier, parameters, subset, .. } = self;
        let BuiltBlocks { blocks, empty: mut empty_blocks, reused_textures, shared } = made;
        empty_blocks.sort_unstable();
        let mut shared_textures = write_textures(shared, reused_textures, output)?;
        let Blocks { infos, reports: blocks, trees: of_blocks } = Blocks::of(blocks);
        let mut warnings = warnings(&inputs, &blocks, plan, earlier, self.globe);
        let Uppers { trees, reports: above, warnings: imperfect } =
            match options.upper_levels && subset.is_none() {
                true => {
                    let none = SharedTextures::new();
                    let target = Target { options, out: output, shared: &none, stages, progress };
                    let builder = UpperBuilder {
                        target,
                        earlier,
                        up: plan.up,
                        partition: &plan.partition,
                        lattice: plan.lattice,
                    };
                    builder.build(of_blocks, &mut shared_textures)?
                }
                false => {
                    let trees = of_blocks.into_values().flat_map(|block| block.trees).collect();
                    Uppers { trees, ..Uppers::default() }
                }
            };
        warnings.extend(imperfect);
        let over_budget = over_budget(&trees, &mut warnings);
        let baked = baked(&trees);
        let scene = scene_of(infos, trees, shared_textures, parameters.clone(), plan.up, &inputs)?;
        let quantization = options.quantization();
        let tilesets = stages.time(Stage::Write, || write_tilesets(&scene, output))?;
        let mut levels = level_reports(&scene);
        let mut by_id: Vec<&Node> = scene.nodes.iter().collect();
        by_id.sort_unstable_by_key(|node| node.id);
        for over in &over_budget {
            if let Ok(at) = by_id.binary_search_by_key(&over.id, |node| node.id) {
                levels[by_id[at].level as usize].over_budget += 1;
            }
        }
        let repeating: BTreeMap<&String, &u64> =
            blocks.iter().flat_map(|block| &block.repeating).collect();
        let source_texels = blocks.iter().map(|block| block.texels).sum::<u64>()
            + repeating.into_values().sum::<u64>();
        let seconds = |stage: Stage| stages.seconds(stage);
        let scans = scans_to_bytes(&inputs);
        let inputs: Vec<InputReport> = inputs.into_iter().map(|input| input.report).collect();
        let report = BuildReport {
            version: env!("CARGO_PKG_VERSION").into(),
            parameters,
            subset,
            source_triangles: inputs.iter().map(|input| input.triangles).sum(),
            source_texels,
            levels,
            shared_textures: SharedTexturesReport::of(&scene),
            stages: Stage::ALL
                .map(|stage| StageReport { stage: stage.name().into(), seconds: seconds(stage) })
                .to_vec(),
            seconds: self.begin.elapsed().as_secs_f64(),
            peak_memory_bytes: crate::builder::memory::peak_bytes(),
            outcomes: most_frequent(blocks.iter().flat_map(|block| &block.outcomes).cloned()),
            inputs,
            blocks,
            empty_blocks,
            tilesets,
            quantized: quantization.map(|quantization| quantized(&scene, quantization)),
            over_budget,
            baked,
            above,
            warnings: Count::of_warnings(&warnings),
        };
        output.write_over(SCENE_FILE, &scene.to_bytes()?)?;
        output.write_over(SCANS_FILE, &scans)?;
        output.write_over(REPORT_FILE, report.to_json()?.as_bytes())?;
        Ok(report)
    }
}

/// All blocks, numbered.
pub(super) struct Blocks {
    pub infos: Vec<BlockInfo>,
    pub reports: Vec<BlockReport>,
    pub trees: BTreeMap<u32, BlockTrees>,
}

impl Blocks {
    /// Numbers built blocks by cell and sets the numbers in their trees.
    pub fn of(blocks: BTreeMap<u32, Vec<BuiltBlock>>) -> Self {
        let mut all = Self { infos: Vec::new(), reports: Vec::new(), trees: BTreeMap::new() };
        for (cell, blocks) in blocks {
            for BuiltBlock { info, mut trees, report } in blocks {
                for tree in &mut trees {
                    make_errors_monotone(tree);
                    set_block(tree, all.infos.len() as u32);
                }
                let of_cell = all.trees.entry(cell).or_default();
                of_cell.names.push(report.name.clone());
                of_cell.trees.extend(trees);
                all.infos.push(info);
                all.reports.push(report);
            }
        }
        all
    }
}

fn write_tilesets(scene: &Scene, output: &OutputDir) -> Result<Vec<FileReport>> {
    // The placement is read back from the parameters, as readers of the scene do.
    let placement = placement_of(&scene.parameters)?;
    let mut reports = Vec::new();
    for file in tileset::files(scene, &placement)? {
        output.write(&file.path, &file.bytes)?;
        reports.push(FileReport::of(&file.path, &file.bytes));
    }
    Ok(reports)
}

/// Collects the warnings of inputs, blocks and placement.
fn warnings(
    inputs: &[KnownInput],
    blocks: &[BlockReport],
    plan: &Plan,
    earlier: Option<&PreviousBuild>,
    globe: Option<&Globe>,
) -> Warnings {
    let mut warnings = Warnings::default();
    for warning in inputs.iter().flat_map(|input| &input.report.warnings) {
        warnings.add(&warning.text, warning.count);
    }
    let first = plan.up;
    let others = inputs.iter().filter(|input| input.report.up != first).count() as u64;
    warnings.add(
        format!("input with another up axis than the first ({first:?}); set --up to choose one"),
        others,
    );
    if plan.is_coarser {
        let what = format!(
            "blocks too large for the step that was asked for; rounded to {} m",
            plan.lattice.step
        );
        warnings.add(what, 1);
    }
    for warning in blocks.iter().flat_map(|block| &block.warnings) {
        warnings.add(&warning.text, warning.count);
    }
    let of_textures: BTreeSet<&String> =
        blocks.iter().flat_map(|block| &block.texture_warnings).collect();
    of_textures.into_iter().for_each(|text| warnings.add(text, 1));
    // The result of a build that was stopped has no tileset either.
    let has_none =
        |earlier: &PreviousBuild| earlier.report.tilesets.is_empty() && !earlier.is_unfinished();
    if earlier.is_some_and(has_none) {
        let file = crate::format::TILESET_FILE;
        let text =
            format!("earlier result without {file} (by an older version): added to its nodes");
        warnings.add(text, 1);
    }
    if let Some(caveat) = globe.and_then(Globe::caveat) {
        warnings.add(caveat, 1);
    }
    warnings
}

fn quantized(scene: &Scene, quantization: Quantization) -> Quantized {
    let Quantization { step } = quantization;
    let is_large = |node: &&Node| !fits_in_steps(node.bbox_min, node.bbox_max, step);
    Quantized {
        step_metres: step,
        bound_metres: quantization.bound(),
        large_nodes: scene.nodes.iter().filter(is_large).count() as u64,
    }
}

/// The nodes that have more triangles than they may, by id.
pub(super) fn over_budget(trees: &[Tree<NodeRecord>], warnings: &mut Warnings) -> Vec<OverBudget> {
    let mut over_budget = Vec::new();
    for tree in trees {
        tree.for_each(&mut |record: &NodeRecord| {
            over_budget.extend(record.reason.clone().map(|reason| OverBudget {
                id: record.id,
                file: record.file.clone(),
                budget: record.budget as u64,
                triangles: u64::from(record.attributes.triangles),
                reason,
            }));
        });
    }
    over_budget.sort_by_key(|over| over.id);
    warnings.add(
        format!(
            "node with more than {:.0} % above its triangle budget (see over_budget in {})",
            (BUDGET_TOLERANCE - 1.0) * 100.0,
            REPORT_FILE
        ),
        over_budget.len() as u64,
    );
    over_budget
}

/// The nodes with textures of their own, by id.
pub(super) fn baked(trees: &[Tree<NodeRecord>]) -> Vec<Baked> {
    let mut baked = Vec::new();
    for tree in trees {
        tree.for_each(&mut |record: &NodeRecord| {
            let entry = |reason| Baked { id: record.id, file: record.file.clone(), reason };
            baked.extend(record.baked.map(entry));
        });
    }
    baked.sort_by_key(|baked: &Baked| baked.id);
    baked
}

/// Joins trees to a scene.
pub(super) fn scene_of(
    blocks: Vec<BlockInfo>,
    trees: Vec<Tree<NodeRecord>>,
    shared_textures: BTreeMap<String, SharedTexture>,
    parameters: serde_json::Value,
    up: UpAxis,
    inputs: &[KnownInput],
) -> Result<Scene> {
    let numbers: BTreeMap<String, u32> = shared_textures.keys().cloned().zip(0u32..).collect();
    let mut nodes = Vec::new();
    for mut tree in trees {
        make_errors_monotone(&mut tree);
        append_nodes(&mut nodes, tree, &numbers);
    }
    if nodes.is_empty() {
        return Err(Error::Internal("a build without nodes".into()));
    }
    let mut ids: Vec<_> = nodes.iter().map(|node| (node.id, node.file.clone())).collect();
    check_unique(&mut ids)?;
    Ok(Scene {
        fingerprint: fingerprint(&parameters, inputs.iter().map(|input| &input.report)),
        parameters,
        up,
        blocks,
        shared_textures: shared_textures.into_values().collect(),
        nodes,
    })
}
