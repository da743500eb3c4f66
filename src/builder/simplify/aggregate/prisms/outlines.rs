//! Fewer points for the borders of regions.
//!
//! Segment collapse that preserves areas (Kronenfeld, Stanislawski, Buttenfield & Brockmeyer,
//! 2020): two points become one, so placed that both sides keep their areas if that is near, always
//! where the area that changes sides, times the step of height there, is least. Corners that a grid has
//! cut off come back. Borders never cross. Closed ones may go as a whole: a courtyard is built over,
//! or what was inside is as high as what is around it.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec2;
use rustc_hash::FxHashSet;

use super::arcs::{Arc, point, twice_area};
use super::heights::NONE as OPEN;
use super::segments::{do_cross, is_within, replacement};
use super::squares::Squares;

const NONE: u32 = u32::MAX;

/// Two points that may become one, or one that may go, or all of a closed arc.
struct Collapse {
    price: f64,
    /// The first of the two, or of all.
    vertex: u32,
    version: u32,
    is_whole: bool,
}

/// Polylines being simplified.
pub(super) struct Outlines {
    positions: Vec<DVec2>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Raised whenever a vertex or its surroundings change.
    versions: Vec<u32>,
    alive: Vec<bool>,
    arc_of: Vec<u32>,
    arcs: Vec<State>,
    /// Of arcs without points between the same ends, which would be one.
    straight: FxHashSet<[[i32; 2]; 2]>,
    squares: Squares,
    collapses: BinaryHeap<Reverse<Collapse>>,
}

struct State {
    first: u32,
    /// Without its ends.
    points: usize,
    /// It may not have fewer.
    least: usize,
    is_closed: bool,
    nodes: Option<[[i32; 2]; 2]>,
    /// The step of height, metres.
    weight: f64,
    /// Triangles that a segment has: two of a wall and one of each roof.
    triangles: usize,
    /// What is changed if it goes as a whole, where it may: metres of height times cells.
    volume: Option<f64>,
}

/// A closed arc has so many points at least: a house that is a triangle has spikes.
const LEAST: usize = 4;

impl Outlines {
    /// Of arcs whose sides differ by `step` metres of height. `lost` is what each cell counts if what
    /// is inside a closed one is taken for what is outside of it, metres.
    pub fn of(
        arcs: &[Arc],
        step: impl Fn([u32; 2]) -> f64,
        lost: impl Fn(u32, u32) -> f64,
    ) -> Self {
        let all = || arcs.iter().flat_map(|arc| &arc.points);
        let mut outlines = Self {
            positions: Vec::new(),
            next: Vec::new(),
            previous: Vec::new(),
            versions: Vec::new(),
            alive: Vec::new(),
            arc_of: Vec::new(),
            arcs: Vec::new(),
            straight: FxHashSet::default(),
            squares: Squares::around(all().copied()),
            collapses: BinaryHeap::new(),
        };
        for arc in arcs {
            let twice = twice_area(&arc.points);
            let [left, right] = arc.sides;
            let [inside, outside] = if twice > 0.0 { [left, right] } else { [right, left] };
            let volume = arc.nodes.is_none().then(|| twice.abs() * 0.5 * lost(inside, outside));
            outlines.add(arc, step(arc.sides).abs(), volume);
        }
        for vertex in 0..outlines.positions.len() as u32 {
            outlines.index(vertex);
        }
        let vertices = 0..outlines.positions.len() as u32;
        let offers: Vec<Reverse<Collapse>> = vertices
            .filter_map(|vertex| outlines.offered(vertex))
            .chain(outlines.arcs.iter().filter_map(State::offered))
            .map(Reverse)
            .collect();
        outlines.collapses = BinaryHeap::from(offers);
        outlines
    }

    fn add(&mut self, arc: &Arc, weight: f64, volume: Option<f64>) {
        let first = self.positions.len() as u32;
        let number = self.arcs.len() as u32;
        match arc.nodes {
            Some([start, end]) => {
                self.positions.push(point(start));
                self.positions.extend(&arc.points);
                self.positions.push(point(end));
            }
            None => self.positions.extend(&arc.points),
        }
        let end = self.positions.len() as u32;
        let is_closed = arc.nodes.is_none();
        for vertex in first..end {
            let (last, first_of_all) = (vertex + 1 == end, vertex == first);
            self.next.push(if !last {
                vertex + 1
            } else if is_closed {
                first
            } else {
                NONE
            });
            let before = if is_closed { end - 1 } else { NONE };
            self.previous.push(if first_of_all { before } else { vertex - 1 });
        }
        self.versions.resize(end as usize, 0);
        self.alive.resize(end as usize, true);
        self.arc_of.resize(end as usize, number);
        let nodes = arc.nodes.map(|ends| {
            let mut ends = ends.map(|end| end.to_array());
            ends.sort_unstable();
            ends
        });
        let least = match nodes {
            None => LEAST,
            Some([a, b]) if a == b => 2,
            Some(_) => 0,
        };
        self.arcs.push(State {
            first,
            points: arc.points.len(),
            least,
            is_closed,
            nodes,
            weight,
            triangles: 2 + arc.sides.iter().filter(|&&side| side != OPEN).count(),
            volume,
        });
    }

    /// Whether an arc is gone as a whole.
    pub fn is_gone(&self, arc: usize) -> bool {
        !self.alive[self.arcs[arc].first as usize]
    }

    /// Triangles of walls, and those of roofs by their corners: two more than there are for each.
    pub fn triangles(&self) -> usize {
        let segments = |arc: &State| arc.points + usize::from(!arc.is_closed);
        let left = (0..).zip(&self.arcs).filter(|&(number, _)| !self.is_gone(number));
        left.map(|(_, arc)| arc.triangles * segments(arc)).sum()
    }

    /// Collapses until there are at most so many by [`Self::triangles`], as far as borders allow.
    pub fn simplify(&mut self, most: usize) {
        let mut triangles = self.triangles();
        while triangles > most {
            let Some(Reverse(collapse)) = self.collapses.pop() else { return };
            let Collapse { vertex, version, is_whole, .. } = collapse;
            let arc = self.arc_of[vertex as usize] as usize;
            if is_whole {
                triangles -= self.arcs[arc].triangles * self.arcs[arc].points;
                self.give_up(arc);
                continue;
            }
            if self.versions[vertex as usize] != version || !self.alive[vertex as usize] {
                continue;
            }
            if self.collapse(vertex) {
                triangles -= self.arcs[arc].triangles;
            }
        }
    }

    /// The points of an arc, its ends included; a closed one does not come back to its first.
    pub fn points(&self, arc: usize) -> Vec<DVec2> {
        let State { first, .. } = self.arcs[arc];
        let mut points = Vec::new();
        let mut vertex = first;
        loop {
            points.push(self.positions[vertex as usize]);
            vertex = self.next[vertex as usize];
            if vertex == NONE || vertex == first {
                return points;
            }
        }
    }

    fn at(&self, vertex: u32) -> DVec2 {
        self.positions[vertex as usize]
    }

    fn is_end(&self, vertex: u32) -> bool {
        self.next[vertex as usize] == NONE || self.previous[vertex as usize] == NONE
    }

    /// The four vertices around the segment that starts here, if both of its ends may go.
    fn around(&self, b: u32) -> Option<[u32; 4]> {
        if self.is_end(b) {
            return None;
        }
        let c = self.next[b as usize];
        if self.is_end(c) {
            return None;
        }
        Some([self.previous[b as usize], b, c, self.next[c as usize]])
    }

    /// The collapse of the segment that starts at a vertex, or of the vertex where it is the only
    /// one.
    fn offered(&self, vertex: u32) -> Option<Collapse> {
        let arc = &self.arcs[self.arc_of[vertex as usize] as usize];
        if arc.points <= arc.least || self.is_end(vertex) {
            return None;
        }
        let displaced = match self.around(vertex) {
            Some(around) => replacement(around.map(|v| self.at(v)))?.1,
            None if arc.points == 1 => {
                let [a, d] = [self.previous[vertex as usize], self.next[vertex as usize]];
                let [a, b, d] = [a, vertex, d].map(|v| self.at(v));
                (b - a).perp_dot(d - a).abs() * 0.5
            }
            None => return None,
        };
        let price = displaced * arc.weight / arc.triangles as f64;
        let version = self.versions[vertex as usize];
        Some(Collapse { price, vertex, version, is_whole: false })
    }

    /// Takes all of a closed arc away.
    fn give_up(&mut self, arc: usize) {
        let first = self.arcs[arc].first;
        let mut vertex = first;
        loop {
            self.alive[vertex as usize] = false;
            vertex = self.next[vertex as usize];
            if vertex == first {
                return;
            }
        }
    }

    /// Does it; false where borders would cross.
    fn collapse(&mut self, vertex: u32) -> bool {
        let number = self.arc_of[vertex as usize] as usize;
        let Some([a, b, c, d]) = self.around(vertex) else {
            return self.remove(vertex, number);
        };
        let corners = [a, b, c, d].map(|v| self.at(v));
        let Some((place, _)) = replacement(corners) else { return false };
        let [pa, pb, pc, pd] = corners;
        let swept = [[pa, pb, place], [pb, pc, place], [pc, pd, place]];
        if !self.is_free([[pa, place], [place, pd]], &swept, [a, b, c]) {
            return false;
        }
        // The first of the two moves, the second goes.
        self.positions[b as usize] = place;
        self.next[b as usize] = d;
        self.previous[d as usize] = b;
        self.alive[c as usize] = false;
        self.versions[c as usize] += 1;
        let arc = &mut self.arcs[number];
        arc.points -= 1;
        if arc.first == c {
            arc.first = b;
        }
        self.index(a);
        self.index(b);
        self.renew(b);
        true
    }

    /// Takes the only point of an open arc away.
    fn remove(&mut self, vertex: u32, number: usize) -> bool {
        let [a, d] = [self.previous[vertex as usize], self.next[vertex as usize]];
        let [pa, pb, pd] = [a, vertex, d].map(|v| self.at(v));
        let Some(nodes) = self.arcs[number].nodes else { return false };
        if self.straight.contains(&nodes)
            || !self.is_free([[pa, pd], [pa, pd]], &[[pa, pb, pd]], [a, vertex, vertex])
        {
            return false;
        }
        self.straight.insert(nodes);
        self.next[a as usize] = d;
        self.previous[d as usize] = a;
        self.alive[vertex as usize] = false;
        self.arcs[number].points = 0;
        self.index(a);
        true
    }

    /// Offers anew what changes with a vertex.
    fn renew(&mut self, vertex: u32) {
        let back = |vertex: u32| if vertex == NONE { NONE } else { self.previous[vertex as usize] };
        let before = back(vertex);
        let near = [vertex, before, back(before), self.next[vertex as usize]];
        for (number, &vertex) in near.iter().enumerate() {
            if vertex != NONE && !near[..number].contains(&vertex) {
                self.versions[vertex as usize] += 1;
                let offered = self.offered(vertex);
                self.collapses.extend(offered.map(Reverse));
            }
        }
    }

    /// Whether new segments cross none but the old ones, which start at these vertices, and no
    /// other vertex lies in what is swept.
    fn is_free(&mut self, new: [[DVec2; 2]; 2], swept: &[[DVec2; 3]], old: [u32; 3]) -> bool {
        let all = swept.as_flattened();
        let low = all.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
        let high = all.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
        for square in self.squares.between(low, high) {
            let alive = &self.alive;
            self.squares.starts[square].retain(|&start| alive[start as usize]);
            for &start in &self.squares.starts[square] {
                let end = self.next[start as usize];
                if end == NONE {
                    continue;
                }
                let [p, q] = [start, end].map(|v| self.at(v));
                if p.max(q).cmplt(low).any() || p.min(q).cmpgt(high).any() {
                    continue;
                }
                if !old.contains(&start) && new.iter().any(|&[a, b]| do_cross([a, b], [p, q])) {
                    return false;
                }
                let is_near = p.cmpge(low).all() && p.cmple(high).all();
                let is_in = |triangle: &[DVec2; 3]| is_within(p, triangle);
                if is_near && !all.contains(&p) && swept.iter().any(is_in) {
                    return false;
                }
            }
        }
        true
    }

    /// Makes the segment that starts at a vertex known.
    fn index(&mut self, vertex: u32) {
        let end = self.next[vertex as usize];
        if end != NONE {
            let [p, q] = [vertex, end].map(|v| self.at(v));
            for square in self.squares.between(p.min(q), p.max(q)) {
                let there = &mut self.squares.starts[square];
                if !there.contains(&vertex) {
                    there.push(vertex);
                }
            }
        }
    }
}

impl State {
    /// That it goes as a whole, at the price for a triangle of those that it then has at least.
    fn offered(&self) -> Option<Collapse> {
        let price = self.volume? / (self.triangles * LEAST) as f64;
        Some(Collapse { price, vertex: self.first, version: 0, is_whole: true })
    }
}

impl Ord for Collapse {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_price = self.price.total_cmp(&other.price);
        by_price.then_with(|| (self.vertex, self.version).cmp(&(other.vertex, other.version)))
    }
}

impl PartialOrd for Collapse {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Collapse {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Collapse {}

#[cfg(test)]
mod tests {
    use glam::dvec2;

    use super::super::arcs::{arcs, rings, twice_area};
    use super::super::heights::{Grid, Near};
    use super::*;

    fn ring_areas(arcs: &[Arc], outlines: &Outlines) -> Vec<f64> {
        let of = |ring: Vec<super::super::arcs::HalfArc>| {
            let mut all = Vec::new();
            for half in ring {
                let mut points = outlines.points(half.arc);
                if !half.forward {
                    points.reverse();
                }
                all.extend(points);
            }
            twice_area(&all)
        };
        rings(arcs).into_iter().map(|(_, ring)| of(ring)).collect()
    }

    #[test]
    fn a_turned_rectangle_gets_its_corners_back() {
        let grid = Grid::over(DVec2::splat(3.0), DVec2::splat(57.0), 1.0, 3);
        let (centre, axis) = (dvec2(30.2, 29.7), DVec2::from_angle(0.4));
        let half = dvec2(20.0, 11.0);
        let cells: Vec<u32> = (0..grid.cells())
            .map(|cell| {
                let p = dvec2((cell % 60) as f64 + 0.5, (cell / 60) as f64 + 0.5) - centre;
                let own = dvec2(p.dot(axis), p.dot(axis.perp())).abs();
                if own.cmple(half).all() { 0 } else { OPEN }
            })
            .collect();
        let arcs = arcs(&cells, &Near::of(&cells, &grid, 1), &grid);
        let mut outlines = Outlines::of(&arcs, |_| 1.0, |_, _| 10.0);
        let before = ring_areas(&arcs, &outlines);
        // Of four corners: two triangles of walls each, and one of the roof.
        outlines.simplify(12);
        let points = outlines.points(0);
        assert_eq!(points.len(), 4);
        assert!((ring_areas(&arcs, &outlines)[0] - before[0]).abs() < 1e-6);
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let corner = centre + axis * half.x * x + axis.perp() * half.y * y;
            let nearest = points.iter().map(|p| p.distance(corner)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1.0, "{nearest} cells from {corner}: {points:?}");
        }
    }

    #[test]
    fn courtyards_and_towers_go_as_a_whole_the_least_first() {
        // A block of 30 by 30 cells with courts of 2 by 2, one of 8 by 8, and a tower.
        let grid = Grid::over(DVec2::splat(3.0), DVec2::splat(37.0), 1.0, 3);
        let cells: Vec<u32> = (0..grid.cells())
            .map(|cell| {
                let (x, y) = (cell % grid.columns, cell / grid.columns);
                let within = |low: [usize; 2], side: usize| {
                    (low[0]..low[0] + side).contains(&x) && (low[1]..low[1] + side).contains(&y)
                };
                match within([5, 5], 30) {
                    true if within([20, 20], 8) || within([8, 8], 2) || within([14, 8], 2) => OPEN,
                    true if within([8, 20], 4) => 1,
                    true => 0,
                    false => OPEN,
                }
            })
            .collect();
        let arcs = arcs(&cells, &Near::of(&cells, &grid, 1), &grid);
        assert_eq!(arcs.len(), 5);
        let lost = |inside: u32, outside: u32| match (inside, outside) {
            (1, 0) => 50.0,
            (0, OPEN) => 1e3,
            _ => 10.0,
        };
        let left_of = |most: usize| {
            let mut outlines = Outlines::of(&arcs, |_| 10.0, lost);
            outlines.simplify(most);
            assert!(outlines.triangles() <= most);
            let sides = (0..5).filter(|&arc| !outlines.is_gone(arc));
            let mut left: Vec<f64> =
                sides.map(|arc| twice_area(&outlines.points(arc)).abs().round()).collect();
            left.sort_by(f64::total_cmp);
            left
        };
        // Half a cell of each was cut off at its corners. Walls of the tower have two roofs.
        assert_eq!(left_of(40), [31.0, 127.0, 1799.0]);
        assert_eq!(left_of(24), [127.0, 1799.0]);
        assert_eq!(left_of(12), [1799.0]);
        assert_eq!(left_of(0), [0.0; 0]);
    }

    #[test]
    fn borders_never_cross_and_regions_keep_their_areas() {
        let grid = Grid::over(DVec2::splat(2.0), DVec2::splat(62.0), 1.0, 2);
        // Each cell belongs to the nearest of some points, and some of these are the open.
        let places: Vec<DVec2> =
            (0..40u32).map(|n| dvec2(f64::from(n * 37 % 64), f64::from(n * 53 % 61))).collect();
        let cells: Vec<u32> = (0..grid.cells())
            .map(|cell| {
                let p = dvec2((cell % 64) as f64 + 0.5, (cell / 64) as f64 + 0.5);
                let nearest = (0..40usize)
                    .min_by(|&a, &b| places[a].distance(p).total_cmp(&places[b].distance(p)));
                let inside = p.min_element() > 2.0 && p.max_element() < 62.0;
                nearest.filter(|n| inside && n % 5 != 0).map_or(OPEN, |n| n as u32)
            })
            .collect();
        let arcs = arcs(&cells, &Near::of(&cells, &grid, 1), &grid);
        let mut outlines = Outlines::of(&arcs, |sides| f64::from(sides[0] % 7 + 1), |_, _| 100.0);
        let before = ring_areas(&arcs, &outlines);
        let triangles = outlines.triangles();
        outlines.simplify(triangles / 3);
        assert!(outlines.triangles() <= triangles / 3, "{}", outlines.triangles());
        let mut segments = Vec::new();
        for (number, arc) in arcs.iter().enumerate() {
            let points = outlines.points(number);
            segments.extend(points.windows(2).map(|pair| [pair[0], pair[1]]));
            if arc.nodes.is_none() {
                segments.push([points[points.len() - 1], points[0]]);
            }
        }
        for (number, &first) in segments.iter().enumerate() {
            for &second in &segments[..number] {
                assert!(!do_cross(first, second), "{first:?} {second:?}");
            }
        }
        // All but what lost the last point of an arc keeps its area to rounding.
        let after = ring_areas(&arcs, &outlines);
        let kept = before.iter().zip(&after).filter(|(a, b)| (*a - *b).abs() < 1e-6).count();
        assert!(kept > 0);
        for (a, b) in before.iter().zip(&after) {
            assert!((a - b).abs() < 0.35 * a.abs() + 40.0, "{a} {b}");
            assert_eq!(*a > 0.0, *b > 0.0);
        }
    }
}
