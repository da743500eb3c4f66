//! A node's atlas: which texels it takes from the level images and where they go.

use super::bits::BitGrid;
use super::charts::UvBox;
use super::fill;
use super::islands::Islands;
use super::level::LevelImage;
use super::pack;
use super::packing::{Packing, Placement};
use super::raster::{self, Rasterizer};
use super::shape::Shape;
use super::split;

/// Sides of atlases are multiples of this, so that two mip levels are exact halves.
const SIDE_MULTIPLE: usize = 4;

/// A lone image whose triangles fill their bounding box to this part is cropped, not packed.
const CROP_FILL: f64 = 0.9;

/// An island that fills its bounding box to this part is packed as it is, else divided.
const ISLAND_FILL: f64 = 0.95;

/// What one atlas is made of.
pub(crate) struct AtlasInput<'a> {
    /// All have the same number of channels.
    pub images: Vec<AtlasImage<'a>>,
    /// Texels per cell: a power of two. Mip levels down to one texel a cell mix no patches.
    pub cell: usize,
    /// Longest side of a page.
    pub max_side: usize,
}

/// A level image and the triangles over it.
pub(crate) struct AtlasImage<'a> {
    pub image: &'a LevelImage,
    /// The corners of the triangles, in the image's texels and inside it.
    pub corners: Vec<[[f64; 2]; 3]>,
    /// The chart of each triangle.
    pub charts: Vec<u32>,
}

/// Where the texels of a patch went: triangles whose texels keep their relative positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PatchPlacement {
    pub page: usize,
    /// True where columns and rows of the level image are exchanged in the page.
    pub transposed: bool,
    /// Added to a position in the level image, transposed where it is, gives that in the page.
    pub shift: [f64; 2],
}

impl PatchPlacement {
    /// Where a position of the level image is in the page, in texels.
    pub fn texel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x, y] = if self.transposed { [y, x] } else { [x, y] };
        [x + self.shift[0], y + self.shift[1]]
    }
}

/// A page of texels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Page {
    pub size: [usize; 2],
    pub pixels: Vec<u8>,
}

/// The outcome.
#[derive(Debug, Default)]
pub(crate) struct Atlas {
    pub pages: Vec<Page>,
    pub placements: Vec<PatchPlacement>,
    /// For each image of the sheet the patch of each triangle.
    pub patches: Vec<Vec<u32>>,
    /// True where the page's opposite sides meet and patches lie across them.
    pub wraps: bool,
}

/// A window of a level image, in texels; it may reach beyond the image, whose border texels
/// then go on.
#[derive(Clone, Copy)]
struct Window {
    origin: [isize; 2],
    size: [usize; 2],
}

/// A patch to be packed: a shape of cells of one image.
struct Patch {
    image: usize,
    /// Texel of the shape's corner; multiples of the cell.
    origin: [isize; 2],
    shape: Shape,
}

impl AtlasInput<'_> {
    /// Packs and copies. `None` where something does not fit a page, or all does not fit
    /// `max_pages`: the caller must take coarser images.
    pub fn build(&self, max_pages: usize) -> Option<Atlas> {
        let lone = match self.images.as_slice() {
            [lone] => self.window(lone),
            _ => None,
        };
        if let Some(window) = lone {
            let area: f64 = self.images[0].corners.iter().map(area).sum();
            let inner = window.size.map(|side| side.saturating_sub(2).max(1) as f64);
            if area >= CROP_FILL * inner[0] * inner[1] {
                return Some(self.crop(window));
            }
        }
        let (patches, assigned) = self.patches();
        let shapes: Vec<&Shape> = patches.iter().map(|patch| &patch.shape).collect();
        let multiple = SIDE_MULTIPLE.div_ceil(self.cell);
        let packing = pack::pack(&shapes, (self.max_side / self.cell).max(1), multiple)
            .filter(|packing| packing.pages.len() <= max_pages);
        let packed_texels =
            packing.as_ref().map_or(usize::MAX, |packing| packing.area() * self.cell * self.cell);
        if let Some(window) = lone
            && window.size[0] * window.size[1] <= packed_texels
        {
            return Some(self.crop(window));
        }
        Some(self.compose(&patches, &packing?, assigned))
    }

    /// The window that holds all triangles' texels, if it fits a page.
    fn window(&self, lone: &AtlasImage) -> Option<Window> {
        let bounds = bounds(&lone.corners);
        let mut window = Window { origin: [0; 2], size: [0; 2] };
        for axis in 0..2 {
            let side = lone.image.size[axis];
            let (start, end) = raster::touched(bounds.min[axis], bounds.max[axis], side);
            let size = (end.saturating_sub(start)).max(1).next_multiple_of(SIDE_MULTIPLE);
            if size > self.max_side {
                return None;
            }
            // The texels that round the size up are the source's own where it has them.
            window.origin[axis] = start.min(side.saturating_sub(size)) as isize;
            window.size[axis] = size;
        }
        Some(window)
    }

    fn crop(&self, window: Window) -> Atlas {
        let lone = &self.images[0];
        let page = Page::window(lone.image, window);
        let shift = window.origin.map(|start| -(start as f64));
        Atlas {
            pages: vec![page],
            placements: vec![PatchPlacement { page: 0, transposed: false, shift }],
            patches: vec![vec![0; lone.corners.len()]],
            wraps: false,
        }
    }

    /// Divides all triangles into patches; also returns the patch of each triangle.
    fn patches(&self) -> (Vec<Patch>, Vec<Vec<u32>>) {
        let mut patches = Vec::new();
        let mut assigned = Vec::new();
        for (index, image) in self.images.iter().enumerate() {
            let all: Vec<u32> = (0..image.corners.len() as u32).collect();
            let (origin, grid) = self.cells(image, &all);
            let islands = Islands::find(&grid);
            let members = self.members(image, origin, &islands);
            let mut patch_of = vec![0; image.corners.len()];
            let parts = islands.shapes.into_iter().zip(islands.origins).zip(members);
            for ((shape, start), members) in parts {
                let fill = shape.area() as f64 / (shape.size[0] * shape.size[1]) as f64;
                let parts = if fill < ISLAND_FILL {
                    split::split(&image.corners, members, 1.5 * self.cell as f64)
                } else {
                    vec![members]
                };
                let whole = parts.len() == 1;
                for part in &parts {
                    part.iter().for_each(|t| patch_of[*t as usize] = patches.len() as u32);
                    if !whole {
                        let (origin, grid) = self.cells(image, part);
                        let shape = Shape::of(&grid);
                        patches.push(Patch { image: index, origin, shape });
                    }
                }
                if whole {
                    let origin =
                        [0, 1].map(|axis| origin[axis] + (start[axis] * self.cell) as isize);
                    patches.push(Patch { image: index, origin, shape });
                }
            }
            assigned.push(patch_of);
        }
        (patches, assigned)
    }

    /// The cells that triangles of an image use, and the texel where their grid begins.
    fn cells(&self, image: &AtlasImage, triangles: &[u32]) -> ([isize; 2], BitGrid) {
        let scale = 1.0 / self.cell as f64;
        let mut bounds = UvBox::EMPTY;
        for triangle in triangles {
            image.corners[*triangle as usize].iter().for_each(|corner| bounds.add(*corner));
        }
        let mut first = [0; 2];
        let mut size = [0; 2];
        for axis in 0..2 {
            // Sampling at the image's border reads one cell beyond it, so cell −1 is the first.
            let count = image.image.size[axis].div_ceil(self.cell) + 2;
            let (low, high) = (bounds.min[axis] * scale + 1.0, bounds.max[axis] * scale + 1.0);
            let (start, end) = raster::touched(low, high, count);
            first[axis] = start as isize - 1;
            size[axis] = end.saturating_sub(start).max(1);
        }
        let mut grid = BitGrid::new(size[0], size[1]);
        let start = first.map(|cell| cell as f64);
        let to_cells = |at: [f64; 2]| [0, 1].map(|axis| at[axis] * scale - start[axis]);
        let filled =
            if triangles.len() == image.corners.len() { image.filled_charts() } else { Vec::new() };
        for bounds in filled.iter().flatten() {
            raster::mark_box(to_cells(bounds.min), to_cells(bounds.max), &mut grid);
        }
        let others = triangles.iter().map(|triangle| *triangle as usize).filter(|triangle| {
            !matches!(filled.get(image.charts[*triangle] as usize), Some(Some(_)))
        });
        let others = others.map(|triangle| image.corners[triangle].map(to_cells));
        Rasterizer::default().mark_all(others, &mut grid);
        (first.map(|cell| cell * self.cell as isize), grid)
    }

    /// The triangles of each island. A chart lies in one island, so its first triangle tells.
    fn members(&self, image: &AtlasImage, origin: [isize; 2], islands: &Islands) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); islands.shapes.len()];
        let charts = image.charts.iter().max().map_or(0, |chart| *chart as usize + 1);
        let mut island_of = vec![None; charts];
        for (triangle, chart) in image.charts.iter().enumerate() {
            let island = *island_of[*chart as usize].get_or_insert_with(|| {
                let corner = image.corners[triangle][0];
                let cell = [0, 1]
                    .map(|axis| (corner[axis] - origin[axis] as f64).max(0.0) as usize / self.cell);
                islands.at(cell[0], cell[1]).unwrap_or(0)
            });
            if let Some(members) = members.get_mut(island) {
                members.push(triangle as u32);
            }
        }
        members
    }

    fn compose(&self, patches: &[Patch], packing: &Packing, assigned: Vec<Vec<u32>>) -> Atlas {
        let channels = self.images.first().map_or(3, |image| image.image.channels);
        let side = |cells: usize| (cells * self.cell).max(1).next_multiple_of(SIDE_MULTIPLE);
        let mut pages: Vec<Page> =
            packing.pages.iter().map(|size| Page::new(size.map(side), channels)).collect();
        let mut owned: Vec<BitGrid> = pages
            .iter()
            .map(|page| {
                let [width, height] = page.size.map(|side| side.div_ceil(self.cell));
                BitGrid::new(width, height)
            })
            .collect();
        let mut placements = Vec::with_capacity(patches.len());
        for (patch, placement) in patches.iter().zip(&packing.placements) {
            let page = &mut pages[placement.page];
            self.copy_patch(patch, placement, page, &mut owned[placement.page]);
            let origin = patch.origin.map(|texel| texel as f64);
            let [x, y] = if placement.transposed { [origin[1], origin[0]] } else { origin };
            placements.push(PatchPlacement {
                page: placement.page,
                transposed: placement.transposed,
                shift: [(placement.x * self.cell) as f64 - x, (placement.y * self.cell) as f64 - y],
            });
        }
        for (page, owned) in pages.iter_mut().zip(&owned) {
            page.fill_empty_cells(owned, self.cell);
        }
        Atlas { pages, placements, patches: assigned, wraps: packing.wraps }
    }

    /// Copies a patch's cells, over the page's sides where it lies across them.
    fn copy_patch(
        &self,
        patch: &Patch,
        placement: &Placement,
        page: &mut Page,
        owned: &mut BitGrid,
    ) {
        let image = self.images[patch.image].image;
        let sides = [owned.width(), owned.height()];
        let along = usize::from(placement.transposed);
        for [row, from, to] in &patch.shape.runs {
            let mut from = *from as usize;
            while from < *to as usize {
                let mut target = [placement.x, placement.y];
                target[along] = (target[along] + from) % sides[along];
                target[1 - along] = (target[1 - along] + *row as usize) % sides[1 - along];
                let count = (*to as usize - from).min(sides[along] - target[along]);
                let window = Window {
                    origin: [
                        patch.origin[0] + (from * self.cell) as isize,
                        patch.origin[1] + (*row as usize * self.cell) as isize,
                    ],
                    size: [count * self.cell, self.cell],
                };
                let texel = target.map(|cell| cell * self.cell);
                if placement.transposed {
                    (target[1]..target[1] + count).for_each(|y| owned.set(target[0], y));
                    page.copy_transposed(image, window, texel);
                } else {
                    owned.set_span(target[1], target[0], target[0] + count);
                    page.copy(image, window, texel);
                }
                from += count;
            }
        }
    }
}

impl AtlasImage<'_> {
    /// By chart: its box, where its triangles fill it.
    fn filled_charts(&self) -> Vec<Option<UvBox>> {
        let count = self.charts.iter().max().map_or(0, |chart| *chart as usize + 1);
        let mut charts = vec![(UvBox::EMPTY, 0.0); count];
        for (chart, corners) in self.charts.iter().zip(&self.corners) {
            let (bounds, sum) = &mut charts[*chart as usize];
            corners.iter().for_each(|corner| bounds.add(*corner));
            *sum += area(corners);
        }
        let filled = |(bounds, sum): (UvBox, f64)| {
            let sides = [0, 1].map(|axis| bounds.max[axis] - bounds.min[axis]);
            (sides[0] >= 0.0 && raster::fills(sides, sum)).then_some(bounds)
        };
        charts.into_iter().map(filled).collect()
    }
}

impl Page {
    fn new(size: [usize; 2], channels: usize) -> Self {
        Self { size, pixels: vec![0; size[0] * size[1] * channels] }
    }

    /// A window as a page of its own.
    fn window(image: &LevelImage, window: Window) -> Self {
        let inside = (0..2).all(|axis| {
            let end = window.origin[axis] + window.size[axis] as isize;
            window.origin[axis] >= 0 && end <= image.size[axis] as isize
        });
        if !inside {
            let mut page = Self::new(window.size, image.channels);
            page.copy(image, window, [0; 2]);
            return page;
        }
        let [left, top] = window.origin.map(|start| start as usize);
        let [width, height] = window.size;
        let mut pixels = vec![0; width * height * image.channels];
        let rows = pixels.chunks_exact_mut(width * image.channels);
        (top..).zip(rows).for_each(|(y, row)| image.copy_row(y, left, row));
        Self { size: window.size, pixels }
    }

    fn channels(&self) -> usize {
        self.pixels.len() / (self.size[0] * self.size[1]).max(1)
    }

    /// Copies a window of an image to `target`; beyond the image its border texels go on.
    fn copy(&mut self, image: &LevelImage, window: Window, target: [usize; 2]) {
        let channels = image.channels;
        let [columns, rows] = image.size;
        let width = window.size[0].min(self.size[0] - target[0]);
        let before = (window.origin[0].min(0).unsigned_abs()).min(width - 1);
        let start = (window.origin[0].max(0) as usize).min(columns - 1);
        let inside = (width - before).min(columns - start);
        for y in 0..window.size[1].min(self.size[1] - target[1]) {
            let row = (window.origin[1] + y as isize).clamp(0, rows as isize - 1) as usize;
            let at = ((target[1] + y) * self.size[0] + target[0]) * channels;
            let copied = &mut self.pixels[at..at + width * channels];
            let (left, copied) = copied.split_at_mut(before * channels);
            let (middle, right) = copied.split_at_mut(inside * channels);
            image.copy_row(row, start, middle);
            for texel in left.chunks_exact_mut(channels) {
                texel.copy_from_slice(&middle[..channels]);
            }
            for texel in right.chunks_exact_mut(channels) {
                texel.copy_from_slice(&middle[(inside - 1) * channels..]);
            }
        }
    }

    /// The same with columns and rows exchanged.
    fn copy_transposed(&mut self, image: &LevelImage, window: Window, target: [usize; 2]) {
        let channels = image.channels;
        let mut upright = Page::new(window.size, channels);
        upright.copy(image, window, [0; 2]);
        let [width, height] = window.size;
        for y in 0..width.min(self.size[1] - target[1]) {
            for x in 0..height.min(self.size[0] - target[0]) {
                let to = ((target[1] + y) * self.size[0] + target[0] + x) * channels;
                let from = (x * width + y) * channels;
                self.pixels[to..to + channels]
                    .copy_from_slice(&upright.pixels[from..from + channels]);
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
            let row = &mut self.pixels[y * self.size[0] * 3..][..self.size[0] * 3];
            let colors = &colors[y / cell * columns * 3..][..columns * 3];
            let mut free = 0;
            for (start, end) in owned.runs(y / cell).chain([(columns, columns)]) {
                for x in free..start {
                    let texels = x * cell * 3..((x + 1) * cell * 3).min(row.len());
                    for texel in row[texels].as_chunks_mut::<3>().0 {
                        texel.copy_from_slice(&colors[x * 3..][..3]);
                    }
                }
                free = end;
            }
        }
    }
}

fn bounds(triangles: &[[[f64; 2]; 3]]) -> UvBox {
    let mut bounds = UvBox::EMPTY;
    for corner in triangles.iter().flatten() {
        bounds.add(*corner);
    }
    bounds
}

fn area([a, b, c]: &[[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
}
