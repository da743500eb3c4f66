//! The cheapest way between two cells of the streets.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::streets::Streets;

/// The price of a cell's side at best, and of its diagonal.
const STRAIGHT: u64 = 64;
const DIAGONAL: u64 = 91;
/// Room to both sides that one would like to have, metres.
const ROOM_M: f64 = 3.0;
/// How much dearer a metre is right beside a wall.
const TIGHT: f64 = 3.0;
/// How much dearer a metre is where nothing is built.
const OUTSIDE: f64 = 1.5;
/// How much dearer a metre is where the scene has no surface.
const BARE: f64 = 1.0;
/// Built-up share at which a place is as good as any other.
const BUILT_ENOUGH: f32 = 0.2;
/// How much dearer a metre is that was gone before.
const AGAIN: u64 = 3;

/// Prices of cells, in 64ths: 64 a cell at best, 0 where one cannot go.
pub(super) struct Prices {
    prices: Vec<u32>,
}

impl Prices {
    pub(super) fn new(streets: &Streets<'_>) -> Self {
        let ground = streets.ground;
        let room = (ROOM_M * ground.scale) as f32;
        let price = |cell: usize| {
            if !streets.is_open[cell] {
                return 0;
            }
            let tight = 1.0 - (ground.clearance[cell] / room).min(1.0);
            let outside = 1.0 - (ground.built[cell] / BUILT_ENOUGH).min(1.0);
            let bare = if ground.is_covered(cell) { 0.0 } else { BARE };
            let dearer = 1.0 + TIGHT * f64::from(tight) + OUTSIDE * f64::from(outside) + bare;
            (dearer * 64.0) as u32
        };
        Self { prices: (0..ground.cells.len()).map(price).collect() }
    }

    /// Makes cells within `reach` cells of a way dearer.
    pub(super) fn mark(&mut self, streets: &Streets<'_>, way: &[usize], reach: usize) {
        let cells = &streets.ground.cells;
        let mut near = std::collections::BTreeSet::new();
        for &cell in way {
            let (column, row) = (cell % cells.columns, cell / cells.columns);
            for y in row.saturating_sub(reach)..(row + reach + 1).min(cells.rows) {
                let from = y * cells.columns + column.saturating_sub(reach);
                let to = y * cells.columns + (column + reach + 1).min(cells.columns);
                near.extend(from..to);
            }
        }
        for cell in near {
            // Never so dear that a long way could overflow.
            let again = u64::from(self.prices[cell]) * AGAIN;
            self.prices[cell] = again.min(64 * 64) as u32;
        }
    }

    /// The cells from `start` to `goal`, both included; `None` where there is no way (A*).
    pub(super) fn way(
        &self,
        streets: &Streets<'_>,
        start: usize,
        goal: usize,
    ) -> Option<Vec<usize>> {
        let cells = &streets.ground.cells;
        let at_least = |cell: usize| {
            let across = (cell % cells.columns).abs_diff(goal % cells.columns) as u64;
            let along = (cell / cells.columns).abs_diff(goal / cells.columns) as u64;
            let (less, more) = (across.min(along), across.max(along));
            64 * (less * DIAGONAL + (more - less) * STRAIGHT)
        };
        let mut least = vec![u64::MAX; cells.len()];
        let mut from = vec![usize::MAX; cells.len()];
        let mut open = BinaryHeap::new();
        least[start] = 0;
        open.push(Reverse((at_least(start), start)));
        while let Some(Reverse((estimate, cell))) = open.pop() {
            if cell == goal {
                let mut way = vec![goal];
                let mut last = goal;
                while last != start {
                    last = from[last];
                    way.push(last);
                }
                way.reverse();
                return Some(way);
            }
            if estimate > least[cell] + at_least(cell) {
                continue;
            }
            for (beside, step) in cells.around(cell) {
                let price = u64::from(self.prices[beside]);
                let length = if step[0] != 0 && step[1] != 0 { DIAGONAL } else { STRAIGHT };
                let cost = least[cell] + length * price;
                if price > 0 && cost < least[beside] {
                    least[beside] = cost;
                    from[beside] = cell;
                    open.push(Reverse((cost + at_least(beside), beside)));
                }
            }
        }
        None
    }
}
