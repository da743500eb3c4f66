//! A node's atlas: which texels it takes from the level pictures and where they go.

use super::bits::BitGrid;
use super::charts::UvBox;
use super::fill;
use super::islands::Islands;
use super::level::LevelPicture;
use super::pack::{self, Packing, Shape};
use super::raster::{self, Rasterizer};

/// Sides of atlases are multiples of this, so that two mip levels are exact halves.
const SIDE_MULTIPLE: usize = 4;

/// A lone picture whose triangles fill their bounding box to this part is cropped, not packed.
const CROP_FILL: f64 = 0.9;

/// What one atlas is made of: the level pictures and the triangles over them.
pub(crate) struct Sheet<'a> {
    /// The level pictures that the triangles use; all have the same number of channels.
    pub pictures: Vec<&'a LevelPicture>,
    /// For each picture the corners of its triangles, in its texels and inside it, and the chart
    /// of each.
    pub triangles: Vec<Vec<([[f64; 2]; 3], u32)>>,
    /// Texels per cell: a power of two. Mip levels down to one texel a cell mix no islands.
    pub cell: usize,
    /// Longest side of a page.
    pub max_side: usize,
}

/// Where a chart's texels went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ChartPlace {
    pub page: usize,
    /// Added to a position in the level picture gives the position in the page.
    pub shift: [f64; 2],
}

/// A page of texels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Page {
    pub size: [usize; 2],
    pub pixels: Vec<u8>,
}

/// The outcome.
#[derive(Debug)]
pub(crate) struct Atlas {
    pub pages: Vec<Page>,
    /// By chart; default for charts that are in no triangle of the sheet.
    pub places: Vec<ChartPlace>,
}

/// A window of a level picture, in texels.
#[derive(Clone, Copy)]
struct Window {
    origin: [usize; 2],
    size: [usize; 2],
}

/// Cells of one picture.
struct Cells {
    /// First texel of the grid; a multiple of the cell.
    origin: [usize; 2],
    islands: Islands,
}

impl Sheet<'_> {
    /// Packs and copies. `None` where something does not fit a page, or all does not fit
    /// `max_pages`: the caller must take coarser pictures.
    pub fn build(&self, charts: usize, max_pages: usize) -> Option<Atlas> {
        let boxes: Vec<UvBox> = self.triangles.iter().map(|list| bounds(list)).collect();
        let lone = (self.pictures.len() == 1).then(|| self.window(&boxes[0])).flatten();
        if let Some(window) = lone {
            let area: f64 = self.triangles[0].iter().map(|(corners, _)| area(corners)).sum();
            let inner = window.size.map(|side| side.saturating_sub(2).max(1) as f64);
            if area >= CROP_FILL * inner[0] * inner[1] {
                return Some(self.crop(window, charts));
            }
        }
        let cells: Vec<Cells> = self
            .triangles
            .iter()
            .zip(&boxes)
            .map(|(list, bounds)| self.cells(list, bounds))
            .collect();
        let shapes: Vec<Shape> =
            cells.iter().flat_map(|cells| cells.islands.shapes.iter().cloned()).collect();
        let packing = pack::pack(&shapes, (self.max_side / self.cell).max(1))
            .filter(|packing| packing.pages.len() <= max_pages);
        let packed_texels =
            packing.as_ref().map_or(usize::MAX, |packing| packing.area() * self.cell * self.cell);
        if let Some(window) = lone
            && window.size[0] * window.size[1] <= packed_texels
        {
            return Some(self.crop(window, charts));
        }
        Some(self.compose(&cells, &packing?, charts))
    }

    /// The window that holds all triangles' texels, if it fits a page.
    fn window(&self, bounds: &UvBox) -> Option<Window> {
        let picture = self.pictures[0];
        let mut window = Window { origin: [0; 2], size: [0; 2] };
        for axis in 0..2 {
            let side = picture.size[axis];
            let (start, end) = raster::touched(bounds.min[axis], bounds.max[axis], side);
            let size = (end.saturating_sub(start)).max(1).next_multiple_of(SIDE_MULTIPLE);
            if size > self.max_side {
                return None;
            }
            // The texels that round the size up are the source's own where it has them.
            window.origin[axis] = start.min(side.saturating_sub(size));
            window.size[axis] = size;
        }
        Some(window)
    }

    fn crop(&self, window: Window, charts: usize) -> Atlas {
        let picture = self.pictures[0];
        let mut page = Page::new(window.size, picture.channels);
        page.copy(picture, window, [0; 2]);
        let shift = window.origin.map(|start| -(start as f64));
        Atlas { pages: vec![page], places: vec![ChartPlace { page: 0, shift }; charts] }
    }

    /// The cells that a picture's triangles use.
    fn cells(&self, triangles: &[([[f64; 2]; 3], u32)], bounds: &UvBox) -> Cells {
        let cell = self.cell as f64;
        let mut origin = [0; 2];
        let mut size = [0; 2];
        for axis in 0..2 {
            let (start, end) =
                raster::touched(bounds.min[axis] / cell, bounds.max[axis] / cell, usize::MAX >> 16);
            origin[axis] = start * self.cell;
            size[axis] = end.saturating_sub(start).max(1);
        }
        let mut grid = BitGrid::new(size[0], size[1]);
        let mut rasterizer = Rasterizer::default();
        for (corners, _) in triangles {
            let corners = corners
                .map(|at| [(at[0] - origin[0] as f64) / cell, (at[1] - origin[1] as f64) / cell]);
            rasterizer.mark(corners, &mut grid);
        }
        Cells { origin, islands: Islands::find(&grid) }
    }

    fn compose(&self, cells: &[Cells], packing: &Packing, charts: usize) -> Atlas {
        let channels = self.pictures.first().map_or(3, |picture| picture.channels);
        let mut pages: Vec<Page> = packing
            .pages
            .iter()
            .map(|size| {
                let side =
                    |cells: usize| (cells * self.cell).max(1).next_multiple_of(SIDE_MULTIPLE);
                Page::new(size.map(side), channels)
            })
            .collect();
        let mut owned: Vec<BitGrid> = pages
            .iter()
            .map(|page| {
                let [width, height] = page.size.map(|side| side.div_ceil(self.cell));
                BitGrid::new(width, height)
            })
            .collect();
        let mut places = vec![ChartPlace::default(); charts];
        let mut first = 0;
        for (index, cells) in cells.iter().enumerate() {
            let placements = &packing.placements[first..first + cells.islands.shapes.len()];
            first += placements.len();
            for (island, placement) in placements.iter().enumerate() {
                let shape = &cells.islands.shapes[island];
                let start = cells.islands.origins[island];
                for [row, from, to] in &shape.runs {
                    let (row, from, to) = (*row as usize, *from as usize, *to as usize);
                    let origin = [
                        cells.origin[0] + (start[0] + from) * self.cell,
                        cells.origin[1] + (start[1] + row) * self.cell,
                    ];
                    let size = [(to - from) * self.cell, self.cell];
                    let target = [placement.x + from, placement.y + row];
                    owned[placement.page].set_span(target[1], target[0], target[0] + to - from);
                    pages[placement.page].copy(
                        self.pictures[index],
                        Window { origin, size },
                        target.map(|cell| cell * self.cell),
                    );
                }
            }
            self.place_charts(index, cells, placements, &mut places);
        }
        for (page, owned) in pages.iter_mut().zip(&owned) {
            page.fill_empty_cells(owned, self.cell);
        }
        Atlas { pages, places }
    }

    /// Finds the island of each chart by its first triangle.
    fn place_charts(
        &self,
        picture: usize,
        cells: &Cells,
        placements: &[pack::Placement],
        places: &mut [ChartPlace],
    ) {
        let mut done = vec![false; places.len()];
        for (corners, chart) in &self.triangles[picture] {
            let chart = *chart as usize;
            if std::mem::replace(&mut done[chart], true) {
                continue;
            }
            let cell = [0, 1].map(|axis| {
                ((corners[0][axis] - cells.origin[axis] as f64).max(0.0) as usize) / self.cell
            });
            let Some(island) = cells.islands.at(cell[0], cell[1]) else { continue };
            let placement = placements[island];
            let start = cells.islands.origins[island];
            let target = [placement.x, placement.y];
            places[chart] = ChartPlace {
                page: placement.page,
                shift: [0, 1].map(|axis| {
                    (target[axis] * self.cell) as f64
                        - (cells.origin[axis] + start[axis] * self.cell) as f64
                }),
            };
        }
    }
}

impl Page {
    fn new(size: [usize; 2], channels: usize) -> Self {
        Self { size, pixels: vec![0; size[0] * size[1] * channels] }
    }

    fn channels(&self) -> usize {
        self.pixels.len() / (self.size[0] * self.size[1]).max(1)
    }

    /// Copies a window of a picture to `target`; beyond the picture its last texels go on.
    fn copy(&mut self, picture: &LevelPicture, window: Window, target: [usize; 2]) {
        let channels = picture.channels;
        let width = window.size[0].min(self.size[0] - target[0]);
        let start = window.origin[0].min(picture.size[0] - 1);
        let inside = width.min(picture.size[0] - start);
        for y in 0..window.size[1].min(self.size[1] - target[1]) {
            let row = (window.origin[1] + y).min(picture.size[1] - 1);
            let source = picture.row(row, start, inside);
            let at = ((target[1] + y) * self.size[0] + target[0]) * channels;
            let (copied, beyond) =
                self.pixels[at..at + width * channels].split_at_mut(inside * channels);
            copied.copy_from_slice(source);
            let last = &source[(inside - 1) * channels..];
            for texel in beyond.chunks_exact_mut(channels) {
                texel.copy_from_slice(last);
            }
        }
    }

    /// Gives cells that no island owns a flat colour from those around, for encoders and for the
    /// mip levels beyond those that the gutters promise.
    fn fill_empty_cells(&mut self, owned: &BitGrid, cell: usize) {
        let channels = self.channels();
        if channels == 4 || (0..owned.height()).all(|y| owned.row_is_full(y)) {
            return;
        }
        let [columns, rows] = [owned.width(), owned.height()];
        let centre = |cells: usize, side: usize| (cells * cell + cell / 2).min(side - 1);
        let mut colors = vec![0; columns * rows * 3];
        for y in 0..rows {
            for (start, end) in owned.runs(y) {
                for x in start..end {
                    let at = centre(y, self.size[1]) * self.size[0] + centre(x, self.size[0]);
                    colors[(y * columns + x) * 3..][..3]
                        .copy_from_slice(&self.pixels[at * 3..][..3]);
                }
            }
        }
        fill::fill_all(&mut colors, 3, owned);
        for y in 0..self.size[1] {
            for x in (0..columns).filter(|x| !owned.get(*x, y / cell)) {
                let color = &colors[(y / cell * columns + x) * 3..][..3];
                let end = ((x + 1) * cell).min(self.size[0]);
                let row = &mut self.pixels
                    [(y * self.size[0] + x * cell) * 3..(y * self.size[0] + end) * 3];
                for texel in row.chunks_exact_mut(3) {
                    texel.copy_from_slice(color);
                }
            }
        }
    }
}

fn bounds(triangles: &[([[f64; 2]; 3], u32)]) -> UvBox {
    let mut bounds = UvBox::EMPTY;
    for corner in triangles.iter().flat_map(|(corners, _)| corners) {
        bounds.add(*corner);
    }
    bounds
}

fn area([a, b, c]: &[[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
}
