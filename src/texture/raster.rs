//! Conservative rasterisation: every cell that bilinear sampling of a triangle can read.

use super::bits::BitGrid;

/// Bilinear filtering at a point reads the cells whose centre is less than one cell away along
/// both axes: those that the point, grown by half a cell, overlaps.
const REACH: f64 = 0.5;

/// Marks cells, keeping its scratch space between triangles.
#[derive(Default)]
pub(crate) struct Rasterizer {
    spans: Vec<[f64; 2]>,
}

impl Rasterizer {
    /// Sets every cell of `grid` that bilinear sampling inside `triangle` (in cells, finite) reads.
    pub fn mark(&mut self, triangle: [[f64; 2]; 3], grid: &mut BitGrid) {
        let [a, b, c] = triangle;
        let (first, end) =
            touched(least(least(a[1], b[1]), c[1]), most(most(a[1], b[1]), c[1]), grid.height());
        if first >= end {
            return;
        }
        self.spans.clear();
        self.spans.resize(end - first, [f64::INFINITY, f64::NEG_INFINITY]);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            self.edge(p, q, first, grid.height());
        }
        for (row, span) in self.spans.iter().enumerate() {
            let (start, end) = touched(span[0], span[1], grid.width());
            grid.set_span(first + row, start, end);
        }
    }

    /// The same for many triangles; pairs that halve an upright rectangle, as the grids of scans
    /// and façades have them, are marked at once.
    pub fn mark_all(&mut self, triangles: impl Iterator<Item = [[f64; 2]; 3]>, grid: &mut BitGrid) {
        let mut held: Option<[[f64; 2]; 3]> = None;
        for triangle in triangles {
            if let Some(before) = held {
                if let Some((min, max)) = rectangle(&before, &triangle) {
                    mark_box(min, max, grid);
                    held = None;
                    continue;
                }
                self.mark(before, grid);
            }
            held = Some(triangle);
        }
        if let Some(last) = held {
            self.mark(last, grid);
        }
    }

    /// Widens the span of each row by the part of an edge that lies in the row's reach.
    fn edge(&mut self, p: [f64; 2], q: [f64; 2], first: usize, height: usize) {
        let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
        let (from, to) = touched(p[1], q[1], height);
        let rise = q[1] - p[1];
        let slope = if rise > 0.0 { (q[0] - p[0]) / rise } else { 0.0 };
        for row in from..to {
            let low = row as f64 - REACH;
            let high = row as f64 + 1.0 + REACH;
            // Ends inside the row's reach are taken as they are: no rounding widens the span.
            let x0 = if low <= p[1] { p[0] } else { p[0] + (low - p[1]) * slope };
            let x1 = if high >= q[1] { q[0] } else { p[0] + (high - p[1]) * slope };
            let span = &mut self.spans[row - first];
            span[0] = least(span[0], least(x0, x1));
            span[1] = most(span[1], most(x0, x1));
        }
    }
}

/// Triangles that leave less than this of their box free, as a band along its sides in cells, are
/// taken to fill it: what a tiling of a rectangle leaves by rounding.
const FREE_BAND: f64 = 0.01;

/// True where triangles with this sum of areas fill a box with these sides, provided that they do
/// not lie on each other; in cells.
pub(crate) fn fills(sides: [f64; 2], area: f64) -> bool {
    sides[0] * sides[1] - area <= FREE_BAND * (sides[0] + sides[1])
}

/// The box of two triangles that are its halves.
fn rectangle(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]) -> Option<([f64; 2], [f64; 2])> {
    let mut min = a[0];
    let mut max = a[0];
    for corner in &a[1..] {
        for axis in 0..2 {
            min[axis] = least(min[axis], corner[axis]);
            max[axis] = most(max[axis], corner[axis]);
        }
    }
    // Bit by bit, which of the box's corners a triangle has.
    let corners = |triangle: &[[f64; 2]; 3]| {
        triangle.iter().try_fold(0u8, |found, at| {
            let on_corner = (0..2).all(|axis| at[axis] == min[axis] || at[axis] == max[axis]);
            let corner = u8::from(at[0] == max[0]) + 2 * u8::from(at[1] == max[1]);
            on_corner.then_some(found | 1 << corner)
        })
    };
    let (a, b) = (corners(a)?, corners(b)?);
    (a.count_ones() == 3 && b.count_ones() == 3 && a | b == 0b1111).then_some((min, max))
}

/// Sets every cell of `grid` that bilinear sampling inside a box reads.
pub(crate) fn mark_box(min: [f64; 2], max: [f64; 2], grid: &mut BitGrid) {
    let (left, right) = touched(min[0], max[0], grid.width());
    let (top, bottom) = touched(min[1], max[1], grid.height());
    (top..bottom).for_each(|y| grid.set_span(y, left, right));
}

/// The cells `start..end` of `0..count` that the interval, grown by the reach, overlaps.
pub(crate) fn touched(low: f64, high: f64, count: usize) -> (usize, usize) {
    // A cell that is only met at its border has no weight, so the comparison is strict: where the
    // border is met exactly, `floor + 1` and `ceil` step over it.
    let start = floor(low - 1.0 - REACH) + 1;
    let end = -floor(-(high + REACH));
    (start.clamp(0, count as i64) as usize, end.clamp(0, count as i64) as usize)
}

/// `f64::min` of numbers: one instruction, as it need not look for what is not a number.
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// `f64::max` of numbers.
fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// `f64::floor` of a value that fits, without the library call that it is on plain x86-64.
fn floor(value: f64) -> i64 {
    let truncated = value as i64;
    truncated - i64::from(truncated as f64 > value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(triangle: [[f64; 2]; 3], size: usize) -> Vec<(usize, usize)> {
        let mut grid = BitGrid::new(size, size);
        Rasterizer::default().mark(triangle, &mut grid);
        (0..size)
            .flat_map(|y| (0..size).map(move |x| (x, y)))
            .filter(|(x, y)| grid.get(*x, *y))
            .collect()
    }

    #[test]
    fn a_texel_centre_reads_one_texel_and_a_corner_four() {
        assert_eq!(cells([[2.5, 3.5]; 3], 8), [(2, 3)]);
        assert_eq!(cells([[2.0, 3.0]; 3], 8), [(1, 2), (2, 2), (1, 3), (2, 3)]);
        assert_eq!(cells([[2.25, 3.5]; 3], 8), [(1, 3), (2, 3)]);
    }

    #[test]
    fn what_lies_outside_the_grid_is_left_out() {
        assert_eq!(cells([[-9.0, -9.0]; 3], 8), []);
        assert_eq!(cells([[-9.0, 3.5], [20.0, 3.5], [20.0, 3.5]], 4).len(), 4);
    }

    #[test]
    fn a_box_is_marked_as_its_two_triangles_are() {
        let [min, max] = [[1.2, 3.5], [9.0, 7.7]];
        let halves = [[min, [max[0], min[1]], max], [min, max, [min[0], max[1]]]];
        let (mut by_box, mut by_halves) = (BitGrid::new(16, 16), BitGrid::new(16, 16));
        mark_box(min, max, &mut by_box);
        for half in halves {
            Rasterizer::default().mark(half, &mut by_halves);
        }
        assert_eq!(by_box, by_halves);
        let mut by_all = BitGrid::new(16, 16);
        Rasterizer::default().mark_all(halves.into_iter(), &mut by_all);
        assert_eq!(by_box, by_all);
        assert_eq!(rectangle(&halves[0], &halves[1]), Some((min, max)));
        // Neither one half twice nor halves over the same diagonal's other side of a larger box.
        assert_eq!(rectangle(&halves[0], &halves[0]), None);
        assert_eq!(rectangle(&halves[0], &[min, max, [0.0, 9.0]]), None);
        assert!(fills([7.8, 4.2], 7.8 * 4.2 - 0.01) && !fills([7.8, 4.2], 7.8 * 2.1));
    }

    #[test]
    fn every_cell_that_sampling_reads_is_marked_and_few_others() {
        let triangle = [[1.3, 2.1], [13.7, 5.2], [4.4, 14.9]];
        let marked = cells(triangle, 16);
        let mut read = std::collections::BTreeSet::new();
        for i in 0..=400 {
            for j in 0..=400 - i {
                let (u, v) = (f64::from(i) / 400.0, f64::from(j) / 400.0);
                let at = |axis: usize| {
                    triangle[0][axis] * (1.0 - u - v)
                        + triangle[1][axis] * u
                        + triangle[2][axis] * v
                };
                let (x, y) = ((at(0) - 0.5).floor() as usize, (at(1) - 0.5).floor() as usize);
                read.extend([(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]);
            }
        }
        assert!(read.iter().all(|cell| marked.contains(cell)));
        assert!(marked.len() <= read.len() + 2, "{} of {}", marked.len(), read.len());
    }
}
