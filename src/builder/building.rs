//! Building the blocks: inputs are read one after another and shared out among the blocks that they meet;
//! a block is built when the last of its inputs is there.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::Result;
use crate::builder::block::{BlockLabel, Draft, DraftBuilder};
use crate::builder::block_materials::{BlockMaterials, Collecting, InputAppearance};
use crate::builder::block_setup::{BlockSetup, Target};
use crate::builder::built::{BuiltBlock, BuiltBlocks};
use crate::builder::checkpoint::Checkpoints;
use crate::builder::cut::cell::CellCut;
use crate::builder::inputs::text_of;
use crate::builder::memory::total_bytes;
use crate::builder::options::BuildOptions;
use crate::builder::partition::{CellBox, Others};
use crate::builder::plan::{KnownInput, Plan, PlannedBlock};
use crate::builder::prepare::{Prepared, Preparing};
use crate::builder::progress::Progress;
use crate::builder::reuse::PreviousBuild;
use crate::builder::scatter::{BlockParts, scatter};
use crate::builder::stages::{Stage, Stages};
use crate::builder::threads::in_parallel;
use crate::format::OutputDir;
use crate::lattice::Quantization;
use crate::mesh::box_tree::BoxTree;
use crate::report::build_report::Count;
use crate::texture::{Announced, DecodedImages, SharedTextures, TextureCache};

/// Builds blocks.
pub struct Building<'a> {
    /// Options of the build.
    pub options: &'a BuildOptions,
    /// Reader of inputs.
    pub preparing: &'a Preparing<'a>,
    /// Plan of the build.
    pub plan: &'a Plan,
    /// Paths of all inputs.
    pub inputs: &'a [PathBuf],
    /// The output in the making.
    pub output: &'a OutputDir,
    /// Timers of the stages.
    pub stages: &'a Stages,
    /// Is told of it.
    pub progress: &'a dyn Progress,
    /// A result whose blocks are taken over where they are made of the same.
    pub earlier: Option<&'a PreviousBuild>,
}

/// A block whose inputs are not all there yet.
struct Waiting<'a> {
    block: &'a PlannedBlock,
    /// Parts from the inputs that are read, by input number.
    parts: BTreeMap<usize, (Arc<InputAppearance>, BlockParts)>,
    /// Number of inputs that are not read yet.
    left: usize,
}

/// A block that can be built.
struct Ready<'a> {
    draft: Draft,
    materials: BlockMaterials,
    announced: Announced<'a>,
}

impl Building<'_> {
    /// Builds a share of the planned blocks, or takes them over. `kept` are the inputs that were read
    /// already. What is known of inputs is returned with what building them has shown.
    pub fn blocks(
        &self,
        share: Range<usize>,
        mut inputs: Vec<KnownInput>,
        mut kept: BTreeMap<usize, Prepared>,
        checkpoints: &mut Checkpoints,
    ) -> Result<(BuiltBlocks, Vec<KnownInput>)> {
        let mut made = BuiltBlocks::default();
        let mut waiting: BTreeMap<u32, Waiting> = BTreeMap::new();
        // Inputs are read in the order of blocks, so that few blocks wait at a time.
        let mut wanted: Vec<usize> = Vec::new();
        let mut blocks_of: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for block in &self.plan.blocks[share] {
            if let Some(earlier) = self.earlier
                && let Some(numbers) = earlier.blocks(&block.name, &block.content_hash)
            {
                earlier.reuse_blocks(block, numbers, self.output, self.progress, &mut made)?;
                continue;
            }
            let left = block.inputs.len();
            waiting.insert(block.cell, Waiting { block, parts: BTreeMap::new(), left });
            for &input in &block.inputs {
                let blocks = blocks_of.entry(input).or_default();
                if blocks.is_empty() {
                    wanted.push(input);
                }
                blocks.push(block.cell);
            }
        }
        let places = inputs.iter().map(|input| {
            let clusters = input.scan.clusters.iter().map(Others::around);
            clusters.fold(CellBox::NONE, |all, one| all.and(&one)).corners()
        });
        let places = BoxTree::new(places.collect());
        let images = DecodedImages::default();
        let mut ready: Vec<Waiting> = Vec::new();
        let mut ahead: Option<Result<Prepared>> = None;
        for (place, &input) in wanted.iter().enumerate() {
            let read = |input: usize| self.preparing.read(&self.inputs[input]);
            let prepared = match (kept.remove(&input), ahead.take()) {
                (Some(kept), _) => kept,
                (None, Some(ahead)) => ahead?,
                (None, None) => {
                    self.progress.reading(&self.inputs[input], input + 1, self.inputs.len());
                    read(input)?
                }
            };
            let others = self.others(input, &inputs, &places);
            let (looks, mut parts) = self.shared_out(prepared, &mut inputs[input], &others);
            for cell in blocks_of.remove(&input).unwrap_or_default() {
                let Some(waits) = waiting.get_mut(&cell) else { continue };
                waits.left -= 1;
                let parts = parts.remove(&cell).map(|parts| (input, (Arc::clone(&looks), parts)));
                waits.parts.extend(parts);
                if waits.left == 0 {
                    ready.extend(waiting.remove(&cell));
                }
            }
            drop((looks, parts));
            let next = wanted.get(place + 1).copied();
            let next = next.filter(|next| !kept.contains_key(next) && self.fits(input, *next));
            let (built, read_ahead) = rayon::join(
                || self.build(std::mem::take(&mut ready), &made.shared, &images),
                || next.map(read),
            );
            ahead = read_ahead;
            for (block, blocks) in built? {
                match blocks.is_empty() {
                    true => made.empty.push(block.empty()),
                    false => drop(made.blocks.insert(block.cell, blocks)),
                }
            }
            checkpoints.finished(&made, &inputs, self.plan, self.output)?;
        }
        Ok((made, inputs))
    }

    /// Returns the clusters of other inputs near an input. `places` has the box of each input.
    fn others(&self, input: usize, inputs: &[KnownInput], places: &BoxTree) -> Others {
        let bounds = inputs[input].scan.bounds;
        let meets = |&[low, high]: &[[f64; 3]; 2]| bounds.meets(&CellBox { low, high });
        let near = places.matching(meets).filter(|&other| other != input);
        let clusters = near.flat_map(|other| &inputs[other].scan.clusters);
        Others::new(clusters.filter(|cluster| bounds.meets(&Others::around(cluster))))
    }

    /// The triangles of an input by the blocks that they are of, on the lattice; what is known of the input
    /// is completed.
    fn shared_out(
        &self,
        prepared: Prepared,
        known: &mut KnownInput,
        others: &Others,
    ) -> (Arc<InputAppearance>, FxHashMap<u32, BlockParts>) {
        let Prepared { mut model, .. } = prepared;
        let step = self.plan.lattice.step;
        let collapsed = self.stages.time(Stage::Gather, || Quantization { step }.snap(&mut model));
        let source = model.source.display();
        let what = match self.options.quantization().is_some_and(|coarse| coarse.step == step) {
            true => format!("{source}: triangle thinner than the lattice of {step} m left out"),
            false => {
                format!("{source}: triangle thinner than its precision ({step:e} m) left out")
            }
        };
        model.warnings.add(what, collapsed);
        self.progress.built(collapsed);
        known.report.warnings = Count::of_warnings(&model.warnings);
        let looks = self.stages.time(Stage::Gather, || InputAppearance::take(&mut model));
        let uncut = self.options.hierarchy.constants.blocks.uncut;
        let most = self.options.most_in_block() as usize / uncut.max(1);
        let parts =
            self.stages.time(Stage::Gather, || scatter(model, &self.plan.partition, most, others));
        (Arc::new(looks), parts)
    }

    /// Builds blocks whose inputs are there, in parallel.
    fn build<'b>(
        &self,
        ready: Vec<Waiting<'b>>,
        shared: &SharedTextures,
        images: &DecodedImages,
    ) -> Result<Vec<(&'b PlannedBlock, Vec<BuiltBlock>)>> {
        let target = Target {
            options: self.options,
            out: self.output,
            shared,
            stages: self.stages,
            progress: self.progress,
        };
        let drafts: Vec<(&PlannedBlock, Ready)> =
            ready.into_iter().map(|waits| (waits.block, self.ready(waits, images))).collect();
        in_parallel(drafts, |_, (block, Ready { draft, materials, announced })| {
            if draft.parts.is_empty() {
                return Ok((block, Vec::new()));
            }
            let cache = TextureCache::new(&materials.model, &materials.looks.textures, &announced);
            let setup = BlockSetup::new(target, self.plan.up, &cache, &materials.looks.extrudable);
            let builder =
                DraftBuilder { materials: &materials, setup: &setup, lattice: self.plan.lattice };
            let mut built = builder.build(draft)?;
            if let Some(first) = built.first_mut() {
                let warnings = cache.warnings_of(|texture| materials.input_of(texture));
                let texts = warnings.iter().map(|(text, _)| text.to_owned());
                first.report.texture_warnings.extend(texts);
            }
            Ok((block, built))
        })
    }

    /// A block with its materials.
    fn ready<'b>(&self, waits: Waiting, images: &'b DecodedImages) -> Ready<'b> {
        let Waiting { block, parts: by_input, .. } = waits;
        let mut collecting = Collecting::default();
        let mut parts = BlockParts::default();
        let mut largest = (0, String::new(), String::new());
        for (looks, mut of_input) in by_input.into_values() {
            let own = || of_input.inner.iter().chain(&of_input.crossing);
            let triangles: usize = own().map(|part| part.indices.len() / 3).sum();
            if triangles > largest.0 {
                let groups = &looks.model.groups;
                let name = own().next().and_then(|part| groups.get(part.group as usize));
                let name = name.map_or_else(String::new, |group| group.name.clone());
                largest = (triangles, name, text_of(&looks.model.source));
            }
            collecting.add(&looks, of_input.inner.iter_mut().chain(of_input.crossing.iter_mut()));
            parts.add(of_input);
        }
        let materials = collecting.finish();
        parts.inner.iter_mut().chain(&mut parts.crossing).for_each(|part| materials.fold(part));
        let used = parts.inner.iter().chain(&parts.crossing).map(|part| part.material);
        let announced = images.announce(&materials.model, &materials.looks.textures, used);
        let (_, name, input) = largest;
        let (files, content_hash) = (block.name.clone(), block.content_hash.clone());
        let draft = Draft {
            label: BlockLabel { files, name, input, content_hash },
            parts,
            cut: CellCut::new(&self.plan.partition, block.cell),
        };
        Ready { draft, materials, announced }
    }

    /// An input is read while blocks are built, unless both are large: a file's model takes about as many
    /// bytes as its text.
    fn fits(&self, current: usize, next: usize) -> bool {
        let bytes = |input: usize| self.preparing.sources.bytes(&self.inputs[input]);
        let both = bytes(current) + bytes(next);
        match self.options.max_memory {
            Some(memory) => both <= memory / 4,
            None => both <= total_bytes() / 16,
        }
    }
}
