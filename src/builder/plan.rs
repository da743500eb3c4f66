//! Which inputs are built, with what borders, and which are taken over from an earlier result.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use rayon::prelude::*;

use crate::builder::inputs::{text_of, unchanged};
use crate::builder::prepare::Preparing;
use crate::builder::progress::Progress;
use crate::builder::reuse::Earlier;
use crate::builder::stages::Stage;
use crate::builder::tiles::Tiles;
use crate::builder::tiles::border::InputBorder;
use crate::builder::tiles::rim::BoundingBox;
use crate::report::build_report::InputReport;
use crate::{Result, import};

/// What is to be done about each input of a build, or of a share of it.
pub struct Plan {
    /// What an earlier result knows of those that are taken over from it.
    pub still_good: Vec<Option<InputReport>>,
    /// The borders of those that are built.
    pub borders: Vec<InputBorder>,
}

impl Plan {
    /// For `inputs` of all.
    pub fn new(
        all: &[PathBuf],
        inputs: &[PathBuf],
        earlier: Option<&Earlier>,
        preparing: &Preparing,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let same = |input: &PathBuf| {
            let report = earlier?.input(&text_of(input))?;
            unchanged(report).then(|| report.clone())
        };
        let compare = || inputs.iter().map(same).collect::<Vec<Option<InputReport>>>();
        let mut still_good = preparing.stages.time(Stage::Compare, compare);
        if all.len() == 1 {
            let borders = vec![InputBorder::default(); inputs.len()];
            return Ok(Self { still_good, borders });
        }
        let place_of: BTreeMap<&PathBuf, usize> = all.iter().zip(0..).collect();
        let places: Vec<usize> = inputs.iter().map(|input| place_of[input]).collect();
        // What is built elsewhere may have changed.
        let mut known: Vec<Option<BoundingBox>> = vec![None; all.len()];
        for (&place, report) in places.iter().zip(&still_good) {
            known[place] = report.as_ref().and_then(|report| report.bounds);
        }
        let box_of = |(input, known): (&PathBuf, &Option<BoundingBox>)| {
            known.map_or_else(|| import::bounds(input), Ok)
        };
        let boxes: Vec<BoundingBox> =
            all.par_iter().zip(&known).map(box_of).collect::<Result<_>>()?;
        let mut tiles = Tiles::new(all, boxes, preparing.options);
        let is_changed = |place: usize| known[place].is_none();
        // One that met an input that is gone, too.
        for (&place, report) in places.iter().zip(&mut still_good) {
            let is_there = |path: &str| {
                tiles.neighbours(place).iter().any(|&other| text_of(&all[other]) == path)
            };
            report.take_if(|known| {
                known.bounds.is_none() || !known.meetings.iter().all(|other| is_there(&other.path))
            });
        }
        let in_question = |(&place, report): (&usize, &Option<InputReport>)| {
            let near_changed = || tiles.neighbours(place).iter().any(|&other| is_changed(other));
            (report.is_none() || near_changed()).then_some(place)
        };
        let in_question: BTreeSet<usize> =
            places.iter().zip(&still_good).filter_map(in_question).collect();
        tiles.read_rims(in_question.iter().copied(), |place| {
            progress.comparing(&all[place]);
            Ok(preparing.read(&all[place])?.model)
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
        Ok(Self { still_good, borders })
    }
}
