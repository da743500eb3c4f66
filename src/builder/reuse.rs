//! Taking over from an earlier result what has not changed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::Result;
use crate::builder::block::BuiltBlock;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::hierarchy::Tree;
use crate::builder::options::same_nodes;
use crate::format::attributes::Attributes;
use crate::format::rims::Rims;
use crate::format::{
    NODES_DIR, NodeId, OutputDir, REPORT_FILE, Scene, SharedTexture, TEXTURES_DIR,
};
use crate::mesh::Warnings;
use crate::report::build_report::{BuildReport, DistrictReport, FileReport, InputReport};

/// A result whose nodes were made by this version with the same parameters, and are whole.
pub struct Earlier {
    dir: PathBuf,
    /// Its scene.
    pub scene: Scene,
    /// How it was made.
    pub report: BuildReport,
    /// True where its tileset is whole, and for the same place.
    pub tileset: bool,
    /// The report of each input, by path.
    input_of: FxHashMap<String, usize>,
    /// The roots of each input's blocks, by path, in the scene's order.
    roots_of: FxHashMap<String, Vec<u32>>,
    /// The reports of districts, by file.
    district_of: FxHashMap<String, usize>,
    /// Nodes, by file.
    node_of: FxHashMap<String, u32>,
    /// Entries of the report on nodes over their budget, by id.
    over_budget_of: FxHashMap<NodeId, usize>,
}

fn is_as_written(dir: &Path, file: &FileReport) -> bool {
    crate::format::read_regular(&dir.join(&file.path))
        .is_ok_and(|bytes| FileReport::of(&file.path, &bytes) == *file)
}

/// What an unchanged input contributes.
pub struct Taken {
    /// Its blocks; their files are in the new output already.
    pub blocks: Vec<BuiltBlock>,
    /// Shared textures that its nodes use, by name; likewise.
    pub shared_textures: BTreeMap<String, SharedTexture>,
}

impl Earlier {
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
        let mut roots_of: FxHashMap<String, Vec<u32>> = FxHashMap::default();
        for root in scene.block_roots() {
            if let Some(block) = scene.nodes[root as usize].block {
                let input = scene.blocks[block as usize].input.clone();
                roots_of.entry(input).or_default().push(root);
            }
        }
        let inputs = report.inputs.iter().map(|input| input.path.clone());
        let districts = report.districts.iter().map(|district| district.file.clone());
        let nodes = scene.nodes.iter().map(|node| node.file.clone());
        Some(Self {
            dir: dir.to_path_buf(),
            input_of: inputs.zip(0..).collect(),
            roots_of,
            district_of: districts.zip(0..).collect(),
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
    pub fn input(&self, path: &str) -> Option<&InputReport> {
        self.input_of.get(path).map(|&at| &self.report.inputs[at])
    }

    /// Links the files of an input's blocks into the new output.
    pub fn take_over(&self, input: &InputReport, output: &OutputDir) -> Result<Taken> {
        let mut taken = Taken { blocks: Vec::new(), shared_textures: BTreeMap::new() };
        // A block may have several roots, which may be in different districts.
        let mut blocks: BTreeMap<u32, BuiltBlock> = BTreeMap::new();
        for &root in self.roots_of.get(&input.path).into_iter().flatten() {
            let Some(block) = self.scene.nodes[root as usize].block else { continue };
            let info = &self.scene.blocks[block as usize];
            let tree = self.tree(root, output, &mut taken)?;
            let built = blocks.entry(block);
            let new = || BuiltBlock { info: info.clone(), trees: Vec::new() };
            built.or_insert_with(new).trees.push(tree);
        }
        taken.blocks = blocks.into_values().collect();
        self.link_textures(taken.shared_textures.keys(), output)?;
        Ok(taken)
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

    /// The rims of its districts; none where it has none that can be read, and all are found out again.
    pub fn rims(&self) -> Rims {
        Rims::read(&self.dir).unwrap_or_default()
    }

    /// Links the file of a district into the new output, where it is made of what it was made of then.
    pub fn take_over_district(
        &self,
        district: &DistrictReport,
        output: &OutputDir,
    ) -> Result<Option<(NodeRecord, BTreeMap<String, SharedTexture>)>> {
        let known = self.district_of.get(&district.file).map(|&at| &self.report.districts[at]);
        let Some(&index) = self.node_of.get(&district.file).filter(|_| known == Some(district))
        else {
            return Ok(None);
        };
        let mut taken = Taken { blocks: Vec::new(), shared_textures: BTreeMap::new() };
        let record = self.record(index, output, &mut taken)?;
        Ok(Some((record, taken.shared_textures)))
    }

    fn tree(&self, index: u32, output: &OutputDir, taken: &mut Taken) -> Result<Tree<NodeRecord>> {
        let children = self
            .scene
            .children(index)
            .map(|child| self.tree(child, output, taken))
            .collect::<Result<Vec<_>>>()?;
        Ok(Tree { record: self.record(index, output, taken)?, children })
    }

    /// A node, its file linked into the new output.
    fn record(&self, index: u32, output: &OutputDir, taken: &mut Taken) -> Result<NodeRecord> {
        let node = &self.scene.nodes[index as usize];
        output.reuse(&self.dir, format!("{NODES_DIR}/{}", node.file))?;
        let mut shared = Vec::new();
        for &number in &node.shared_textures {
            let texture = &self.scene.shared_textures[number as usize];
            shared.push((
                texture.file_name.clone(),
                u64::from(texture.width) * u64::from(texture.height),
            ));
            taken.shared_textures.insert(texture.file_name.clone(), texture.clone());
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
