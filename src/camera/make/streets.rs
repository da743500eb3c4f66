//! The streets: the room between obstacles that hangs together, and places in it.

use super::ground::Ground;
use super::look::ENOUGH;
use super::{ground, search};
use crate::random::Random;

/// How far from obstacles and from the rim of the ground one keeps, metres.
const KEEP_AWAY_M: f64 = 1.0;
/// Smallest side of the space to go about in, metres.
const MIN_EXTENT_M: f64 = 6.0;
/// A scene has ground where it covers this part of where one can stand and see something.
const GROUND: f64 = 0.1;
/// What a place counts from which nothing is seen.
const BLIND: f64 = 0.01;

/// Cells in which one can go from any to any other.
pub(super) struct Streets<'a> {
    pub(super) ground: &'a Ground,
    /// True at cells of the streets.
    pub(super) is_open: Vec<bool>,
    /// Those cells, in order; not empty.
    pub(super) open: Vec<usize>,
    /// What going through each cell costs.
    pub(super) prices: Vec<u32>,
}

impl<'a> Streets<'a> {
    /// The streets that lead through most of what is built, and from where one can see enough of it,
    /// wherever there are such, and on its ground, where it has any; `None` where there is no room.
    pub(super) fn find(ground: &'a Ground) -> Option<Self> {
        let sees = |cell: usize| {
            let place = ground.surfaces.cells.middle(cell);
            f64::from(ground.sight().at(place).any) >= ENOUGH
        };
        let cells = &ground.surfaces.cells;
        let is_covered = |cell: usize| ground.surfaces.is_covered(cell);
        let open = || (0..cells.len()).filter(|&c| ground.clearance[c] > 0.0 && sees(c));
        let has_ground = open().filter(|&cell| is_covered(cell)).count() as f64
            >= GROUND * open().count() as f64;
        let on_ground = || {
            let is_bare: Vec<bool> = (0..cells.len()).map(|cell| !is_covered(cell)).collect();
            let from_rim = ground::clearance(cells, &is_bare);
            Self::among(ground, |cell| sees(cell) && from_rim[cell] >= keep_away(ground))
        };
        let found = if has_ground { on_ground() } else { None };
        found.or_else(|| Self::among(ground, sees)).or_else(|| Self::among(ground, |_| true))
    }

    fn among(ground: &'a Ground, is_fit: impl Fn(usize) -> bool) -> Option<Self> {
        let cells = &ground.surfaces.cells;
        let is_free = |cell: usize| ground.clearance[cell] >= keep_away(ground) && is_fit(cell);
        let mut seen = vec![false; cells.len()];
        let mut best: Option<(f64, Vec<usize>)> = None;
        for start in 0..cells.len() {
            if seen[start] || !is_free(start) {
                continue;
            }
            let mut part = vec![start];
            seen[start] = true;
            let mut read = 0;
            while let Some(&cell) = part.get(read) {
                read += 1;
                for (beside, step) in cells.around(cell) {
                    if (step[0] == 0 || step[1] == 0) && !seen[beside] && is_free(beside) {
                        seen[beside] = true;
                        part.push(beside);
                    }
                }
            }
            let worth = part.iter().map(|&cell| interest(ground, cell)).sum();
            if best.as_ref().is_none_or(|(most, _)| worth > *most) {
                best = Some((worth, part));
            }
        }
        let (_, mut open) = best?;
        open.sort_unstable();
        let mut is_open = vec![false; cells.len()];
        open.iter().for_each(|&cell| is_open[cell] = true);
        let prices = search::prices(ground, &is_open);
        let streets = Self { ground, is_open, open, prices };
        (streets.extent() >= MIN_EXTENT_M * ground.scale).then_some(streets)
    }

    /// Metres from end to end, along x or y.
    fn extent(&self) -> f64 {
        let places = || self.open.iter().map(|&cell| self.ground.surfaces.cells.middle(cell));
        let min = places().reduce(glam::DVec2::min).unwrap_or_default();
        let max = places().reduce(glam::DVec2::max).unwrap_or_default();
        (max - min).max_element()
    }

    /// How much there is to see around a cell; above 0.
    pub(super) fn interest(&self, cell: usize) -> f64 {
        interest(self.ground, cell)
    }

    /// Any cell of the streets.
    pub(super) fn draw(&self, random: &mut Random) -> usize {
        self.open[(random.bits() % self.open.len() as u64) as usize]
    }
}

/// Metres from obstacles and from the rim of the ground.
fn keep_away(ground: &Ground) -> f32 {
    (KEEP_AWAY_M * ground.scale).max(ground.surfaces.cells.side * 1.1) as f32
}

fn interest(ground: &Ground, cell: usize) -> f64 {
    let part = f64::from(ground.sight().at(ground.surfaces.cells.middle(cell)).level);
    BLIND + part * part
}
