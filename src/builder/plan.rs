//! Which inputs are built, with what borders, and which are taken over from an earlier result.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::Result;
use crate::builder::inputs::{text_of, unchanged};
use crate::builder::memory::total_bytes;
use crate::builder::prepare::{Prepared, Preparing};
use crate::builder::progress::Progress;
use crate::builder::reuse::Earlier;
use crate::builder::stages::Stage;
use crate::builder::tiles::Tiles;
use crate::builder::tiles::border::InputBorder;
use crate::builder::tiles::boxes::boxes;
use crate::builder::tiles::rim::BoundingBox;
use crate::report::build_report::InputReport;

/// Models of inputs that have a share of so much of the memory, as files, are read once.
const KEPT: u64 = 64;

/// What is to be done about each input of a build, or of a share of it.
pub struct Plan {
    /// What an earlier result knows of those that are taken over from it.
    pub still_good: Vec<Option<InputReport>>,
    /// The borders of those that are built.
    pub borders: Vec<InputBorder>,
    /// Those of them that were read already.
    pub prepared: BTreeMap<PathBuf, Prepared>,
}

impl Plan {
    /// For `inputs` of all. `subsets` is the folder of all shares, where these are one.
    pub fn new(
        all: &[PathBuf],
        inputs: &[PathBuf],
        subsets: Option<&Path>,
        earlier: Option<&Earlier>,
        preparing: &Preparing,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let same = |input: &PathBuf| {
            let report = earlier?.input(&text_of(input))?;
            unchanged(report, preparing.sources).then(|| report.clone())
        };
        let compare = || inputs.iter().map(same).collect::<Vec<Option<InputReport>>>();
        let mut still_good = preparing.stages.time(Stage::Compare, compare);
        if all.len() == 1 {
            // One among several was on a lattice that it need not be on alone.
            still_good.iter_mut().for_each(|report| {
                report.take_if(|known| known.bounds.is_some());
            });
            let borders = vec![InputBorder::default(); inputs.len()];
            return Ok(Self { still_good, borders, prepared: BTreeMap::new() });
        }
        let place_of: BTreeMap<&PathBuf, usize> = all.iter().zip(0..).collect();
        let places: Vec<usize> = inputs.iter().map(|input| place_of[input]).collect();
        // What is built elsewhere may have changed.
        let mut known: Vec<Option<BoundingBox>> = vec![None; all.len()];
        for (&place, report) in places.iter().zip(&still_good) {
            known[place] = report.as_ref().and_then(|report| report.bounds);
        }
        let first = places.first().copied().unwrap_or(0);
        let boxes = boxes(all, &known, preparing.sources, subsets, first)?;
        let mut tiles = Tiles::new(all, boxes, preparing.options);
        let is_changed = |place: usize| known[place].is_none();
        let place_of: BTreeMap<String, usize> =
            all.iter().map(|path| text_of(path)).zip(0..).collect();
        // One that met an input that is gone, too.
        for (&place, report) in places.iter().zip(&mut still_good) {
            let is_there = |path: &str| {
                place_of.get(path).is_some_and(|&other| tiles.are_neighbours(place, other))
            };
            report.take_if(|known| {
                known.bounds.is_none() || !known.meetings.iter().all(|other| is_there(&other.path))
            });
        }
        let near_changed = tiles.neighbours_of((0..all.len()).filter(|&place| is_changed(place)));
        let in_question = |(&place, report): (&usize, &Option<InputReport>)| {
            (report.is_none() || near_changed.contains(&place)).then_some(place)
        };
        let in_question: BTreeSet<usize> =
            places.iter().zip(&still_good).filter_map(in_question).collect();
        // What is read for its border is kept to be built, where all of it is small; all of it is built
        // together then, which leaves nothing finished before the end.
        let bytes = |input: &PathBuf| preparing.sources.bytes(input);
        let memory = preparing.options.max_memory.unwrap_or_else(total_bytes);
        let is_small = all.iter().map(bytes).sum::<u64>() <= memory / KEPT;
        let keep = is_small && !preparing.options.resume;
        let mut prepared: BTreeMap<PathBuf, Prepared> = BTreeMap::new();
        tiles.read_rims(&in_question, |place, rim| {
            progress.comparing(&all[place]);
            let read = preparing.read(&all[place])?;
            let rim = preparing.stages.time(Stage::Gather, || rim(&read.model));
            if keep && is_changed(place) {
                prepared.insert(all[place].clone(), read);
            }
            Ok(rim)
        })?;
        let mut borders = Vec::with_capacity(inputs.len());
        for (place, report) in places.iter().zip(&mut still_good) {
            let border = match in_question.contains(place) {
                true => tiles.border(*place),
                false => InputBorder::default(),
            };
            report
                .take_if(|known| in_question.contains(place) && known.meetings != border.meetings);
            borders.push(border);
        }
        Ok(Self { still_good, borders, prepared })
    }
}
