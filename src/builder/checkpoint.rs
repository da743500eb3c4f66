//! What a build that is stopped leaves behind, so that another can go on from there.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::Result;
use crate::builder::built::BuiltBlock;
use crate::builder::built::BuiltBlocks;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::finish::{Blocks, baked, over_budget, scene_of};
use crate::builder::options::BuildOptions;
use crate::builder::plan::{KnownInput, Plan};
use crate::builder::scans::scans_to_bytes;
use crate::format::{OutputDir, REPORT_FILE, SCANS_FILE, SCENE_FILE};
use crate::mesh::Warnings;
use crate::report::build_report::BuildReport;

/// Writing what is finished may take this part of the time.
const PART: u32 = 20;

/// Writes scene and report of what is finished, now and then, into the output in the making: whoever is to go
/// on finds an earlier result there.
pub struct Checkpoints<'a> {
    options: &'a BuildOptions,
    written: Instant,
    took: Duration,
}

impl<'a> Checkpoints<'a> {
    /// Creates the state of a build that has just begun.
    pub fn new(options: &'a BuildOptions) -> Self {
        Self { options, written: Instant::now(), took: Duration::ZERO }
    }

    /// One more input is built.
    pub fn finished(
        &mut self,
        made: &BuiltBlocks,
        inputs: &[KnownInput],
        plan: &Plan,
        output: &OutputDir,
    ) -> Result<()> {
        if !self.options.resume || self.written.elapsed() < self.took * PART {
            return Ok(());
        }
        let begin = Instant::now();
        self.write(made, inputs, plan, output)?;
        (self.written, self.took) = (Instant::now(), begin.elapsed());
        Ok(())
    }

    fn write(
        &self,
        made: &BuiltBlocks,
        inputs: &[KnownInput],
        plan: &Plan,
        output: &OutputDir,
    ) -> Result<()> {
        // Textures that blocks share are written at the end.
        let is_done = |block: &BuiltBlock| {
            let mut is_done = true;
            block.for_each(&mut |record: &NodeRecord| {
                let mut names = record.shared.keys();
                is_done &= names.all(|name| made.reused_textures.contains_key(name));
            });
            is_done
        };
        let done: BTreeMap<u32, Vec<BuiltBlock>> = made
            .blocks
            .iter()
            .filter(|(_, blocks)| blocks.iter().all(is_done))
            .map(|(cell, blocks)| (*cell, blocks.clone()))
            .collect();
        if done.values().all(Vec::is_empty) {
            return Ok(());
        }
        let parameters = self.options.to_json();
        let Blocks { infos, reports: blocks, trees } = Blocks::of(done);
        let trees: Vec<_> = trees.into_values().flat_map(|block| block.trees).collect();
        let report = BuildReport {
            version: env!("CARGO_PKG_VERSION").into(),
            parameters: parameters.clone(),
            over_budget: over_budget(&trees, &mut Warnings::default()),
            baked: baked(&trees),
            inputs: inputs.iter().map(|input| input.report.clone()).collect(),
            blocks,
            empty_blocks: made.empty.clone(),
            ..BuildReport::default()
        };
        let textures = made.reused_textures.clone();
        let scene = scene_of(infos, trees, textures, parameters, plan.up, inputs)?;
        // Whoever finds a scene finds its report.
        output.write_over(SCANS_FILE, &scans_to_bytes(inputs))?;
        output.write_over(REPORT_FILE, report.to_json()?.as_bytes())?;
        output.write_over(SCENE_FILE, &scene.to_bytes()?)?;
        output.keep();
        Ok(())
    }
}
