//! The cheapest way between two cells of the streets.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::ground::Ground;
use super::streets::Streets;

/// The price of a cell's side at best, and of its diagonal.
const STRAIGHT: u64 = 64;
const DIAGONAL: u64 = 91;
/// Room to both sides that one would like to have, metres.
const ROOM_M: f64 = 3.0;
/// How much dearer a metre is right beside a wall.
const TIGHT: f64 = 3.0;
/// How much dearer a metre is where nothing of the model is seen.
const BLIND: f64 = 20.0;
/// Where a picture can show this part of the model, a place is as good as any other.
const SEEN: f64 = 0.55;

/// The price of each cell, in 64ths: 64 at best, 0 where one cannot go.
pub(super) fn prices(ground: &Ground, is_open: &[bool]) -> Vec<u32> {
    let room = (ROOM_M * ground.scale) as f32;
    let price = |cell: usize| {
        if !is_open[cell] {
            return 0;
        }
        let tight = 1.0 - (ground.clearance[cell] / room).min(1.0);
        let seen = f64::from(ground.sight().at(ground.surfaces.cells.middle(cell)).level);
        let blind = 1.0 - (seen / SEEN).min(1.0);
        let dearer = 1.0 + TIGHT * f64::from(tight) + BLIND * blind;
        (dearer * 64.0) as u32
    };
    (0..is_open.len()).map(price).collect()
}

impl Streets<'_> {
    /// The cells from `start` to `goal`, both included; `None` where there is no way (A*).
    pub(super) fn way(&self, start: usize, goal: usize) -> Option<Vec<usize>> {
        let cells = &self.ground.surfaces.cells;
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
