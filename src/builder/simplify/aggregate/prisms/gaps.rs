//! Gaps between regions: cells of the open that lie between two of them.

use super::heights::{Grid, NONE, Near};

/// An open cell between two regions, the lower number first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GapCell {
    pub cell: usize,
    pub regions: [u32; 2],
}

/// Runs may be so many times as long as a gap is wide: those of a strip that lies askew are, and
/// where it lies still less so one of them alone is hardly wider than the strip.
const MOST: f64 = 3.0;

/// The run of open cells between two regions that a cell is in: the cells at its ends, or twice 0.
type Run = [u32; 2];

/// The open cells with a region on either side, where the two are at most `width` cells apart.
pub(super) fn gap_cells(regions: &[u32], near: &Near, grid: &Grid, width: f64) -> Vec<GapCell> {
    let most = (width * MOST) as usize;
    let mark = |runs: &mut Vec<Run>, from: usize, to: usize, step: usize| {
        if to - from <= (most + 1) * step && regions[from] != regions[to] {
            for cell in (from + step..to).step_by(step) {
                runs[cell] = [from as u32, to as u32];
            }
        }
    };
    let mut rows: Vec<Run> = vec![[0; 2]; regions.len()];
    let mut columns: Vec<Run> = vec![[0; 2]; regions.len()];
    // The last cell with a region of the row, and of each column.
    let mut of_row = 0;
    let mut of_column = vec![0; grid.columns];
    for cell in near.cells.iter().map(|&cell| cell as usize).filter(|&cell| regions[cell] != NONE) {
        let (row, column) = (cell / grid.columns, cell % grid.columns);
        // There is a margin before the first.
        if of_row / grid.columns == row {
            mark(&mut rows, of_row, cell, 1);
        }
        if of_column[column] > 0 {
            mark(&mut columns, of_column[column], cell, grid.columns);
        }
        (of_row, of_column[column]) = (cell, cell);
    }
    let between = |run: Run, step: usize| {
        let cells = (run[1] - run[0]) as usize / step;
        let [a, b] = run.map(|cell| regions[cell as usize]);
        (cells > 0).then(|| (cells as f64 - 1.0, [a.min(b), a.max(b)]))
    };
    let gap = |&cell: &u32| {
        let cell = cell as usize;
        let (wide, regions) = across(between(rows[cell], 1), between(columns[cell], grid.columns))?;
        (wide <= width).then_some(GapCell { cell, regions })
    };
    near.cells.iter().filter_map(gap).collect()
}

/// How many cells wide a gap is, and what it is between, by the lengths of the runs along the row
/// and the column of a cell of it.
fn across(
    row: Option<(f64, [u32; 2])>,
    column: Option<(f64, [u32; 2])>,
) -> Option<(f64, [u32; 2])> {
    let (Some((width, regions)), Some((height, others))) = (row, column) else {
        return row.or(column);
    };
    if regions == others {
        // A strip that lies askew is cut by both.
        Some((width * height / width.hypot(height), regions))
    } else if width <= height {
        row
    } else {
        column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of digits; a dot is the open.
    fn of(rows: &[&str]) -> (Vec<u32>, Grid) {
        let size = glam::dvec2(rows[0].len() as f64, rows.len() as f64);
        let grid = Grid::over(glam::DVec2::ZERO, size, 1.0, MARGIN);
        let mut regions = vec![NONE; grid.cells()];
        for (row, text) in rows.iter().enumerate() {
            for (column, c) in text.chars().enumerate() {
                let cell = (row + MARGIN) * grid.columns + column + MARGIN;
                regions[cell] = c.to_digit(10).unwrap_or(NONE);
            }
        }
        (regions, grid)
    }

    const MARGIN: usize = 8;

    /// Columns and rows, and the two regions.
    fn found(rows: &[&str], width: f64) -> Vec<([usize; 2], [u32; 2])> {
        let (regions, grid) = of(rows);
        let near = Near::of(&regions, &grid, 6);
        let place = |cell: usize| [cell % grid.columns - MARGIN, cell / grid.columns - MARGIN];
        let found = gap_cells(&regions, &near, &grid, width);
        found.iter().map(|gap| (place(gap.cell), gap.regions)).collect()
    }

    #[test]
    fn what_lies_between_two_is_a_gap_and_what_lies_beside_both_is_none() {
        let apart =
            ["..........", ".000..111.", ".000..111.", ".000..111.", "..........", ".........."];
        let cells: Vec<[usize; 2]> = found(&apart, 3.0).iter().map(|gap| gap.0).collect();
        assert_eq!(cells, [[4, 1], [5, 1], [4, 2], [5, 2], [4, 3], [5, 3]]);
        assert!(found(&apart, 1.0).is_empty(), "too wide");
        // A straight front of two that touch.
        assert!(found(&["........", "00001111", "00001111"], 4.0).is_empty());
        // The inner corner of an L.
        assert!(found(&["00......", "00......", "00......", "11111111"], 4.0).is_empty());
    }

    #[test]
    fn a_gap_is_between_the_nearest_two() {
        let pairs: Vec<[u32; 2]> = found(&["0..1..2"], 4.0).iter().map(|gap| gap.1).collect();
        assert_eq!(pairs, [[0, 1], [0, 1], [1, 2], [1, 2]]);
    }

    #[test]
    fn a_strip_that_lies_askew_is_as_wide_as_it_is_across() {
        // Three cells up for two to the side: 5 cells along a row are 4.16 across.
        let rows: Vec<String> = (0..24i32)
            .map(|y| {
                let from = 4 + (24 - y) * 2 / 3;
                (0..32i32).map(move |x| {
                    if x < from {
                        '0'
                    } else if x < from + 5 {
                        '.'
                    } else {
                        '1'
                    }
                })
            })
            .map(Iterator::collect)
            .collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let within = |[x, y]: [usize; 2]| (8..24).contains(&x) && (8..16).contains(&y);
        let count = |width: f64| found(&rows, width).iter().filter(|gap| within(gap.0)).count();
        assert_eq!(count(4.6), 5 * 8);
        assert!(count(3.6) == 0, "{}", count(3.6));
    }
}
