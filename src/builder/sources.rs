//! What is read as one input: a file, or a tile of one that is too large to be read whole.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rayon::prelude::*;

use crate::builder::options::BuildOptions;
use crate::builder::progress::Progress;
use crate::builder::reuse::PreviousBuild;
use crate::format::check_regular;
use crate::import::tiling::{TILE_VERTICES, Tiling, is_divided};
use crate::mesh::{Model, UpAxis};
use crate::report::build_report::{FileReport, InputReport};
use crate::stage_timer::StageTimer;
use crate::{Result, import};

/// Where inputs are read from.
///
/// Tiles of a file are inputs like others. Their paths are not
/// those of files: they lie below that of the file that they are of, as if it were a folder.
#[derive(Debug, Default)]
pub struct Sources {
    tilings: Vec<Tiling>,
    /// By path: the tiling, and which of its tiles.
    tiles: BTreeMap<PathBuf, (usize, usize)>,
    /// Files that were looked at for changes: several tiles are of the same.
    reports: Mutex<BTreeMap<PathBuf, FileReport>>,
}

impl Sources {
    /// Divides those of `inputs` that are large, where memory is to be [kept](BuildOptions::max_memory), with files
    /// in `dir` while it lasts. What is built then: tiles in place of what was divided. Where nothing has changed
    /// since an earlier result, nothing is read, and the tiles are those of then.
    pub fn divide(
        inputs: Vec<PathBuf>,
        options: &BuildOptions,
        earlier: Option<&PreviousBuild>,
        dir: &Path,
        progress: &dyn Progress,
    ) -> Result<(Self, Vec<PathBuf>)> {
        let mut sources = Self::default();
        if options.max_memory.is_none() {
            return Ok((sources, inputs));
        }
        if let Some(known) = earlier.and_then(|earlier| sources.unchanged(&inputs, earlier)) {
            return Ok((sources, known));
        }
        let mut all = Vec::with_capacity(inputs.len());
        for input in inputs {
            if !is_divided(&input) {
                all.push(input);
                continue;
            }
            progress.dividing(&input);
            let bounds = import::bounds(&input)?;
            let degrees = options.placement.is_degrees().then_some(UpAxis::Z);
            let up = options.up.or(degrees);
            let tiling = Tiling::of(&input, bounds, up, TILE_VERTICES, dir)?;
            let stem = input.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            for tile in 0..tiling.tiles() {
                let path = input.join(format!("{stem}-{tile:04}"));
                sources.tiles.insert(path.clone(), (sources.tilings.len(), tile));
                all.push(path);
            }
            sources.tilings.push(tiling);
        }
        Ok((sources, all))
    }

    /// What an earlier result was built from, where that is all of `inputs` and none of them has changed.
    fn unchanged(&self, inputs: &[PathBuf], earlier: &PreviousBuild) -> Option<Vec<PathBuf>> {
        let known = &earlier.report.inputs;
        let is_whole = earlier.report.subset.is_none() && earlier.tileset;
        let known_paths: BTreeSet<&Path> = known.iter().flat_map(paths).collect();
        let all_known = inputs.iter().all(|input| known_paths.contains(input.as_path()));
        let input_paths: BTreeSet<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let all_there =
            known.iter().all(|known| paths(known).any(|path| input_paths.contains(path)));
        let is_same = || known.iter().all(|known| unchanged(known, self));
        let same = is_whole && all_known && all_there && is_same();
        same.then(|| known.iter().map(|known| PathBuf::from(&known.path)).collect())
    }

    /// Reads an input.
    pub fn load(&self, input: &Path) -> Result<Model> {
        match self.tiles.get(input) {
            Some(&(tiling, tile)) => {
                let mut model = self.tilings[tiling].load(tile)?;
                model.source = input.to_path_buf();
                Ok(model)
            }
            None => import::load(input),
        }
    }

    /// The up axis of an input by the shape of all that it is a tile of; `None` where it is none.
    pub fn up_of(&self, input: &Path) -> Option<UpAxis> {
        self.tiles.get(input).map(|&(tiling, _)| self.tilings[tiling].up())
    }

    /// Least and greatest coordinates of an input's vertices, where they are known without reading it.
    pub fn bounds(&self, input: &Path) -> Option<[[f64; 3]; 2]> {
        self.tiles.get(input).map(|&(tiling, tile)| self.tilings[tiling].bounds(tile))
    }

    /// Bytes of the text of an input.
    pub fn bytes(&self, input: &Path) -> u64 {
        match self.tiles.get(input) {
            Some(&(tiling, tile)) => self.tilings[tiling].bytes(tile),
            None => std::fs::metadata(input).map_or(0, |facts| facts.len()),
        }
    }

    /// Size and hash of a file, which is looked at once.
    pub fn report(&self, path: &Path) -> Result<FileReport> {
        let known = || self.reports.lock().ok()?.get(path).cloned();
        if let Some(known) = known() {
            return Ok(known);
        }
        let report = FileReport::read(path)?;
        if let Ok(mut reports) = self.reports.lock() {
            reports.insert(path.to_path_buf(), report.clone());
        }
        Ok(report)
    }
}

/// The path of an input, and that of the file which it may be a tile of.
fn paths(known: &InputReport) -> impl Iterator<Item = &Path> {
    let path = Path::new(&known.path);
    [Some(path), path.parent()].into_iter().flatten()
}
/// True where every file of an input is as it was.
pub fn unchanged(earlier: &InputReport, sources: &Sources) -> bool {
    let timer = StageTimer::current();
    let is_same = |file: &FileReport| {
        let path = Path::new(&file.path);
        let size = check_regular(path).map_or(0, |metadata| metadata.len());
        size == file.bytes && sources.report(path).is_ok_and(|now| now == *file)
    };
    !earlier.files.is_empty() && earlier.files.par_iter().all(|file| timer.time(|| is_same(file)))
}
