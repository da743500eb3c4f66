//! Building the blocks: inputs are read one after another and shared out among the blocks that they meet;
//! a block is built when the last of its inputs is there.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::Result;
use crate::builder::block::{Blocks, BuiltBlock, Draft};
use crate::builder::block_setup::{BlockSetup, Target};
use crate::builder::checkpoint::Checkpoints;
use crate::builder::cut::cell::CellCut;
use crate::builder::inputs::text_of;
use crate::builder::options::BuildOptions;
use crate::builder::partition::Others;
use crate::builder::plan::{KnownInput, Plan, PlannedBlock};
use crate::builder::prepare::{Prepared, Preparing};
use crate::builder::progress::Progress;
use crate::builder::reuse::Earlier;
use crate::builder::scatter::{BlockParts, scatter};
use crate::builder::stages::{Stage, Stages};
use crate::builder::threads::in_parallel;
use crate::builder::world::{Collecting, InputLooks, World};
use crate::format::{OutputDir, SharedTexture};
use crate::lattice::Quantization;
use crate::report::build_report::Count;
use crate::texture::{Announced, DecodedImages, SharedTextures, TextureCache};

/// What has come of blocks.
#[derive(Default)]
pub struct Made {
    /// By cell, those of each in their order.
    pub blocks: BTreeMap<u32, Vec<BuiltBlock>>,
    /// Shared textures of earlier results, by name.
    pub reused_textures: BTreeMap<String, SharedTexture>,
    /// Those of this build.
    pub shared: SharedTextures,
}

/// What building blocks takes.
pub struct Building<'a> {
    /// How.
    pub options: &'a BuildOptions,
    /// How inputs are read.
    pub preparing: &'a Preparing<'a>,
    /// What there is to build.
    pub plan: &'a Plan,
    /// Of all inputs.
    pub inputs: &'a [PathBuf],
    /// The output in the making.
    pub output: &'a OutputDir,
    /// Where the time goes.
    pub stages: &'a Stages,
    /// Is told of it.
    pub progress: &'a dyn Progress,
    /// A result whose blocks are taken over where they are made of the same.
    pub earlier: Option<&'a Earlier>,
}

/// A block whose inputs are not all there yet.
#[derive(Default)]
struct Waiting {
    /// By input.
    parts: BTreeMap<usize, (Arc<InputLooks>, BlockParts)>,
    left: usize,
}

/// A block that can be built.
struct Ready<'a> {
    draft: Draft,
    world: World,
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
    ) -> Result<(Made, Vec<KnownInput>)> {
        let mut made = Made::default();
        let mut waiting: BTreeMap<u32, Waiting> = BTreeMap::new();
        let mut wanted: Vec<usize> = Vec::new();
        for block in &self.plan.blocks[share] {
            if let Some(earlier) = self.earlier
                && let Some(numbers) = earlier.blocks(&block.name, &block.made_of)
            {
                for &number in numbers {
                    let triangles = earlier.report.blocks[number].triangles;
                    earlier.take_over(number, block.cell, self.output, &mut made)?;
                    self.progress.built(triangles);
                }
                continue;
            }
            let left = block.inputs.len();
            waiting.insert(block.cell, Waiting { parts: BTreeMap::new(), left });
            wanted.extend(&block.inputs);
        }
        // In the order of blocks, so that few wait at a time whatever inputs are called.
        let mut seen = BTreeSet::new();
        wanted.retain(|input| seen.insert(*input));
        let planned: BTreeMap<u32, usize> =
            (0..).zip(&self.plan.blocks).map(|(at, block)| (block.cell, at)).collect();
        let images = DecodedImages::default();
        let mut ready: Vec<(usize, Waiting)> = Vec::new();
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
            let others = self.others(input, &inputs);
            let (looks, mut parts) = self.shared_out(prepared, &mut inputs[input], &others);
            for (cell, waits) in &mut waiting {
                let block = &self.plan.blocks[planned[cell]];
                if block.inputs.binary_search(&input).is_ok() {
                    waits.left -= 1;
                    let parts =
                        parts.remove(cell).map(|parts| (input, (Arc::clone(&looks), parts)));
                    waits.parts.extend(parts);
                }
            }
            drop((looks, parts));
            let done: Vec<u32> = waiting
                .iter()
                .filter(|(_, waits)| waits.left == 0)
                .map(|(&cell, _)| cell)
                .collect();
            for cell in done {
                ready.extend(waiting.remove(&cell).map(|waits| (planned[&cell], waits)));
            }
            let next = wanted.get(place + 1).copied();
            let next = next.filter(|next| !kept.contains_key(next) && self.fits(input, *next));
            let (built, read_ahead) = rayon::join(
                || self.build(std::mem::take(&mut ready), &made.shared, &images),
                || next.map(read),
            );
            ahead = read_ahead;
            for (cell, blocks) in built? {
                made.blocks.insert(cell, blocks);
            }
            checkpoints.finished(&made, &inputs, self.plan, self.output)?;
        }
        Ok((made, inputs))
    }

    /// What other inputs have in the box around one.
    fn others(&self, input: usize, inputs: &[KnownInput]) -> Others {
        let [low, high] = inputs[input].scan.bounds;
        let meets = |[other_low, other_high]: [[f64; 3]; 2]| {
            (0..3).all(|axis| other_low[axis] <= high[axis] && low[axis] <= other_high[axis])
        };
        let near = (0..)
            .zip(inputs)
            .filter(|(number, other)| *number != input && meets(other.scan.bounds));
        let clusters = near.flat_map(|(_, other)| &other.scan.clusters);
        Others::new(clusters.filter(|cluster| meets(cluster.around)))
    }

    /// The triangles of an input by the blocks that they are of, on the lattice; what is known of the input
    /// is completed.
    fn shared_out(
        &self,
        prepared: Prepared,
        known: &mut KnownInput,
        others: &Others,
    ) -> (Arc<InputLooks>, FxHashMap<u32, BlockParts>) {
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
        let looks = self.stages.time(Stage::Gather, || InputLooks::take(&mut model));
        let uncut = self.options.hierarchy.constants.blocks.uncut;
        let most = self.options.most_in_block() as usize / uncut.max(1);
        let parts =
            self.stages.time(Stage::Gather, || scatter(model, &self.plan.partition, most, others));
        (Arc::new(looks), parts)
    }

    /// Builds blocks whose inputs are there, in parallel.
    fn build(
        &self,
        ready: Vec<(usize, Waiting)>,
        shared: &SharedTextures,
        images: &DecodedImages,
    ) -> Result<Vec<(u32, Vec<BuiltBlock>)>> {
        let target = Target {
            options: self.options,
            out: self.output,
            shared,
            stages: self.stages,
            progress: self.progress,
        };
        let drafts: Vec<(u32, Ready)> = ready
            .into_iter()
            .filter(|(_, waits)| !waits.parts.is_empty())
            .map(|(number, waits)| {
                let block = &self.plan.blocks[number];
                (block.cell, self.ready(block, waits, images))
            })
            .collect();
        in_parallel(drafts, |_, (cell, Ready { draft, world, announced })| {
            let cache = TextureCache::new(&world.model, &world.looks.textures, &announced);
            let setup = BlockSetup::new(target, self.plan.up, &cache, &world.looks.extrudable);
            let blocks = Blocks { world: &world, setup: &setup, lattice: self.plan.lattice };
            let mut built = blocks.build(draft)?;
            if let Some(block) = built.first_mut() {
                let warnings = cache.warnings_of(|texture| world.input_of(texture));
                let texts = warnings.iter().map(|(text, _)| text.to_owned());
                block.report.texture_warnings.extend(texts);
            }
            Ok((cell, built))
        })
    }

    /// A block with its materials.
    fn ready<'b>(
        &self,
        block: &PlannedBlock,
        waits: Waiting,
        images: &'b DecodedImages,
    ) -> Ready<'b> {
        let mut collecting = Collecting::default();
        let mut parts = BlockParts::default();
        let mut largest = (0, String::new(), String::new());
        for (looks, mut of_input) in waits.parts.into_values() {
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
        let world = collecting.finish();
        parts.inner.iter_mut().chain(&mut parts.crossing).for_each(|part| world.fold(part));
        let materials = parts.inner.iter().chain(&parts.crossing).map(|part| part.material);
        let announced = images.announce(&world.model, &world.looks.textures, materials);
        let (_, name, input) = largest;
        let draft = Draft {
            name: block.name.clone(),
            title: [name, input],
            made_of: block.made_of.clone(),
            parts,
            cut: CellCut::new(&self.plan.partition, block.cell),
        };
        Ready { draft, world, announced }
    }

    /// An input is read while blocks are built, unless both are large: a file's model takes about as many
    /// bytes as its text.
    fn fits(&self, current: usize, next: usize) -> bool {
        let bytes = |input: usize| self.preparing.sources.bytes(&self.inputs[input]);
        let both = bytes(current) + bytes(next);
        match self.options.max_memory {
            Some(memory) => both <= memory / 4,
            None => both <= crate::builder::memory::total_bytes() / 16,
        }
    }
}
