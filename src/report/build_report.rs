//! `build.json`: how a result was made and what it is made of.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::format::Subset;
use crate::format::{NodeId, check_regular};
use crate::import::is_model;
use crate::mesh::{OutlineCoverage, UpAxis, Warnings};
use crate::texture::BakeReason;
use crate::{Error, Result, side_file};

/// The contents of `build.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BuildReport {
    /// Version of the program that built it.
    pub version: String,
    /// What it was asked for; the same as [`Scene::parameters`](crate::format::Scene).
    pub parameters: serde_json::Value,
    /// The subset of blocks that was built, and the paths of all inputs; `None` for all blocks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subset: Option<SubsetReport>,
    /// What it was built from, in order of path, so that the order of the arguments changes nothing.
    pub inputs: Vec<InputReport>,
    /// Blocks, in the order of the scene.
    pub blocks: Vec<BlockReport>,
    /// Planned blocks without a triangle: all components in them are kept whole in a neighbour.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub empty_blocks: Vec<EmptyBlock>,
    /// Triangles of all inputs after import.
    pub source_triangles: u64,
    /// Different texels of the source that its triangles use.
    pub source_texels: u64,
    /// One entry a level, the roots' first.
    pub levels: Vec<LevelReport>,
    /// Textures that nodes share, which no level counts.
    #[serde(default)]
    pub shared_textures: SharedTexturesReport,
    /// Stages in the order in which they began.
    pub stages: Vec<StageReport>,
    /// Wall time of the whole, in seconds.
    pub seconds: f64,
    /// Most memory that the process held at any time; 0 where the system does not say.
    pub peak_memory_bytes: u64,
    /// How often each reason or step of the ladder occurred, most frequent first.
    pub outcomes: Vec<Count>,
    /// The files of the tileset, relative to the folder; none in results of versions that wrote
    /// no tileset.
    #[serde(default)]
    pub tilesets: Vec<FileReport>,
    /// How far positions were rounded; `None` where they are the source's to the digits of f32.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantized: Option<Quantized>,
    /// Nodes that have more triangles than their budget allows, in order of id.
    pub over_budget: Vec<OverBudget>,
    /// Nodes with textures of their own instead of the source's charts, in order of id.
    #[serde(default)]
    pub baked: Vec<Baked>,
    /// Nodes above the blocks, in order of their files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub above: Vec<UpperReport>,
    /// What was imperfect and how often, in the order in which it was met.
    pub warnings: Vec<Count>,
}

/// Which share of a build's blocks a result is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SubsetReport {
    /// Which of how many.
    #[serde(flatten)]
    pub subset: Subset,
    /// Paths of all inputs, in order.
    pub all_inputs: Vec<String>,
}

/// A node above the blocks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UpperReport {
    /// Its file.
    pub file: String,
    /// BLAKE3 of all that it is made of, in hexadecimal: the files below it and its borders.
    pub content_hash: String,
}

/// A planned block without a triangle.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct EmptyBlock {
    /// Prefix that its files would have.
    pub name: String,
    /// BLAKE3 of all that it is made of, in hexadecimal.
    pub content_hash: String,
}

/// A block. Whoever takes over its nodes takes over all of this with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BlockReport {
    /// Prefix of the names of its files.
    pub name: String,
    /// BLAKE3 of all that it is made of, in hexadecimal: its inputs' files, its place, and where others
    /// meet it.
    pub content_hash: String,
    /// Triangles of the source that it has or has parts of.
    pub triangles: u64,
    /// Different texels that its triangles use, repeating textures aside.
    pub texels: u64,
    /// Texels of its repeating textures, by a hash of the image.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub repeating: BTreeMap<String, u64>,
    /// Open edges of it that touch other borders without sharing vertices, and are joined with them
    /// on all levels but the leaves'.
    #[serde(default)]
    pub stitched_edges: u64,
    /// How often each step of the ladder made one of its nodes, most frequent first.
    pub outcomes: Vec<Count>,
    /// Coarse nodes that are not written, by file.
    #[serde(default)]
    pub left_out: Vec<SkippedNodeReport>,
    /// Warnings and how often each occurred, in order of occurrence.
    pub warnings: Vec<Count>,
    /// Warnings of its textures, which other blocks may share.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub texture_warnings: Vec<String>,
}

/// An input of the command line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputReport {
    /// Path as given, or as found in a given folder.
    pub path: String,
    /// All files that were read for it or that it names: the model, its materials, its textures.
    pub files: Vec<FileReport>,
    /// Number of triangles after import.
    pub triangles: u64,
    /// Which of its axes points at the sky.
    pub up: UpAxis,
    /// The evidence that determined the axis; `None` in results of earlier versions.
    #[serde(default)]
    pub up_from: Option<UpFrom>,
    /// Warnings and how often each occurred, in order of occurrence.
    pub warnings: Vec<Count>,
}

/// A file that was read.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileReport {
    /// Its path.
    pub path: String,
    /// Its size; 0 where it was not there.
    pub bytes: u64,
    /// BLAKE3 of its contents, in hexadecimal; empty where it was not there.
    pub blake3: String,
}

/// The rounding of a quantised build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantized {
    /// Positions are multiples of it; a power of two.
    pub step_metres: f64,
    /// Farthest that a vertex of the source may be from where a leaf has it.
    pub bound_metres: f64,
    /// Nodes that are larger than 16 bits reach: their positions take 32 bits.
    pub large_nodes: u64,
}

/// How it is known which axis points at the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpFrom {
    /// It was asked for.
    Option,
    /// The input's format says so.
    Format,
    /// From the shape: an assumption.
    Shape,
    /// Longitude, latitude and height, in this order: an assumption.
    Degrees,
}

impl FileReport {
    /// Reads a file on disk. A path without a regular file that may be opened has no bytes: should a
    /// file appear there, that is a change. A texture or library that is too large to be read is known by
    /// its size alone.
    pub fn read(path: &Path) -> Result<Self> {
        let failed = |error: std::io::Error| Error::input(path, format!("cannot be read: {error}"));
        let name = path.to_string_lossy().into_owned();
        let unread = |bytes| Ok(Self { path: name.clone(), bytes, ..Self::default() });
        match check_regular(path) {
            Err(_) => return unread(0),
            Ok(metadata) if metadata.len() > side_file::MOST_BYTES && !is_model(path) => {
                return unread(metadata.len());
            }
            Ok(_) => {}
        }
        let file = match File::open(path) {
            Err(error) if error.kind() == ErrorKind::PermissionDenied => return unread(0),
            opened => opened.map_err(failed)?,
        };
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(file).map_err(failed)?;
        Ok(Self {
            path: name,
            bytes: hasher.count(),
            blake3: hasher.finalize().to_hex().to_string(),
        })
    }

    /// Of a file's contents.
    pub fn of(path: &str, bytes: &[u8]) -> Self {
        Self {
            path: path.into(),
            bytes: bytes.len() as u64,
            blake3: blake3::hash(bytes).to_hex().to_string(),
        }
    }
}

/// The nodes of one level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelReport {
    /// Steps from the root.
    pub level: u32,
    /// Number of nodes.
    pub nodes: u64,
    /// Triangles of all of them.
    pub triangles: u64,
    /// Triangles with a texture.
    pub textured_triangles: u64,
    /// Texels of textures in the nodes' files.
    pub texels: u64,
    /// Bytes of the nodes' files.
    pub bytes: u64,
    /// Nodes that missed their budget.
    pub over_budget: u64,
}

/// Textures that several nodes refer to, each in a file of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SharedTexturesReport {
    /// Number of files.
    pub files: u64,
    /// Texels of all of them.
    pub texels: u64,
    /// Bytes of all of them.
    pub bytes: u64,
}

impl SharedTexturesReport {
    /// Those of a scene.
    pub fn of(scene: &crate::format::Scene) -> Self {
        let textures = &scene.shared_textures;
        Self {
            files: textures.len() as u64,
            texels: textures.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum(),
            bytes: textures.iter().map(|texture| texture.bytes).sum(),
        }
    }
}

/// How long a stage took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// Its name.
    pub stage: String,
    /// Processor seconds, summed over the threads that worked on it; wall seconds of each thread
    /// where the system has no clock of a thread's processor time.
    pub seconds: f64,
}

/// A text and how often it applies.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// What happened.
    pub text: String,
    /// How often.
    pub count: u64,
}

impl Count {
    /// The entries of a list of warnings.
    pub fn of_warnings(warnings: &Warnings) -> Vec<Self> {
        warnings.iter().map(|(text, count)| Self { text: text.into(), count }).collect()
    }
}

/// Sums up equal texts; the most frequent first, then by text.
pub fn most_frequent(counts: impl IntoIterator<Item = Count>) -> Vec<Count> {
    let mut sums: BTreeMap<String, u64> = BTreeMap::new();
    for Count { text, count } in counts {
        *sums.entry(text).or_insert(0) += count;
    }
    let mut sums: Vec<Count> =
        sums.into_iter().map(|(text, count)| Count { text, count }).collect();
    sums.sort_by_key(|sum| std::cmp::Reverse(sum.count));
    sums
}

/// A node that missed its budget.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverBudget {
    /// [`Node::id`](crate::format::Node).
    pub id: NodeId,
    /// [`Node::file`](crate::format::Node).
    pub file: String,
    /// Triangles that it should have at most.
    pub budget: u64,
    /// Triangles that it has.
    pub triangles: u64,
    /// Why.
    pub reason: String,
}

/// A coarse node that is not written, since it would keep less than 88 % of the ground that its
/// source covers, or of its skyline, even with almost as many triangles as those below it. These
/// stand in its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkippedNodeReport {
    /// The name that its file would have.
    pub file: String,
    /// The triangles that it would have.
    pub triangles: u64,
    /// What it would keep with these.
    pub kept: OutlineCoverage,
}

/// A node that was simplified across texture seams and has a texture of its own.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Baked {
    /// [`Node::id`](crate::format::Node).
    pub id: NodeId,
    /// [`Node::file`](crate::format::Node).
    pub file: String,
    /// Why.
    pub reason: BakeReason,
}

impl BuildReport {
    /// The contents of `build.json`, indented, with a line break at the end.
    pub fn to_json(&self) -> Result<String> {
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|error| Error::Internal(format!("build report: {error}")))
    }
}

/// Sums up a scene by level; `over_budget` is left at 0 for the caller to fill in.
pub fn level_reports(scene: &crate::format::Scene) -> Vec<LevelReport> {
    let mut levels = vec![LevelReport::default(); scene.level_count()];
    for (level, number) in levels.iter_mut().zip(0..) {
        level.level = number;
    }
    for node in &scene.nodes {
        let level = &mut levels[node.level as usize];
        level.nodes += 1;
        level.triangles += u64::from(node.triangles);
        level.textured_triangles += u64::from(node.textured_triangles);
        level.texels += node.texels;
        level.bytes += node.file_bytes;
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_back_what_it_wrote() {
        let report = BuildReport {
            version: "1.2.3".into(),
            parameters: serde_json::json!({ "level_factor": 4 }),
            stages: vec![StageReport { stage: "import".into(), seconds: 0.1 + 0.2 }],
            warnings: vec![Count { text: "a.mtl: not found".into(), count: 2 }],
            ..BuildReport::default()
        };
        let text = report.to_json().unwrap();
        assert!(text.ends_with("}\n"));
        assert_eq!(serde_json::from_str::<BuildReport>(&text).unwrap(), report);
    }
}
