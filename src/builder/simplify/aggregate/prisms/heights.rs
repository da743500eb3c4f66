//! Bodies as heights over a grid.

use glam::{DVec2, DVec3};

/// Where no body is.
pub(super) const NONE: u32 = u32::MAX;

/// Square cells, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    low: DVec2,
    /// Of a cell, metres.
    pub side: f64,
    pub columns: usize,
    pub rows: usize,
}

impl Grid {
    /// Over a rectangle, with so many empty cells around it.
    pub fn over(low: DVec2, high: DVec2, side: f64, margin: usize) -> Self {
        let size = ((high - low) / side).ceil().max(DVec2::ONE);
        Self {
            low: low - DVec2::splat(side * margin as f64),
            side,
            columns: size.x as usize + 2 * margin,
            rows: size.y as usize + 2 * margin,
        }
    }

    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// The place of a corner of cells, or a point between, metres.
    pub fn place(&self, corner: DVec2) -> DVec2 {
        self.low + corner * self.side
    }

    /// The opposite of [`Self::place`].
    pub fn corner(&self, place: DVec2) -> DVec2 {
        (place - self.low) / self.side
    }

    /// The cell that a point given in cells lies in; `None` beyond the grid.
    pub fn cell(&self, corner: DVec2) -> Option<usize> {
        let inside = corner.cmpge(DVec2::ZERO).all()
            && corner.x < self.columns as f64
            && corner.y < self.rows as f64;
        inside.then(|| corner.y as usize * self.columns + corner.x as usize)
    }
}

/// Edges are followed by at most so many steps.
const MOST_STEPS: f64 = 4096.0;

/// What is seen of bodies from above.
pub(super) struct Heights {
    pub grid: Grid,
    /// The highest surface over the centre of each cell, metres.
    pub top: Vec<f32>,
    /// The lowest surface or edge in each cell, metres; infinite where there is none.
    pub low: Vec<f32>,
    /// The body that is highest, or [`NONE`].
    pub body: Vec<u32>,
    /// Of each body, metres.
    pub lows: Vec<f64>,
}

impl Heights {
    /// Nothing yet of so many bodies.
    pub fn none(grid: Grid, bodies: usize) -> Self {
        let cells = grid.cells();
        Self {
            grid,
            top: vec![f32::NEG_INFINITY; cells],
            low: vec![f32::INFINITY; cells],
            body: vec![NONE; cells],
            lows: vec![f64::INFINITY; bodies],
        }
    }

    /// Adds a triangle of a body; Z is up.
    pub fn add(&mut self, body: u32, corners: [DVec3; 3]) {
        self.lows[body as usize] =
            corners.iter().map(|p| p.z).fold(self.lows[body as usize], f64::min);
        // Feet of walls, which have no floor to be seen by.
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (from, to) = (corners[from], corners[to]);
            let cells = from.truncate().distance(to.truncate()) / self.grid.side;
            let steps = (2.0 * cells).ceil().clamp(1.0, MOST_STEPS);
            for step in 0..steps as u32 {
                let at = from.lerp(to, f64::from(step) / steps);
                if let Some(cell) = self.grid.cell(self.grid.corner(at.truncate())) {
                    self.low[cell] = self.low[cell].min(at.z as f32);
                }
            }
        }
        let [a, b, c] = corners.map(|p| self.grid.corner(p.truncate()));
        let twice = (b - a).perp_dot(c - a);
        if twice.abs() < 1e-12 {
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // Metres for each column and row.
        let [at_a, at_b, at_c] = corners.map(|corner| corner.z);
        let rise = ((b - a) * (at_c - at_a) - (c - a) * (at_b - at_a)).perp() / twice;
        // Rows and columns whose centres are within.
        let span = |low: f64, high: f64, most: usize| {
            let end = ((high + 0.5).floor().max(0.0) as usize).min(most);
            (low - 0.5).ceil().max(0.0) as usize..end
        };
        for row in span(low.y, high.y, self.grid.rows) {
            let y = row as f64 + 0.5;
            let mut left = f64::INFINITY;
            let mut right = f64::NEG_INFINITY;
            for (p, q) in [(a, b), (b, c), (c, a)] {
                if (p.y <= y) != (q.y <= y) {
                    let x = p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            if left > right {
                continue;
            }
            for column in span(left, right, self.grid.columns) {
                let p = glam::dvec2(column as f64 + 0.5, y);
                let height = (at_a + rise.dot(p - a)) as f32;
                let cell = row * self.grid.columns + column;
                self.low[cell] = self.low[cell].min(height);
                if height > self.top[cell] {
                    (self.top[cell], self.body[cell]) = (height, body);
                }
            }
        }
    }
}

/// Where anything is: the cells that bodies cover, and those near them. All others are open.
pub(super) struct Near {
    /// In order.
    pub cells: Vec<u32>,
    is_near: Vec<bool>,
    columns: usize,
}

impl Near {
    /// The cells at most `reach` columns and rows from those with a body; the grid's margin is
    /// wider than that.
    pub fn of(body: &[u32], grid: &Grid, reach: usize) -> Self {
        let (columns, rows) = (grid.columns, grid.rows);
        // Along rows, then across them.
        let mut along = vec![false; body.len()];
        for row in 0..rows {
            let start = row * columns;
            for column in (0..columns).filter(|column| body[start + column] != NONE) {
                let (low, high) = (column.saturating_sub(reach), (column + reach).min(columns - 1));
                along[start + low..=start + high].fill(true);
            }
        }
        let mut is_near = vec![false; body.len()];
        let mut count = vec![0u32; columns];
        for row in 0..rows + reach {
            if row < rows {
                for (count, &near) in count.iter_mut().zip(&along[row * columns..]) {
                    *count += u32::from(near);
                }
            }
            if row > 2 * reach {
                let gone = &along[(row - 2 * reach - 1) * columns..];
                for (count, &near) in count.iter_mut().zip(gone) {
                    *count -= u32::from(near);
                }
            }
            if row >= reach {
                let to = &mut is_near[(row - reach) * columns..][..columns];
                for (near, &count) in to.iter_mut().zip(&count) {
                    *near = count > 0;
                }
            }
        }
        let cells = (0..).zip(&is_near).filter(|(_, near)| **near).map(|(cell, _)| cell).collect();
        Self { cells, is_near, columns }
    }

    /// All pairs of cells that share a side and are not both open and far from all bodies; of most
    /// of these.
    pub fn sides(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.cells.iter().flat_map(|&cell| {
            let cell = cell as usize;
            [(cell, cell + 1), (cell, cell + self.columns)]
        })
    }

    /// Whether a near cell has a neighbour that is not near.
    pub fn is_outermost(&self, cell: usize) -> bool {
        [cell - 1, cell + 1, cell - self.columns, cell + self.columns]
            .into_iter()
            .any(|neighbour| !self.is_near[neighbour])
    }
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;

    #[test]
    fn near_is_what_a_search_around_each_cell_finds() {
        let grid = Grid::over(DVec2::ZERO, DVec2::splat(30.0), 1.0, 4);
        let body: Vec<u32> = (0..grid.cells())
            .map(|cell| {
                let (x, y) = (cell % grid.columns, cell / grid.columns);
                let within = (4..34).contains(&x) && (4..34).contains(&y);
                if within && (x * 7 + y * 13) % 97 == 0 { 1 } else { NONE }
            })
            .collect();
        let near = Near::of(&body, &grid, 3);
        for cell in 0..grid.cells() {
            let (x, y) = ((cell % grid.columns) as i32, (cell / grid.columns) as i32);
            let any =
                (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (x + dx, y + dy))).any(|(x, y)| {
                    let inside =
                        x >= 0 && y >= 0 && x < grid.columns as i32 && y < grid.rows as i32;
                    inside && body[y as usize * grid.columns + x as usize] != NONE
                });
            assert_eq!(near.is_near[cell], any, "{x} {y}");
            assert_eq!(near.cells.binary_search(&(cell as u32)).is_ok(), any);
        }
    }

    #[test]
    fn cells_have_the_height_of_the_highest_triangle_over_their_centres() {
        let mut heights = Heights::none(Grid::over(DVec2::ZERO, DVec2::splat(8.0), 1.0, 1), 2);
        heights.add(0, [dvec3(0.0, 0.0, 0.0), dvec3(8.0, 0.0, 8.0), dvec3(0.0, 8.0, 0.0)]);
        heights.add(1, [dvec3(0.0, 0.0, 2.0), dvec3(3.0, 0.0, 2.0), dvec3(0.0, 3.0, 2.0)]);
        // A wall has no height of its own, but a foot.
        heights.add(1, [dvec3(7.5, 7.5, 3.0), dvec3(7.5, 7.9, 3.0), dvec3(7.5, 7.5, -4.0)]);
        let at = |x: usize, y: usize| (y + 1) * heights.grid.columns + x + 1;
        assert_eq!((heights.top[at(0, 0)], heights.body[at(0, 0)]), (2.0, 1));
        assert_eq!(heights.low[at(0, 0)], 0.0);
        assert_eq!((heights.top[at(4, 1)], heights.body[at(4, 1)]), (4.5, 0));
        assert_eq!(heights.body[at(7, 7)], NONE);
        assert_eq!(heights.low[at(7, 7)], -4.0);
        assert_eq!(heights.lows, [0.0, -4.0]);
        // Along an edge.
        assert!((heights.low[at(7, 0)] - 7.0).abs() < 0.6, "{}", heights.low[at(7, 0)]);
        let covered = heights.body.iter().filter(|&&body| body != NONE).count();
        // The centres on the longest side are within.
        assert_eq!(covered, 36);
    }
}
