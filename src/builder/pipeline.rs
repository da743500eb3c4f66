//! The whole build: inputs one after another, blocks in parallel, everything in its place at the
//! end or nothing changed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;

use crate::builder::block::{BuiltBlock, build_input};
use crate::builder::block_setup::Target;
use crate::builder::checkpoint::Checkpoints;
use crate::builder::copyright;
use crate::builder::districts::{Above, Districts, build_districts};
use crate::builder::emit::disk_sink::{NodeRecord, check_unique};
use crate::builder::emit::forest::{append_nodes, make_errors_monotone, set_block};
use crate::builder::emit::shared_textures::write_textures;
use crate::builder::hierarchy::Tree;
use crate::builder::inputs::{describe, fingerprint, text_of};
use crate::builder::merge::Subsets;
use crate::builder::options::BuildOptions;
use crate::builder::plan::Plan;
use crate::builder::prepare::{Prepared, Preparing};
use crate::builder::progress::Progress;
use crate::builder::reuse::Earlier;
use crate::builder::simplify::ladder::BUDGET_TOLERANCE;
use crate::builder::simplify::simplified::LadderStep;
use crate::builder::sources::Sources;
use crate::builder::stages::{Stage, Stages};
use crate::builder::subset::Subset;
use crate::builder::tiles::border::InputBorder;
use crate::format::{
    BlockInfo, Node, OutputDir, REPORT_FILE, SCENE_FILE, SUBSETS_DIR, Scene, SharedTexture,
    Unfinished, check_apart, fits_in_steps,
};
use crate::lattice::Quantization;
use crate::mesh::{UpAxis, Warnings};
use crate::place::Globe;
use crate::place::placement_of;
use crate::report::build_report::{
    Baked, BlockCut, BuildReport, Count, FileReport, InputReport, OverBudget, Quantized,
    SharedTexturesReport, StageReport, SubsetReport, level_reports,
};
use crate::texture::{BakeReason, SharedTextures};
use crate::{Error, Result, import, tileset};

/// How a build ended.
#[derive(Debug)]
pub enum Outcome {
    /// Nothing had changed; nothing was done. Holds the report of the build that made the result.
    UpToDate(BuildReport),
    /// A new result stands in the output folder.
    Built(BuildReport),
}

/// Builds `out` from model files and folders.
pub fn build(
    arguments: &[PathBuf],
    out: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Outcome> {
    let subsets = out.join(SUBSETS_DIR);
    if subsets.exists() {
        let what =
            "holds subsets, which hlod-build merge joins; choose another folder, or remove them";
        return Err(Error::output(&subsets, what));
    }
    run(arguments, out, options, None, progress)
}

/// Builds a share of what [`build`] builds, into a folder of `out`: all shares together, on any machines,
/// are joined by [`merge_subsets`]. Arguments and options are those of the whole, and paths must be the same
/// on all machines, since files of nodes are named by them.
pub fn build_subset(
    arguments: &[PathBuf],
    out: &Path,
    options: &BuildOptions,
    subset: Subset,
    progress: &dyn Progress,
) -> Result<Outcome> {
    run(arguments, out, options, Some(subset), progress)
}

/// Joins all subsets that stand in `out` to what [`build`] would have built of all inputs, and removes
/// them. Inputs are not read again.
pub fn merge_subsets(out: &Path, progress: &dyn Progress) -> Result<BuildReport> {
    let begin = Instant::now();
    let subsets = Subsets::open(out)?;
    let parameters = subsets.parameters().clone();
    let options = BuildOptions::from_json(&parameters)?;
    let output = OutputDir::create(out)?;
    let globe = options.placement.globe()?;
    let run = Run {
        globe: globe.as_ref(),
        options: &options,
        output: &output,
        shared: SharedTextures::new(),
        stages: &Stages::default(),
        progress,
    };
    let mut done = Done::default();
    for (input, result) in subsets.inputs() {
        progress.found(input.triangles);
        run.take_over(input, result, &mut done)?;
    }
    progress.finishing();
    let earlier = Earlier::open(out, &parameters);
    done.repeating_texels = subsets.repeating_texels();
    let report = run.finish(done, earlier.as_ref(), parameters, None, begin)?;
    output.commit()?;
    Ok(report)
}

fn run(
    arguments: &[PathBuf],
    out: &Path,
    options: &BuildOptions,
    subset: Option<Subset>,
    progress: &dyn Progress,
) -> Result<Outcome> {
    let begin = Instant::now();
    options.check()?;
    let globe = options.placement.globe()?;
    let files = import::find_inputs(arguments)?;
    let copyright = copyright::joined(&files, options.copyright.as_deref());
    let options = &BuildOptions { copyright, ..options.clone() };
    // A folder that was given counts as a whole: what is built into it would be an input the next
    // time.
    check_apart(out, arguments.iter().chain(&files))?;
    let target = subset.map_or_else(|| out.to_owned(), |subset| subset.dir(out));
    let stages = Stages::default();
    let parameters = options.to_json();
    let unfinished = if options.resume { Unfinished::find(&target) } else { None };

    // What a subset has not built before may be in the result of a merge.
    let open = |dir: &Path| Earlier::open(dir, &parameters);
    let known = || open(&target).or_else(|| open(out));
    let stopped = || unfinished.as_ref().and_then(|unfinished| open(unfinished.path()));
    let earlier = if options.force { None } else { stopped().or_else(known) };
    let folder = existing_folder(&target);
    let (sources, all_inputs) = stages.time(Stage::Import, || {
        Sources::divide(files, options, earlier.as_ref(), &folder, progress)
    })?;
    let inputs = match subset {
        Some(subset) => subset.pick(&all_inputs, &sources)?,
        None => all_inputs.clone(),
    };
    let part = subset.map(|subset| SubsetReport {
        subset,
        all_inputs: all_inputs.iter().map(|input| text_of(input)).collect(),
    });
    let preparing = Preparing {
        options,
        sources: &sources,
        globe: globe.as_ref(),
        stages: &stages,
        inputs: all_inputs.len(),
    };
    let beside = subset.map(|_| out.join(SUBSETS_DIR));
    let Plan { still_good, borders, prepared } =
        Plan::new(&all_inputs, &inputs, beside.as_deref(), earlier.as_ref(), &preparing, progress)?;
    if let Some(earlier) = &earlier
        && still_good.iter().all(Option::is_some)
        && earlier.report.inputs.len() == inputs.len()
        && earlier.report.subset == part
        && earlier.tileset
    {
        return Ok(Outcome::UpToDate(earlier.report.clone()));
    }

    let output = OutputDir::create(&target)?;
    let run = Run {
        options,
        globe: globe.as_ref(),
        output: &output,
        shared: SharedTextures::new(),
        stages: &stages,
        progress,
    };
    let done =
        run.inputs(&inputs, &still_good, (borders, prepared), earlier.as_ref(), &preparing)?;
    progress.finishing();
    let report = run.finish(done, earlier.as_ref(), parameters, part, begin)?;
    output.commit()?;
    if let Some(unfinished) = unfinished {
        unfinished.remove();
    }
    Ok(Outcome::Built(report))
}

/// The folder in which an output will stand, or the nearest above it that is there.
fn existing_folder(out: &Path) -> PathBuf {
    let path = std::path::absolute(out).unwrap_or_else(|_| out.to_path_buf());
    let above = path.ancestors().skip(1).find(|folder| folder.is_dir());
    above.map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// What all steps of a build share.
struct Run<'a> {
    options: &'a BuildOptions,
    globe: Option<&'a Globe>,
    output: &'a OutputDir,
    shared: SharedTextures,
    stages: &'a Stages,
    progress: &'a dyn Progress,
}

/// What has come of inputs, in their order.
#[derive(Default)]
pub(super) struct Done {
    pub(super) reports: Vec<InputReport>,
    pub(super) blocks: Vec<BuiltBlock>,
    /// Shared textures of earlier results, by name.
    pub(super) reused_textures: BTreeMap<String, SharedTexture>,
    /// Texels of repeating textures that sources of subsets use.
    repeating_texels: u64,
}

impl Run<'_> {
    /// Links what an earlier result has of an input.
    fn take_over(&self, input: &InputReport, earlier: &Earlier, done: &mut Done) -> Result<()> {
        let taken = earlier.take_over(input, self.output)?;
        self.progress.built(input.triangles);
        done.reused_textures.extend(taken.shared_textures);
        done.blocks.extend(taken.blocks);
        done.reports.push(input.clone());
        Ok(())
    }

    /// Builds inputs one after another, with these borders and of them what was read already, or takes over what
    /// `still_good` says of them.
    fn inputs(
        &self,
        inputs: &[PathBuf],
        still_good: &[Option<InputReport>],
        (borders, mut prepared): (Vec<InputBorder>, BTreeMap<PathBuf, Prepared>),
        earlier: Option<&Earlier>,
        preparing: &Preparing,
    ) -> Result<Done> {
        let mut done = Done::default();
        let mut checkpoints = Checkpoints::new(self.options);
        // What was read already is small, and several are built at a time: one alone may be a block or two.
        let mut together = Vec::new();
        for ((input, border), report) in inputs.iter().zip(&borders).zip(still_good) {
            if let (None, Some(prepared)) = (report, prepared.remove(input)) {
                together.push((input, prepared, border));
            }
        }
        let build = |(input, prepared, border): (&PathBuf, Prepared, &InputBorder)| {
            (input.clone(), self.input(input, prepared, border.clone(), preparing.sources))
        };
        let mut together: BTreeMap<PathBuf, Result<_>> =
            together.into_par_iter().with_max_len(1).map(build).collect();
        let mut ahead: Option<Result<Prepared>> = None;
        for (number, (input, border)) in inputs.iter().zip(&borders).enumerate() {
            if let (Some(report), Some(earlier)) = (&still_good[number], earlier) {
                self.take_over(report, earlier, &mut done)?;
                continue;
            }
            let (blocks, report) = match together.remove(input) {
                Some(built) => built?,
                None => {
                    self.progress.reading(input, number + 1, inputs.len());
                    let model = ahead.take().unwrap_or_else(|| preparing.read(input))?;
                    // Only the input that comes next in turn, and only where both fit in memory.
                    let is_next = still_good.get(number + 1).is_some_and(Option::is_none);
                    let next = inputs.get(number + 1).filter(|next| {
                        is_next
                            && !together.contains_key(*next)
                            && fits_beside(input, next, preparing)
                    });
                    let (built, read_ahead) = rayon::join(
                        || self.input(input, model, border.clone(), preparing.sources),
                        || next.map(|next| preparing.read(next)),
                    );
                    ahead = read_ahead;
                    built?
                }
            };
            done.blocks.extend(blocks);
            done.reports.push(report);
            checkpoints.finished(&done, self.output)?;
        }
        Ok(done)
    }

    /// Builds one input.
    fn input(
        &self,
        input: &Path,
        prepared: Prepared,
        border: InputBorder,
        sources: &Sources,
    ) -> Result<(Vec<BuiltBlock>, InputReport)> {
        let &Self { options, output, stages, progress, .. } = self;
        let Prepared { model, up, up_from, triangles, collapsed } = prepared;
        let dependencies = model.dependencies.clone();
        progress.found(triangles);
        progress.built(collapsed);
        let target = Target { options, out: output, shared: &self.shared, stages, progress };
        let (built, files) = rayon::join(
            || build_input(model, up, &border, target),
            || describe(&dependencies, sources, stages),
        );
        let (built, files) = (built?, files?);
        let mut warnings = built.warnings;
        let outcomes = outcomes(&built.blocks, &mut warnings);
        let report = InputReport {
            path: text_of(input),
            files,
            triangles,
            texels: built.used_texels,
            stitched_edges: built.stitched_edges,
            cuts: built.cuts,
            bounds: border.bounds,
            meetings: border.meetings,
            up,
            up_from: Some(up_from),
            outcomes,
            left_out: built.left_out,
            warnings: Count::of_warnings(&warnings),
        };
        Ok((built.blocks, report))
    }

    /// Writes what belongs to no node: shared textures, tileset, scene and report.
    fn finish(
        self,
        done: Done,
        earlier: Option<&Earlier>,
        parameters: serde_json::Value,
        subset: Option<SubsetReport>,
        begin: Instant,
    ) -> Result<BuildReport> {
        let Done { reports, blocks, reused_textures, repeating_texels } = done;
        let source_texels = reports.iter().map(|input| input.texels).sum::<u64>()
            + self.shared.source_texels()
            + repeating_texels;
        let mut warnings = warnings(&reports, earlier, self.globe);
        let mut shared_textures = write_textures(self.shared, reused_textures, self.output)?;
        let up = agreed_up(&reports, &mut warnings);
        let (infos, trees) = numbered(blocks);
        let Districts { trees, reports: districts, warnings: imperfect } =
            match self.options.districts && subset.is_none() {
                true => {
                    let Self { options, output, stages, progress, .. } = self;
                    let cuts: Vec<BlockCut> =
                        reports.iter().flat_map(|input| input.cuts.iter().copied()).collect();
                    let above = Above {
                        options,
                        out: output,
                        stages,
                        progress,
                        earlier,
                        up,
                        cuts: &cuts,
                        several: reports.len() > 1,
                        meet: reports.iter().any(|input| !input.meetings.is_empty()),
                    };
                    build_districts(trees, &mut shared_textures, &above)?
                }
                false => Districts { trees, ..Districts::default() },
            };
        warnings.extend(imperfect);
        let over_budget = over_budget(&trees, &mut warnings);
        let baked = baked(&trees);
        let scene = scene_of(infos, trees, shared_textures, parameters.clone(), up, &reports)?;
        let quantization = self.options.quantization();
        if let (Some(quantization), Some(bounds), None) = (quantization, scene.bounds(), &subset) {
            quantization.check_extent(bounds)?;
        }
        let tilesets = self.stages.time(Stage::Write, || write_tilesets(&scene, self.output))?;
        let mut levels = level_reports(&scene);
        let mut by_id: Vec<&Node> = scene.nodes.iter().collect();
        by_id.sort_unstable_by_key(|node| node.id);
        for over in &over_budget {
            if let Ok(at) = by_id.binary_search_by_key(&over.id, |node| node.id) {
                levels[by_id[at].level as usize].over_budget += 1;
            }
        }
        let seconds = |stage: Stage| self.stages.seconds(stage);
        let report = BuildReport {
            version: env!("CARGO_PKG_VERSION").into(),
            parameters,
            subset,
            source_triangles: reports.iter().map(|input| input.triangles).sum(),
            source_texels,
            levels,
            shared_textures: SharedTexturesReport::of(&scene),
            stages: Stage::ALL
                .map(|stage| StageReport { stage: stage.name().into(), seconds: seconds(stage) })
                .to_vec(),
            seconds: begin.elapsed().as_secs_f64(),
            peak_memory_bytes: crate::builder::memory::peak_bytes(),
            outcomes: most_frequent(reports.iter().flat_map(|input| &input.outcomes).cloned()),
            inputs: reports,
            tilesets,
            quantized: quantization.map(|quantization| quantized(&scene, quantization)),
            over_budget,
            baked,
            districts,
            warnings: Count::of_warnings(&warnings),
        };
        self.output.write_over(SCENE_FILE, &scene.to_bytes()?)?;
        self.output.write_over(REPORT_FILE, report.to_json()?.as_bytes())?;
        Ok(report)
    }
}

fn write_tilesets(scene: &Scene, output: &OutputDir) -> Result<Vec<FileReport>> {
    // As whoever reads the scene will see it.
    let placement = placement_of(&scene.parameters)?;
    let mut reports = Vec::new();
    for file in tileset::files(scene, &placement)? {
        output.write(&file.path, &file.bytes)?;
        reports.push(FileReport::of(&file.path, &file.bytes));
    }
    Ok(reports)
}

/// What was imperfect in inputs, and in where the result stands.
fn warnings(reports: &[InputReport], earlier: Option<&Earlier>, globe: Option<&Globe>) -> Warnings {
    let mut warnings = Warnings::default();
    for warning in reports.iter().flat_map(|input| &input.warnings) {
        warnings.add(&warning.text, warning.count);
    }
    // What a build that was stopped leaves has none either.
    let has_none =
        |earlier: &Earlier| earlier.report.tilesets.is_empty() && !earlier.is_unfinished();
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

/// An input is read while the one before it is built, unless both are large: a file's model takes
/// about as many bytes as its text.
fn fits_beside(current: &Path, next: &Path, preparing: &Preparing) -> bool {
    let bytes = preparing.sources.bytes(current) + preparing.sources.bytes(next);
    match preparing.options.max_memory {
        Some(memory) => bytes <= memory / 4,
        None => bytes <= crate::builder::memory::total_bytes() / 16,
    }
}

/// One direction for the whole scene; the first input's where they differ.
fn agreed_up(inputs: &[InputReport], warnings: &mut Warnings) -> UpAxis {
    let first = inputs.first().map_or(UpAxis::Z, |input| input.up);
    let others = inputs.iter().filter(|input| input.up != first).count() as u64;
    warnings.add(
        format!("input with another up axis than the first ({first:?}); set --up to choose one"),
        others,
    );
    first
}

/// How the nodes of an input were made; what was imperfect in them is added to `warnings`.
fn outcomes(blocks: &[BuiltBlock], warnings: &mut Warnings) -> Vec<Count> {
    let mut steps = Vec::new();
    for block in blocks {
        block.for_each(&mut |record: &NodeRecord| {
            let baked = record.baked.filter(|_| record.step.is_some()).map(BakeReason::describe);
            let texts = record.step.map(LadderStep::describe).into_iter().chain(baked);
            steps.extend(texts.map(|text| Count { text: text.into(), count: 1 }));
            warnings.extend(record.warnings.clone());
        });
    }
    most_frequent(steps)
}

/// Sums up equal texts; the most frequent first, then by text.
fn most_frequent(counts: impl IntoIterator<Item = Count>) -> Vec<Count> {
    let mut sums: BTreeMap<String, u64> = BTreeMap::new();
    for Count { text, count } in counts {
        *sums.entry(text).or_insert(0) += count;
    }
    let mut sums: Vec<Count> =
        sums.into_iter().map(|(text, count)| Count { text, count }).collect();
    sums.sort_by_key(|sum| std::cmp::Reverse(sum.count));
    sums
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

/// The trees of blocks, which know the numbers of their blocks, and what these are.
pub(super) fn numbered(blocks: Vec<BuiltBlock>) -> (Vec<BlockInfo>, Vec<Tree<NodeRecord>>) {
    let mut infos = Vec::with_capacity(blocks.len());
    let mut all = Vec::with_capacity(blocks.len());
    for (number, BuiltBlock { info, mut trees }) in (0u32..).zip(blocks) {
        for tree in &mut trees {
            make_errors_monotone(tree);
            set_block(tree, number);
        }
        infos.push(info);
        all.extend(trees);
    }
    (infos, all)
}

/// Joins trees to a scene.
pub(super) fn scene_of(
    blocks: Vec<BlockInfo>,
    trees: Vec<Tree<NodeRecord>>,
    shared_textures: BTreeMap<String, SharedTexture>,
    parameters: serde_json::Value,
    up: UpAxis,
    reports: &[InputReport],
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
        fingerprint: fingerprint(&parameters, reports),
        parameters,
        up,
        blocks,
        shared_textures: shared_textures.into_values().collect(),
        nodes,
    })
}
