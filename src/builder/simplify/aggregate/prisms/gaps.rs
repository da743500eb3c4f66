//! Gaps between regions: cells of the open that lie between two of them.

use glam::{IVec2, ivec2};

use super::heights::{Grid, NONE, Near as NearBodies};

/// A region near an open cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Near {
    region: u32,
    /// The cell of the region from which it was reached.
    from: IVec2,
}

const NOWHERE: Near = Near { region: NONE, from: IVec2::MAX };

/// An open cell between two regions, the nearer one first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GapCell {
    pub cell: usize,
    pub regions: [u32; 2],
}

/// The open cells with a region on either side, where the two are at most `width` cells apart.
pub(super) fn gap_cells(
    regions: &[u32],
    near_bodies: &NearBodies,
    grid: &Grid,
    width: f64,
) -> Vec<GapCell> {
    let mut near = vec![[NOWHERE; 2]; regions.len()];
    // By three times the distance, with steps of 3 and 4 for it: near enough for the order.
    let most = (3.0 * width).ceil() as usize;
    let mut rings: Vec<Vec<(usize, Near)>> = vec![Vec::new(); most + 5];
    let at = |cell: usize| ivec2((cell % grid.columns) as i32, (cell / grid.columns) as i32);
    let neighbours = |cell: usize| {
        let (columns, rows) = (grid.columns as i32, grid.rows as i32);
        let centre = at(cell);
        (-1..=1).flat_map(move |y| (-1..=1).map(move |x| ivec2(x, y))).filter_map(move |way| {
            let to = centre + way;
            let inside = to.x >= 0 && to.y >= 0 && to.x < columns && to.y < rows;
            let length = way.x.abs() + way.y.abs();
            (inside && length > 0)
                .then(|| ((to.y * columns + to.x) as usize, if length == 1 { 3 } else { 4 }))
        })
    };
    for cell in near_bodies.cells.iter().map(|&cell| cell as usize) {
        let region = regions[cell];
        if region != NONE {
            for (to, length) in neighbours(cell).filter(|&(to, _)| regions[to] == NONE) {
                rings[length].push((to, Near { region, from: at(cell) }));
            }
        }
    }
    for distance in 0..=most {
        for (cell, found) in std::mem::take(&mut rings[distance]) {
            let known = &mut near[cell];
            if known[0].region == found.region || known[1].region != NONE {
                continue;
            }
            known[usize::from(known[0].region != NONE)] = found;
            for (to, length) in neighbours(cell).filter(|&(to, _)| regions[to] == NONE) {
                if distance + length <= most {
                    rings[distance + length].push((to, found));
                }
            }
        }
    }
    let between = |&cell: &u32| {
        let cell = cell as usize;
        let [first, second] = near[cell];
        if second.region == NONE {
            return None;
        }
        let [a, b] = [first, second].map(|near| (near.from - at(cell)).as_dvec2());
        // Wider than 120 degrees apart: beside the line where two meet, nothing is between them.
        let opposite = a.dot(b) < -0.5 * a.length() * b.length();
        let regions = [first.region, second.region];
        (opposite && a.length() + b.length() <= width + 1.0).then_some(GapCell { cell, regions })
    };
    near_bodies.cells.iter().filter_map(between).collect()
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
        let near = NearBodies::of(&regions, &grid, 6);
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
    }

    #[test]
    fn a_gap_is_between_the_nearest_two() {
        let pairs: Vec<[u32; 2]> = found(&["0..1..2"], 4.0).iter().map(|gap| gap.1).collect();
        assert_eq!(pairs, [[0, 1], [1, 0], [1, 2], [2, 1]]);
    }
}
