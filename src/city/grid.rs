//! The scan grid of a façade: columns and rows of samples, cut off at each house's roof.

use super::facade::Facade;

/// A corner of the grid: column and row.
pub(super) type Corner = (u32, u32);

/// The shape of a façade's scan grid. Its domain is a skyline: the cells below each house's roof.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    /// Cells along the façade.
    pub(super) columns: u32,
    /// Cells from the ground to the highest roof.
    pub(super) rows: u32,
    /// Where each house begins, and the end of the last; strictly increasing.
    pub(super) bounds: Vec<u32>,
    /// Cells from the ground to each house's roof.
    pub(super) roofs: Vec<u32>,
}

impl Grid {
    /// The grid whose cells are as near to squares of `spacing` metres as the façade allows.
    pub(super) fn new(facade: &Facade, spacing: f64) -> Self {
        let cells = |metres: f64, least: u32| ((metres / spacing).round() as u32).max(least);
        // At the coarsest, the narrowest house (8 m) still has two columns.
        let columns = cells(facade.length, (facade.length / 4.0).ceil() as u32);
        let rows = cells(facade.height, 4);
        let column_at = |x: f64| (x / facade.length * f64::from(columns)).round() as u32;
        let bounds = std::iter::once(0)
            .chain(facade.houses.iter().map(|house| column_at(house.span[1])))
            .collect();
        let roof = |height: f64| (height / facade.height * f64::from(rows)).round() as u32;
        let roofs = facade.houses.iter().map(|house| roof(house.height).max(2)).collect();
        Self { columns, rows, bounds, roofs }
    }

    /// Cells below the roofs.
    pub(super) fn cells(&self) -> u64 {
        self.bounds
            .windows(2)
            .zip(&self.roofs)
            .map(|(bounds, &roof)| u64::from(bounds[1] - bounds[0]) * u64::from(roof))
            .sum()
    }

    /// The house of each column of cells.
    pub(super) fn house_of_columns(&self) -> Vec<u32> {
        self.bounds
            .windows(2)
            .zip(0..)
            .flat_map(|(bounds, house)| (bounds[0]..bounds[1]).map(move |_| house))
            .collect()
    }

    /// All grid corners on the border of the skyline, counter-clockwise as seen from the street,
    /// from the lower right corner over the roofs to the lower left one, then along the ground
    /// from left to right without the two ends.
    pub(super) fn outline(&self) -> Vec<Corner> {
        let mut outline = vec![(self.columns, 0)];
        let mut row = 0;
        for (bounds, &roof) in self.bounds.windows(2).zip(&self.roofs).rev() {
            climb(&mut outline, bounds[1], row, roof);
            outline.extend((bounds[0]..bounds[1]).rev().map(|column| (column, roof)));
            row = roof;
        }
        climb(&mut outline, 0, row, 0);
        outline.extend((1..self.columns).map(|column| (column, 0)));
        outline
    }

    /// How many of [`Grid::outline`]'s corners come before those along the ground.
    pub(super) fn outline_above_ground(&self) -> usize {
        let steps: u32 = self.roofs.windows(2).map(|pair| pair[0].abs_diff(pair[1])).sum();
        let ends = self.roofs.first().unwrap_or(&0) + self.roofs.last().unwrap_or(&0);
        (self.columns + steps + ends + 1) as usize
    }
}

/// Appends the corners of a vertical step, without its start.
fn climb(outline: &mut Vec<Corner>, column: u32, from: u32, to: u32) {
    if from <= to {
        outline.extend((from + 1..=to).map(|row| (column, row)));
    } else {
        outline.extend((to..from).rev().map(|row| (column, row)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outline_walks_once_around_the_skyline() {
        let grid = Grid { columns: 5, rows: 4, bounds: vec![0, 2, 3, 5], roofs: vec![2, 4, 4] };
        assert_eq!(grid.cells(), 2 * 2 + 4 + 2 * 4);
        let outline = grid.outline();
        let mut area = 0i64;
        for (i, &(x0, y0)) in outline.iter().enumerate() {
            let (x1, y1) = outline[(i + 1) % outline.len()];
            assert_eq!(x0.abs_diff(x1) + y0.abs_diff(y1), 1, "{outline:?}");
            area += i64::from(x0) * i64::from(y1) - i64::from(x1) * i64::from(y0);
        }
        assert_eq!(area, 2 * 16, "counter-clockwise around all cells");
        assert_eq!(outline[grid.outline_above_ground() - 1], (0, 0));
        assert_eq!(grid.house_of_columns(), [0, 0, 1, 2, 2]);
    }

    #[test]
    fn houses_stay_apart_on_the_coarsest_grid() {
        for seed in 0..200 {
            let facade = Facade::draw(seed, 120.0);
            let grid = Grid::new(&facade, 1e9);
            assert!(grid.bounds.windows(2).all(|pair| pair[0] + 2 <= pair[1]), "{grid:?}");
            assert!(grid.roofs.iter().all(|&roof| (2..=grid.rows).contains(&roof)));
        }
    }
}
