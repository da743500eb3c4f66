//! Shapes of cells: what is packed.

use super::bits::BitGrid;

/// A shape on the cell grid: rows of runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shape {
    /// Columns and rows of the bounding box.
    pub size: [usize; 2],
    /// `row, start, end` in cells from the bounding box's corner, by row, then start.
    pub runs: Vec<[u32; 3]>,
}

impl Shape {
    /// The shape of a grid's set cells; empty rows and columns around them stay.
    pub fn of(grid: &BitGrid) -> Self {
        let runs = (0..grid.height())
            .flat_map(|y| grid.runs(y).map(move |(from, to)| [y as u32, from as u32, to as u32]))
            .collect();
        Self { size: [grid.width(), grid.height()], runs }
    }

    /// The number of cells.
    pub fn area(&self) -> usize {
        self.runs.iter().map(|[_, start, end]| (end - start) as usize).sum()
    }

    /// The shape on a grid `factor` times as coarse, whole cells for parts of them.
    pub fn coarser(&self, factor: usize) -> Shape {
        if factor == 1 {
            return self.clone();
        }
        let factor = factor as u32;
        let size = self.size.map(|side| side.div_ceil(factor as usize));
        let mut runs: Vec<[u32; 3]> = self
            .runs
            .iter()
            .map(|[row, start, end]| [row / factor, start / factor, end.div_ceil(factor)])
            .collect();
        runs.sort_unstable();
        let mut merged: Vec<[u32; 3]> = Vec::with_capacity(runs.len());
        for run in runs {
            match merged.last_mut() {
                Some(last) if last[0] == run[0] && run[1] <= last[2] => {
                    last[2] = last[2].max(run[2])
                }
                _ => merged.push(run),
            }
        }
        Shape { size, runs: merged }
    }

    /// The shape with columns and rows exchanged.
    pub fn transposed(&self) -> Shape {
        let mut grid = BitGrid::new(self.size[1], self.size[0]);
        for [row, start, end] in &self.runs {
            (*start..*end).for_each(|x| grid.set(*row as usize, x as usize));
        }
        Shape::of(&grid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_twice_changes_nothing_and_once_exchanges_the_axes() {
        let shape = Shape { size: [5, 3], runs: vec![[0, 0, 5], [1, 2, 3], [2, 1, 2], [2, 3, 5]] };
        let transposed = shape.transposed();
        assert_eq!((transposed.size, transposed.area()), ([3, 5], shape.area()));
        assert_eq!(transposed.runs[0], [0, 0, 1]);
        assert_eq!(transposed.transposed(), shape);
    }
}
