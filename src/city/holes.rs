//! What the scanner did not see: shadows of trees and cars, and ragged edges below the roofs.

use super::facade::Facade;
use super::grid::Grid;
use crate::random::{Random, hash, unit};

/// Share of the cells under the eaves that are missing.
const RAGGED_SHARE: f64 = 0.2;

/// Which cells of a façade are missing.
pub(super) struct Holes<'a> {
    grid: &'a Grid,
    house_of_column: Vec<u32>,
    missing: Vec<bool>,
    left_to_remove: u64,
}

impl<'a> Holes<'a> {
    /// Removes exactly `count` cells (or all, where there are fewer).
    pub(super) fn draw(facade: &Facade, grid: &'a Grid, seed: u64, count: u64) -> Self {
        let mut holes = Self {
            grid,
            house_of_column: grid.house_of_columns(),
            missing: vec![false; grid.columns as usize * grid.rows as usize],
            left_to_remove: count.min(grid.cells()),
        };
        holes.fray(seed);
        holes.cast_shadows(facade, seed);
        holes.fill_quota();
        holes
    }

    /// True where the façade has the cell.
    pub(super) fn has(&self, column: u32, row: u32) -> bool {
        row < self.roof(column) && !self.missing[self.index(column, row)]
    }

    fn roof(&self, column: u32) -> u32 {
        self.grid.roofs[self.house_of_column[column as usize] as usize]
    }

    fn index(&self, column: u32, row: u32) -> usize {
        column as usize * self.grid.rows as usize + row as usize
    }

    fn remove(&mut self, column: u32, row: u32) {
        if self.left_to_remove > 0 && self.has(column, row) {
            let index = self.index(column, row);
            self.missing[index] = true;
            self.left_to_remove -= 1;
        }
    }

    fn fray(&mut self, seed: u64) {
        for column in 0..self.grid.columns {
            let depth = unit(hash(seed, column.into(), 2)) / RAGGED_SHARE;
            let top = self.roof(column);
            if depth < 1.0 {
                self.remove(column, top - 1);
            }
            if depth < 0.3 {
                self.remove(column, top - 2);
            }
        }
    }

    fn cast_shadows(&mut self, facade: &Facade, seed: u64) {
        let [width, height] = [
            facade.length / f64::from(self.grid.columns),
            facade.height / f64::from(self.grid.rows),
        ];
        let mut random = Random::new(seed, 2);
        // A shadow may fall where there is nothing left, so their number is bounded.
        for _ in 0..10_000 {
            if self.left_to_remove == 0 {
                return;
            }
            let x = random.between(0.0, facade.length);
            let is_car = random.whole(0, 2) == 0;
            let (z, radius_x, radius_z) = if is_car {
                (0.6, random.between(1.6, 2.4), random.between(0.6, 1.0))
            } else {
                let radius = random.between(0.5, 1.6);
                (random.between(1.5, 7.0), radius, radius * random.between(0.8, 1.6))
            };
            let last = |end: f64, cell: f64, count: u32| {
                ((end / cell).max(0.0) as u32).min(count.saturating_sub(1))
            };
            let columns = last(x - radius_x, width, self.grid.columns)
                ..=last(x + radius_x, width, self.grid.columns);
            let rows = last(z - radius_z, height, self.grid.rows)
                ..=last(z + radius_z, height, self.grid.rows);
            for column in columns {
                for row in rows.clone() {
                    let dx = ((f64::from(column) + 0.5) * width - x) / radius_x;
                    let dz = ((f64::from(row) + 0.5) * height - z) / radius_z;
                    let ragged = 0.7 + 0.5 * unit(hash(seed, column.into(), u64::from(row) + 3));
                    if dx * dx + dz * dz < ragged {
                        self.remove(column, row);
                    }
                }
            }
        }
    }

    /// Cells from the left, where coarse grids slip through every shadow.
    fn fill_quota(&mut self) {
        for column in 0..self.grid.columns {
            for row in 0..self.grid.rows {
                if self.left_to_remove == 0 {
                    return;
                }
                self.remove(column, row);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_the_asked_cells_are_missing() {
        let facade = Facade::draw(4, 77.0);
        for spacing in [0.2, 1.0, 4.0] {
            let grid = Grid::new(&facade, spacing);
            for count in [0, 1, grid.cells() / 20, grid.cells()] {
                let holes = Holes::draw(&facade, &grid, 9, count);
                let present = (0..grid.columns)
                    .flat_map(|column| (0..grid.rows).map(move |row| (column, row)))
                    .filter(|&(column, row)| holes.has(column, row))
                    .count() as u64;
                assert_eq!(present, grid.cells() - count);
            }
        }
    }
}
