//! The whole build: what there is, what is to be built, building it; everything in its place at the end
//! or nothing changed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::builder::building::Building;
use crate::builder::built::BuiltBlocks;
use crate::builder::checkpoint::Checkpoints;
use crate::builder::copyright;
use crate::builder::finish::Finishing;
use crate::builder::inputs::{known, look_at, text_of};
use crate::builder::memory::total_bytes;
use crate::builder::merge::Subsets;
use crate::builder::options::BuildOptions;
use crate::builder::partition::CellBox;
use crate::builder::plan::{KnownInput, Plan};
use crate::builder::prepare::{Prepared, Preparing};
use crate::builder::progress::Progress;
use crate::builder::reuse::PreviousBuild;
use crate::builder::sources::Sources;
use crate::builder::stages::{Stage, Stages};
use crate::format::Subset;
use crate::format::{OutputDir, SUBSETS_DIR, Unfinished, check_apart};
use crate::mesh::UpAxis;
use crate::report::build_report::{BuildReport, SubsetReport};
use crate::{Error, Result, import};

/// Models of inputs that have a share of so much of the memory, as files, are read once.
const KEPT: u64 = 64;

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
/// on all machines.
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
    let inputs = subsets.inputs().to_vec();
    let plan = Plan::new(&inputs, agreed_up(&inputs), &options);
    let mut made = BuiltBlocks::default();
    for block in &plan.blocks {
        let Some((earlier, numbers)) = subsets.blocks(&block.name, &block.content_hash) else {
            continue;
        };
        let triangles = numbers.iter().map(|&number| earlier.report.blocks[number].triangles);
        progress.found(triangles.sum());
        earlier.reuse_blocks(block, numbers, &output, progress, &mut made)?;
    }
    progress.finishing();
    let earlier = PreviousBuild::open(out, &parameters);
    let finishing = Finishing {
        options: &options,
        globe: globe.as_ref(),
        output: &output,
        stages: &Stages::default(),
        progress,
        earlier: earlier.as_ref(),
        parameters,
        subset: None,
        begin,
    };
    let report = finishing.finish(inputs, &plan, made)?;
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
    let open = |dir: &Path| PreviousBuild::open(dir, &parameters);
    let known_result = || open(&target).or_else(|| open(out));
    let stopped = || unfinished.as_ref().and_then(|unfinished| open(unfinished.path()));
    let earlier = if options.force { None } else { stopped().or_else(known_result) };
    let earlier = earlier.as_ref();
    let folder = existing_folder(&target);
    let (sources, paths) = stages
        .time(Stage::Import, || Sources::divide(files, options, earlier, &folder, progress))?;
    let preparing =
        Preparing { options, sources: &sources, globe: globe.as_ref(), stages: &stages };
    let part = subset.map(|subset| SubsetReport {
        subset,
        all_inputs: paths.iter().map(|input| text_of(input)).collect(),
    });
    let looked = paths.iter().map(|input| known(input, earlier, &preparing)).collect::<Vec<_>>();
    if let Some(earlier) = earlier
        && looked.iter().all(Option::is_some)
        && earlier.report.inputs.len() == paths.len()
        && earlier.report.subset == part
        && earlier.tileset
    {
        return Ok(Outcome::UpToDate(earlier.report.clone()));
    }
    let (inputs, kept) = look_at_all(&paths, looked, &preparing, progress)?;
    let plan = Plan::new(&inputs, agreed_up(&inputs), options);
    if let Some(quantization) = options.quantization().filter(|_| !plan.blocks.is_empty()) {
        let bounds = inputs.iter().map(|input| &input.scan.bounds);
        let whole = bounds.fold(CellBox::NONE, |all, one| all.and(one));
        quantization.check_extent(whole.longest())?;
    }
    let share = match subset {
        Some(subset) => plan.share(subset)?,
        None => 0..plan.blocks.len(),
    };
    let output = OutputDir::create(&target)?;
    let building = Building {
        options,
        preparing: &preparing,
        plan: &plan,
        inputs: &paths,
        output: &output,
        stages: &stages,
        progress,
        earlier,
    };
    let mut checkpoints = Checkpoints::new(options);
    let (made, inputs) = building.blocks(share, inputs, kept, &mut checkpoints)?;
    progress.finishing();
    let finishing = Finishing {
        options,
        globe: globe.as_ref(),
        output: &output,
        stages: &stages,
        progress,
        earlier,
        parameters,
        subset: part,
        begin,
    };
    let report = finishing.finish(inputs, &plan, made)?;
    output.commit()?;
    if let Some(unfinished) = unfinished {
        unfinished.remove();
    }
    Ok(Outcome::Built(report))
}

/// Looks at all inputs of which an earlier result does not know enough. What was read is kept to be built,
/// where all of it is small.
fn look_at_all(
    paths: &[PathBuf],
    known: Vec<Option<KnownInput>>,
    preparing: &Preparing,
    progress: &dyn Progress,
) -> Result<(Vec<KnownInput>, BTreeMap<usize, Prepared>)> {
    let bytes = |input: &PathBuf| preparing.sources.bytes(input);
    let memory = preparing.options.max_memory.unwrap_or_else(total_bytes);
    let keeps = paths.len() == 1 || paths.iter().map(bytes).sum::<u64>() <= memory / KEPT;
    let mut kept = BTreeMap::new();
    let mut inputs = Vec::with_capacity(paths.len());
    for (number, (input, known)) in paths.iter().zip(known).enumerate() {
        if let Some(known) = known {
            progress.found(known.report.triangles);
            inputs.push(known);
            continue;
        }
        progress.reading(input, number + 1, paths.len());
        let (looked, prepared) = look_at(input, preparing, progress)?;
        if keeps {
            kept.insert(number, prepared);
        }
        inputs.push(looked);
    }
    Ok((inputs, kept))
}

/// One direction for the whole scene: the first input's.
pub(super) fn agreed_up(inputs: &[KnownInput]) -> UpAxis {
    inputs.first().map_or(UpAxis::Z, |input| input.report.up)
}

/// The folder in which an output will stand, or the nearest above it that is there.
fn existing_folder(out: &Path) -> PathBuf {
    let path = std::path::absolute(out).unwrap_or_else(|_| out.to_path_buf());
    let above = path.ancestors().skip(1).find(|folder| folder.is_dir());
    above.map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}
