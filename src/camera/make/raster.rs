//! The lowest and highest surface over each cell of a map.

use glam::{DVec2, DVec3, Vec2, Vec3};

/// Cells that triangles may cover in all, as a multiple of a map's cells. What lies layer upon
/// layer beyond that counts only at its corners, so that no input takes forever.
const MAX_LAYERS: u64 = 400;

/// A rectangle of square cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cells {
    /// The map coordinates of the outer corner of cell 0.
    pub(super) corner: DVec2,
    /// Length of a cell's side in metres.
    pub(super) side: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl Cells {
    pub(super) fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// The cell at a place; `None` outside.
    pub(super) fn at(&self, place: DVec2) -> Option<usize> {
        let cell = ((place - self.corner) / self.side).floor();
        let inside = cell.x >= 0.0
            && cell.y >= 0.0
            && cell.x < self.columns as f64
            && cell.y < self.rows as f64;
        inside.then(|| cell.y as usize * self.columns + cell.x as usize)
    }

    /// The cells in a rectangle.
    pub(super) fn within(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = usize> + '_ {
        let count = DVec2::new(self.columns as f64, self.rows as f64);
        let cell = |place: DVec2| ((place - self.corner) / self.side).clamp(DVec2::ZERO, count);
        let (from, to) = (cell(low).floor(), cell(high).ceil());
        (from.y as usize..to.y as usize).flat_map(move |row| {
            (from.x as usize..to.x as usize).map(move |column| row * self.columns + column)
        })
    }

    /// The cells that a line crosses from `from` metres along it to `to`, in order (Amanatides and
    /// Woo 1987); none outside of the map. `ahead` has length 1 and is along neither axis.
    pub(super) fn along(
        &self,
        start: DVec2,
        ahead: DVec2,
        [from, to]: [f64; 2],
    ) -> impl Iterator<Item = usize> + '_ {
        let size = DVec2::new(self.columns as f64, self.rows as f64);
        let begin = (start - self.corner) / self.side;
        let (first, last) = (-begin / ahead, (size - begin) / ahead);
        let enter = first.min(last).max_element().max(from / self.side);
        let leave = first.max(last).min_element().min(to / self.side);
        let at = (begin + ahead * enter).clamp(DVec2::ZERO, size - 0.5);
        let mut cell = at.floor();
        let step = ahead.signum();
        // Where it leaves the cell along each axis, in cells from the start.
        let border = cell + step.max(DVec2::ZERO);
        let mut next = (border - begin) / ahead;
        let each = ahead.recip().abs();
        let mut is_done = enter > leave;
        std::iter::from_fn(move || {
            if is_done {
                return None;
            }
            let here = cell.y as usize * self.columns + cell.x as usize;
            let axis = usize::from(next.y < next.x);
            cell[axis] += step[axis];
            is_done = next[axis] > leave || cell[axis] < 0.0 || cell[axis] >= size[axis];
            next[axis] += each[axis];
            Some(here)
        })
    }

    /// The middle of a cell.
    pub(super) fn middle(&self, cell: usize) -> DVec2 {
        let place = DVec2::new((cell % self.columns) as f64, (cell / self.columns) as f64);
        self.corner + (place + 0.5) * self.side
    }

    /// The cells beside one, those that touch it with a side first; with steps of a side each.
    pub(super) fn around(&self, cell: usize) -> impl Iterator<Item = (usize, [i32; 2])> + '_ {
        const STEPS: [[i32; 2]; 8] =
            [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]];
        let (column, row) = (cell % self.columns, cell / self.columns);
        STEPS.into_iter().filter_map(move |step| {
            let column = column.checked_add_signed(step[0] as isize)?;
            let row = row.checked_add_signed(step[1] as isize)?;
            (column < self.columns && row < self.rows).then(|| (row * self.columns + column, step))
        })
    }
}

/// Heights over each cell. Cells without any surface have `low` +∞ and `high` −∞.
#[derive(Clone, Debug)]
pub(super) struct Surfaces {
    pub(super) cells: Cells,
    /// The lowest surface within each cell.
    pub(super) low: Vec<f32>,
    /// The highest surface within each cell.
    pub(super) high: Vec<f32>,
    /// The part of each cell that its surfaces are over or under: a rectangle, as least and greatest
    /// x and y in cells from its corner, 0 to 1.
    rectangles: Vec<[Vec2; 2]>,
    /// Squares of [`BLOCK`] by [`BLOCK`] cells.
    pub(super) blocks: Cells,
    /// The lowest and the highest surface within each block, as of cells.
    block_heights: Vec<[f32; 2]>,
    visits_left: u64,
}

/// Cells along the side of a block.
const BLOCK: usize = 16;

impl Surfaces {
    pub(super) fn new(cells: Cells) -> Self {
        let count = cells.len();
        let blocks = Cells {
            corner: cells.corner,
            side: cells.side * BLOCK as f64,
            columns: cells.columns.div_ceil(BLOCK),
            rows: cells.rows.div_ceil(BLOCK),
        };
        Self {
            block_heights: vec![[f32::INFINITY, f32::NEG_INFINITY]; blocks.len()],
            blocks,
            cells,
            low: vec![f32::INFINITY; count],
            high: vec![f32::NEG_INFINITY; count],
            rectangles: vec![[Vec2::INFINITY, Vec2::NEG_INFINITY]; count],
            visits_left: count as u64 * MAX_LAYERS,
        }
    }

    /// Adds a triangle, in map coordinates.
    pub(super) fn add(&mut self, corners: [DVec3; 3]) {
        // From here on in cells from the corner, heights in metres.
        let scale = DVec3::new(1.0 / self.cells.side, 1.0 / self.cells.side, 1.0);
        let corner = self.cells.corner.extend(0.0);
        let triangle = corners.map(|place| ((place - corner) * scale).as_vec3());
        if triangle.iter().any(|place| !place.is_finite()) {
            return;
        }
        let min = triangle[0].min(triangle[1]).min(triangle[2]);
        let max = triangle[0].max(triangle[1]).max(triangle[2]);
        let (columns, rows) = (self.cells.columns as f32, self.cells.rows as f32);
        if max.x < 0.0 || max.y < 0.0 || min.x >= columns || min.y >= rows {
            return;
        }
        let first = [min.x.max(0.0) as usize, min.y.max(0.0) as usize];
        let last = [
            (max.x as usize).min(self.cells.columns - 1),
            (max.y as usize).min(self.cells.rows - 1),
        ];
        if first == last {
            self.put(first, [min, max]);
            return;
        }
        let covered = (last[0] - first[0] + 1) as u64 * (last[1] - first[1] + 1) as u64;
        if covered > self.visits_left {
            for place in triangle {
                if place.x >= 0.0 && place.y >= 0.0 && place.x < columns && place.y < rows {
                    self.put([place.x as usize, place.y as usize], [place, place]);
                }
            }
            return;
        }
        self.visits_left -= covered;
        for row in first[1]..=last[1] {
            let Some(strip) = Polygon::new(triangle).between(1, row as f32) else { continue };
            let (left, right) = strip.range(0);
            let begin = left.max(0.0) as usize;
            let end = (right.max(0.0) as usize).min(self.cells.columns - 1);
            for column in begin..=end {
                if let Some(piece) = strip.between(0, column as f32) {
                    self.put([column, row], piece.bounds());
                }
            }
        }
    }

    fn put(&mut self, [column, row]: [usize; 2], [min, max]: [Vec3; 2]) {
        let cell = row * self.cells.columns + column;
        self.low[cell] = self.low[cell].min(min.z);
        self.high[cell] = self.high[cell].max(max.z);
        let block = row / BLOCK * self.blocks.columns + column / BLOCK;
        let [low, high] = &mut self.block_heights[block];
        (*low, *high) = (low.min(min.z), high.max(max.z));
        let corner = Vec2::new(column as f32, row as f32);
        let [least, greatest] = &mut self.rectangles[cell];
        *least = least.min(min.truncate() - corner);
        *greatest = greatest.max(max.truncate() - corner);
    }

    /// The rectangle within a cell that its surfaces are over or under, on the map.
    pub(super) fn rectangle(&self, cell: usize) -> [DVec2; 2] {
        let Cells { corner, side, columns, .. } = self.cells;
        let first = DVec2::new((cell % columns) as f64, (cell / columns) as f64);
        self.rectangles[cell].map(|at| corner + (first + at.as_dvec2()) * side)
    }

    /// The lowest and the highest surface within a block; `None` where there is none.
    pub(super) fn block_heights(&self, block: usize) -> Option<[f32; 2]> {
        Some(self.block_heights[block]).filter(|[low, high]| low <= high)
    }

    /// As if each block had surfaces at all heights.
    #[cfg(test)]
    pub(super) fn raise_blocks(&mut self) {
        self.block_heights.fill([f32::NEG_INFINITY, f32::INFINITY]);
    }

    /// True where a cell has any surface.
    pub(super) fn is_covered(&self, cell: usize) -> bool {
        self.low[cell] <= self.high[cell]
    }
}

/// A triangle cut by four lines has at most seven corners.
const MAX_CORNERS: usize = 7;

/// A flat convex polygon.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [Vec3; MAX_CORNERS],
    count: usize,
}

impl Polygon {
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let mut corners = [Vec3::ZERO; MAX_CORNERS];
        corners[..3].copy_from_slice(&[a, b, c]);
        Self { corners, count: 3 }
    }

    /// The part whose coordinate along `axis` is from `low` to `low + 1`.
    fn between(&self, axis: usize, low: f32) -> Option<Self> {
        let part = self.beyond(axis, low, 1.0)?.beyond(axis, low + 1.0, -1.0)?;
        Some(part)
    }

    /// The part where `(coordinate − limit) × sign ≥ 0` (Sutherland and Hodgman 1974).
    fn beyond(&self, axis: usize, limit: f32, sign: f32) -> Option<Self> {
        let mut part = Self { corners: [Vec3::ZERO; MAX_CORNERS], count: 0 };
        let mut push = |place: Vec3| {
            if part.count < MAX_CORNERS {
                part.corners[part.count] = place;
                part.count += 1;
            }
        };
        for index in 0..self.count {
            let (a, b) = (self.corners[index], self.corners[(index + 1) % self.count]);
            let (from, to) = ((a[axis] - limit) * sign, (b[axis] - limit) * sign);
            if from >= 0.0 {
                push(a);
            }
            if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
                push(a + (b - a) * (from / (from - to)));
            }
        }
        (part.count > 0).then_some(part)
    }

    fn range(&self, axis: usize) -> (f32, f32) {
        let [min, max] = self.bounds();
        (min[axis], max[axis])
    }

    fn bounds(&self) -> [Vec3; 2] {
        let corners = &self.corners[..self.count];
        corners.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[min, max], &corner| {
            [min.min(corner), max.max(corner)]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(columns: usize, rows: usize) -> Surfaces {
        Surfaces::new(Cells { corner: DVec2::new(-10.0, 20.0), side: 2.0, columns, rows })
    }

    #[test]
    fn a_triangle_covers_the_cells_that_it_touches_at_their_heights() {
        let mut surfaces = flat(10, 10);
        // Heights grow by 1 a metre along x: in cell c the surface is 2c to 2c + 2.
        let at = |x: f64, y: f64| DVec3::new(x - 10.0, y + 20.0, x);
        surfaces.add([at(0.0, 0.0), at(20.0, 0.0), at(0.0, 20.0)]);
        for row in 0..10 {
            for column in 0..10 {
                let cell = row * 10 + column;
                assert_eq!(surfaces.is_covered(cell), row + column <= 10, "{column} {row}");
                if row + column < 9 {
                    assert!((surfaces.low[cell] - 2.0 * column as f32).abs() < 1e-4);
                    assert!((surfaces.high[cell] - 2.0 * column as f32 - 2.0).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn walls_and_triangles_that_reach_outside_are_seen() {
        let mut surfaces = flat(10, 10);
        let at = |x: f64, z: f64| DVec3::new(x - 10.0, 31.0, z);
        surfaces.add([at(3.0, 0.0), at(3.0, 9.0), at(9.0, 9.0)]);
        assert_eq!((surfaces.low[51], surfaces.high[51]), (0.0, 9.0));
        assert!(surfaces.is_covered(54) && !surfaces.is_covered(55) && !surfaces.is_covered(41));
        let far =
            [DVec3::new(-1e6, -1e6, 5.0), DVec3::new(1e6, -1e6, 5.0), DVec3::new(0.0, 1e6, 5.0)];
        surfaces.add(far);
        assert!((0..100).all(|cell| surfaces.is_covered(cell)));
        let mut other = flat(3, 3);
        other.add(far.map(|place| place + DVec3::X * 1e9));
        other.add([DVec3::NAN; 3]);
        assert!((0..9).all(|cell| !other.is_covered(cell)));
    }

    #[test]
    fn cells_are_found_again_by_their_middle() {
        let cells = flat(4, 3).cells;
        for cell in 0..cells.len() {
            assert_eq!(cells.at(cells.middle(cell)), Some(cell));
        }
        assert_eq!(cells.at(DVec2::new(-10.1, 21.0)), None);
        assert_eq!(cells.at(DVec2::new(-2.0, 21.0)), None);
        assert_eq!(cells.around(0).map(|(cell, _)| cell).collect::<Vec<_>>(), [1, 4, 5]);
    }

    #[test]
    fn a_line_crosses_the_cells_that_are_found_by_small_steps() {
        let cells = flat(9, 7).cells;
        let lines = [(-15.0, 26.3), (1.1, 25.7), (-9.99, 33.9), (20.0, 40.0), (-30.0, 10.0)];
        for ((x, y), index) in lines.into_iter().flat_map(|start| (0..40).map(move |i| (start, i)))
        {
            let start = DVec2::new(x, y);
            let ahead = DVec2::from_angle(0.01 + f64::from(index) * 0.157);
            for range in [[0.0, f64::INFINITY], [3.0, 11.0]] {
                let found: Vec<usize> = cells.along(start, ahead, range).collect();
                let last = range[1].min(200.0);
                let steps = (0..).map(|step| range[0] + f64::from(step) * 1e-3);
                let steps = steps.take_while(|&step| step < last);
                let mut expected: Vec<usize> =
                    steps.filter_map(|step| cells.at(start + ahead * step)).collect();
                expected.dedup();
                // Small steps miss corners that are cut by less.
                let mut rest = found.iter();
                assert!(
                    expected.iter().all(|cell| rest.any(|other| other == cell)),
                    "{start} {index}"
                );
                let missed = found.len() - expected.len();
                assert!(missed <= 1, "{missed} of {} at {start} {index}", found.len());
            }
        }
    }

    #[test]
    fn a_rectangle_is_what_triangles_cover_of_a_cell() {
        let mut surfaces = flat(10, 10);
        let at = |x: f64, y: f64| DVec3::new(x - 10.0, y + 20.0, 0.0);
        // A thin wall along x through the cells of row 3, and a corner within one cell.
        surfaces.add([at(1.0, 7.0), at(5.0, 7.0), at(1.0, 7.0) + DVec3::Z]);
        surfaces.add([at(14.5, 14.25), at(15.5, 14.25), at(14.5, 15.75)]);
        let near = |[a, b]: [DVec2; 2], c: [DVec3; 2]| {
            a.distance(c[0].truncate()) < 1e-5 && b.distance(c[1].truncate()) < 1e-5
        };
        assert!(near(surfaces.rectangle(30), [at(1.0, 7.0), at(2.0, 7.0)]));
        assert!(near(surfaces.rectangle(31), [at(2.0, 7.0), at(4.0, 7.0)]));
        assert!(near(surfaces.rectangle(32), [at(4.0, 7.0), at(5.0, 7.0)]));
        assert!(near(surfaces.rectangle(77), [at(14.5, 14.25), at(15.5, 15.75)]));
    }
}
