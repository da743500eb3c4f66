//! The streets: the room between obstacles that hangs together, and places in it.

use super::ground::Ground;
use crate::random::Random;

/// How far from obstacles one keeps, metres.
const KEEP_AWAY_M: f64 = 1.0;
/// Smallest side of the space to go about in, metres.
const MIN_EXTENT_M: f64 = 6.0;
/// What a place without any surface counts, against 1 of a place with one.
const BARE: f32 = 0.3;
/// What a place without buildings around it counts.
const OUTSIDE: f32 = 0.02;

/// Cells in which one can go from any to any other.
pub(super) struct Streets<'a> {
    pub(super) ground: &'a Ground,
    /// True at cells of the streets.
    pub(super) is_open: Vec<bool>,
    /// Those cells, in order; not empty.
    pub(super) open: Vec<usize>,
}

impl<'a> Streets<'a> {
    /// The streets that lead through most of what is built; `None` where there is no room.
    pub(super) fn find(ground: &'a Ground) -> Option<Self> {
        let cells = &ground.cells;
        let keep = (KEEP_AWAY_M * ground.scale).max(cells.side * 1.1) as f32;
        let is_free = |cell: usize| ground.clearance[cell] >= keep;
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
            let worth = part.iter().map(|&cell| f64::from(interest(ground, cell))).sum();
            if best.as_ref().is_none_or(|(most, _)| worth > *most) {
                best = Some((worth, part));
            }
        }
        let (_, mut open) = best?;
        open.sort_unstable();
        let mut is_open = vec![false; cells.len()];
        open.iter().for_each(|&cell| is_open[cell] = true);
        let streets = Self { ground, is_open, open };
        (streets.extent() >= MIN_EXTENT_M * ground.scale).then_some(streets)
    }

    /// Metres from end to end, along x or y.
    fn extent(&self) -> f64 {
        let places = || self.open.iter().map(|&cell| self.ground.cells.middle(cell));
        let min = places().reduce(glam::DVec2::min).unwrap_or_default();
        let max = places().reduce(glam::DVec2::max).unwrap_or_default();
        (max - min).max_element()
    }

    /// How much there is to see around a cell; above 0.
    pub(super) fn interest(&self, cell: usize) -> f64 {
        f64::from(interest(self.ground, cell))
    }

    /// Any cell of the streets.
    pub(super) fn draw(&self, random: &mut Random) -> usize {
        self.open[(random.bits() % self.open.len() as u64) as usize]
    }
}

fn interest(ground: &Ground, cell: usize) -> f32 {
    (OUTSIDE + ground.built[cell]) * if ground.is_covered(cell) { 1.0 } else { BARE }
}
