//! The ground under a city, without its buildings: the progressive morphological filter.
//!
//! Zhang et al., "A progressive morphological filter for removing nonground measurements from
//! airborne LIDAR data" (2003). The lowest surface is opened (eroded, then dilated) with squares
//! that grow; where an opening takes off more than a slope could, there is a building. Here the
//! squares grow by equal steps, and the ground under a building is that of the nearest cells
//! around it.

use glam::{DMat3, DVec3};

use super::raster::Cells;

/// What is wider than this counts as ground, metres.
const LARGEST_BUILDING_M: f64 = 96.0;
/// Growth of the squares from one opening to the next, metres.
const STEP_M: f64 = 8.0;
/// Metres that ground rises in a metre.
const SLOPE: f64 = 0.15;
/// What an opening may take off besides, metres.
const ROUGHNESS_M: f64 = 0.85;
/// The part of the map that must be known for its slope to be.
const SLOPED_PART: f64 = 0.3;
/// Where no ground is seen its height is a mean over so many metres to all sides.
const EVEN_M: f64 = 10.0;

/// The height of the ground in every cell, from the surface `bottom` where `has`. `scale` is a
/// person's size, as in [`Ground`](super::Ground).
pub(super) fn ground(
    cells: &Cells,
    bottom: &[f32],
    has: impl Fn(usize) -> bool,
    scale: f64,
) -> Vec<f32> {
    // An opening takes the upper end off a slope that goes on beyond the map: so the slope of the
    // whole goes first.
    let plane = plane(cells, bottom, &has);
    let above = |cell: usize| bottom[cell] - plane_height(cells, plane, cell);
    let level: Vec<f32> = (0..cells.len()).map(above).collect();
    let filled = nearest(cells, &level, &has);
    // Stray points below the ground are narrower than a street: a closing takes them off.
    let mut opened = erode(cells, dilate(cells, filled, 1), 1);
    let closed = opened.clone();
    let mut is_ground: Vec<bool> = (0..cells.len()).map(has).collect();
    let step = ((STEP_M * scale / cells.side) as usize / 2).max(1);
    let most =
        ((LARGEST_BUILDING_M * scale / cells.side) as usize / 2).min(cells.columns.max(cells.rows));
    let mut before = 0;
    for reach in std::iter::once(1).chain((step..=most).step_by(step)) {
        let next = dilate(cells, erode(cells, opened.clone(), reach), reach);
        let width = 2 * (reach.max(before) - before);
        let limit = (SLOPE * width as f64 * cells.side + ROUGHNESS_M * scale) as f32;
        for ((ground, was), is) in is_ground.iter_mut().zip(&opened).zip(&next) {
            *ground &= was - is <= limit;
        }
        (opened, before) = (next, reach);
    }
    let nearest = nearest(cells, &closed, |cell| is_ground[cell]);
    let even = evened(cells, nearest.clone(), (EVEN_M * scale / cells.side) as usize);
    let height = |cell: usize| {
        let level = if is_ground[cell] { nearest[cell] } else { even[cell] };
        level + plane_height(cells, plane, cell)
    };
    (0..cells.len()).map(height).collect()
}

/// `[a, b, c]` of the plane `a + b column + c row` nearest to the values of the cells that have
/// one, by least squares; level where few have: the foot of a façade says nothing of the slope
/// before it.
fn plane(cells: &Cells, values: &[f32], has: impl Fn(usize) -> bool) -> [f64; 3] {
    let mut matrix = DMat3::ZERO;
    let mut right = DVec3::ZERO;
    for cell in (0..cells.len()).filter(|&cell| has(cell)) {
        let row = plane_row(cells, cell);
        matrix += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
        right += row * f64::from(values[cell]);
    }
    let count = matrix.x_axis.x;
    // The columns are of like size, so that the determinant tells of cells in one line.
    let is_flat = matrix.determinant().abs() < 1e-6 * (count * count * count);
    if count < SLOPED_PART * cells.len() as f64 || is_flat {
        return [if count > 0.0 { right.x / count } else { 0.0 }, 0.0, 0.0];
    }
    (matrix.inverse() * right).to_array()
}

/// What the coefficients of the plane are multiplied by: columns and rows run from −1 to 1.
fn plane_row(cells: &Cells, cell: usize) -> DVec3 {
    let along = |index: usize, count: usize| 2.0 * index as f64 / count as f64 - 1.0;
    let (column, row) = (cell % cells.columns, cell / cells.columns);
    DVec3::new(1.0, along(column, cells.columns), along(row, cells.rows))
}

fn plane_height(cells: &Cells, plane: [f64; 3], cell: usize) -> f32 {
    plane_row(cells, cell).dot(DVec3::from_array(plane)) as f32
}

/// Gives every cell the value of the nearest of those that have one; all are alike where none has.
fn nearest(cells: &Cells, values: &[f32], has: impl Fn(usize) -> bool) -> Vec<f32> {
    let mut filled = vec![0.0; cells.len()];
    let mut done = vec![false; cells.len()];
    let mut queue: Vec<usize> = (0..cells.len()).filter(|&cell| has(cell)).collect();
    for &cell in &queue {
        (filled[cell], done[cell]) = (values[cell], true);
    }
    let mut read = 0;
    while let Some(&cell) = queue.get(read) {
        read += 1;
        for (beside, _) in cells.around(cell).take_while(|(_, step)| step[0] == 0 || step[1] == 0) {
            if !done[beside] {
                (filled[beside], done[beside]) = (filled[cell], true);
                queue.push(beside);
            }
        }
    }
    filled
}

/// Means over the squares of `reach` cells to each side, twice: where `nearest` jumps from one
/// place's height to another's there is a slope instead.
fn evened(cells: &Cells, values: Vec<f32>, reach: usize) -> Vec<f32> {
    let mut values = values;
    let mut sums = Vec::new();
    let mut along = |first: usize, step: usize, count: usize, values: &mut [f32]| {
        sums.clear();
        let mut sum = 0.0;
        sums.push(sum);
        for index in 0..count {
            sum += f64::from(values[first + index * step]);
            sums.push(sum);
        }
        for index in 0..count {
            let (from, to) = (index.saturating_sub(reach), (index + reach + 1).min(count));
            values[first + index * step] = ((sums[to] - sums[from]) / (to - from) as f64) as f32;
        }
    };
    for _ in 0..2 {
        for row in 0..cells.rows {
            along(row * cells.columns, 1, cells.columns, &mut values);
        }
        for column in 0..cells.columns {
            along(column, cells.columns, cells.rows, &mut values);
        }
    }
    values
}

fn erode(cells: &Cells, values: Vec<f32>, reach: usize) -> Vec<f32> {
    filter(cells, values, reach, |a, b| a <= b)
}

fn dilate(cells: &Cells, values: Vec<f32>, reach: usize) -> Vec<f32> {
    filter(cells, values, reach, |a, b| a >= b)
}

/// The extreme value within `reach` cells along both axes.
fn filter(
    cells: &Cells,
    mut values: Vec<f32>,
    reach: usize,
    beats: impl Fn(f32, f32) -> bool,
) -> Vec<f32> {
    let mut line = Vec::new();
    let mut queue = Vec::new();
    let mut along = |first: usize, step: usize, count: usize, values: &mut [f32]| {
        line.clear();
        line.extend((0..count).map(|index| values[first + index * step]));
        queue.clear();
        let mut head = 0;
        // The queue holds those that may yet be the extreme of a window, the best first.
        for index in 0..count + reach {
            if let Some(&value) = line.get(index) {
                while queue.len() > head && beats(value, line[queue[queue.len() - 1]]) {
                    queue.pop();
                }
                queue.push(index);
            }
            if let Some(middle) = index.checked_sub(reach) {
                while queue[head] + reach < middle {
                    head += 1;
                }
                values[first + middle * step] = line[queue[head]];
            }
        }
    };
    for row in 0..cells.rows {
        along(row * cells.columns, 1, cells.columns, &mut values);
    }
    for column in 0..cells.columns {
        along(column, cells.columns, cells.rows, &mut values);
    }
    values
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::super::raster::Surfaces;
    use super::*;

    fn cells(columns: usize, rows: usize) -> Cells {
        Cells { corner: DVec2::ZERO, side: 1.0, columns, rows }
    }

    #[test]
    fn filters_give_the_extreme_of_each_square() {
        let cells = cells(13, 9);
        let values: Vec<f32> = (0..cells.len()).map(|cell| (cell * 7919 % 101) as f32).collect();
        for reach in [0, 1, 3, 20] {
            let least = erode(&cells, values.clone(), reach);
            let most = dilate(&cells, values.clone(), reach);
            for cell in 0..cells.len() {
                let (column, row) = (cell % 13, cell / 13);
                let near = (0..cells.len())
                    .filter(|other| (other % 13).abs_diff(column) <= reach)
                    .filter(|other| (other / 13).abs_diff(row) <= reach)
                    .map(|other| values[other]);
                assert_eq!(least[cell], near.clone().fold(f32::INFINITY, f32::min));
                assert_eq!(most[cell], near.fold(f32::NEG_INFINITY, f32::max));
            }
        }
    }

    #[test]
    fn buildings_and_pits_leave_the_ground_as_it_was_on_a_slope() {
        let mut surfaces = Surfaces::new(cells(120, 120));
        let height = |x: f64, y: f64| 0.4 * x + 0.02 * y;
        let mut square = |x: f64, y: f64, side: f64, up: f64| {
            let at = |x: f64, y: f64| DVec3::new(x, y, height(x, y) + up);
            let corners = [at(x, y), at(x + side, y), at(x + side, y + side), at(x, y + side)];
            surfaces.add([corners[0], corners[1], corners[2]]);
            surfaces.add([corners[0], corners[2], corners[3]]);
        };
        square(80.0, 20.0, 0.5, -9.0);
        square(0.0, 0.0, 120.0, 0.0);
        let holes = surfaces.cells.clone();
        // A roof with no ground below it, as in a surface seen from the air.
        for row in 40..70 {
            for column in 30..60 {
                surfaces.low[row * 120 + column] = height(column as f64, row as f64) as f32 + 12.0;
            }
        }
        let ground = ground(&holes, &surfaces.low, |cell| surfaces.is_covered(cell), 1.0);
        for (cell, found) in ground.iter().enumerate() {
            let place = holes.middle(cell);
            let under_roof = (29.0..61.0).contains(&place.x) && (39.0..71.0).contains(&place.y);
            let tolerance = if under_roof { 3.0 } else { 0.5 };
            let expected = height(place.x, place.y);
            assert!((f64::from(*found) - expected).abs() < tolerance, "{place}: {found}");
        }
    }
}
