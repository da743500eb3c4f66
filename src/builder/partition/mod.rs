//! One tree of cells over all inputs: its lower cells are blocks, its upper cells are nodes above them.
//!
//! A cell is a box whose sides are cutting planes, or infinite. Planes are at multiples of powers of
//! two, the coarsest within the middle half of what a cell has. So they depend on where things are
//! and hardly on how many there are: a change in one place moves planes nowhere else, and which
//! blocks a process builds changes no byte of them.

mod blocks;
mod cell_box;
mod kept_whole;
mod scan;

pub use self::blocks::{BlockSplit, Most};
pub use self::cell_box::CellBox;
pub use self::kept_whole::{KeptWhole, Others};
pub use self::scan::{Cluster, Scan};

use crate::mesh::UpAxis;

/// The plane that divides a cell, and the cells on either side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Source coordinate.
    pub at: f64,
    /// The numbers of the cell below and of that above.
    pub children: [u32; 2],
}

/// Bodies that extend over no more than this share of a block are of one block, as
/// [`CutConstants::uncut`](crate::builder::constants::CutConstants::uncut) of a slab.
const SMALL: f64 = 0.5;

impl Cell {
    /// Bodies up to this size are not divided by the block's sides, metres. A power of two, so that it is
    /// mostly the same where what the block has changes.
    pub fn body_size(&self) -> f64 {
        if self.extent > 0.0 { SMALL * self.extent.log2().floor().exp2() } else { 0.0 }
    }
}

/// A cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The space that it fills.
    pub place: CellBox,
    /// `None`: it is a block.
    pub split: Option<Split>,
    /// About so many triangles of the source have their middle here.
    pub triangles: u64,
    /// About how far the block extends along its longest side, metres; of a block alone.
    pub extent: f64,
}

/// All cells, parents first; the root is number 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    cells: Vec<Cell>,
}

/// Cells are not divided more often: each plane takes a bit of a vertex, and none is needed deeper.
const MOST_DEPTH: usize = 48;

/// Nor where what they have extends over less than this share of the whole.
const LEAST_SHARE: f64 = 1.0 / (1 << 20) as f64;

/// This share of a block's triangles may be larger than what counts as its extent: a few huge ones
/// would leave all others a lattice of metres.
const FEW: f64 = 0.005;

impl Partition {
    /// Divides what inputs have, in any order.
    pub fn new(mut clusters: Vec<Cluster>, split: BlockSplit, most: Most, up: UpAxis) -> Self {
        let first = Cell { place: CellBox::ALL, split: None, triangles: 0, extent: 0.0 };
        let mut partition = Self { cells: vec![first] };
        let whole = scan::middles(&clusters).longest();
        let dividing = Dividing { split, most, up, least: whole * LEAST_SHARE };
        partition.divide(0, &mut clusters, 0, &dividing);
        partition
    }

    /// All cells, parents first.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// A cell.
    pub fn cell(&self, number: u32) -> &Cell {
        &self.cells[number as usize]
    }

    /// The numbers of the blocks, in order of place: those below a plane before those above it.
    pub fn blocks(&self) -> Vec<u32> {
        let mut blocks = Vec::new();
        let mut stack = vec![0];
        while let Some(number) = stack.pop() {
            match self.cell(number).split {
                Some(Split { children: [below, above], .. }) => stack.extend([above, below]),
                None => blocks.push(number),
            }
        }
        blocks
    }

    /// The block that has a place.
    pub fn block_at(&self, place: [f64; 3]) -> u32 {
        let mut number = 0;
        while let Some(Split { axis, at, children }) = self.cell(number).split {
            number = children[usize::from(place[axis] >= at)];
        }
        number
    }

    /// The blocks that a box meets, or touches.
    pub fn blocks_meeting(&self, place: &CellBox, visit: &mut impl FnMut(u32)) {
        let mut stack = vec![0];
        while let Some(number) = stack.pop() {
            match self.cell(number).split {
                Some(Split { axis, at, children: [below, above] }) => {
                    if place.high[axis] >= at {
                        stack.push(above);
                    }
                    if place.low[axis] <= at {
                        stack.push(below);
                    }
                }
                None => visit(number),
            }
        }
    }

    /// The blocks on the other side of one side of a block that have a part of it in common.
    pub fn beyond(&self, block: u32, axis: usize, upper: bool) -> Vec<u32> {
        let CellBox { low, high } = self.cell(block).place;
        let at = self.cell(block).place.side(axis, upper);
        let mut side = CellBox { low, high };
        (side.low[axis], side.high[axis]) = (at, at);
        let mut found = Vec::new();
        self.blocks_meeting(&side, &mut |other| {
            let place = &self.cell(other).place;
            let in_common = (0..3).all(|other_axis| {
                other_axis == axis
                    || place.low[other_axis] < high[other_axis]
                        && low[other_axis] < place.high[other_axis]
            });
            if in_common && place.side(axis, !upper) == at {
                found.push(other);
            }
        });
        found
    }

    /// Divides a cell that has these clusters, and its parts.
    fn divide(&mut self, number: u32, clusters: &mut [Cluster], depth: usize, how: &Dividing) {
        let triangles = clusters.iter().map(|cluster| u64::from(cluster.triangles)).sum();
        self.cells[number as usize].triangles = triangles;
        let plane = if depth < MOST_DEPTH { how.plane(clusters, triangles) } else { None };
        let Some((axis, at)) = plane else {
            let place = self.cell(number).place;
            self.cells[number as usize].extent = extent(clusters, triangles, &place);
            return;
        };
        // Stable: clusters below the plane come first.
        clusters.sort_by_key(|cluster| cluster.middle(axis) >= at);
        let below = clusters.partition_point(|cluster| cluster.middle(axis) < at);
        let place = self.cell(number).place;
        let children = [self.cells.len() as u32, self.cells.len() as u32 + 1];
        self.cells[number as usize].split = Some(Split { axis, at, children });
        let child = |upper: bool| {
            let mut place = place;
            if upper {
                place.low[axis] = at;
            } else {
                place.high[axis] = at;
            }
            Cell { place, split: None, triangles: 0, extent: 0.0 }
        };
        self.cells.extend([child(false), child(true)]);
        let (below, above) = clusters.split_at_mut(below);
        self.divide(children[0], below, depth + 1, how);
        self.divide(children[1], above, depth + 1, how);
    }
}

/// Returns the longest side of the box around a block's triangles inside its cell, without a few huge ones.
fn extent(clusters: &[Cluster], triangles: u64, place: &CellBox) -> f64 {
    let mut by_size: Vec<&Cluster> = clusters.iter().collect();
    by_size.sort_by(|a, b| b.largest.total_cmp(&a.largest));
    let mut left = (triangles as f64 * FEW) as u64;
    let few = by_size.iter().take_while(|cluster| {
        let is_few = u64::from(cluster.triangles) <= left;
        left = left.saturating_sub(cluster.triangles.into());
        is_few
    });
    let few = few.count();
    let around = by_size[few..].iter().map(|cluster| &cluster.around);
    around.fold(CellBox::NONE, |all, one| all.and(one)).common(place).longest()
}

/// Parameters of the division of cells.
struct Dividing {
    split: BlockSplit,
    most: Most,
    up: UpAxis,
    /// Anything that extends over less is not divided, metres.
    least: f64,
}

impl Dividing {
    /// The plane that divides clusters, if any does.
    fn plane(&self, clusters: &[Cluster], triangles: u64) -> Option<(usize, f64)> {
        let middles = scan::middles(clusters);
        let CellBox { low, high } = middles;
        let side = |axis: usize| middles.length(axis);
        match self.split {
            BlockSplit::Auto => {
                let texels: f64 = clusters.iter().map(|cluster| cluster.texels).sum();
                if triangles <= self.most.triangles && texels <= self.most.texels {
                    return None;
                }
                // The longest first; the first of equals.
                let mut axes = [0, 1, 2];
                axes.sort_by(|&a, &b| side(b).total_cmp(&side(a)));
                let divides = |axis: usize| {
                    if side(axis).is_nan() || side(axis) <= self.least {
                        return None;
                    }
                    let at = coarsest_between(
                        low[axis] + 0.25 * side(axis),
                        high[axis] - 0.25 * side(axis),
                    )?;
                    let below = clusters.iter().filter(|cluster| cluster.middle(axis) < at).count();
                    (0 < below && below < clusters.len()).then_some((axis, at))
                };
                axes.into_iter().find_map(divides)
            }
            BlockSplit::Grid(metres) => {
                let axes = match self.up {
                    UpAxis::Y => [0, 2],
                    UpAxis::Z => [0, 1],
                };
                // Lines that middles lie on either side of.
                let squares = |axis: usize| {
                    let first = (low[axis] / metres).floor();
                    (first, (high[axis] / metres).floor() - first)
                };
                let axis = if squares(axes[0]).1 >= squares(axes[1]).1 { axes[0] } else { axes[1] };
                let (first, lines) = squares(axis);
                let at = (first + (lines / 2.0).ceil()) * metres;
                let below = clusters.iter().filter(|cluster| cluster.middle(axis) < at).count();
                (lines >= 1.0 && 0 < below && below < clusters.len()).then_some((axis, at))
            }
        }
    }
}

/// Returns the multiple of the largest power of two between `low` and `high`.
fn coarsest_between(low: f64, high: f64) -> Option<f64> {
    if low.is_nan() || high.is_nan() || low > high || !(high - low).is_finite() {
        return None;
    }
    if low <= 0.0 && high >= 0.0 {
        return Some(0.0);
    }
    let largest = low.abs().max(high.abs());
    // From above the largest coordinate down to a step that is sure to have a multiple between.
    let mut power = largest.log2().ceil().exp2();
    loop {
        let at = (low / power).ceil() * power;
        if at <= high {
            return Some(at);
        }
        if power <= f64::MIN_POSITIVE * 2.0 {
            return None;
        }
        power *= 0.5;
    }
}

#[cfg(test)]
mod tests;
