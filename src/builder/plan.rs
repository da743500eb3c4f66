//! What is to be built: the partition of all inputs, and what each block is made of.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use crate::builder::options::BuildOptions;
use crate::builder::partition::{CellBox, Cluster, Partition, Scan};
use crate::builder::subset::Subset;
use crate::lattice::Lattice;
use crate::mesh::UpAxis;
use crate::report::build_report::InputReport;
use crate::{Error, Result};

/// An input that was looked at.
#[derive(Clone, Debug)]
pub struct KnownInput {
    /// For `build.json`.
    pub report: InputReport,
    /// Where its triangles are.
    pub scan: Scan,
}

/// A block before anything is built.
#[derive(Clone, Debug)]
pub struct PlannedBlock {
    /// Its cell.
    pub cell: u32,
    /// What the names of its files begin with.
    pub name: String,
    /// The inputs that it may have triangles of, in order.
    pub inputs: Vec<usize>,
    /// A hash of all that it is made of.
    pub made_of: String,
}

/// What is to be built.
pub struct Plan {
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// The cells of all inputs.
    pub partition: Partition,
    /// Of all blocks' vertices.
    pub lattice: Lattice,
    /// Blocks are too large for the lattice that was asked for.
    pub is_coarser: bool,
    /// In order of place.
    pub blocks: Vec<PlannedBlock>,
}

impl Plan {
    /// For inputs of which everything is known.
    pub fn new(inputs: &[KnownInput], up: UpAxis, options: &BuildOptions) -> Self {
        let clusters = inputs.iter().flat_map(|input| &input.scan.clusters).copied().collect();
        let partition = Partition::new(clusters, options.blocks, options.most_in_block(), up);
        let magnitude = inputs.iter().flat_map(|input| input.scan.bounds.as_flattened());
        let magnitude =
            magnitude.filter(|at| at.is_finite()).fold(0.0, |most: f64, at| most.max(at.abs()));
        let cells = partition.cells().iter();
        let extent = cells.map(|cell| cell.extent).fold(0.0, f64::max);
        let fine = Lattice::for_extent(extent, magnitude);
        let quantization = options.quantization();
        let is_coarser = quantization.is_some_and(|coarse| coarse.step < fine.step);
        let lattice = fine.or_coarser(quantization);
        let inputs_of = inputs_of_blocks(&partition, inputs);
        let numbers = partition.blocks();
        let planned = |cell: u32| {
            let of_cell: Vec<usize> = inputs_of.get(&cell)?.iter().copied().collect();
            Some(planned(cell, of_cell, inputs, &partition, lattice, up))
        };
        let blocks = numbers.into_iter().filter_map(planned).collect();
        Self { up, partition, lattice, is_coarser, blocks }
    }

    /// The blocks of a subset: they follow one another, and have of triangles about as many as others'.
    pub fn share(&self, subset: Subset) -> Result<Range<usize>> {
        if self.blocks.len() < subset.of as usize {
            return Err(Error::Usage(format!(
                "--subset {subset}: expected as many subsets as there are blocks at most, found {}",
                self.blocks.len()
            )));
        }
        let sizes = self.blocks.iter().map(|block| self.partition.cell(block.cell).triangles);
        Ok(subset.picked(&sizes.collect::<Vec<u64>>()))
    }
}

/// The inputs that each block may have triangles of, by cell.
fn inputs_of_blocks(
    partition: &Partition,
    inputs: &[KnownInput],
) -> BTreeMap<u32, BTreeSet<usize>> {
    // No body whose middle is in a block reaches out of it by more.
    let reach = |cell: u32| 0.5 * partition.cell(cell).body_size();
    let cells = 0..partition.cells().len() as u32;
    let most = cells.map(reach).fold(0.0, f64::max);
    let mut all: BTreeMap<u32, BTreeSet<usize>> = BTreeMap::new();
    for (input, known) in inputs.iter().enumerate() {
        for Cluster { around: [low, high], .. } in &known.scan.clusters {
            let around = CellBox { low: low.map(|at| at - most), high: high.map(|at| at + most) };
            partition.blocks_meeting(&around, &mut |cell| {
                let (place, reach) = (partition.cell(cell).place, reach(cell));
                let meets = (0..3).all(|axis| {
                    high[axis] + reach >= place.low[axis] && low[axis] - reach <= place.high[axis]
                });
                if meets {
                    all.entry(cell).or_default().insert(input);
                }
            });
        }
    }
    all
}

fn planned(
    cell: u32,
    inputs_of: Vec<usize>,
    inputs: &[KnownInput],
    partition: &Partition,
    lattice: Lattice,
    up: UpAxis,
) -> PlannedBlock {
    let place = partition.cell(cell).place;
    let mut hasher = blake3::Hasher::new();
    let mut add = |place: &CellBox| {
        for at in place.low.iter().chain(&place.high) {
            hasher.update(&at.to_le_bytes());
        }
    };
    add(&place);
    let name = &hasher.finalize().to_hex()[..12];
    let stem = match inputs_of.iter().map(|&at| stem(&inputs[at])).collect::<BTreeSet<_>>() {
        stems if stems.len() == 1 => stems.into_iter().next().unwrap_or_default(),
        _ => "city".into(),
    };
    let mut hasher = blake3::Hasher::new();
    let mut add = |place: &CellBox| {
        for at in place.low.iter().chain(&place.high) {
            hasher.update(&at.to_le_bytes());
        }
    };
    add(&place);
    for axis in 0..3 {
        for upper in [false, true] {
            if place.side(axis, upper).is_finite() {
                for other in partition.beyond(cell, axis, upper) {
                    add(&partition.cell(other).place);
                }
            }
        }
    }
    hasher.update(&lattice.step.to_le_bytes());
    hasher.update(&[u8::from(up == UpAxis::Y)]);
    // Which bodies are small is a matter of all blocks around.
    let extent = partition.cell(cell).extent;
    let around =
        CellBox { low: place.low.map(|at| at - extent), high: place.high.map(|at| at + extent) };
    partition.blocks_meeting(&around, &mut |other| {
        hasher.update(&partition.cell(other).body_size().to_le_bytes());
    });
    for &input in &inputs_of {
        let report = &inputs[input].report;
        hasher.update(report.path.as_bytes());
        for file in &report.files {
            hasher.update(file.blake3.as_bytes());
            hasher.update(&file.bytes.to_le_bytes());
        }
    }
    let made_of = hasher.finalize().to_hex().to_string();
    PlannedBlock { cell, name: format!("{stem}-{name}"), inputs: inputs_of, made_of }
}

/// The name of an input for people, as file names have it.
fn stem(input: &KnownInput) -> String {
    let stem = Path::new(&input.report.path).file_stem().unwrap_or_default();
    let stem = stem.to_string_lossy().to_lowercase();
    stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(40).collect()
}
