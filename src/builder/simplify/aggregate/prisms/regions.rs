//! Regions of one height, and merging them.
//!
//! Regions are merged by the full λ-schedule (Robinson, Redding & Crisp, 2002) of the piecewise
//! constant model of Mumford & Shah: always the two first whose merging adds the least squared
//! difference of heights for the length of border that it saves. The open between two bodies may be
//! filled where that pays, and a region may be given up to the open, so that a row of houses
//! becomes a block, a shed goes and a tower stays.

use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BinaryHeap};

use rustc_hash::FxHashMap;

use super::gaps::{GapCell, gap_cells};
use super::heights::{Heights, NONE, Near};
use super::tidy::tidy;
use crate::builder::constants::PrismConstants;
use crate::mesh::DisjointSet;

/// A merging, as it was done.
#[derive(Clone, Copy, Debug)]
enum Merging {
    /// The second into the first.
    Regions(u32, u32),
    /// Given up.
    Open(u32),
}

/// Sums over the cells of a region.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Those of gaps included.
    cells: f64,
    height: f64,
    squares: f64,
    /// Without gaps: those that bodies cover, and their heights.
    covered: f64,
    covered_height: f64,
    covered_squares: f64,
    /// The lowest of its bodies.
    low: f64,
}

impl Sums {
    fn add(&mut self, height: f64, low: f64) {
        self.cells += 1.0;
        self.height += height;
        self.squares += height * height;
        self.low = self.low.min(low);
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            cells: self.cells + other.cells,
            height: self.height + other.height,
            squares: self.squares + other.squares,
            covered: self.covered + other.covered,
            covered_height: self.covered_height + other.covered_height,
            covered_squares: self.covered_squares + other.covered_squares,
            low: self.low.min(other.low),
        }
    }

    /// A gap, at the height of the ground.
    fn gap(cells: f64, low: f64) -> Self {
        Self {
            cells,
            height: cells * low,
            squares: cells * low * low,
            low: f64::INFINITY,
            ..Default::default()
        }
    }

    /// The volume between these heights and their mean, about: the standard deviation times the
    /// cells.
    fn spread(&self) -> f64 {
        (self.squares * self.cells - self.height * self.height).max(0.0).sqrt()
    }

    /// The volume above the ground.
    fn volume(&self) -> f64 {
        self.height - self.low * self.cells
    }
}

/// Where two regions meet or face each other.
#[derive(Clone, Copy, Debug, Default)]
struct Contact {
    /// Sides of cells that both have.
    edges: f64,
    /// Cells between them, and sides where these end at either.
    gap: f64,
    gap_edges: f64,
}

impl Contact {
    fn and(&self, other: &Self) -> Self {
        Self {
            edges: self.edges + other.edges,
            gap: self.gap + other.gap,
            gap_edges: self.gap_edges + other.gap_edges,
        }
    }

    /// By how many sides of cells the border gets shorter.
    fn saved(&self) -> f64 {
        // A gap is closed at both of its mouths.
        let mouths = if self.gap_edges > 0.0 { 4.0 * self.gap / self.gap_edges } else { 0.0 };
        self.edges + (self.gap_edges - mouths).max(0.0)
    }
}

/// A merging that may be done.
struct Offer {
    price: f64,
    first: u32,
    /// The same region where it is to be given up.
    second: u32,
    /// How often the two had changed then.
    version: u32,
}

/// All regions and how they merge.
pub(super) struct Regions {
    pub near: Near,
    /// Of each cell, at first.
    of_cell: Vec<u32>,
    gaps: Vec<GapCell>,
    first: Vec<Sums>,
    /// See [`PrismConstants`].
    roof_deviations: f64,
    mergings: Vec<Merging>,
}

/// Cells with their regions after some mergings.
pub(super) struct Labels {
    /// Of each cell; [`NONE`] in the open.
    pub of_cell: Vec<u32>,
    /// Of each region that is left, by its number.
    pub regions: BTreeMap<u32, Region>,
}

/// A region that is left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    /// Of its roof, metres.
    pub height: f64,
    pub low: f64,
}

impl Regions {
    /// `gap` is the width of what may be filled, in cells.
    pub fn of(heights: &Heights, gap: f64, constants: &PrismConstants) -> Self {
        let reach = gap.ceil() as usize + 1;
        let near = Near::of(&heights.body, &heights.grid, reach);
        let of_cell = flat_regions(heights, &near, constants.slope);
        let count = of_cell.iter().filter(|&&region| region != NONE).max().map_or(0, |&n| n + 1);
        let mut first = vec![Sums { low: f64::INFINITY, ..Sums::default() }; count as usize];
        for cell in near.cells.iter().map(|&cell| cell as usize) {
            let region = of_cell[cell];
            if region != NONE {
                let (top, low) =
                    (heights.top[cell].into(), heights.lows[heights.body[cell] as usize]);
                first[region as usize].add(top, low);
            }
        }
        for sums in &mut first {
            sums.covered = sums.cells;
            sums.covered_height = sums.height;
            sums.covered_squares = sums.squares;
        }
        let gaps = gap_cells(&of_cell, &near, &heights.grid, gap);
        let mut regions = Self {
            near,
            of_cell,
            gaps,
            first,
            roof_deviations: constants.roof_deviations,
            mergings: Vec::new(),
        };
        regions.mergings = Merger::of(&regions, constants.footprint_penalty).run();
        regions
    }

    pub fn count(&self) -> usize {
        self.first.len()
    }

    /// The regions once at most `count` of them are left, without crumbs of fewer than `least`
    /// cells.
    pub fn down_to(&self, count: usize, least: usize) -> Labels {
        let done = self.count().saturating_sub(count).min(self.mergings.len());
        let mut joined = DisjointSet::new(self.count());
        let mut open = vec![false; self.count()];
        let mut sums = self.first.clone();
        for &merging in &self.mergings[..done] {
            match merging {
                Merging::Regions(into, region) => {
                    sums[into as usize] = sums[into as usize].and(&sums[region as usize]);
                    joined.join(into, region);
                    let root = joined.root(into) as usize;
                    sums[root] = sums[into as usize];
                }
                Merging::Open(region) => open[joined.root(region) as usize] = true,
            }
        }
        let mut of_cell = self.of_cell.clone();
        let root: Vec<u32> = (0..self.count() as u32)
            .map(|region| joined.root(region))
            .map(|root| if open[root as usize] { NONE } else { root })
            .collect();
        for &cell in &self.near.cells {
            let region = &mut of_cell[cell as usize];
            *region = root.get(*region as usize).copied().unwrap_or(NONE);
        }
        for gap in &self.gaps {
            let [a, b] = gap.regions.map(|region| root[region as usize]);
            if a == b {
                of_cell[gap.cell] = a;
            }
        }
        tidy(&mut of_cell, &self.near, least);
        let left = (0..self.count() as u32).filter(|&number| root[number as usize] == number);
        let region = |region: u32| {
            let Sums { covered, covered_height, covered_squares, low, .. } = sums[region as usize];
            let mean = covered_height / covered;
            let deviation = (covered_squares / covered - mean * mean).max(0.0).sqrt();
            (region, Region { height: mean + self.roof_deviations * deviation, low })
        };
        let regions = left.map(region).collect();
        Labels { of_cell, regions }
    }
}

/// Numbers the connected cells of each body across which heights do not jump.
fn flat_regions(heights: &Heights, near: &Near, slope: f64) -> Vec<u32> {
    let Heights { grid, top, body, .. } = heights;
    let most = (slope * grid.side) as f32;
    let mut connected = DisjointSet::new(grid.cells());
    let flat = |a: usize, b: usize| {
        body[a] != NONE && body[a] == body[b] && (top[a] - top[b]).abs() <= most
    };
    for (cell, other) in near.sides().filter(|&(cell, other)| flat(cell, other)) {
        connected.join(cell as u32, other as u32);
    }
    let mut numbers = vec![NONE; grid.cells()];
    let mut next = 0;
    let mut of_cell = vec![NONE; grid.cells()];
    for cell in near.cells.iter().map(|&cell| cell as usize) {
        if body[cell] != NONE {
            let number = &mut numbers[connected.root(cell as u32) as usize];
            if *number == NONE {
                *number = next;
                next += 1;
            }
            of_cell[cell] = *number;
        }
    }
    of_cell
}

/// The full λ-schedule.
struct Merger {
    footprint_penalty: f64,
    sums: Vec<Option<Sums>>,
    contacts: Vec<BTreeMap<u32, Contact>>,
    /// Sides of cells at the open.
    outer: Vec<f64>,
    versions: Vec<u32>,
    offers: BinaryHeap<Reverse<Offer>>,
    done: Vec<Merging>,
}

impl Merger {
    fn of(regions: &Regions, footprint_penalty: f64) -> Self {
        let count = regions.count();
        let mut pairs: FxHashMap<[u32; 2], Contact> = FxHashMap::default();
        let mut outer = vec![0.0; count];
        let mut add = |a: u32, b: u32, contact: Contact| {
            let known = pairs.entry([a.min(b), a.max(b)]).or_default();
            *known = known.and(&contact);
        };
        let mut gap_of = FxHashMap::default();
        for gap in &regions.gaps {
            gap_of.insert(gap.cell, gap.regions);
            let [a, b] = gap.regions;
            add(a, b, Contact { gap: 1.0, ..Contact::default() });
        }
        let mut side = |cell: usize, other: usize| {
            let [a, b] = [cell, other].map(|cell| regions.of_cell[cell]);
            match (a != NONE, b != NONE) {
                (true, true) if a != b => add(a, b, Contact { edges: 1.0, ..Contact::default() }),
                (true, false) | (false, true) => {
                    let (region, open) = if a != NONE { (a, other) } else { (b, cell) };
                    outer[region as usize] += 1.0;
                    if let Some(pair) = gap_of.get(&open).filter(|pair| pair.contains(&region)) {
                        let [a, b] = *pair;
                        add(a, b, Contact { gap_edges: 1.0, ..Contact::default() });
                    }
                }
                _ => {}
            }
        };
        for (cell, other) in regions.near.sides() {
            side(cell, other);
        }
        let mut contacts: Vec<BTreeMap<u32, Contact>> = vec![BTreeMap::new(); count];
        for ([a, b], contact) in pairs {
            contacts[a as usize].insert(b, contact);
            contacts[b as usize].insert(a, contact);
        }
        Self {
            footprint_penalty,
            sums: regions.first.iter().copied().map(Some).collect(),
            contacts,
            outer,
            versions: vec![0; count],
            offers: BinaryHeap::new(),
            done: Vec::new(),
        }
    }

    fn run(mut self) -> Vec<Merging> {
        for region in 0..self.sums.len() as u32 {
            self.offer(region, |other| other < region);
        }
        while let Some(Reverse(offer)) = self.offers.pop() {
            let Offer { first, second, version, .. } = offer;
            if self.version(first, second) == version {
                self.merge(first, second);
            }
        }
        self.done
    }

    fn version(&self, first: u32, second: u32) -> u32 {
        let [a, b] = [first, second].map(|region| self.versions[region as usize]);
        if first == second { a } else { a.saturating_add(b) }
    }

    /// Offers to give a region up, and to merge it with the neighbours that are asked for.
    fn offer(&mut self, region: u32, asked: impl Fn(u32) -> bool) {
        let Some(sums) = self.sums[region as usize] else { return };
        let mut offers = Vec::new();
        let outer = self.outer[region as usize];
        if outer > 0.0 {
            offers.push((self.footprint_penalty * sums.volume() / outer, region));
        }
        for (&other, contact) in &self.contacts[region as usize] {
            let Some(others) = self.sums[other as usize].filter(|_| asked(other)) else { continue };
            let saved = contact.saved();
            if saved > 0.0 {
                offers.push((changed(&sums, &others, contact) / saved, other));
            }
        }
        for (price, second) in offers {
            let version = self.version(region, second);
            self.offers.push(Reverse(Offer { price, first: region, second, version }));
        }
    }

    fn merge(&mut self, first: u32, second: u32) {
        let Some(sums) = self.sums[first as usize] else { return };
        if first == second {
            self.done.push(Merging::Open(first));
            self.sums[first as usize] = None;
            self.versions[first as usize] = u32::MAX;
            let around: Vec<u32> = self.contacts[first as usize].keys().copied().collect();
            for other in around {
                let contact = self.contacts[other as usize].remove(&first);
                // What was between them is the open now.
                self.outer[other as usize] += contact.map_or(0.0, |contact| contact.edges);
                self.versions[other as usize] = self.versions[other as usize].saturating_add(1);
                self.offer(other, |_| true);
            }
            return;
        }
        let Some(others) = self.sums[second as usize] else { return };
        let contact = self.contacts[first as usize].remove(&second).unwrap_or_default();
        self.done.push(Merging::Regions(first, second));
        let both = with_gap(&sums, &others, &contact);
        self.sums[first as usize] = Some(both);
        self.sums[second as usize] = None;
        self.versions[second as usize] = u32::MAX;
        self.versions[first as usize] = self.versions[first as usize].saturating_add(1);
        let mouths = contact.gap_edges - (contact.saved() - contact.edges);
        let outer = self.outer[first as usize] + self.outer[second as usize];
        self.outer[first as usize] = (outer - contact.gap_edges + mouths).max(0.0);
        for (other, contact) in std::mem::take(&mut self.contacts[second as usize]) {
            if other != first {
                self.contacts[other as usize].remove(&second);
                for (a, b) in [(first, other), (other, first)] {
                    let known = self.contacts[a as usize].entry(b).or_default();
                    *known = known.and(&contact);
                }
            }
        }
        self.offer(first, |_| true);
    }
}

/// The region of two, and what is between them.
fn with_gap(a: &Sums, b: &Sums, contact: &Contact) -> Sums {
    a.and(b).and(&Sums::gap(contact.gap, (a.low + b.low) * 0.5))
}

/// By how much the volume between heights and their means grows.
fn changed(a: &Sums, b: &Sums, contact: &Contact) -> f64 {
    (with_gap(a, b, contact).spread() - a.spread() - b.spread()).max(0.0)
}

impl Ord for Offer {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_price = self.price.total_cmp(&other.price);
        by_price.then_with(|| (self.first, self.second).cmp(&(other.first, other.second)))
    }
}

impl PartialOrd for Offer {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Offer {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Offer {}

#[cfg(test)]
mod tests {
    use glam::{DVec2, dvec2, dvec3};

    use super::super::heights::Grid;
    use super::*;

    /// Flat roofs over rectangles: low and high corner, and height.
    fn seen(roofs: &[([f64; 4], f64)]) -> Heights {
        let mut heights =
            Heights::none(Grid::over(DVec2::ZERO, dvec2(60.0, 40.0), 0.5, 8), roofs.len());
        for (body, &([x, y, to_x, to_y], height)) in (0..).zip(roofs) {
            for z in [0.0, height] {
                let [a, b, c, d] =
                    [[x, y], [to_x, y], [to_x, to_y], [x, to_y]].map(|[x, y]| dvec3(x, y, z));
                heights.add(body, [a, b, c]);
                heights.add(body, [a, c, d]);
            }
        }
        heights
    }

    fn constants() -> PrismConstants {
        PrismConstants { cells: 1 << 16, ..PrismConstants::default() }
    }

    #[test]
    fn a_row_becomes_a_block_a_shed_goes_and_a_tower_stays() {
        let heights = seen(&[
            ([2.0, 2.0, 10.0, 12.0], 6.0),
            ([11.0, 2.0, 19.0, 12.0], 6.5),
            ([20.0, 2.0, 28.0, 12.0], 6.0),
            ([40.0, 20.0, 46.0, 26.0], 50.0),
            ([50.0, 5.0, 52.0, 7.0], 2.0),
        ]);
        let regions = Regions::of(&heights, 4.0, &constants());
        assert_eq!(regions.count(), 5);
        let Labels { of_cell, regions } = regions.down_to(2, 4);
        let found: Vec<f64> = regions.values().map(|region| region.height).collect();
        assert_eq!(found.len(), 2);
        // The mean of 6, 6.5 and 6, and half of their standard deviation.
        let row = 18.5 / 3.0 + 0.5 * (1.0f64 / 18.0).sqrt();
        assert!((found[0] - row).abs() < 1e-6 && (found[1] - 50.0).abs() < 1e-6, "{found:?}");
        // The gaps of a metre between houses are filled: 26 m by 10 m.
        let cells = of_cell.iter().filter(|&&region| Some(&region) == regions.keys().next());
        assert_eq!(cells.count(), 4 * 26 * 10);
    }

    #[test]
    fn parts_of_a_body_of_several_heights_are_regions() {
        let heights = seen(&[([2.0, 2.0, 20.0, 20.0], 10.0), ([23.0, 2.0, 27.0, 6.0], 3.0)]);
        // A tower on the first.
        let mut on_it = heights;
        for triangle in [[[5.0, 5.0], [9.0, 5.0], [9.0, 9.0]], [[5.0, 5.0], [9.0, 9.0], [5.0, 9.0]]]
        {
            on_it.add(0, triangle.map(|[x, y]| dvec3(x, y, 40.0)));
        }
        let all = Regions::of(&on_it, 4.0, &constants());
        assert_eq!(all.count(), 3);
        // The shed beside it goes before the tower does.
        let two = all.down_to(2, 4);
        assert!(two.regions.values().any(|region| (region.height - 40.0).abs() < 1e-3));
        assert!(two.regions.values().any(|region| (region.height - 10.0).abs() < 1e-3));
    }

    #[test]
    fn nothing_changes_where_all_regions_are_left() {
        let heights = seen(&[([2.0, 2.0, 10.0, 12.0], 6.0), ([10.0, 2.0, 19.0, 12.0], 6.0)]);
        let regions = Regions::of(&heights, 4.0, &constants());
        let all = regions.down_to(usize::MAX, 4);
        assert_eq!(all.of_cell, regions.of_cell);
        // Regions of one height that touch become one with the cells of both.
        let one = regions.down_to(1, 4);
        let covered = |labels: &Labels| labels.of_cell.iter().filter(|&&of| of != NONE).count();
        assert_eq!((one.regions.len(), covered(&one)), (1, covered(&all)));
    }
}
