//! Nodes above the blocks: the upper cells of the partition.
//!
//! A cell whose nodes have together about the triangles that the children of a node have becomes a node
//! above them. It is made from their files ([`members`]) and from the borders of its blocks ([`border`]),
//! so that what is needed of a city does not grow with its detail, and blocks of earlier builds and of
//! other machines are one case with those of this build.

mod below;
pub mod border;
pub mod members;

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use rustc_hash::FxHashSet;

use self::below::Files;
use crate::Error;
use crate::Result;
use crate::builder::block_setup::{Appearances, BlockPlace, BlockSetup, Target};
use crate::builder::border::chain::KeepRule;
use crate::builder::built::border_file;
use crate::builder::cut::mark::{Marks, mark_border};
use crate::builder::cut::record::RecordedBorder;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::emit::shared_textures::write_textures;
use crate::builder::folding::merge_untextured;
use crate::builder::gather::{gather, localise};
use crate::builder::hierarchy::{BorderMode, MemberSurfaces, Resolutions, Tree};
use crate::builder::options::BuildOptions;
use crate::builder::partition::{CellBox, Partition, Split};
use crate::builder::reuse::PreviousBuild;
use crate::builder::stages::Stage;
use crate::builder::stitch::{OpenEdge, stitches};
use crate::format::{SharedTexture, read_regular};
use crate::lattice::Lattice;
use crate::mesh::{PositionKey, UpAxis, Warnings, key};
use crate::report::build_report::UpperReport;
use crate::texture::{DecodedImages, SharedTextures, TextureCache};

/// A node has at most about so many times the children that a node of a block has: members of few
/// triangles each would otherwise make nodes that are replaced by very many at once.
const MOST_MEMBERS: usize = 4;

/// The trees of a scene, those of blocks below those of the nodes above them.
#[derive(Debug, Default)]
pub struct Uppers {
    /// The trees.
    pub trees: Vec<Tree<NodeRecord>>,
    /// Content hashes of the nodes, in order of files.
    pub reports: Vec<UpperReport>,
    /// Warnings of all upper nodes.
    pub warnings: Warnings,
}

/// The trees of a block, and the name of its files.
#[derive(Debug, Default)]
pub struct BlockTrees {
    /// Prefixes of its files.
    pub names: Vec<String>,
    /// Node trees.
    pub trees: Vec<Tree<NodeRecord>>,
}

/// Builds nodes above blocks.
pub struct UpperBuilder<'a> {
    /// Options and output. The output folder has the files of the nodes below.
    pub target: Target<'a>,
    /// A result whose nodes are taken over where they are made of the same.
    pub earlier: Option<&'a PreviousBuild>,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// The cells.
    pub partition: &'a Partition,
    /// Lattice of the blocks' vertices.
    pub lattice: Lattice,
}

/// The trees and the border of a cell.
struct Built {
    trees: Vec<Tree<NodeRecord>>,
    border: RecordedBorder,
}

/// Results that all cells add to.
struct Gathered<'a> {
    blocks: Mutex<BTreeMap<u32, BlockTrees>>,
    textures: Mutex<&'a mut BTreeMap<String, SharedTexture>>,
    uppers: Mutex<Uppers>,
}

impl UpperBuilder<'_> {
    /// Builds nodes above the trees of blocks, by the blocks' cells. Shared textures, which are written, are
    /// added to `textures`.
    pub fn build(
        &self,
        blocks: BTreeMap<u32, BlockTrees>,
        textures: &mut BTreeMap<String, SharedTexture>,
    ) -> Result<Uppers> {
        let gathered = Gathered {
            blocks: Mutex::new(blocks),
            textures: Mutex::new(textures),
            uppers: Mutex::default(),
        };
        let Built { trees, .. } = self.cell(0, &gathered)?;
        let mut uppers = gathered.uppers.into_inner().unwrap_or_else(PoisonError::into_inner);
        uppers.reports.sort_by(|a, b| a.file.cmp(&b.file));
        uppers.trees = trees;
        Ok(uppers)
    }

    fn cell(&self, number: u32, gathered: &Gathered) -> Result<Built> {
        let cell = self.partition.cell(number);
        let Built { mut trees, border } = match cell.split {
            None => self.block(number, gathered)?,
            Some(Split { children: [below, above], .. }) => {
                let (below, above) =
                    rayon::join(|| self.cell(below, gathered), || self.cell(above, gathered));
                let (below, above) = (below?, above?);
                let border = border::joined(below.border, above.border, &cell.place);
                Built { trees: [below.trees, above.trees].concat(), border }
            }
        };
        // One node at the top, whatever it has below.
        if trees.len() > 1 && (number == 0 || self.is_enough(&trees)) {
            trees = self.node(number, trees, &border, gathered)?;
        }
        Ok(Built { trees, border })
    }

    fn block(&self, number: u32, gathered: &Gathered) -> Result<Built> {
        let block = {
            let mut blocks = gathered.blocks.lock().unwrap_or_else(PoisonError::into_inner);
            blocks.remove(&number).unwrap_or_default()
        };
        let BlockTrees { names, trees } = block;
        let mut border = RecordedBorder::default();
        for name in names {
            let path = self.target.out.path().join(border_file(&name));
            let bytes = read_regular(&path)
                .map_err(|error| Error::output(&path, format!("cannot be read again: {error}")))?;
            border.faces.extend(RecordedBorder::from_bytes(&bytes, &path)?.faces);
        }
        Ok(Built { trees, border })
    }

    /// Returns whether trees have together as many triangles as the children of a node.
    fn is_enough(&self, trees: &[Tree<NodeRecord>]) -> bool {
        let BuildOptions { hierarchy, .. } = self.target.options;
        let (budget, factor) =
            (u64::from(hierarchy.desired_tris), u64::from(hierarchy.level_factor));
        let triangles: u64 =
            trees.iter().map(|tree| u64::from(tree.record.attributes.triangles)).sum();
        triangles >= budget * factor || trees.len() >= MOST_MEMBERS * factor as usize
    }

    /// A node above the trees of a cell; the trees themselves where it would keep too little of them.
    fn node(
        &self,
        number: u32,
        members: Vec<Tree<NodeRecord>>,
        border: &RecordedBorder,
        gathered: &Gathered,
    ) -> Result<Vec<Tree<NodeRecord>>> {
        let lattice = self.lattice_of(&members);
        let file = file_of(&members);
        let content_hash = content_hash(&members, border, lattice);
        let report = UpperReport { file, content_hash };
        if let Some(earlier) = self.earlier
            && let Some((record, reused)) = earlier.reuse_upper(&report, self.target.out)?
        {
            earlier.link_textures(reused.keys(), self.target.out)?;
            let mut textures = gathered.textures.lock().unwrap_or_else(PoisonError::into_inner);
            textures.extend(reused);
            let mut uppers = gathered.uppers.lock().unwrap_or_else(PoisonError::into_inner);
            uppers.reports.push(report);
            return Ok(vec![Tree { record, children: members }]);
        }
        let shared = SharedTextures::new();
        let target = Target { shared: &shared, ..self.target };
        let (made, mut warnings) = self.made(target, number, &members, border, lattice)?;
        {
            // Whatever is above reads them.
            let mut textures = gathered.textures.lock().unwrap_or_else(PoisonError::into_inner);
            let all = write_textures(shared, std::mem::take(&mut **textures), self.target.out)?;
            **textures = all;
        }
        let mut uppers = gathered.uppers.lock().unwrap_or_else(PoisonError::into_inner);
        let trees = match made {
            Some(record) => {
                warnings.extend(record.warnings.clone());
                uppers.reports.push(report);
                vec![Tree { record, children: members }]
            }
            None => {
                let what =
                    "node above blocks left out, since it would keep too little of the outline";
                warnings.add(what, 1);
                members
            }
        };
        uppers.warnings.extend(warnings);
        Ok(trees)
    }

    /// The record of a node above others; `None` where it would keep too little of them.
    fn made(
        &self,
        target: Target,
        number: u32,
        members: &[Tree<NodeRecord>],
        border: &RecordedBorder,
        lattice: Lattice,
    ) -> Result<(Option<NodeRecord>, Warnings)> {
        let Target { options, out, stages, .. } = target;
        let hierarchy = &options.hierarchy;
        let records = || members.iter().map(|tree| &tree.record);
        let place = self.partition.cell(number).place;
        let mut model =
            stages.time(Stage::Gather, || members::read(out.path(), records(), lattice))?;
        merge_untextured(&mut model);
        let looks = Appearances::new(&model);
        let kinds = looks.kinds(&model.parts);
        let goes_on = |edge: &OpenEdge| {
            let in_plane = |axis: usize, at: f64| edge.ends.iter().all(|end| end[axis] == at);
            (0..3).any(|axis| [false, true].iter().any(|&up| in_plane(axis, place.side(axis, up))))
        };
        let mut chunk = stages.time(Stage::Gather, || {
            let between = stitches(&model.parts, kinds, &hierarchy.constants.stitch, goes_on);
            gather(&model.materials, &model.parts, &between)
        });
        model.parts = Vec::new();
        let there: FxHashSet<PositionKey<f64>> =
            chunk.mesh.positions.iter().map(|&position| key(position)).collect();
        let planes = border::planes(border, &there, lattice, &self.keep_rule(lattice));
        let marks =
            Marks { planes: planes.iter().collect(), touching: FxHashSet::default(), coarser: 0 };
        stages.time(Stage::Gather, || mark_border(&mut chunk, &marks));
        stages.time(Stage::Gather, || members::read_pictures(out.path(), records(), &mut model))?;
        let Appearances { textures, extrudable, .. } = looks;
        let images = DecodedImages::default();
        let announced = images.announce(&model, &textures, chunk.mesh.materials.iter().copied());
        let cache = TextureCache::new(&model, &textures, &announced);
        let setup = BlockSetup::new(target, self.up, &cache, &extrudable);
        let Some((low, high)) = chunk.mesh.bounds() else {
            return Ok((None, Warnings::default()));
        };
        let origin = lattice.origin_near(std::array::from_fn(|i| (low[i] + high[i]) * 0.5));
        let (chunk, _) = stages.time(Stage::Gather, || localise(chunk, origin, lattice, false));
        let triangles = chunk.mesh.triangles.len();
        let budget = (triangles as f64 / f64::from(hierarchy.level_factor)).round();
        // A node has at most the budget of a root.
        let budget = (budget as usize).clamp(1, hierarchy.desired_tris as usize);
        let resolutions = Resolutions::above(triangles, budget, hierarchy);
        let place = BlockPlace { prefix: prefix_of(members), origin, lattice };
        let textures = setup.textures(&chunk.mesh, &resolutions);
        let sink = setup.sink(&textures, &place);
        let builder = setup.builder(&sink, resolutions, lattice);
        let files = Files { out: out.path(), origin, constants: hierarchy.constants.measure };
        let below = stages.time(Stage::Measure, || files.below(members))?;
        let made = builder.above(MemberSurfaces { chunk, below }, budget)?;
        Ok((made.ok(), cache.warnings()))
    }

    /// Returns the lattice of the blocks, or a coarser one for large nodes.
    fn lattice_of(&self, members: &[Tree<NodeRecord>]) -> Lattice {
        let bounds = members.iter().map(|tree| &tree.record.attributes);
        let corners = bounds.flat_map(|node| [node.bbox_min, node.bbox_max]);
        CellBox::around(corners).lattice().coarser(self.lattice)
    }

    /// Returns the rule that ranks border vertices, as at planes within blocks: triangles fall to a share, and
    /// border vertices to its square root.
    fn keep_rule(&self, lattice: Lattice) -> KeepRule<'static> {
        let hierarchy = &self.target.options.hierarchy;
        let (share, collinear) = match hierarchy.borders {
            BorderMode::Locked => (1.0, -1.0),
            BorderMode::Skirts => (1.0 / f64::from(hierarchy.level_factor).sqrt(), lattice.step),
        };
        KeepRule {
            shares: vec![share, 1.0],
            most: Vec::new(),
            first_level: 0,
            collinear,
            baked: None,
            constants: hierarchy.constants.border,
        }
    }
}

fn file_of(members: &[Tree<NodeRecord>]) -> String {
    format!("{}.glb", prefix_of(members))
}

/// Returns the prefix of a node's file, a hash of its members' file names.
fn prefix_of(members: &[Tree<NodeRecord>]) -> String {
    let mut hasher = blake3::Hasher::new();
    for Tree { record, .. } in members {
        hasher.update(record.file.as_bytes());
        hasher.update(b"\n");
    }
    format!("above-{}", &hasher.finalize().to_hex().as_str()[..12])
}

/// A hash of all that a node is made of.
fn content_hash(members: &[Tree<NodeRecord>], border: &RecordedBorder, lattice: Lattice) -> String {
    let mut hasher = blake3::Hasher::new();
    // The error depends on all nodes below.
    for tree in members {
        tree.for_each(&mut |record: &NodeRecord| {
            hasher.update(record.file.as_bytes());
            hasher.update(&record.file_crc.to_le_bytes());
            hasher.update(&record.geometric_error.to_le_bytes());
        });
    }
    hasher.update(&border.to_bytes());
    hasher.update(&lattice.step.to_le_bytes());
    hasher.finalize().to_hex().to_string()
}
