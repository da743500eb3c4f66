//! Writes a block's nodes: textures them, encodes them as GLB, and records them for `scene.hlod`.

use std::collections::BTreeMap;

use crate::builder::border::skirt;
use crate::builder::hierarchy::{NodeDraft, NodeSink};
use crate::builder::progress::Progress;
use crate::builder::simplify::ladder::BUDGET_TOLERANCE;
use crate::builder::simplify::simplified::LadderStep;
use crate::builder::stages::{Stage, Stages};
use crate::format::attributes::{Attributes, attributes};
use crate::format::{
    Encoding, NODES_DIR, NodeId, NodeImageData, NodeLabel, NodeMesh, OutputDir, file_crc,
    write_glb_encoded,
};
use crate::mesh::{Mesh, OutlineCoverage, UpAxis, Warnings};
use crate::texture::{AppendedSkirts, BakeReason, BakedMesh, BlockTextures, TexturedNode};
use crate::{Error, Result};

/// The record of a written node.
#[derive(Clone, Debug)]
pub struct NodeRecord {
    /// Identity, from the file's name.
    pub id: NodeId,
    /// File name inside `nodes/`.
    pub file: String,
    /// Size of the file.
    pub file_bytes: u64,
    /// Checksum of the file.
    pub file_crc: u32,
    /// Source coordinates of the file's origin.
    pub origin: [f64; 3],
    /// From its geometry.
    pub attributes: Attributes,
    /// Bound on the distance to the source, metres; not yet monotone.
    pub geometric_error: f64,
    /// Mean distance to the source, metres.
    pub mean_error: f64,
    /// 95th percentile of it.
    pub p95_error: f64,
    /// Width and height of each of its own images, in the order of the file.
    pub pictures: Vec<[u32; 2]>,
    /// Names and texels of the shared textures that it uses.
    pub shared: BTreeMap<String, u64>,
    /// Its triangle budget.
    pub budget: usize,
    /// The step that made it; `None` if it was reused from an earlier build.
    pub step: Option<LadderStep>,
    /// Why it has a baked texture, if it has one.
    pub baked: Option<BakeReason>,
    /// Why it exceeds its budget, if it does.
    pub reason: Option<String>,
    /// The number of its block in the scene; `None` of a node above blocks, and while blocks have none.
    pub block: Option<u32>,
    /// Warnings about it.
    pub warnings: Warnings,
}

impl NodeRecord {
    /// Texels of its own images.
    pub fn own_texels(&self) -> u64 {
        self.pictures.iter().map(|&[width, height]| u64::from(width) * u64::from(height)).sum()
    }
}

/// Writes the nodes of one block.
pub struct DiskSink<'a> {
    /// The block's textures at every level.
    pub textures: &'a BlockTextures<'a>,
    /// The output folder.
    pub out: &'a OutputDir,
    /// Beginning of the block's file names; unique in the output.
    pub prefix: String,
    /// Source coordinates of the block's origin.
    pub origin: [f64; 3],
    /// For glTF's axes.
    pub up: UpAxis,
    /// How geometry is stored.
    pub encoding: Encoding,
    /// The copyright notice of all inputs.
    pub copyright: Option<&'a str>,
    /// `c_textured`.
    pub textured_weight: f64,
    /// Timers of the stages.
    pub stages: &'a Stages,
    /// Told of finished leaves.
    pub progress: &'a dyn Progress,
}

/// The name of a node's file: of its block, and child numbers from the block's root down.
pub fn file_name(prefix: &str, child_path: &[u32]) -> String {
    let child_path: Vec<String> = child_path.iter().map(u32::to_string).collect();
    match &child_path[..] {
        [] => format!("{prefix}.glb"),
        numbers => format!("{prefix}-{}.glb", numbers.join(".")),
    }
}

impl NodeSink for DiskSink<'_> {
    type Record = NodeRecord;

    fn take(&self, node: &NodeDraft) -> Result<NodeRecord> {
        let file = file_name(&self.prefix, node.child_path);
        let id = NodeId::of_file(&file);
        let baked = node.baked.and_then(|_| {
            self.stages.time(Stage::Bake, || self.textures.bake(node.mesh, node.resolution))
        });
        let textured = self.stages.time(Stage::Atlas, || match baked {
            Some(baked) => self.baked(node, baked),
            None => self.textured(node),
        })?;
        let TexturedNode { mut mesh, warnings, .. } = textured;
        self.stages.time(Stage::Write, || {
            let label = NodeLabel { id, level: node.level() as u32 };
            self.encoding.prepare(&mut mesh);
            let write = |mesh: &NodeMesh| {
                write_glb_encoded(mesh, self.up, label, self.encoding, self.copyright)
            };
            let mut bytes = write(&mesh)?;
            if self.textures.embed_small(&mut mesh, bytes.len(), node.resolution) {
                bytes = write(&mesh)?;
            }
            self.out.write(format!("{NODES_DIR}/{file}"), &bytes)?;
            let attributes = attributes(&mesh, self.textured_weight);
            let pictures = mesh
                .images
                .iter()
                .filter(|image| matches!(image.data, NodeImageData::Embedded { .. }))
                .map(|image| [image.width, image.height])
                .collect();
            let shared = mesh
                .images
                .iter()
                .filter_map(|image| match &image.data {
                    NodeImageData::Shared { file_name } => {
                        let texels = u64::from(image.width) * u64::from(image.height);
                        Some((file_name.to_string(), texels))
                    }
                    NodeImageData::Embedded { .. } => None,
                })
                .collect();
            Ok(NodeRecord {
                id,
                file,
                file_bytes: bytes.len() as u64,
                file_crc: file_crc(&bytes),
                origin: mesh.origin,
                attributes,
                geometric_error: node.error.bound,
                mean_error: node.error.mean,
                p95_error: node.error.p95,
                pictures,
                shared,
                budget: node.budget,
                step: Some(node.step),
                baked: node.baked,
                reason: over_budget(node, attributes.triangles as usize),
                block: None,
                warnings,
            })
        })
    }

    fn leaves_done(&self, triangles: usize) {
        self.progress.built(triangles as u64);
    }
}

impl DiskSink<'_> {
    fn baked(&self, node: &NodeDraft, mut baked: BakedMesh) -> Result<TexturedNode> {
        let skirts = skirt::rehung(node.skirts, node.mesh, &baked.mesh);
        let skirts = skirt::append(&mut baked.mesh, &skirts);
        self.textures.baked_node_mesh(&baked, &skirts, node.resolution, self.origin)
    }

    fn textured(&self, node: &NodeDraft) -> Result<TexturedNode> {
        if node.skirts.is_empty() {
            let none = AppendedSkirts::default();
            return self.textures.node_mesh(node.mesh, &none, node.resolution, self.origin);
        }
        let mut mesh: Mesh = node.mesh.clone();
        let skirts = skirt::append(&mut mesh, node.skirts);
        self.textures.node_mesh(&mesh, &skirts, node.resolution, self.origin)
    }
}

/// Why a node exceeds its triangle budget.
fn over_budget(node: &NodeDraft, triangles: usize) -> Option<String> {
    if node.step == LadderStep::Original
        || triangles as f64 <= (node.budget as f64 * BUDGET_TOLERANCE).ceil()
    {
        return None;
    }
    if let Some(OutlineCoverage { area, skyline, .. }) = node.within_budget {
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(1.0);
        return Some(format!(
            "within its budget it keeps {:.1} % of the covered ground and {:.1} % of the skyline",
            percent(area),
            percent(skyline)
        ));
    }
    let skirts = skirt::triangles_of(node.skirts);
    Some(if triangles - skirts <= node.budget {
        format!("its long border needs {skirts} triangles of skirts")
    } else {
        format!("{} border vertices shared with neighbours cannot be removed", node.locked)
    })
}

/// Checks that no two nodes have the same id.
pub fn check_unique(ids: &mut [(NodeId, String)]) -> Result<()> {
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => Err(Error::Internal(format!(
            "nodes {} and {} have the same id; rename one of the inputs",
            pair[0].1, pair[1].1
        ))),
        None => Ok(()),
    }
}
