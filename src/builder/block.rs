//! From the triangles that a block gets to its tree.

use crate::Result;
use crate::builder::block_materials::BlockMaterials;
use crate::builder::block_setup::{BlockPlace, BlockSetup};
use crate::builder::border::chain::KeepRule;
use crate::builder::built::{BuiltBlock, border_file};
use crate::builder::cut::cell::CellCut;
use crate::builder::cut::face::{FaceBorder, SideTriangle};
use crate::builder::cut::mark::{Marks, mark_border};
use crate::builder::cut::record::RecordedBorder;
use crate::builder::cut::section::Triangle;
use crate::builder::cut::split::Chunk;
use crate::builder::emit::disk_sink::{NodeRecord, file_name};
use crate::builder::gather::{gather, localise};
use crate::builder::hierarchy::{
    BorderMode, Forest, HierarchyOptions, Resolutions, SkippedNode, Tree,
};
use crate::builder::outliers::set_outliers_aside;
use crate::builder::partition::CellBox;
use crate::builder::scatter::BlockParts;
use crate::builder::simplify::simplified::LadderStep;
use crate::builder::stages::Stage;
use crate::builder::stitch::{OpenEdge, stitches};
use crate::format::BlockInfo;
use crate::lattice::Lattice;
use crate::mesh::{Normal, Part, Warnings, key};
use crate::report::build_report::{BlockReport, Count, SkippedNodeReport, most_frequent};
use crate::texture::BakeReason;

/// Steps of simplification that borders between blocks are ranked for.
const RANKED_STEPS: u32 = 8;

/// Identifies a block.
#[derive(Clone)]
pub struct BlockLabel {
    /// Beginning of its files' names, unique in the output.
    pub files: String,
    /// A name for people.
    pub name: String,
    /// The input that it has most triangles of.
    pub input: String,
    /// A hash of all that it is made of.
    pub content_hash: String,
}

/// A block about to be built.
pub struct Draft {
    /// Identity of the block.
    pub label: BlockLabel,
    /// Triangles of the block from all inputs. Material numbers index its [`BlockMaterials`].
    pub parts: BlockParts,
    /// Cutter of triangles at the sides of its cell.
    pub cut: CellCut,
}

/// Builds one block.
pub struct DraftBuilder<'a> {
    /// Materials of the block.
    pub materials: &'a BlockMaterials,
    /// It says how nodes are made, and writes them.
    pub setup: &'a BlockSetup<'a>,
    /// All blocks have one lattice, so that blocks that touch agree on positions.
    pub lattice: Lattice,
}

/// A block's triangles as one mesh, and its borders with other blocks.
struct Gathered {
    chunk: Chunk<f64>,
    border: RecordedBorder,
    resolutions: Resolutions,
    /// Edges that were closed by stitches.
    stitched_edges: u64,
}

impl DraftBuilder<'_> {
    /// Builds a block and writes its nodes and borders. Triangles that lie so far off that the lattice would
    /// become coarse for all others become a second block. The result is empty where no triangle is left.
    pub fn build(&self, draft: Draft) -> Result<Vec<BuiltBlock>> {
        let stages = self.setup.target().stages;
        let Draft { label, parts: BlockParts { inner, crossing }, cut } = draft;
        let stray = stages.time(Stage::Gather, || set_outliers_aside(&inner));
        let (inner, far) = stray.unwrap_or((inner, Vec::new()));
        let mut built = Vec::new();
        let triangles = triangles_of(inner.iter().chain(&crossing));
        let gathered = self.gathered(inner, crossing, &cut);
        built.extend(self.built(label.clone(), triangles, gathered)?);
        if !far.is_empty() {
            let places = far.iter().flat_map(|part| part.positions.iter().copied());
            let lattice = CellBox::around(places).lattice();
            let lattice = lattice.or_coarser(self.setup.target().options.quantization());
            let own = Self { lattice, ..*self };
            let (files, name) =
                (format!("{}-far", label.files), format!("{} (far off)", label.name));
            let triangles = triangles_of(far.iter());
            let gathered = own.gathered(far, Vec::new(), &cut);
            built.extend(own.built(BlockLabel { files, name, ..label }, triangles, gathered)?);
        }
        Ok(built)
    }

    /// Cuts the triangles that cross a side, stitches what touches, and marks what lies on borders.
    fn gathered(
        &self,
        mut parts: Vec<Part>,
        crossing: Vec<Part>,
        cut: &CellCut,
    ) -> Option<Gathered> {
        let (materials, lattice) = (self.materials, self.lattice);
        let (options, stages) = (self.setup.target().options, self.setup.target().stages);
        let hierarchy = &options.hierarchy;
        let faces = stages.time(Stage::Cut, || self.faces(&crossing, cut));
        stages.time(Stage::Cut, || {
            let pieces = crossing.iter().map(|part| piece(part, cut, lattice));
            parts.extend(pieces.filter(|part| !part.indices.is_empty()));
        });
        drop(crossing);
        let goes_on = |edge: &OpenEdge| {
            let in_plane = |axis: usize, at: f64| edge.ends.iter().all(|end| end[axis] == at);
            cut.sides().iter().any(|side| in_plane(side.plane.axis, side.plane.at))
        };
        let (mut chunk, stitched_edges) = stages.time(Stage::Gather, || {
            let kinds = materials.looks.kinds(&parts);
            let between = stitches(&parts, kinds, &hierarchy.constants.stitch, goes_on);
            (gather(&materials.model.materials, &parts, &between), between.len() as u64)
        });
        drop(parts);
        if chunk.mesh.triangles.is_empty() {
            return None;
        }
        let resolutions = Resolutions::new(chunk.mesh.triangles.len(), hierarchy);
        let border = RecordedBorder::of(faces.iter());
        let marks = Marks {
            planes: faces.iter().map(|face| &*face.plane).collect(),
            touching: faces.iter().flat_map(|face| &face.touching).map(|&at| key(at)).collect(),
            // Ranked for as many steps as any block may have.
            coarser: RANKED_STEPS as usize - resolutions.last().min(RANKED_STEPS as usize),
        };
        stages.time(Stage::Gather, || mark_border(&mut chunk, &marks));
        Some(Gathered { chunk, border, resolutions, stitched_edges })
    }

    /// Builds and writes the nodes of a block of so many source triangles, and its borders.
    fn built(
        &self,
        label: BlockLabel,
        triangles: u64,
        gathered: Option<Gathered>,
    ) -> Result<Option<BuiltBlock>> {
        let lattice = self.lattice;
        let target = self.setup.target();
        let (options, stages) = (target.options, target.stages);
        let Some(Gathered { chunk, border, resolutions, stitched_edges }) = gathered else {
            return Ok(None);
        };
        let Some((low, high)) = chunk.mesh.bounds() else { return Ok(None) };
        let origin = lattice.origin_near(std::array::from_fn(|i| (low[i] + high[i]) * 0.5));
        let follow = options.quantization().is_some();
        let (chunk, collapsed) =
            stages.time(Stage::Gather, || localise(chunk, origin, lattice, follow));
        let mut warnings = Warnings::default();
        warnings.add(
            format!(
                "triangle thinner than the precision of its block ({:e} m) left out",
                lattice.step
            ),
            collapsed,
        );
        if chunk.mesh.triangles.is_empty() {
            target.progress.built(collapsed);
            return Ok(None);
        }
        let BlockLabel { files, name, input, content_hash } = label;
        let place = BlockPlace { prefix: files.clone(), origin, lattice };
        let textures = self.setup.textures(&chunk.mesh, &resolutions);
        let sink = self.setup.sink(&textures, &place);
        let builder = self.setup.builder(&sink, resolutions, lattice);
        let Forest { trees, left_out } = builder.build(chunk)?;
        target.out.write(border_file(&files), &border.to_bytes())?;
        let mut left_out: Vec<SkippedNodeReport> = left_out
            .into_iter()
            .map(|SkippedNode { child_path, triangles, kept }| SkippedNodeReport {
                file: file_name(&files, &child_path),
                triangles,
                kept,
            })
            .collect();
        left_out.sort_by(|a, b| a.file.cmp(&b.file));
        let outcomes = outcomes(&trees, &mut warnings);
        let report = BlockReport {
            name: files,
            content_hash,
            triangles,
            texels: textures.used_texels(),
            repeating: textures.repeating(),
            stitched_edges,
            outcomes,
            left_out,
            warnings: Count::of_warnings(&warnings),
            texture_warnings: Vec::new(),
        };
        Ok(Some(BuiltBlock { info: BlockInfo { name, input, origin }, trees, report }))
    }

    /// The borders that a block has with others.
    fn faces(&self, crossing: &[Part], cut: &CellCut) -> Vec<FaceBorder> {
        let triangles: Vec<SideTriangle> = crossing
            .iter()
            .flat_map(|part| {
                let corners = part.indices.as_chunks::<3>().0.iter();
                corners.map(|corners| SideTriangle::new(part, *corners, self.lattice))
            })
            .collect();
        let rule = self.keep_rule();
        cut.sides().iter().map(|side| FaceBorder::new(side, &triangles, &rule)).collect()
    }

    /// Returns the rule that ranks border vertices at planes between blocks. Each level keeps 1 / level factor
    /// of the triangles, so the square root of that of a border's vertices. Levels are counted from the leaves,
    /// where all blocks are alike.
    fn keep_rule(&self) -> KeepRule<'static> {
        let HierarchyOptions { borders, level_factor, constants, .. } =
            &self.setup.target().options.hierarchy;
        let factor = f64::from(*level_factor).sqrt();
        let shares = match borders {
            BorderMode::Locked => vec![1.0; RANKED_STEPS as usize + 1],
            BorderMode::Skirts => {
                let step = |step: u32| (0..step).fold(1.0, |share, _| share / factor);
                (0..=RANKED_STEPS).rev().map(step).collect()
            }
        };
        KeepRule {
            shares,
            most: Vec::new(),
            first_level: 0,
            collinear: if *borders == BorderMode::Locked { -1.0 } else { self.lattice.step },
            baked: None,
            constants: constants.border,
        }
    }
}

fn triangles_of<'a>(parts: impl Iterator<Item = &'a Part>) -> u64 {
    parts.map(|part| part.indices.len() as u64 / 3).sum()
}

/// The part of each triangle that is in a cell.
fn piece(part: &Part, cut: &CellCut, lattice: Lattice) -> Part {
    let mut own = Part { group: part.group, material: part.material, ..Part::default() };
    for &corners in part.indices.as_chunks::<3>().0 {
        let positions = corners.map(|vertex| part.positions[vertex as usize]);
        let cut = cut.piece(&Triangle { corners: positions, lattice });
        if cut.triangles.is_empty() {
            continue;
        }
        let first = own.positions.len() as u32;
        // Corners are sorted, so that two triangles compute the same values for what they share.
        let mut order = [0, 1, 2];
        order.sort_by_key(|&corner| key(positions[corner]));
        for place in &cut.places {
            let mixed = |value: &dyn Fn(usize) -> f64| -> f64 {
                order.iter().map(|&corner| place.weights[corner] * value(corner)).sum()
            };
            own.positions.push(place.position);
            if !part.texcoords.is_empty() {
                own.texcoords.push(std::array::from_fn(|i| {
                    mixed(&|corner| f64::from(part.texcoords[corners[corner] as usize][i])) as f32
                }));
            }
            if !part.colors.is_empty() {
                own.colors.push(std::array::from_fn(|i| {
                    mixed(&|corner| f64::from(part.colors[corners[corner] as usize][i])).round()
                        as u16
                }));
            }
            if !part.normals.is_empty() {
                own.normals.push(normal(part, corners, order, place.weights));
            }
        }
        own.indices.extend(cut.triangles.as_flattened().iter().map(|&corner| first + corner));
    }
    own
}

fn normal(part: &Part, corners: [u32; 3], order: [usize; 3], weights: [f64; 3]) -> Normal {
    let mut sum = glam::DVec3::ZERO;
    for corner in order {
        if weights[corner] == 0.0 {
            continue;
        }
        let own = part.normals[corners[corner] as usize];
        if weights[corner] == 1.0 {
            return own;
        }
        match own.vector() {
            Some(vector) => sum += vector * weights[corner],
            None => return Normal::NONE,
        }
    }
    Normal::along(sum)
}

/// Counts how the nodes of a block were made, and adds what was imperfect in them to `warnings`.
fn outcomes(trees: &[Tree<NodeRecord>], warnings: &mut Warnings) -> Vec<Count> {
    let mut steps = Vec::new();
    for tree in trees {
        tree.for_each(&mut |record: &NodeRecord| {
            let baked = record.baked.filter(|_| record.step.is_some()).map(BakeReason::describe);
            let texts = record.step.map(LadderStep::describe).into_iter().chain(baked);
            steps.extend(texts.map(|text| Count { text: text.into(), count: 1 }));
            warnings.extend(record.warnings.clone());
        });
    }
    most_frequent(steps)
}
