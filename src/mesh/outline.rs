//! What a simplified mesh keeps of the outline of its source: the ground that it covers, seen from
//! above, and the skyline that it makes, seen from all sides.
//!
//! Distances tell little of either: a tower that is gone is one point of a large error, and a
//! thousand sheds that are gone are none.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::UpAxis;

/// Skylines, evenly over half a turn: from the other side each is the same.
const SIDES: usize = 4;

/// The ground and the heights that outlines are compared on: that of a source.
pub struct OutlineFrame {
    up: UpAxis,
    /// The corner of the ground, and the height of its lowest point.
    low: DVec3,
    /// Cells a metre.
    per_metre: DVec2,
    /// Along each side of the ground.
    cells: [usize; 2],
    /// Of each skyline.
    columns: usize,
    /// By skyline: how many columns it runs to with each metre along either axis of the ground, and
    /// where it begins, in columns.
    sides: [[f64; SIDES]; 3],
}

/// What triangles cover, and how high they rise. They may be added by many threads at once.
pub struct Outline {
    /// A bit for each cell whose centre is below or above a triangle, row by row.
    covered: Vec<AtomicU64>,
    /// Of each column of each side, the highest point above the frame's lowest as bits, which are in
    /// the order of the numbers as none is below 0; `EMPTY` where nothing is.
    top: Vec<AtomicU64>,
    /// Likewise the lowest, as the largest number less it, so that both are found by `max`.
    bottom: Vec<AtomicU64>,
    /// Of each side.
    columns: usize,
    /// Of the columns of each side, metres.
    widths: [f64; SIDES],
}

/// What is kept of the ground that a source covers, seen from above, and of its skylines, seen from
/// eight sides: shares of the source, 0–1. `None` where the source covers nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OutlineCoverage {
    /// Of the covered ground, what is covered still.
    pub area: Option<f64>,
    /// What is covered besides, over the area of the source; may exceed 1.
    pub area_added: Option<f64>,
    /// Of the area between each column's lowest point and the skyline, what is below the simplified
    /// skyline still. A column is at least as high as it is wide, so that flat ground is not judged
    /// by its bumps.
    pub skyline: Option<f64>,
    /// How far the simplified skyline is above the source's, over the same area; may exceed 1.
    pub skyline_added: Option<f64>,
}

const EMPTY: u64 = 0;

/// Along the shorter side of the ground at least: square cells may be wider than a long strip.
const LEAST_CELLS: usize = 16;

/// Numbers that this is added to are rounded to whole ones.
const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;

impl OutlineFrame {
    /// Around these positions, with so many cells along the longer side of the ground, about square,
    /// and as many columns in each skyline; `None` where they are all in one place seen from above.
    pub fn around(
        up: UpAxis,
        positions: impl IntoIterator<Item = DVec3>,
        columns: usize,
    ) -> Option<Self> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for position in positions {
            let position = up.z_up(position);
            (low, high) = (low.min(position), high.max(position));
        }
        let size = (high - low).truncate();
        if !((high - low).is_finite() && size.max_element() > 0.0) {
            return None;
        }
        // A side without length has no cells' centres on it.
        let square = size.max_element() / columns as f64;
        let least = LEAST_CELLS.min(columns);
        let cells = size.to_array().map(|side| ((side / square) as usize).clamp(least, columns));
        let per =
            |axis: usize| if size[axis] > 0.0 { cells[axis] as f64 / size[axis] } else { 0.0 };
        let per_metre = DVec2::new(per(0), per(1));
        let each: [[f64; 3]; SIDES] = std::array::from_fn(|side| {
            // libm's, which is alike on all machines.
            let (sin, cos) = libm::sincos(PI * side as f64 / SIDES as f64);
            let axis = DVec2::new(cos, sin);
            let corners =
                [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|at| (at * size).dot(axis));
            let first = corners.into_iter().fold(f64::INFINITY, f64::min);
            let last = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let per_metre = columns as f64 / (last - first).max(f64::MIN_POSITIVE);
            let [x, y] = (axis * per_metre).to_array();
            [x, y, first * per_metre]
        });
        let sides = std::array::from_fn(|part| each.map(|side| side[part]));
        Some(Self { up, low, per_metre, cells, columns, sides })
    }

    /// An outline of nothing.
    pub fn empty(&self) -> Outline {
        let none = |count: usize| (0..count).map(|_| AtomicU64::new(EMPTY)).collect();
        Outline {
            covered: none((self.cells[0] * self.cells[1]).div_ceil(64)),
            top: none(SIDES * self.columns),
            bottom: none(SIDES * self.columns),
            columns: self.columns,
            widths: std::array::from_fn(|side| {
                1.0 / DVec2::new(self.sides[0][side], self.sides[1][side]).length()
            }),
        }
    }

    /// Adds a triangle to an outline of this frame.
    pub fn add(&self, outline: &Outline, corners: [DVec3; 3]) {
        let corners = corners.map(|corner| self.up.z_up(corner) - self.low);
        self.cover(&outline.covered, corners);
        let heights = corners.map(|corner| corner.z.max(0.0));
        let highest = top_bits(heights.into_iter().fold(0.0, f64::max));
        let lowest = bottom_bits(heights.into_iter().fold(f64::INFINITY, f64::min));
        let [along, columns] = self.on_skylines(corners);
        for side in 0..SIDES {
            let of = side * self.columns..(side + 1) * self.columns;
            let (top, bottom) = (&outline.top[of.clone()], &outline.bottom[of]);
            let columns = columns.map(|columns| columns[side]);
            if columns[0] == columns[1] && columns[1] == columns[2] {
                continue;
            }
            let columns = columns.map(|column| column as usize);
            let first = columns[0].min(columns[1]).min(columns[2]);
            let end = columns[0].max(columns[1]).max(columns[2]);
            // No edge is higher or lower than its ends, and few triangles are at the skyline.
            let all = first..end;
            if is_within(&top[all.clone()], highest) && is_within(&bottom[all], lowest) {
                continue;
            }
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let columns = columns[from].min(columns[to])..columns[from].max(columns[to]);
                let end = |i: usize| DVec2::new(along[i][side], heights[i]);
                rise(top, bottom, [end(from), end(to)], columns);
            }
        }
    }

    /// Where corners lie along each skyline, in columns, and the first column whose centre is
    /// farther: all skylines at once, without branches.
    fn on_skylines(&self, corners: [DVec3; 3]) -> [[[f64; SIDES]; 3]; 2] {
        let [along_x, along_y, first] = &self.sides;
        let last = self.columns as f64;
        let (mut along, mut columns) = ([[0.0; SIDES]; 3], [[0.0; SIDES]; 3]);
        for corner in 0..3 {
            let [x, y] = corners[corner].truncate().to_array();
            for side in 0..SIDES {
                let at = x * along_x[side] + y * along_y[side] - first[side];
                along[corner][side] = at;
                let at = if at > 0.0 { at } else { 0.0 };
                let at = if at < last { at } else { last };
                columns[corner][side] = (at + WHOLE) - WHOLE;
            }
        }
        [along, columns]
    }

    /// Marks the cells whose centres a triangle covers.
    fn cover(&self, covered: &[AtomicU64], corners: [DVec3; 3]) {
        let corners = corners.map(|corner| {
            let [x, y] = (corner.truncate() * self.per_metre).to_array();
            DVec2::new(y, x)
        });
        let rows = centres(corners.map(|corner| corner.x), self.cells[1]);
        let columns = centres(corners.map(|corner| corner.y), self.cells[0]);
        if rows.is_empty() || columns.is_empty() {
            return;
        }
        let [a, b, c] = corners;
        let edges = [[a, b], [b, c], [c, a]].map(|[from, to]| Edge {
            from,
            end: to.x,
            slope: (to.y - from.y) / (to.x - from.x),
        });
        for row in rows {
            let Some([from, to]) = across(&edges, row as f64 + 0.5) else { continue };
            for column in centres([from, to], self.cells[0]) {
                let bit = row * self.cells[0] + column;
                let word = &covered[bit / 64];
                let mask = 1 << (bit % 64);
                // Most are there already, and reading is cheaper.
                if word.load(Ordering::Relaxed) & mask == 0 {
                    word.fetch_or(mask, Ordering::Relaxed);
                }
            }
        }
    }
}

/// Raises and lowers the columns of a skyline at whose centres an edge is there: no triangle is
/// higher or lower than its edges.
fn rise(top: &[AtomicU64], bottom: &[AtomicU64], [from, to]: [DVec2; 2], columns: Range<usize>) {
    if columns.is_empty() {
        return;
    }
    let slope = (to.y - from.y) / (to.x - from.x);
    let (low, high) = (from.y.min(to.y), from.y.max(to.y));
    for column in columns {
        let height = (from.y + (column as f64 + 0.5 - from.x) * slope).clamp(low, high);
        raise(&top[column], top_bits(height));
        raise(&bottom[column], bottom_bits(height));
    }
}

/// How the highest point of a column is stored.
fn top_bits(height: f64) -> u64 {
    height.max(f64::MIN_POSITIVE).to_bits()
}

/// How the lowest point of a column is stored.
fn bottom_bits(height: f64) -> u64 {
    u64::MAX - height.to_bits()
}

/// True where all of these are as large already.
fn is_within(most: &[AtomicU64], to: u64) -> bool {
    most.iter().all(|most| most.load(Ordering::Relaxed) >= to)
}

/// The largest that was ever there.
fn raise(most: &AtomicU64, to: u64) {
    // Most are lower, and reading is cheaper.
    if most.load(Ordering::Relaxed) < to {
        most.fetch_max(to, Ordering::Relaxed);
    }
}

/// The first cell, of so many, whose centre is above a coordinate in cells.
fn centre(coordinate: f64, count: usize) -> usize {
    // The cast rounds towards 0.
    ((coordinate + 0.5) as i32).clamp(0, count as i32) as usize
}

/// The cells, of so many, whose centres lie above the least of some coordinates, in cells, and not
/// above the largest.
fn centres(coordinates: impl IntoIterator<Item = f64>, count: usize) -> Range<usize> {
    coordinates
        .into_iter()
        .map(|coordinate| centre(coordinate, count))
        .fold(count..0, |range, at| range.start.min(at)..range.end.max(at))
}

/// An edge of a triangle.
struct Edge {
    from: DVec2,
    /// The first coordinate at its end.
    end: f64,
    /// By how much the second coordinate grows with the first; not a number where that stays.
    slope: f64,
}

/// Where a line of equal first coordinate crosses a triangle: the least and largest second one.
fn across(edges: &[Edge; 3], at: f64) -> Option<[f64; 2]> {
    let crossing = |edge: &Edge| {
        let is_across = (edge.from.x < at) != (edge.end < at);
        is_across.then_some(edge.from.y + (at - edge.from.x) * edge.slope)
    };
    edges.iter().filter_map(crossing).fold(None, |range, y| match range {
        None => Some([y, y]),
        Some([low, high]) => Some([low.min(y), high.max(y)]),
    })
}

impl Outline {
    /// What of the ground and of the skyline of `self` another outline of the same frame has, and
    /// what it adds.
    pub fn kept_by(&self, other: &Self) -> OutlineCoverage {
        let words = self.covered.iter().zip(&other.covered);
        let words = words.map(|(own, others)| [own, others].map(|w| w.load(Ordering::Relaxed)));
        let (mut area, mut both, mut more) = (0u64, 0u64, 0u64);
        for [own, others] in words {
            area += u64::from(own.count_ones());
            both += u64::from((own & others).count_ones());
            more += u64::from((others & !own).count_ones());
        }
        let (mut height, mut lost, mut added) = (0.0, 0.0, 0.0);
        for column in 0..self.top.len() {
            let of = |bits: &AtomicU64| bits.load(Ordering::Relaxed);
            let (own, others) = (of(&self.top[column]), of(&other.top[column]));
            if own == EMPTY {
                continue;
            }
            let bottom = f64::from_bits(u64::MAX - of(&self.bottom[column]));
            let rises = |top: u64| (f64::from_bits(top) - bottom).max(0.0);
            let (own, others) = (rises(own), rises(others));
            height += own.max(self.widths[column / self.columns]);
            lost += (own - others).max(0.0);
            added += (others - own).max(0.0);
        }
        let share = |part: f64, of: f64| (of > 0.0).then(|| part / of);
        OutlineCoverage {
            area: share(both as f64, area as f64),
            area_added: share(more as f64, area as f64),
            skyline: share(height - lost, height),
            skyline_added: share(added, height),
        }
    }
}

impl OutlineCoverage {
    /// Returns the area of the covered ground, anywhere, over that of the source; 1 where the source covers none.
    pub fn covered(&self) -> f64 {
        self.area.zip(self.area_added).map_or(1.0, |(kept, added)| kept + added)
    }

    /// The smaller share of the ground and of the skyline; 1 where there is neither.
    pub fn least(&self) -> f64 {
        self.area.unwrap_or(1.0).min(self.skyline.unwrap_or(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const CELLS: usize = 4096;

    /// Upright boxes: corner, size.
    fn boxes(boxes: &[[DVec3; 2]]) -> Vec<[DVec3; 3]> {
        let mut triangles = Vec::new();
        for &[low, size] in boxes {
            let corner = |at: u32| {
                let at = DVec3::new(f64::from(at & 1), f64::from(at >> 1 & 1), f64::from(at >> 2));
                low + at * size
            };
            let faces = [
                [0, 1, 3, 2],
                [4, 5, 7, 6],
                [0, 1, 5, 4],
                [2, 3, 7, 6],
                [0, 2, 6, 4],
                [1, 3, 7, 5],
            ];
            for [a, b, c, d] in faces.map(|face| face.map(corner)) {
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        triangles
    }

    fn kept_of(up: UpAxis, source: &[[DVec3; 3]], level: &[[DVec3; 3]]) -> OutlineCoverage {
        let corners = source.iter().flatten().copied();
        let frame = OutlineFrame::around(up, corners, CELLS).unwrap();
        let [source, level] = [source, level].map(|triangles| {
            let outline = frame.empty();
            triangles.iter().for_each(|&corners| frame.add(&outline, corners));
            outline
        });
        source.kept_by(&level)
    }

    fn kept(source: &[[DVec3; 2]], level: &[[DVec3; 2]]) -> OutlineCoverage {
        kept_of(UpAxis::Z, &boxes(source), &boxes(level))
    }

    /// A row of houses as high as they are wide, on slabs that keep the ground where it is.
    fn houses(random: &mut Random) -> Vec<[DVec3; 2]> {
        let house = |n: usize| {
            let size = DVec3::new(
                random.between(4.0, 9.0),
                random.between(4.0, 9.0),
                random.between(3.0, 30.0),
            );
            let low = DVec3::new(n as f64 * 10.0, random.between(0.0, 50.0), 0.0);
            [low, size]
        };
        (0..12).map(house).collect()
    }

    #[test]
    fn what_is_the_same_is_kept_whole() {
        let all = houses(&mut Random::new(1, 0));
        let whole = OutlineCoverage {
            area: Some(1.0),
            area_added: Some(0.0),
            skyline: Some(1.0),
            skyline_added: Some(0.0),
        };
        assert_eq!(kept(&all, &all), whole);
    }

    /// Areas are sums of rectangles, and a box's skyline is a rectangle of its own: naive sums, over
    /// columns of another width.
    #[test]
    fn houses_that_go_or_grow_are_missed_by_their_own_area_and_skyline() {
        for seed in 0..4 {
            let mut random = Random::new(seed, 1);
            let all = houses(&mut random);
            let mut level: Vec<[DVec3; 2]> = all.iter().copied().step_by(2).collect();
            level[2][1].z *= 2.0;
            level[3][1].z *= 0.5;
            let found = kept(&all, &level);

            let area =
                |boxes: &[[DVec3; 2]]| boxes.iter().map(|[_, size]| size.x * size.y).sum::<f64>();
            let expected = area(&level) / area(&all);
            assert!((found.area.unwrap() - expected).abs() < 1e-3, "{seed}: {found:?} {expected}");
            assert!(found.area_added.unwrap() < 1e-3);

            let (mut height, mut both, mut more) = (0.0, 0.0, 0.0);
            for side in 0..SIDES {
                let angle = PI * side as f64 / SIDES as f64;
                let top = |boxes: &[[DVec3; 2]], at: f64| {
                    let over = boxes.iter().filter(|[low, size]| {
                        let middle = *low + *size * 0.5;
                        let off = middle.x * angle.cos() + middle.y * angle.sin() - at;
                        off.abs() < 0.5 * (size.x * angle.cos().abs() + size.y * angle.sin())
                    });
                    over.map(|[_, size]| size.z).fold(0.0, f64::max)
                };
                // Columns of a skyline are as many, however wide it is: so is each step here.
                let corners = |[low, size]: &[DVec3; 2]| [*low, *low + *size];
                let (low, high) = all
                    .iter()
                    .flat_map(corners)
                    .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), corner| {
                        (low.min(corner), high.max(corner))
                    });
                let ends = [low.x, high.x]
                    .into_iter()
                    .flat_map(|x| [low.y, high.y].map(|y| x * angle.cos() + y * angle.sin()));
                let ends: Vec<f64> = ends.collect();
                let first = ends.iter().copied().fold(f64::INFINITY, f64::min);
                let last = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                for step in 0..20_000 {
                    let at = first + (last - first) * (f64::from(step) + 0.5) / 20_000.0;
                    let (own, others) = (top(&all, at), top(&level, at));
                    height += own;
                    both += own.min(others);
                    more += (others - own).max(0.0);
                }
            }
            let (skyline, added) = (found.skyline.unwrap(), found.skyline_added.unwrap());
            assert!((skyline - both / height).abs() < 2e-3, "{seed}: {skyline} {}", both / height);
            assert!((added - more / height).abs() < 2e-3, "{seed}: {added} {}", more / height);
            assert!(skyline < 0.9 && added > 0.0, "the case tells: {skyline} {added}");
        }
    }

    #[test]
    fn whichever_axis_is_up() {
        let all = boxes(&houses(&mut Random::new(3, 2)));
        let turned = |triangles: &[[DVec3; 3]]| -> Vec<[DVec3; 3]> {
            triangles.iter().map(|corners| corners.map(|p| UpAxis::Y.from_z_up(p))).collect()
        };
        let few = &all[..48];
        let upright = kept_of(UpAxis::Z, &all, few);
        assert!(upright.area.unwrap() < 0.5);
        assert_eq!(kept_of(UpAxis::Y, &turned(&all), &turned(few)), upright);
    }

    #[test]
    fn a_strip_has_ground_however_thin_it_is() {
        let strip = |length: f64| boxes(&[[DVec3::ZERO, DVec3::new(length, 0.01, 0.01)]]);
        let whole = [DVec3::ZERO, DVec3::new(1e3, 0.01, 0.0)].map(|low| [low, DVec3::splat(0.01)]);
        let source = [strip(1e3), boxes(&whole)].concat();
        let kept = kept_of(UpAxis::Z, &source, &strip(500.0));
        assert!((kept.area.unwrap() - 0.5).abs() < 1e-3, "{kept:?}");
    }

    #[test]
    fn what_has_no_ground_has_no_shares() {
        let upright = [DVec3::ZERO, DVec3::new(0.0, 0.0, 5.0)];
        assert!(OutlineFrame::around(UpAxis::Z, upright, CELLS).is_none());
        assert!(OutlineFrame::around(UpAxis::Z, [DVec3::NAN, DVec3::ONE], CELLS).is_none());
        let wall = [[DVec3::ZERO, DVec3::new(9.0, 0.0, 0.0), DVec3::new(9.0, 0.0, 4.0)]];
        let kept = kept_of(UpAxis::Z, &wall, &wall);
        assert_eq!((kept.area, kept.skyline), (None, Some(1.0)));
    }
}
