//! What a build that is stopped leaves behind, so that another can go on from there.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use super::pipeline::{Done, baked, numbered, over_budget, scene_of};
use crate::Result;
use crate::builder::block::BuiltBlock;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::options::BuildOptions;
use crate::format::{OutputDir, REPORT_FILE, SCENE_FILE};
use crate::mesh::{UpAxis, Warnings};
use crate::report::build_report::BuildReport;

/// Writing what is finished may take this part of the time.
const PART: u32 = 20;

/// Writes scene and report of what is finished, now and then, into the output in the making: whoever is to go
/// on finds an earlier result there.
pub(super) struct Checkpoints<'a> {
    options: &'a BuildOptions,
    written: Instant,
    took: Duration,
}

impl<'a> Checkpoints<'a> {
    pub fn new(options: &'a BuildOptions) -> Self {
        Self { options, written: Instant::now(), took: Duration::ZERO }
    }

    /// One more input is built.
    pub fn finished(&mut self, done: &Done, output: &OutputDir) -> Result<()> {
        if !self.options.resume || self.written.elapsed() < self.took * PART {
            return Ok(());
        }
        let begin = Instant::now();
        self.write(done, output)?;
        (self.written, self.took) = (Instant::now(), begin.elapsed());
        Ok(())
    }

    fn write(&self, done: &Done, output: &OutputDir) -> Result<()> {
        // Textures that inputs share are written at the end.
        let mut waits = BTreeSet::new();
        for block in &done.blocks {
            block.for_each(&mut |record: &NodeRecord| {
                if record.shared.iter().any(|(name, _)| !done.reused_textures.contains_key(name)) {
                    waits.insert(block.info.input.as_str());
                }
            });
        }
        let is_done = |input: &str| !waits.contains(input);
        let blocks: Vec<BuiltBlock> =
            done.blocks.iter().filter(|block| is_done(&block.info.input)).cloned().collect();
        if blocks.is_empty() {
            return Ok(());
        }
        let inputs: Vec<_> =
            done.reports.iter().filter(|input| is_done(&input.path)).cloned().collect();
        let parameters = self.options.to_json();
        let (infos, trees) = numbered(blocks);
        let report = BuildReport {
            version: env!("CARGO_PKG_VERSION").into(),
            parameters: parameters.clone(),
            over_budget: over_budget(&trees, &mut Warnings::default()),
            baked: baked(&trees),
            ..BuildReport::default()
        };
        let up = inputs.first().map_or(UpAxis::Z, |input| input.up);
        let textures = done.reused_textures.clone();
        let scene = scene_of(infos, trees, textures, parameters, up, &inputs)?;
        let report = BuildReport { inputs, ..report };
        // Whoever finds a scene finds its report.
        output.write_over(REPORT_FILE, report.to_json()?.as_bytes())?;
        output.write_over(SCENE_FILE, &scene.to_bytes()?)?;
        output.keep();
        Ok(())
    }
}
