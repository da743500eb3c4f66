//! Which borders touch, and the strips between them.
//!
//! Two open edges of one kind of surface, whose colours may come to lie on either side, touch where
//! they run side by side in opposite directions, their triangles on opposite sides, no farther apart
//! than a share of the surface's *resolution*: the length that nine of ten of its edges exceed. What
//! is narrower is no feature of such a surface. In a scan that is half of an edge; among houses with
//! walls of many metres it is less than any alley.

use std::collections::BTreeMap;
use std::hash::Hasher;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHasher};

use super::open_edges::{OpenEdge, open_edges};
use super::strip::{LEAST_LENGTH, Stitch, Strip, nearest_on};
use crate::builder::constants::StitchConstants;
use crate::mesh::{Part, PositionKey, key, wide};
use crate::stage_timer::StageTimer;

/// The strips between all borders of some parts that touch; `kinds` says for each what it looks
/// like: the first of those materials that differ in nothing but their images. Only borders of one
/// kind touch; `None` touches nothing, since its colours may not leave their triangles. Edges at which
/// the surface `goes_on` in what is built apart touch nothing either.
pub fn stitches(
    parts: &[Part],
    kinds: Vec<Option<u32>>,
    constants: &StitchConstants,
    goes_on: impl Fn(&OpenEdge) -> bool,
) -> Vec<Stitch> {
    if constants.resolution <= 0.0 {
        return Vec::new();
    }
    let mut edges = open_edges(parts);
    edges.retain(|edge| kinds[edge.part as usize].is_some() && !goes_on(edge));
    if edges.is_empty() {
        return Vec::new();
    }
    let resolutions = resolutions(parts, constants);
    let reach: Vec<f64> =
        edges.iter().map(|edge| constants.resolution * resolutions[edge.part as usize]).collect();
    let borders = Borders::new(edges, kinds, reach);
    borders.strips()
}

/// Of each part, the length that nine of ten edges exceed; of small parts, that of all parts.
fn resolutions(parts: &[Part], constants: &StitchConstants) -> Vec<f64> {
    let of = |parts: &[Part]| {
        let triangles: usize = parts.iter().map(|part| part.indices.len() / 3).sum();
        let step = (triangles / constants.sampled).max(1);
        let corners = parts.iter().flat_map(|part| {
            let at = |vertex: u32| wide(part.positions[vertex as usize]);
            part.indices.as_chunks::<3>().0.iter().map(move |corners| corners.map(at))
        });
        let lengths = corners.step_by(step).flat_map(|[a, b, c]| {
            [a.distance(b), b.distance(c), c.distance(a)].into_iter().filter(|length| *length > 0.0)
        });
        let mut lengths: Vec<f64> = lengths.collect();
        let tenth = lengths.len() / 10;
        match lengths.is_empty() {
            true => 0.0,
            false => *lengths.select_nth_unstable_by(tenth, f64::total_cmp).1,
        }
    };
    let all = of(parts);
    let of_part = |part: &Part| match part.indices.len() / 3 < constants.small_part {
        true => all,
        false => of(std::slice::from_ref(part)),
    };
    parts.iter().map(of_part).collect()
}

/// A number for each cell of a grid; cells far apart may have the same.
type Cell = u64;

/// Open edges, as chains and by place.
struct Borders {
    edges: Vec<OpenEdge>,
    /// Of each part.
    kinds: Vec<Option<u32>>,
    /// How far from each another may be to touch it, metres.
    reach: Vec<f64>,
    /// The edges that start at each position, and those that end there: several where borders have
    /// a vertex in common.
    from: AtPosition,
    to: AtPosition,
    /// The edges by place, those of about the same reach together.
    grids: Vec<Grid>,
}

/// Edges by the cells that they run through.
struct Grid {
    /// Which edges run through which cell, by cell.
    entered: Vec<(Cell, u32)>,
    /// The range of `entered` that is of each cell.
    cells: FxHashMap<Cell, Range<usize>>,
    /// The side of a cell, at least [`SIDE`] times the largest reach of the edges.
    side: f64,
}

impl Grid {
    /// Of numbered edges, of which none reaches farther than `widest`.
    fn new(edges: &[(u32, [DVec3; 2])], widest: f64) -> Self {
        let mut lengths: Vec<f64> =
            edges.iter().map(|(_, [from, to])| from.distance(*to)).collect();
        let middle = lengths.len() / 2;
        let median = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let side = (SIDE * widest).max(median).max(f64::MIN_POSITIVE);
        let mut entered: Vec<(Cell, u32)> = Vec::with_capacity(2 * edges.len());
        for &(number, [from, to]) in edges {
            let pieces = (from.distance(to) / (side * SPACING)).ceil().max(1.0) as usize;
            for piece in 0..=pieces {
                let cell = cell(from.lerp(to, piece as f64 / pieces as f64), side);
                if entered.last() != Some(&(number_of(cell), number)) {
                    entered.push((number_of(cell), number));
                }
            }
        }
        entered.sort_unstable();
        entered.dedup();
        let mut cells: FxHashMap<Cell, Range<usize>> = FxHashMap::default();
        for (at, (cell, _)) in entered.iter().enumerate() {
            cells.entry(*cell).or_insert(at..at).end = at + 1;
        }
        Self { entered, cells, side }
    }

    /// The edges near a place, some more than once.
    fn near(&self, place: DVec3) -> impl Iterator<Item = u32> {
        // Of an edge within reach, one of the points that were entered is no farther than this.
        let beyond = self.side * (1.0 / SIDE + 0.5 * SPACING);
        let [low, high] = [-beyond, beyond].map(|by| cell(place + by, self.side));
        let line = move |x: i64, y: i64| (low[2]..=high[2]).map(move |z| [x, y, z]);
        let cells =
            (low[0]..=high[0]).flat_map(move |x| (low[1]..=high[1]).flat_map(move |y| line(x, y)));
        let there = |at| self.cells.get(&number_of(at)).cloned().unwrap_or_default();
        let entered =
            cells.flat_map(move |at| self.entered[there(at)].iter().map(|(_, edge)| *edge));
        entered.take(MOST_NEAR)
    }
}

/// By position, the edges that start or end there, the last first.
struct AtPosition {
    last: FxHashMap<PositionKey<f64>, u32>,
    /// Of each edge, the one before it at the same position.
    before: Vec<Option<u32>>,
}

impl AtPosition {
    fn new(positions: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut last = FxHashMap::default();
        let before = (0..).zip(positions).map(|(edge, at)| last.insert(key(at), edge)).collect();
        Self { last, before }
    }

    /// Some of them, where they are more than [`MOST_AT_VERTEX`].
    fn at(&self, position: [f64; 3]) -> impl Iterator<Item = u32> {
        let last = self.last.get(&key(position)).copied();
        std::iter::successors(last, |&edge| self.before[edge as usize]).take(MOST_AT_VERTEX)
    }
}

/// Open edges that start or end at a vertex and are told apart, at most: where more do, there is no
/// border to follow, and looking at all of them at each would take quadratic time.
const MOST_AT_VERTEX: usize = 32;

/// Edges that are looked at around a vertex, of one [`Grid`], at most: where more are, triangles
/// lie across each other rather than beside each other.
const MOST_NEAR: usize = 512;

/// The least side of a cell, in the largest reach: mostly one cell is looked into.
const SIDE: f64 = 8.0;

/// Edges are entered into cells at points so far apart, in sides of a cell.
const SPACING: f64 = 0.25;

/// A vertex of another border.
#[derive(Clone, Copy, Debug)]
struct Partner {
    at: [f64; 3],
    part: u32,
}

/// Strips walk along no more edges of one border for one edge of the other.
const MOST_STEPS: usize = 64;

/// The cosine of the angle that edges side by side may have, and that their triangles' planes may
/// have. The sides of a notch between two teeth of a border have more.
const SIDE_BY_SIDE: f64 = 0.85;

/// Open edges whose partners one thread looks for at a time.
const CHUNK: u32 = 1024;

/// Nor back by more, where nearest vertices are not in order.
const MOST_BACK: usize = 4;

impl Borders {
    fn new(edges: Vec<OpenEdge>, kinds: Vec<Option<u32>>, reach: Vec<f64>) -> Self {
        let [from, to] = [0, 1].map(|end| AtPosition::new(edges.iter().map(|edge| edge.ends[end])));
        // Powers of two of the reach.
        let mut of_reach: BTreeMap<i32, Vec<(u32, [DVec3; 2])>> = BTreeMap::new();
        for (number, (edge, reach)) in (0..).zip(edges.iter().zip(&reach)) {
            let class = reach.max(f64::MIN_POSITIVE).log2().ceil() as i32;
            of_reach.entry(class).or_default().push((number, edge.ends.map(wide)));
        }
        let grids =
            of_reach.iter().map(|(&class, edges)| Grid::new(edges, f64::from(class).exp2()));
        let grids = grids.collect();
        Self { edges, kinds, reach, from, to, grids }
    }

    fn edge(&self, number: u32) -> &OpenEdge {
        &self.edges[number as usize]
    }

    /// The edge with which a border goes on. Of several, the one that turns least.
    fn next(&self, edge: u32) -> Option<u32> {
        self.straightest(edge, self.from.at(self.edge(edge).ends[1]))
    }

    fn previous(&self, edge: u32) -> Option<u32> {
        self.straightest(edge, self.to.at(self.edge(edge).ends[0]))
    }

    fn straightest(&self, edge: u32, mut others: impl Iterator<Item = u32>) -> Option<u32> {
        let first = others.next()?;
        let mut rest = others.peekable();
        if rest.peek().is_none() {
            return Some(first);
        }
        let own = self.edge(edge);
        let turned = |other: &u32| {
            let other = self.edge(*other);
            -own.direction().dot(other.direction()) - own.outward().dot(other.outward())
        };
        let all = std::iter::once(first).chain(rest);
        all.min_by(|a, b| turned(a).total_cmp(&turned(b)).then(a.cmp(b)))
    }

    /// All edges, those of one border one after another.
    fn in_order(&self) -> Vec<u32> {
        let mut done = vec![false; self.edges.len()];
        let mut order = Vec::with_capacity(self.edges.len());
        for edge in 0..self.edges.len() as u32 {
            if done[edge as usize] {
                continue;
            }
            let mut first = edge;
            while let Some(previous) = self.previous(first).filter(|&previous| {
                previous != edge && !done[previous as usize] && self.next(previous) == Some(first)
            }) {
                first = previous;
            }
            let mut at = Some(first);
            while let Some(edge) = at.filter(|&edge| !done[edge as usize]) {
                done[edge as usize] = true;
                order.push(edge);
                at = self.next(edge);
            }
        }
        order
    }

    /// By the position of a vertex, that of another border that it is nearest to and touches.
    fn partners(&self) -> FxHashMap<PositionKey<f64>, Partner> {
        let partners = |edge: u32| {
            // Vertices where no edge starts are the last of their borders.
            let ends = 0..1 + usize::from(self.next(edge).is_none());
            ends.filter_map(move |end| {
                Some((key(self.edge(edge).ends[end]), self.partner(edge, end)?))
            })
        };
        let timer = StageTimer::current();
        let of_chunk = |first: u32| {
            let edges = first..(first + CHUNK).min(self.edges.len() as u32);
            timer.time(|| edges.flat_map(partners).collect::<Vec<_>>())
        };
        let chunks = (0..self.edges.len() as u32).into_par_iter().step_by(CHUNK as usize);
        chunks.map(of_chunk).collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// The vertex of another border that the end of an edge is nearest to, if it touches one.
    fn partner(&self, edge: u32, end: usize) -> Option<Partner> {
        let at = self.edge(edge).ends[end];
        let beside = if end == 0 { self.previous(edge) } else { self.next(edge) };
        let place = wide(at);
        let mut nearest: Option<(f64, u32, f64)> = None;
        for other in self.grids.iter().flat_map(|grid| grid.near(place)) {
            let reach = self.reach[edge as usize].min(self.reach[other as usize]);
            let (distance, along) = self.distance(other, place);
            let is_nearer =
                nearest.is_none_or(|(least, number, _)| (distance, other) < (least, number));
            let own = || [edge].into_iter().chain(beside);
            let touches = distance <= reach
                && is_nearer
                && own().any(|own| self.faces(own, other))
                && !own().any(|own| self.is_ribbon(own, other, place));
            if touches {
                nearest = Some((distance, other, along));
            }
        }
        let (_, other, along) = nearest?;
        let OpenEdge { part, ends, .. } = *self.edge(other);
        Some(Partner { at: ends[usize::from(along > 0.5)], part })
    }

    /// The distance of a place from an edge, and how far along it the nearest point is, 0–1.
    fn distance(&self, edge: u32, place: DVec3) -> (f64, f64) {
        nearest_on(self.edge(edge).ends.map(wide), place)
    }

    /// Whether two edges are of one kind and run in opposite directions with their triangles on
    /// opposite sides.
    fn faces(&self, own: u32, other: u32) -> bool {
        let (a, b) = (self.edge(own), self.edge(other));
        let [kind_a, kind_b] = [a, b].map(|edge| self.kinds[edge.part as usize]);
        let is_itself = || a.ends.iter().all(|end| b.ends.contains(end));
        let opposite = |a: DVec3, b: DVec3| a.dot(b) < -SIDE_BY_SIDE;
        kind_a == kind_b
            && !is_itself()
            && opposite(a.direction(), b.direction())
            && opposite(a.outward(), b.outward())
    }

    /// Whether two edges are the sides of a narrow strip of triangles: what lies between them is
    /// surface, and one's triangle ends at the other.
    fn is_ribbon(&self, own: u32, other: u32, place: DVec3) -> bool {
        let (a, b) = (self.edge(own), self.edge(other));
        let (_, along) = self.distance(other, place);
        let to = wide(b.ends[0]).lerp(wide(b.ends[1]), along) - place;
        to.dot(a.outward()) < 0.0 && (b.ends.contains(&a.corner) || a.ends.contains(&b.corner))
    }

    fn strips(&self) -> Vec<Stitch> {
        let mut stitches = Vec::new();
        let mut strip = Strip::default();
        let mut used = vec![false; self.edges.len()];
        // Where the strip along a border has come to on the other side.
        let mut reached = self.partners();
        let mut before = None;
        for edge in self.in_order() {
            let [a, b] = self.edge(edge).ends;
            let begins = before.replace(b) != Some(a);
            if begins || strip.gap > LEAST_LENGTH * self.reach[edge as usize] {
                stitches.append(&mut strip.finished());
            }
            if used[edge as usize] {
                continue;
            }
            let length = wide(a).distance(wide(b));
            strip.gap += length;
            let [to_a, to_b] = [0, 1].map(|end| {
                let at = key(self.edge(edge).ends[end]);
                reached.get(&at).copied()
            });
            // A slit ends where both borders have a vertex in common.
            let own = *self.edge(edge);
            let end_at = |at| Partner { at, part: own.part };
            let (start, goal) = match (to_a, to_b) {
                (Some(to_a), Some(to_b)) => (to_b, to_a),
                (Some(to_a), None) => (end_at(b), to_a),
                (None, Some(to_b)) => (to_b, end_at(a)),
                (None, None) => continue,
            };
            let free = |other: u32| other != edge && !used[other as usize];
            let walk = match self.walk(edge, start.at, goal.at, free) {
                Some(walk) => walk,
                None if to_a.is_some() && to_b.is_some() => {
                    // The nearest vertex may lie behind by a little: the strip stays where it was.
                    let back = self.walk(edge, goal.at, start.at, |_| true);
                    if back.is_none_or(|back| back.len() > MOST_BACK) {
                        continue;
                    }
                    reached.insert(key(b), goal);
                    Vec::new()
                }
                None => continue,
            };
            let reach = 2.0 * self.reach[edge as usize];
            let is_far = |&other: &u32| {
                let [from, to] = self.edge(other).ends.map(wide);
                self.distance(edge, from.midpoint(to)).0 > reach
            };
            if walk.iter().any(is_far) {
                continue;
            }
            used[edge as usize] = true;
            strip.gap = 0.0;
            strip.length += length;
            let parts = [own.part, goal.part];
            strip.push(Stitch { edge: own.ends, apex: goal.at, parts });
            for other in walk {
                used[other as usize] = true;
                let other = self.edge(other);
                let parts = [other.part, own.part];
                strip.push(Stitch { edge: other.ends, apex: b, parts });
            }
        }
        stitches.append(&mut strip.finished());
        stitches
    }

    /// The edge that starts at a vertex of the border along an edge; where both borders have that
    /// vertex, the nearest of those that face the edge.
    fn going_on(&self, along: u32, at: [f64; 3]) -> Option<u32> {
        let mut starting = self.from.at(at);
        let first = starting.next()?;
        let mut others = starting.peekable();
        if others.peek().is_none() {
            return Some(first);
        }
        let facing = std::iter::once(first).chain(others).filter(|&other| self.faces(along, other));
        let off = |other: u32| {
            let [from, to] = self.edge(other).ends.map(wide);
            self.distance(along, from.midpoint(to)).0
        };
        facing.min_by(|&a, &b| off(a).total_cmp(&off(b)).then(a.cmp(&b)))
    }

    /// The edges of the border along an edge from one of its vertices to another, if that is not
    /// far and all are free.
    fn walk(
        &self,
        along: u32,
        start: [f64; 3],
        goal: [f64; 3],
        free: impl Fn(u32) -> bool,
    ) -> Option<Vec<u32>> {
        let mut walk = Vec::new();
        let mut at = start;
        while at != goal {
            let edge = self.going_on(along, at)?;
            if walk.len() == MOST_STEPS || !free(edge) {
                return None;
            }
            walk.push(edge);
            at = self.edge(edge).ends[1];
        }
        Some(walk)
    }
}

fn cell(place: DVec3, side: f64) -> [i64; 3] {
    (place / side).floor().to_array().map(|coordinate| coordinate as i64)
}

fn number_of(cell: [i64; 3]) -> Cell {
    let mut hasher = FxHasher::default();
    cell.iter().for_each(|at| hasher.write_i64(*at));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scaling::assert_scales;

    /// A sheet of `nx` by `ny` squares from one corner to another, at heights.
    fn sheet(
        from: [f64; 2],
        to: [f64; 2],
        nx: u32,
        ny: u32,
        height: impl Fn(f64, f64) -> f64,
    ) -> Part {
        let mut part = Part::default();
        for y in 0..=ny {
            for x in 0..=nx {
                let along = |axis: usize, at: u32, of: u32| {
                    from[axis] + (to[axis] - from[axis]) * f64::from(at) / f64::from(of)
                };
                let (x, y) = (along(0, x, nx), along(1, y, ny));
                part.positions.push([x, y, height(x, y)]);
            }
        }
        for y in 0..ny {
            for x in 0..nx {
                let corner = y * (nx + 1) + x;
                let [a, b, c, d] = [0, 1, nx + 2, nx + 1].map(|step| corner + step);
                part.indices.extend([a, b, c, a, c, d]);
            }
        }
        part
    }

    fn between(parts: &[Part]) -> Vec<Stitch> {
        stitches(parts, vec![Some(0); parts.len()], &StitchConstants::default(), |_| false)
    }

    /// The stitches as a part.
    fn as_part(stitches: &[Stitch]) -> Part {
        let corners = |s: &Stitch| [s.edge[1], s.edge[0], s.apex];
        let positions: Vec<[f64; 3]> = stitches.iter().flat_map(corners).collect();
        Part { indices: (0..positions.len() as u32).collect(), positions, ..Part::default() }
    }

    /// The open edges that are left with the stitches.
    fn left_open(parts: &[Part]) -> Vec<OpenEdge> {
        let mut all = parts.to_vec();
        all.push(as_part(&between(parts)));
        open_edges(&all)
    }

    fn flat(_: f64, _: f64) -> f64 {
        0.0
    }

    #[test]
    fn between_sheets_that_overlap_or_leave_a_slit_nothing_stays_open() {
        let wavy = |x: f64, y: f64| 0.02 * (3.0 * x).sin() + 0.02 * (5.0 * y).cos();
        // The second begins before the first ends, or after; its squares are narrower or wider.
        for beyond in [-0.06, 0.05] {
            for ny in [20, 31, 45, 7] {
                let parts = [
                    sheet([0.0, 0.0], [5.0, 5.0], 20, 20, wavy),
                    sheet([5.0 + beyond, 0.01], [10.0, 5.03], 20, ny, flat),
                ];
                // Where the strip ends, a rung on either side.
                let open = left_open(&parts).len();
                let own = (20 + 40 + 40 + ny) as usize;
                assert_eq!(open, own + 2, "{beyond} {ny}");
            }
        }
    }

    #[test]
    fn vertices_in_common_and_vertices_within_an_edge() {
        // A row of squares beside one of half as many: each long edge has a vertex of the other
        // border within it, and ends where two of its edges do.
        let parts =
            [sheet([0.0, 0.0], [8.0, 1.0], 8, 1, flat), sheet([0.0, 1.0], [8.0, 2.0], 4, 1, flat)];
        assert_eq!(open_edges(&parts).len(), 8 + 8 + 2 + 4 + 4 + 2);
        let stitches = between(&parts);
        assert_eq!(stitches.len(), 4);
        assert_eq!(left_open(&parts).len(), 8 + 2 + 4 + 2);
    }

    #[test]
    fn a_slit_within_a_sheet_is_closed_to_its_end() {
        // A sheet cut open along y = 2.5 from x = 1 on.
        let mut part = sheet([0.0, 0.0], [5.0, 5.0], 20, 20, flat);
        let mut second = part.clone();
        part.indices.truncate(part.indices.len() / 2);
        second.indices.drain(..second.indices.len() / 2);
        for position in second.positions.iter_mut().filter(|at| at[1] == 2.5 && at[0] > 1.0) {
            position[1] = 2.54;
        }
        assert_eq!(open_edges(&[part.clone(), second.clone()]).len(), 80 + 2 * 16);
        let stitches = between(&[part.clone(), second.clone()]);
        assert_eq!(stitches.len(), 2 * 16 - 1, "one at the slit's end, two for each further edge");
        assert_eq!(left_open(&[part, second]).len(), 80 + 1);
    }

    #[test]
    fn real_gaps_other_kinds_facing_walls_and_ribbons_stay_apart() {
        let first = sheet([0.0, 0.0], [5.0, 5.0], 20, 20, flat);
        let beside = |x: f64| sheet([x, 0.0], [x + 5.0, 5.0], 20, 20, flat);
        assert!(!between(&[first.clone(), beside(5.15)]).is_empty());
        assert_eq!(between(&[first.clone(), beside(5.25)]), [], "as wide as a square");

        let parts = [first.clone(), beside(5.05)];
        let of = |kinds: [Option<u32>; 2]| {
            stitches(&parts, kinds.to_vec(), &StitchConstants::default(), |_| false)
        };
        assert_eq!(of([Some(0), Some(1)]), []);
        assert_eq!(of([None, None]), []);
        let never = StitchConstants { resolution: 0.0, ..StitchConstants::default() };
        assert_eq!(stitches(&parts, vec![Some(0); 2], &never, |_| false), []);
        // Where both go on in what is built apart.
        let goes_on = |edge: &OpenEdge| edge.ends.iter().all(|end| end[1] <= 2.5);
        let some = stitches(&parts, vec![Some(0); 2], &StitchConstants::default(), goes_on);
        assert!(some.len() > 15 && some.len() < 25, "{}", some.len());
        assert!(some.iter().all(|stitch| stitch.edge.iter().any(|end| end[1] > 2.5)));

        // Two walls back to back, both of which end at the ground.
        let upright = |mut part: Part, x: f64| {
            for position in &mut part.positions {
                *position = [x, position[1], position[0]];
            }
            part
        };
        assert_eq!(between(&[upright(first.clone(), 0.0), upright(first.clone(), 0.05)]), []);

        // Teeth along a border of squares: the notch between two is part of the shape.
        let mut teeth = sheet([0.0, 0.0], [5.0, 5.0], 5, 5, flat);
        for y in 0..2 {
            let first = teeth.positions.len() as u32;
            let at = |x: f64, along: f64| [5.0 + x, f64::from(y) + along, 0.0];
            teeth.positions.extend([at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)]);
            teeth.indices.extend([first, first + 1, first + 2]);
        }
        assert_eq!(between(&[teeth]), []);

        // A hole that is as long as a square and half as wide.
        let mut holed = sheet([0.0, 0.0], [5.0, 5.0], 20, 20, flat);
        for position in &mut holed.positions {
            if position[0] == 2.5 && [2.25, 2.5].contains(&position[1]) {
                position[0] = 2.37;
            }
        }
        holed.indices.drain(6 * (20 * 9 + 9)..6 * (20 * 9 + 10));
        assert_eq!(between(&[holed]), []);

        // Long squares, narrower than what is no feature of the sheet beside them.
        let ribbon = sheet([20.0, 0.0], [20.05, 5.0], 1, 20, flat);
        assert_eq!(between(&[first, ribbon]).len(), 0);
    }

    #[test]
    fn the_order_of_parts_changes_nothing_but_their_numbers() {
        let parts = [
            sheet([0.0, 0.0], [5.0, 5.0], 20, 20, flat),
            sheet([4.95, 0.0], [10.0, 5.0], 20, 23, flat),
        ];
        let places = |stitches: &[Stitch]| -> Vec<_> {
            stitches.iter().map(|stitch| (stitch.edge, stitch.apex)).collect()
        };
        let [a, b] = parts.clone();
        assert_eq!(places(&between(&parts)), places(&between(&[b, a])));
    }

    /// Triangles `of` corners on a circle around two points, with a number each.
    fn around(count: usize, of: impl Fn(usize, [f64; 3]) -> [[f64; 3]; 3]) -> Part {
        let corner = |number: usize| {
            let (sin, cos) = (number as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
            of(number, [10.0 * cos, 10.0 * sin, 5.0])
        };
        let positions: Vec<[f64; 3]> = (0..count).flat_map(corner).collect();
        Part { indices: (0..positions.len() as u32).collect(), positions, ..Part::default() }
    }

    #[test]
    fn time_scales_where_many_triangles_have_a_vertex_or_an_edge_in_common() {
        let top = [0.0, 0.0, 10.0];
        // The pages of a book, and loose triangles around a vertex.
        let book = |count: usize| around(count, |_, at| [[0.0; 3], top, at]);
        let spokes = |count: usize| {
            around(count, |_, [x, y, z]| [[0.0; 3], [x, y, z], [x, y, z + 10.0 / count as f64]])
        };
        assert_scales(150, book, |part| between(&[part]));
        assert_scales(150, spokes, |part| between(&[part]));
    }

    #[test]
    fn time_scales_where_many_triangles_are_at_nearly_one_place() {
        let pile = |count: usize| {
            around(count, |number, _| {
                let z = number as f64 * 1e-6;
                [[0.0, 0.0, z], [10.0, z, z], [z, 10.0, z]]
            })
        };
        assert_scales(100, pile, |part| between(&[part]));
    }

    #[test]
    fn time_scales_where_fine_borders_are_beside_coarse_ones() {
        let fine = |count: usize| {
            let squares = count as u32 / 2;
            let width = 0.01 * f64::from(squares);
            let coarse = sheet([0.0, -1000.0], [20_000.0, -0.001], 20, 1, flat);
            vec![coarse, sheet([0.0, 0.0], [width, 0.01], squares, 1, flat)]
        };
        assert_scales(1000, fine, |parts| between(&parts));
    }
}
