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
            touched(a[1].min(b[1]).min(c[1]), a[1].max(b[1]).max(c[1]), grid.height());
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
            span[0] = span[0].min(x0).min(x1);
            span[1] = span[1].max(x0).max(x1);
        }
    }
}

/// The cells `start..end` of `0..count` that the interval, grown by the reach, overlaps.
pub(crate) fn touched(low: f64, high: f64, count: usize) -> (usize, usize) {
    // A cell that is only met at its border has no weight, so the comparison is strict: where the
    // border is met exactly, `floor + 1` and `ceil` step over it.
    let start = floor(low - 1.0 - REACH) + 1;
    let end = -floor(-(high + REACH));
    (start.clamp(0, count as i64) as usize, end.clamp(0, count as i64) as usize)
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
