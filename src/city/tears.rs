//! Textures torn into charts, as those of scans are: pieces of the façade's image, turned and
//! shuffled, each with a border of its own.

use image::RgbImage;
use rustc_hash::FxHashMap;

use super::grid::Grid;
use super::scan::{Scan, TEXCOORD_STEPS};
use crate::random::{Random, hash};

/// Texels around a chart that show what is beside it on the façade.
const BORDER: u32 = 2;
/// Where a piece is divided, as shares of its longer side.
const DIVIDED_AT: [f64; 2] = [0.35, 0.65];

/// How a façade's texture is torn.
pub(super) struct Tears {
    /// Cells of the scan grid.
    cells: [u32; 2],
    /// Texels of the whole image.
    whole: [u32; 2],
    /// Texels of the image of charts.
    size: [u32; 2],
    charts: Vec<Chart>,
    /// By cell, row by row from the ground: its chart.
    chart_of: Vec<u32>,
}

/// A rectangle of cells, and where it is in the image.
struct Chart {
    /// First and end of its texels in the whole image, with its border; from the upper left.
    texels: [[u32; 2]; 2],
    /// Whether its columns are rows in the image.
    is_turned: bool,
    /// Its upper left texel in the image.
    place: [u32; 2],
}

impl Chart {
    /// Columns and rows of its texels in the image.
    fn size(&self) -> [u32; 2] {
        let [x, y] = self.texels.map(|[first, end]| end - first);
        if self.is_turned { [y, x] } else { [x, y] }
    }
}

impl Tears {
    /// Tears an image of `whole` texels over a grid into so many charts, or one for each cell.
    pub(super) fn new(grid: &Grid, whole: [u32; 2], charts: u32, seed: u64) -> Self {
        let cells = [grid.columns, grid.rows];
        let mut random = Random::new(hash(seed, 0x7ea5, 0), 0);
        let texels = |axis: usize, cells_of: [u32; 2]| {
            f64::from(cells_of[1] - cells_of[0]) * f64::from(whole[axis]) / f64::from(cells[axis])
        };
        let area = |piece: &[[u32; 2]; 2]| texels(0, piece[0]) * texels(1, piece[1]);
        let mut pieces = vec![[[0, cells[0]], [0, cells[1]]]];
        while pieces.len() < charts as usize {
            let divisible = (0..pieces.len())
                .filter(|&index| pieces[index].iter().any(|[first, end]| end - first > 1));
            let Some(largest) =
                divisible.max_by(|&a, &b| area(&pieces[a]).total_cmp(&area(&pieces[b])))
            else {
                break;
            };
            let piece = pieces[largest];
            let wide = texels(0, piece[0]) >= texels(1, piece[1]);
            let can = |axis: usize| piece[axis][1] - piece[axis][0] > 1;
            let axis = usize::from(if wide { !can(0) } else { can(1) });
            let [first, end] = piece[axis];
            let share = random.between(DIVIDED_AT[0], DIVIDED_AT[1]);
            let at = first + (f64::from(end - first) * share).round() as u32;
            let at = at.clamp(first + 1, end - 1);
            pieces[largest][axis] = [first, at];
            let mut other = piece;
            other[axis] = [at, end];
            pieces.push(other);
        }
        let mut chart_of = vec![0; (cells[0] * cells[1]) as usize];
        let mut torn: Vec<Chart> = Vec::with_capacity(pieces.len());
        for (piece, number) in pieces.into_iter().zip(0..) {
            for row in piece[1][0]..piece[1][1] {
                let start = (row * cells[0]) as usize;
                chart_of[start + piece[0][0] as usize..start + piece[0][1] as usize].fill(number);
            }
            // Rows count from the ground, texels from above.
            let from_above = piece[1].map(|row| cells[1] - row);
            let texels = [piece[0], [from_above[1], from_above[0]]];
            let texels = std::array::from_fn(|axis| {
                let at =
                    |cell: u32| f64::from(cell) * f64::from(whole[axis]) / f64::from(cells[axis]);
                let [first, end] = texels[axis];
                let first = (at(first).floor() as u32).saturating_sub(BORDER);
                [first, (at(end).ceil() as u32 + BORDER).min(whole[axis])]
            });
            let is_turned = random.unit() < 0.5;
            torn.push(Chart { texels, is_turned, place: [0; 2] });
        }
        let size = place(&mut torn);
        Self { cells, whole, size, charts: torn, chart_of }
    }

    /// The image of charts, from the whole one.
    pub(super) fn tear_image(&self, whole: &RgbImage) -> RgbImage {
        let mut image = RgbImage::new(self.size[0], self.size[1]);
        for chart in &self.charts {
            let [columns, rows] = chart.size();
            for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                let from = if chart.is_turned { [y, x] } else { [x, y] };
                let texel =
                    whole.get_pixel(chart.texels[0][0] + from[0], chart.texels[1][0] + from[1]);
                image.put_pixel(chart.place[0] + x, chart.place[1] + y, *texel);
            }
        }
        image
    }

    /// Gives the façade's vertices a copy for each chart that uses them, and all of them the
    /// texture coordinates of the image of charts.
    pub(super) fn tear_scan(&self, scan: &mut Scan) {
        let before = std::mem::take(&mut scan.texcoords);
        let (facade, rest) = scan.triangles.split_at_mut(scan.facade_triangles);
        let mut copies: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        let mut positions = Vec::with_capacity(before.len() * 5 / 4);
        // For what is welded to the façade: the first copy.
        let mut first = vec![u32::MAX; scan.positions.len()];
        for triangle in facade {
            let chart = self.chart_of(triangle.map(|vertex| before[vertex as usize]));
            for vertex in triangle {
                *vertex = *copies.entry((chart, *vertex)).or_insert_with(|| {
                    let copy = positions.len() as u32;
                    positions.push(scan.positions[*vertex as usize]);
                    scan.texcoords.push(self.texcoord(chart, before[*vertex as usize]));
                    first[*vertex as usize] = first[*vertex as usize].min(copy);
                    copy
                });
            }
        }
        for (vertex, &position) in scan.positions.iter().enumerate().skip(before.len()) {
            first[vertex] = positions.len() as u32;
            positions.push(position);
        }
        rest.iter_mut().flatten().for_each(|vertex| *vertex = first[*vertex as usize]);
        scan.positions = positions;
    }

    /// The chart of the cell that a triangle lies in.
    fn chart_of(&self, texcoords: [[u32; 2]; 3]) -> u32 {
        let cell = |axis: usize| {
            let low = texcoords.map(|at| at[axis]).into_iter().min().unwrap_or(0);
            let at = f64::from(low) / f64::from(TEXCOORD_STEPS) * f64::from(self.cells[axis]);
            (at.round() as u32).min(self.cells[axis] - 1)
        };
        let (column, from_above) = (cell(0), cell(1));
        let row = self.cells[1] - 1 - from_above;
        self.chart_of[(row * self.cells[0] + column) as usize]
    }

    /// Where a chart shows what the whole image has at a position.
    fn texcoord(&self, chart: u32, at: [u32; 2]) -> [u32; 2] {
        let chart = &self.charts[chart as usize];
        let inside: [f64; 2] = std::array::from_fn(|axis| {
            let texel = f64::from(at[axis]) / f64::from(TEXCOORD_STEPS);
            texel * f64::from(self.whole[axis]) - f64::from(chart.texels[axis][0])
        });
        let [x, y] = inside;
        let inside = if chart.is_turned { [y, x] } else { [x, y] };
        std::array::from_fn(|axis| {
            let texel = f64::from(chart.place[axis]) + inside[axis];
            (texel / f64::from(self.size[axis]) * f64::from(TEXCOORD_STEPS)).round() as u32
        })
    }
}

/// Places charts in rows, the highest first, in an image about as wide as high; its size.
fn place(charts: &mut [Chart]) -> [u32; 2] {
    let mut order: Vec<usize> = (0..charts.len()).collect();
    order.sort_by_key(|&index| (std::cmp::Reverse(charts[index].size()[1]), index));
    let area: f64 = charts
        .iter()
        .map(|chart| chart.size().map(f64::from))
        .map(|[width, height]| width * height)
        .sum();
    let widest = charts.iter().map(|chart| chart.size()[0]).max().unwrap_or(1);
    let width = (area.sqrt().ceil() as u32).max(widest);
    let [mut x, mut y, mut row] = [0; 3];
    for index in order {
        let [columns, rows] = charts[index].size();
        if x + columns > width {
            (x, y, row) = (0, y + row, 0);
        }
        charts[index].place = [x, y];
        x += columns;
        row = row.max(rows);
    }
    [width, y + row]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid { columns: 40, rows: 16, bounds: vec![0, 40], roofs: vec![16] }
    }

    #[test]
    fn charts_show_what_the_whole_image_has_and_do_not_overlap() {
        let whole =
            RgbImage::from_fn(331, 122, |x, y| image::Rgb([x as u8, y as u8, (x / 256) as u8]));
        for charts in [1, 7, 60, 10_000] {
            let tears = Tears::new(&grid(), [331, 122], charts, 5);
            assert_eq!(tears.charts.len(), charts.min(640) as usize);
            let image = tears.tear_image(&whole);
            let mut taken = vec![false; (tears.size[0] * tears.size[1]) as usize];
            for chart in &tears.charts {
                let [columns, rows] = chart.size();
                for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                    let at = (chart.place[1] + y) * tears.size[0] + chart.place[0] + x;
                    assert!(!std::mem::replace(&mut taken[at as usize], true));
                }
            }
            // The middle of each cell, by the texture coordinates of its corners.
            for (row, column) in (0..16u32).flat_map(|row| (0..40u32).map(move |c| (row, c))) {
                let corner = |right: u32, up: u32| {
                    [(column + right) * 1_000_000 / 40, 1_000_000 - (row + up) * 1_000_000 / 16]
                };
                let corners = [corner(0, 0), corner(1, 0), corner(1, 1)];
                let chart = tears.chart_of(corners);
                let middle = |corners: [[u32; 2]; 3], size: [u32; 2]| {
                    let [x, y] = [0, 1].map(|axis| {
                        let sum = corners[0][axis] + corners[2][axis];
                        f64::from(sum) / 2e6 * f64::from(size[axis])
                    });
                    [x as u32, y as u32]
                };
                let [x, y] = middle(corners, [331, 122]);
                let torn = corners.map(|at| tears.texcoord(chart, at));
                let [u, v] = middle(torn, tears.size);
                let (expected, found) = (whole.get_pixel(x, y).0, image.get_pixel(u, v).0);
                // Rounding of texture coordinates may step over a texel's edge.
                let near = (0..2).all(|channel| expected[channel].abs_diff(found[channel]) <= 1);
                assert!(near || expected[2] != found[2], "{expected:?} {found:?}");
            }
        }
    }

    #[test]
    fn the_surface_stays_as_it_is() {
        let steps = |at: u32, end: u32| at * TEXCOORD_STEPS / end;
        let mut scan = Scan {
            positions: Vec::new(),
            texcoords: Vec::new(),
            triangles: Vec::new(),
            facade_triangles: 0,
            spacing: 1.0,
        };
        for (row, column) in (0..17).flat_map(|row| (0..41).map(move |column| (row, column))) {
            scan.positions.push([column as i32, 0, row as i32]);
            scan.texcoords.push([steps(column, 40), TEXCOORD_STEPS - steps(row, 16)]);
        }
        for (row, column) in (0..16).flat_map(|row| (0..40).map(move |column| (row, column))) {
            let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)]
                .map(|(up, right)| (row + up) * 41 + column + right);
            scan.triangles.extend([[a, b, c], [a, c, d]]);
        }
        scan.facade_triangles = scan.triangles.len();
        scan.positions.push([7, 7, 7]);
        scan.triangles.push([0, 40, 41 * 17]);
        let corners = |scan: &Scan| -> Vec<_> {
            let of = |vertex: u32| scan.positions[vertex as usize];
            scan.triangles.iter().map(|triangle| triangle.map(of)).collect()
        };
        let before = corners(&scan);
        Tears::new(&grid(), [331, 122], 60, 5).tear_scan(&mut scan);
        assert_eq!(corners(&scan), before);
        assert!(scan.texcoords.len() > 41 * 17 && scan.texcoords.len() + 1 == scan.positions.len());
        assert!(scan.texcoords.iter().flatten().all(|&at| at <= TEXCOORD_STEPS));
    }
}
