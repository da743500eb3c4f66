//! Joining boxes with neighbours, or leaving them out, until there are as few as asked.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec2;
use rustc_hash::FxHashMap;

use super::solid::Solid;
use crate::builder::constants::BoxConstants;

/// Joins or leaves out boxes, the least change first, until at most `most` are left.
pub(super) fn join_down_to(solids: &mut Vec<Solid>, most: usize, constants: &BoxConstants) {
    if solids.len() <= most {
        return;
    }
    let mut joining = Joining::new(std::mem::take(solids), constants);
    while joining.left > most && joining.step() {}
    solids.extend(joining.solids.into_iter().flatten());
}

/// One step that may be taken.
struct Step {
    change: f64,
    first: usize,
    /// The same box where it is to be left out.
    second: usize,
}

struct Joining {
    /// Those that are left; joined ones come last.
    solids: Vec<Option<Solid>>,
    neighbours: Vec<Vec<usize>>,
    steps: BinaryHeap<Reverse<Step>>,
    left: usize,
    /// See [`BoxConstants`].
    net: f64,
}

impl Joining {
    fn new(solids: Vec<Solid>, constants: &BoxConstants) -> Self {
        let neighbours = neighbours(&solids, constants.neighbours);
        let left = solids.len();
        let solids = solids.into_iter().map(Some).collect();
        let net = constants.net;
        let mut joining = Self { solids, neighbours, steps: BinaryHeap::new(), left, net };
        for number in 0..left {
            joining.offer(number);
        }
        joining
    }

    /// Offers to leave a box out and to join it with each of its neighbours of lower number.
    fn offer(&mut self, number: usize) {
        let Some(solid) = &self.solids[number] else { return };
        let mut steps =
            vec![Step { change: self.net * seen(solid), first: number, second: number }];
        for &other in self.neighbours[number].iter().filter(|&&other| other < number) {
            if let Some(neighbour) = &self.solids[other] {
                let change = change(solid, neighbour, &solid.joined(neighbour), self.net);
                steps.push(Step { change, first: number, second: other });
            }
        }
        self.steps.extend(steps.into_iter().map(Reverse));
    }

    /// Takes the step that changes least; false where there is none.
    fn step(&mut self) -> bool {
        let Some(Reverse(Step { first, second, .. })) = self.steps.pop() else { return false };
        let (Some(a), Some(b)) = (self.solids[first], self.solids[second]) else { return true };
        self.solids[first] = None;
        self.solids[second] = None;
        self.left -= 1;
        if first == second {
            return true;
        }
        let number = self.solids.len();
        let mut around = std::mem::take(&mut self.neighbours[first]);
        around.append(&mut self.neighbours[second]);
        around.retain(|&other| self.solids[other].is_some());
        around.sort_unstable();
        around.dedup();
        for &other in &around {
            self.neighbours[other].push(number);
        }
        self.solids.push(Some(a.joined(&b)));
        self.neighbours.push(around);
        self.offer(number);
        true
    }
}

/// What is seen of a box from above and from two sides, square metres.
fn seen(solid: &Solid) -> f64 {
    let height = solid.high - solid.low;
    solid.footprint + 2.0 * height * solid.half().element_sum()
}

/// How much of what is seen from above and along both of the joined box's axes changes where it
/// stands for two, square metres.
fn change(a: &Solid, b: &Solid, joined: &Solid, net: f64) -> f64 {
    let axes = [joined.axis, joined.axis.perp()];
    let [along, across] = axes.map(|axis| [a, b, joined].map(|solid| interval(solid, axis)));
    let up = [a, b, joined].map(|solid| [solid.low, solid.high]);
    difference(along, across, net) + difference(along, up, net) + difference(across, up, net)
}

/// A box's extent along an axis.
fn interval(solid: &Solid, axis: DVec2) -> [f64; 2] {
    let (middle, half) = (solid.centre.dot(axis), solid.half_along(axis));
    [middle - half, middle + half]
}

/// The area that is in one of two rectangles but not in the third, or in the third alone, which
/// counts `net` times as far as one is not made up for by the other; each is the product of an `x` and a
/// `y`.
fn difference(x: [[f64; 2]; 3], y: [[f64; 2]; 3], net: f64) -> f64 {
    let common = |of: &[usize]| {
        let length = |sides: [[f64; 2]; 3]| {
            let low = of.iter().map(|&i| sides[i][0]).fold(f64::NEG_INFINITY, f64::max);
            let high = of.iter().map(|&i| sides[i][1]).fold(f64::INFINITY, f64::min);
            (high - low).max(0.0)
        };
        length(x) * length(y)
    };
    let either = common(&[0]) + common(&[1]) - common(&[0, 1]);
    let shared = common(&[0, 2]) + common(&[1, 2]) - common(&[0, 1, 2]);
    let (lost, added) = (either - shared, common(&[2]) - shared);
    lost + added + (net - 1.0) * (lost - added).abs()
}

/// The nearest boxes of each, `most` of them, both ways, by a grid with about two to a cell.
fn neighbours(solids: &[Solid], most: usize) -> Vec<Vec<usize>> {
    let low = solids.iter().fold(DVec2::INFINITY, |low, solid| low.min(solid.centre));
    let high = solids.iter().fold(DVec2::NEG_INFINITY, |high, solid| high.max(solid.centre));
    let size = (high - low).max(DVec2::splat(1e-9));
    let side =
        (size.x * size.y * 2.0 / solids.len() as f64).sqrt().max(size.max_element() / 4096.0);
    let cell = |solid: &Solid| ((solid.centre - low) / side).as_ivec2().to_array();
    let mut cells: FxHashMap<[i32; 2], Vec<usize>> = FxHashMap::default();
    for (number, solid) in solids.iter().enumerate() {
        cells.entry(cell(solid)).or_default().push(number);
    }
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); solids.len()];
    for (number, solid) in solids.iter().enumerate() {
        let [x, y] = cell(solid);
        let around = (-2..=2).flat_map(|i| (-2..=2).map(move |j| [x + i, y + j]));
        let mut near: Vec<(f64, usize)> = around
            .filter_map(|at| cells.get(&at))
            .flatten()
            .filter(|&&other| other != number)
            .map(|&other| (solids[other].centre.distance_squared(solid.centre), other))
            .collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(_, other) in near.iter().take(most) {
            neighbours[number].push(other);
            neighbours[other].push(number);
        }
    }
    for of_one in &mut neighbours {
        of_one.sort_unstable();
        of_one.dedup();
    }
    neighbours
}

impl Ord for Step {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_change = self.change.total_cmp(&other.change);
        by_change.then_with(|| (self.first, self.second).cmp(&(other.first, other.second)))
    }
}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Step {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Step {}

#[cfg(test)]
mod tests {
    use glam::dvec2;

    use super::*;

    #[test]
    fn a_row_of_houses_is_joined_while_a_tower_stays_and_a_shed_goes() {
        let house = |x: f64| Solid::plain(dvec2(x, 0.0), dvec2(5.0, 4.0), 0.0, 6.0);
        let mut solids: Vec<Solid> = (0..6).map(|i| house(10.5 * f64::from(i))).collect();
        solids.push(Solid::plain(dvec2(20.0, 30.0), dvec2(2.0, 2.0), 0.0, 60.0));
        solids.push(Solid::plain(dvec2(40.0, 15.0), dvec2(0.5, 0.5), 0.0, 1.0));
        join_down_to(&mut solids, 2, &BoxConstants::default());
        assert_eq!(solids.len(), 2);
        assert_eq!((solids[0].high, solids[0].footprint), (60.0, 16.0), "the tower");
        let row = solids[1];
        assert!((row.high - 6.0).abs() < 1e-9);
        assert!((row.footprint - 6.0 * 80.0).abs() < 1e-6);
        assert!((row.centre.x - 26.25).abs() < 1e-6 && row.centre.y.abs() < 1e-6);
        assert!((row.half_along(DVec2::X) - 30.5).abs() < 1.0, "{}", row.half_along(DVec2::X));
    }

    #[test]
    fn what_changes_is_nothing_where_the_joined_box_is_both() {
        let a = Solid::plain(dvec2(0.0, 0.0), dvec2(1.0, 2.0), 0.0, 3.0);
        let b = Solid::plain(dvec2(2.0, 0.0), dvec2(1.0, 2.0), 0.0, 3.0);
        assert!(change(&a, &b, &a.joined(&b), 3.0).abs() < 1e-9);
        // A gap of 1 m by 4 m: seen from above and from one side; the box keeps the footprint.
        let c = Solid::plain(dvec2(3.0, 0.0), dvec2(1.0, 2.0), 0.0, 3.0);
        assert!(change(&a, &c, &a.joined(&c), 3.0) > 1.0);
    }

    #[test]
    fn as_few_are_left_as_asked_and_all_volume_that_was_not_left_out() {
        let mut solids: Vec<Solid> = (0..100u32)
            .map(|i| {
                let (x, y) = (f64::from(i % 10) * 20.0, f64::from(i / 10) * 15.0);
                Solid::plain(dvec2(x, y), dvec2(5.0, 4.0), 0.0, 5.0 + f64::from(i % 3))
            })
            .collect();
        let volume = |solids: &[Solid]| -> f64 {
            solids.iter().map(|solid| solid.footprint * (solid.high - solid.low)).sum()
        };
        let before = volume(&solids);
        join_down_to(&mut solids, 30, &BoxConstants::default());
        assert_eq!(solids.len(), 30);
        let after = volume(&solids);
        assert!(after <= before * (1.0 + 1e-9) && after > before * 0.5, "{before} {after}");
    }
}
