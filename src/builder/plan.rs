//! Plans a build: the partition of all inputs, and the inputs and content hash of each block.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use crate::builder::options::BuildOptions;
use crate::builder::partition::{CellBox, Most, Others, Partition, Scan};
use crate::format::Subset;
use crate::lattice::Lattice;
use crate::mesh::UpAxis;
use crate::report::build_report::{EmptyBlock, InputReport};
use crate::{Error, Result};

/// An input that was looked at.
#[derive(Clone, Debug)]
pub struct KnownInput {
    /// Entry of `build.json`.
    pub report: InputReport,
    /// Histogram of its triangles.
    pub scan: Scan,
}

/// A block before anything is built.
#[derive(Clone, Debug)]
pub struct PlannedBlock {
    /// Number of its cell.
    pub cell: u32,
    /// Prefix of the names of its files.
    pub name: String,
    /// The inputs that it may have triangles of, in order.
    pub inputs: Vec<usize>,
    /// A hash of all that it is made of.
    pub content_hash: String,
}

impl PlannedBlock {
    /// Returns the report's entry of a block without a triangle.
    pub fn empty(&self) -> EmptyBlock {
        EmptyBlock { name: self.name.clone(), content_hash: self.content_hash.clone() }
    }
}

/// The partition and the blocks of a build.
pub struct Plan {
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// The cells of all inputs.
    pub partition: Partition,
    /// Lattice of all vertices.
    pub lattice: Lattice,
    /// Blocks are too large for the lattice that was asked for.
    pub is_coarser: bool,
    /// Blocks in the order of cells.
    pub blocks: Vec<PlannedBlock>,
}

impl Plan {
    /// Plans the build of scanned inputs.
    pub fn new(inputs: &[KnownInput], up: UpAxis, options: &BuildOptions) -> Self {
        let texels = options.hierarchy.constants.blocks.texels as f64;
        let most = Most { triangles: options.most_in_block(), texels };
        let clusters = inputs.iter().flat_map(|input| &input.scan.clusters).copied().collect();
        let partition = Partition::new(clusters, options.blocks, most, up);
        let magnitude =
            inputs.iter().map(|input| input.scan.bounds.magnitude()).fold(0.0, f64::max);
        let cells = partition.cells().iter();
        let extent = cells.map(|cell| cell.extent).fold(0.0, f64::max);
        let fine = Lattice::for_extent(extent, magnitude);
        let quantization = options.quantization();
        let is_coarser = quantization.is_some_and(|coarse| coarse.step < fine.step);
        let lattice = fine.or_coarser(quantization);
        let mut surroundings = surroundings(&partition, inputs);
        let numbers = partition.blocks();
        let planned = |cell: u32| {
            let of_cell = surroundings.remove(&cell)?;
            Some(planned(cell, of_cell, inputs, &partition, lattice, up))
        };
        let blocks = numbers.into_iter().filter_map(planned).collect();
        Self { up, partition, lattice, is_coarser, blocks }
    }

    /// The blocks of a subset: they follow one another, and have of triangles about as many as others'.
    pub fn share(&self, subset: Subset) -> Result<Range<usize>> {
        if self.blocks.len() < subset.of as usize {
            return Err(Error::Usage(format!(
                "--subset {subset}: expected at most as many subsets as there are blocks, found {}; \
                 build the city in one go, or in smaller blocks, as with --blocks grid:200",
                self.blocks.len()
            )));
        }
        let sizes = self.blocks.iter().map(|block| self.partition.cell(block.cell).triangles);
        Ok(subset.picked(&sizes.collect::<Vec<u64>>()))
    }
}

/// Other blocks and inputs that a block depends on.
#[derive(Default)]
struct Surroundings {
    /// The blocks of which bodies may lie here: how large these are at most decides which stay whole.
    blocks: BTreeSet<u32>,
    /// The inputs that the block may have triangles of.
    inputs: BTreeSet<usize>,
    /// Those, and others near such a component: if it continues in them it is not kept whole.
    near: BTreeSet<usize>,
}

/// Finds those of each block that has any input, by cell.
fn surroundings(partition: &Partition, inputs: &[KnownInput]) -> BTreeMap<u32, Surroundings> {
    let mut all: BTreeMap<u32, Surroundings> = BTreeMap::new();
    for block in partition.blocks() {
        let cell = partition.cell(block);
        // A body has its middle in its block.
        partition.blocks_meeting(&cell.place.larger(0.5 * cell.body_size()), &mut |other| {
            all.entry(other).or_default().blocks.insert(block);
        });
    }
    let body_size = |block: u32| partition.cell(block).body_size();
    // No body that lies here in part reaches farther from here.
    let reach: BTreeMap<u32, f64> = all
        .iter()
        .map(|(&block, of)| (block, of.blocks.iter().map(|&of| body_size(of)).fold(0.0, f64::max)))
        .collect();
    let most = reach.values().copied().fold(0.0, f64::max);
    for (input, known) in inputs.iter().enumerate() {
        for cluster in &known.scan.clusters {
            let may_meet = Others::around(cluster);
            partition.blocks_meeting(&may_meet.larger(most), &mut |block| {
                let place = partition.cell(block).place;
                let of_block = all.entry(block).or_default();
                if place.meets(&cluster.around.larger(0.5 * body_size(block))) {
                    of_block.inputs.insert(input);
                }
                if place.meets(&may_meet.larger(reach[&block])) {
                    of_block.near.insert(input);
                }
            });
        }
    }
    all.retain(|_, of| !of.inputs.is_empty());
    all
}

fn hash_of_box(hasher: &mut blake3::Hasher, place: &CellBox) {
    for at in place.low.iter().chain(&place.high) {
        hasher.update(&at.to_le_bytes());
    }
}

fn planned(
    cell: u32,
    of_cell: Surroundings,
    inputs: &[KnownInput],
    partition: &Partition,
    lattice: Lattice,
    up: UpAxis,
) -> PlannedBlock {
    let Surroundings { blocks, inputs: own, near } = of_cell;
    let place = partition.cell(cell).place;
    let mut hasher = blake3::Hasher::new();
    hash_of_box(&mut hasher, &place);
    let name = &hasher.finalize().to_hex()[..12];
    let stem = match own.iter().map(|&at| stem(&inputs[at])).collect::<BTreeSet<_>>() {
        stems if stems.len() == 1 => stems.into_iter().next().unwrap_or_default(),
        _ => "city".into(),
    };
    for axis in 0..3 {
        for upper in [false, true] {
            if place.side(axis, upper).is_finite() {
                for other in partition.beyond(cell, axis, upper) {
                    hash_of_box(&mut hasher, &partition.cell(other).place);
                }
            }
        }
    }
    hasher.update(&lattice.step.to_le_bytes());
    hasher.update(&[u8::from(up == UpAxis::Y)]);
    for block in blocks {
        hasher.update(&partition.cell(block).body_size().to_le_bytes());
    }
    for input in near {
        let report = &inputs[input].report;
        hasher.update(report.path.as_bytes());
        for file in &report.files {
            hasher.update(file.blake3.as_bytes());
            hasher.update(&file.bytes.to_le_bytes());
        }
    }
    let content_hash = hasher.finalize().to_hex().to_string();
    let inputs = own.into_iter().collect();
    PlannedBlock { cell, name: format!("{stem}-{name}"), inputs, content_hash }
}

/// The name of an input for people, as file names have it.
fn stem(input: &KnownInput) -> String {
    let stem = Path::new(&input.report.path).file_stem().unwrap_or_default();
    let stem = stem.to_string_lossy().to_lowercase();
    stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::partition::Cluster;
    use crate::report::build_report::FileReport;

    /// An input of points, each with so many triangles.
    fn input(name: &str, hash: &str, points: &[[f64; 2]], triangles: u32) -> KnownInput {
        let cluster = |&[x, y]: &[f64; 2]| {
            let around = CellBox::around([[x, y, 0.0]]);
            Cluster { triangles, texels: 0.0, middles: around, largest: 1.0, around }
        };
        let bounds = CellBox::around(points.iter().map(|&[x, y]| [x, y, 0.0]));
        let file = FileReport { path: name.into(), bytes: 7, blake3: hash.into() };
        let report = InputReport {
            path: name.into(),
            files: vec![file],
            triangles: u64::from(triangles) * points.len() as u64,
            up: UpAxis::Z,
            up_from: None,
            warnings: Vec::new(),
        };
        KnownInput { report, scan: Scan { bounds, clusters: points.iter().map(cluster).collect() } }
    }

    #[test]
    fn blocks_are_made_of_inputs_in_which_their_bodies_may_go_on() {
        let mut options = BuildOptions::default();
        options.hierarchy.desired_tris = 300;
        // Two blocks of 62 m by 124 m beside the plane x = 0: bodies of 32 m stay whole.
        let steps = || (0..32).map(|step| -62.0 + 4.0 * f64::from(step));
        let ground: Vec<[f64; 2]> = steps().flat_map(|x| steps().map(move |y| [x, y])).collect();
        let west = |x: f64, hash: &str| {
            let inputs = [input("a", "a", &ground, 64), input("b", hash, &[[x, 0.0]], 1)];
            let plan = Plan::new(&inputs, UpAxis::Z, &options);
            assert_eq!(plan.blocks.len(), 2);
            plan.blocks[0].clone()
        };
        for (x, is_in, is_near) in [(10.0, true, true), (20.0, false, true), (40.0, false, false)] {
            let (block, changed) = (west(x, "b"), west(x, "c"));
            assert_eq!(block.inputs.contains(&1), is_in, "{x}");
            assert_eq!(block.content_hash != changed.content_hash, is_near, "{x}");
        }
    }
}
