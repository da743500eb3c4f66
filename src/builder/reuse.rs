//! Taking over from an earlier result what has not changed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::Result;
use crate::builder::built::BuiltBlocks;
use crate::builder::built::{BuiltBlock, border_file};
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::hierarchy::Tree;
use crate::builder::options::same_nodes;
use crate::builder::plan::{KnownInput, PlannedBlock};
use crate::builder::progress::Progress;
use crate::builder::scans::known_inputs;
use crate::format::attributes::Attributes;
use crate::format::{
    NODES_DIR, NodeId, OutputDir, REPORT_FILE, Scene, SharedTexture, TEXTURES_DIR,
};
use crate::mesh::Warnings;
use crate::report::build_report::{BlockReport, BuildReport, FileReport, UpperReport};

/// A result whose nodes were made by this version with the same parameters, and are whole.
pub struct PreviousBuild {
    dir: PathBuf,
    /// Its scene.
    pub scene: Scene,
    /// How it was made.
    pub report: BuildReport,
    /// True where its tileset is whole, and for the same place.
    pub tileset: bool,
    /// Facts of its inputs.
    inputs: Vec<KnownInput>,
    /// Index of inputs by path.
    input_of: FxHashMap<String, usize>,
    /// The roots of each block, in the scene's order.
    roots_of: Vec<Vec<u32>>,
    /// Blocks, by what they are made of.
    block_of: FxHashMap<String, Vec<usize>>,
    /// The reports of nodes above blocks, by file.
    upper_of: FxHashMap<String, usize>,
    /// Nodes, by file.
    node_of: FxHashMap<String, u32>,
    /// Entries of the report on nodes over their budget, by id.
    over_budget_of: FxHashMap<NodeId, usize>,
}

fn is_as_written(dir: &Path, file: &FileReport) -> bool {
    crate::format::read_regular(&dir.join(&file.path))
        .is_ok_and(|bytes| FileReport::of(&file.path, &bytes) == *file)
}

impl PreviousBuild {
    /// `None` where there is none, or none that can be used.
    pub fn open(dir: &Path, parameters: &serde_json::Value) -> Option<Self> {
        let scene = Scene::read(dir).ok()?;
        let text = std::fs::read_to_string(dir.join(REPORT_FILE)).ok()?;
        let report: BuildReport = serde_json::from_str(&text).ok()?;
        let same = report.version == env!("CARGO_PKG_VERSION")
            && same_nodes(&report.parameters, parameters)
            && report.parameters == scene.parameters;
        let whole = || {
            scene.nodes.iter().all(|node| {
                std::fs::metadata(dir.join(NODES_DIR).join(&node.file))
                    .is_ok_and(|facts| facts.len() == node.file_bytes)
            }) && scene.shared_textures.iter().all(|texture| {
                std::fs::metadata(dir.join(TEXTURES_DIR).join(&texture.file_name))
                    .is_ok_and(|facts| facts.len() == texture.bytes)
            })
        };
        if !(same && whole()) {
            return None;
        }
        let tileset = !report.tilesets.is_empty()
            && report.parameters == *parameters
            && report.tilesets.par_iter().all(|file| is_as_written(dir, file));
        if report.blocks.len() != scene.blocks.len() {
            return None;
        }
        let borders = |block: &BlockReport| dir.join(border_file(&block.name)).is_file();
        if !report.blocks.iter().all(borders) {
            return None;
        }
        let mut roots_of: Vec<Vec<u32>> = vec![Vec::new(); scene.blocks.len()];
        for root in scene.block_roots() {
            if let Some(block) = scene.nodes[root as usize].block {
                roots_of[block as usize].push(root);
            }
        }
        let mut block_of: FxHashMap<String, Vec<usize>> = FxHashMap::default();
        for (number, block) in report.blocks.iter().enumerate() {
            block_of.entry(block.content_hash.clone()).or_default().push(number);
        }
        for block in &report.empty_blocks {
            block_of.entry(block.content_hash.clone()).or_default();
        }
        let inputs = known_inputs(dir, &report.inputs)?;
        let paths = inputs.iter().map(|input| input.report.path.clone());
        let uppers = report.above.iter().map(|upper| upper.file.clone());
        let nodes = scene.nodes.iter().map(|node| node.file.clone());
        Some(Self {
            dir: dir.to_path_buf(),
            input_of: paths.zip(0..).collect(),
            inputs,
            roots_of,
            block_of,
            upper_of: uppers.zip(0..).collect(),
            node_of: nodes.zip(0..).collect(),
            over_budget_of: report.over_budget.iter().map(|over| over.id).zip(0..).collect(),
            scene,
            report,
            tileset,
        })
    }

    /// Whether it is what a build that was stopped had finished: every whole result has levels.
    pub fn is_unfinished(&self) -> bool {
        self.report.levels.is_empty()
    }

    /// What it knows of an input.
    pub fn input(&self, path: &str) -> Option<&KnownInput> {
        self.input_of.get(path).map(|&at| &self.inputs[at])
    }

    /// Returns the facts of all inputs, in order.
    pub fn inputs(&self) -> &[KnownInput] {
        &self.inputs
    }

    /// Returns the numbers of the blocks with a name and content hash: none if the block was empty, several if
    /// outliers have blocks of their own. `None` if there is no such block.
    pub fn blocks(&self, name: &str, content_hash: &str) -> Option<&[usize]> {
        let numbers = self.block_of.get(content_hash)?;
        let is_of = |&number: &usize| self.report.blocks[number].name.starts_with(name);
        numbers.iter().all(is_of).then_some(numbers)
    }

    /// Reuses the [blocks](Self::blocks) of a planned block.
    pub fn reuse_blocks(
        &self,
        block: &PlannedBlock,
        numbers: &[usize],
        output: &OutputDir,
        progress: &dyn Progress,
        made: &mut BuiltBlocks,
    ) -> Result<()> {
        if numbers.is_empty() {
            made.empty.push(block.empty());
        }
        for &number in numbers {
            self.reuse_block(number, block.cell, output, made)?;
            progress.built(self.report.blocks[number].triangles);
        }
        Ok(())
    }

    /// Links the files of a block into the new output.
    fn reuse_block(
        &self,
        number: usize,
        cell: u32,
        output: &OutputDir,
        made: &mut BuiltBlocks,
    ) -> Result<()> {
        let mut textures = BTreeMap::new();
        let mut trees = Vec::new();
        for &root in &self.roots_of[number] {
            trees.push(self.tree(root, output, &mut textures)?);
        }
        self.link_textures(textures.keys(), output)?;
        made.reused_textures.extend(textures);
        let report = self.report.blocks[number].clone();
        output.reuse(&self.dir, border_file(&report.name))?;
        let info = self.scene.blocks[number].clone();
        made.blocks.entry(cell).or_default().push(BuiltBlock { info, trees, report });
        Ok(())
    }

    /// Links shared textures into the new output that are not there yet: several nodes may have one.
    pub fn link_textures<'a>(
        &self,
        names: impl Iterator<Item = &'a String>,
        output: &OutputDir,
    ) -> Result<()> {
        for name in names {
            let relative = format!("{TEXTURES_DIR}/{name}");
            if !output.path().join(&relative).exists() {
                output.reuse(&self.dir, relative)?;
            }
        }
        Ok(())
    }

    /// Links the file of a node above blocks into the new output, where it is made of what it was made of then.
    pub fn reuse_upper(
        &self,
        upper: &UpperReport,
        output: &OutputDir,
    ) -> Result<Option<(NodeRecord, BTreeMap<String, SharedTexture>)>> {
        let known = self.upper_of.get(&upper.file).map(|&at| &self.report.above[at]);
        let Some(&index) = self.node_of.get(&upper.file).filter(|_| known == Some(upper)) else {
            return Ok(None);
        };
        let mut textures = BTreeMap::new();
        let record = self.record(index, output, &mut textures)?;
        Ok(Some((record, textures)))
    }

    fn tree(
        &self,
        index: u32,
        output: &OutputDir,
        textures: &mut BTreeMap<String, SharedTexture>,
    ) -> Result<Tree<NodeRecord>> {
        let children = self
            .scene
            .children(index)
            .map(|child| self.tree(child, output, textures))
            .collect::<Result<Vec<_>>>()?;
        Ok(Tree { record: self.record(index, output, textures)?, children })
    }

    /// A node, its file linked into the new output.
    fn record(
        &self,
        index: u32,
        output: &OutputDir,
        textures: &mut BTreeMap<String, SharedTexture>,
    ) -> Result<NodeRecord> {
        let node = &self.scene.nodes[index as usize];
        output.reuse(&self.dir, format!("{NODES_DIR}/{}", node.file))?;
        let mut shared = BTreeMap::new();
        for &number in &node.shared_textures {
            let texture = &self.scene.shared_textures[number as usize];
            let texels = u64::from(texture.width) * u64::from(texture.height);
            shared.insert(texture.file_name.clone(), texels);
            textures.insert(texture.file_name.clone(), texture.clone());
        }
        let over = self.over_budget_of.get(&node.id).map(|&at| &self.report.over_budget[at]);
        // In order of id.
        let baked = self.report.baked.binary_search_by_key(&node.id, |baked| baked.id);
        let baked = baked.ok().map(|place| &self.report.baked[place]);
        Ok(NodeRecord {
            id: node.id,
            file: node.file.clone(),
            file_bytes: node.file_bytes,
            file_crc: node.file_crc,
            origin: node.origin,
            attributes: Attributes {
                triangles: node.triangles,
                textured_triangles: node.textured_triangles,
                vertices: node.vertices,
                bbox_min: node.bbox_min,
                bbox_max: node.bbox_max,
                cost: node.cost,
                static_benefit: node.static_benefit,
                average_normal: node.average_normal.map(f64::from),
            },
            geometric_error: node.geometric_error,
            mean_error: node.mean_error,
            p95_error: node.p95_error,
            pictures: node.pictures.clone(),
            shared,
            budget: over.map_or(0, |over| over.budget as usize),
            step: None,
            baked: baked.map(|baked| baked.reason),
            reason: over.map(|over| over.reason.clone()),
            block: None,
            warnings: Warnings::default(),
        })
    }
}
