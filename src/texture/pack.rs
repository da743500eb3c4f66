//! Packing shapes of cells into rectangles, by shape rather than by bounding box.
//!
//! Shapes are placed largest first at the lowest, then leftmost place where they fit (as xatlas
//! does by brute force); all places of a row are tried at once, 64 to a machine word.

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
    fn coarser(&self, factor: usize) -> Shape {
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
}

/// Where a shape's bounding box lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Placement {
    pub page: usize,
    pub x: usize,
    pub y: usize,
}

/// Where all shapes lie.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packing {
    /// In the order of the shapes.
    pub placements: Vec<Placement>,
    /// Columns and rows of each page.
    pub pages: Vec<[usize; 2]>,
}

impl Packing {
    /// Cells of all pages.
    pub fn area(&self) -> usize {
        self.pages.iter().map(|[width, height]| width * height).sum()
    }
}

/// Pages wider than this are packed on a coarser grid: the search grows with the square.
const MAX_COLUMNS: usize = 384;

/// Widths that are tried, relative to the side of a square of the shapes' area.
const WIDTHS: [f64; 9] = [1.0, 0.94, 1.06, 1.12, 0.85, 1.2, 0.75, 1.35, 1.6];

/// Packs shapes into pages of at most `max` cells a side; one page where they fit, as near to a
/// square as wastes least. `None` where a shape is larger than a page.
pub(crate) fn pack(shapes: &[&Shape], max: usize) -> Option<Packing> {
    let widest = shapes.iter().map(|shape| shape.size[0]).max().unwrap_or(1);
    let tallest = shapes.iter().map(|shape| shape.size[1]).max().unwrap_or(1);
    if widest > max || tallest > max {
        return None;
    }
    if let [shape] = shapes {
        let placements = vec![Placement { page: 0, x: 0, y: 0 }];
        return Some(Packing { placements, pages: vec![shape.size] });
    }
    let area: usize = shapes.iter().map(|shape| shape.area()).sum();
    let side = (area as f64).sqrt();
    let mut factor = 1;
    while (side / factor as f64) > MAX_COLUMNS as f64 {
        factor *= 2;
    }
    let coarse: Vec<Shape> = shapes.iter().map(|shape| shape.coarser(factor)).collect();
    let order = order(&coarse);
    let max = (max / factor).max(1);
    let widest = widest.div_ceil(factor).min(max);
    let side = side / factor as f64;

    let mut best: Option<Packing> = None;
    let mut tried = Vec::new();
    for relative in WIDTHS {
        let width = ((side * relative).ceil() as usize).clamp(widest, max);
        if tried.contains(&width) {
            continue;
        }
        tried.push(width);
        let limit = best.as_ref().map_or(usize::MAX, |best| best.area() / width);
        if let Some(packing) = one_page(&coarse, &order, width, max.min(limit)) {
            let better = best.as_ref().is_none_or(|best| packing.area() < best.area());
            if better {
                best = Some(packing);
            }
        }
    }
    let mut packing = match best {
        Some(packing) => packing,
        None => many_pages(&coarse, &order, max)?,
    };
    for placement in &mut packing.placements {
        placement.x *= factor;
        placement.y *= factor;
    }
    // Coarse cells may stand out over what the shapes need.
    for (page, size) in packing.pages.iter_mut().enumerate() {
        *size = [0; 2];
        for (placement, shape) in packing.placements.iter().zip(shapes) {
            if placement.page == page {
                size[0] = size[0].max(placement.x + shape.size[0]);
                size[1] = size[1].max(placement.y + shape.size[1]);
            }
        }
    }
    Some(packing)
}

/// Largest first; what is equal stays in the order given.
fn order(shapes: &[Shape]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    order.sort_by_key(|index| {
        let [width, height] = shapes[*index].size;
        std::cmp::Reverse((width.max(height), width * height))
    });
    order
}

/// All shapes on one page of at most this size, or `None`.
fn one_page(shapes: &[Shape], order: &[usize], width: usize, height: usize) -> Option<Packing> {
    let mut page = Page::new(width);
    let mut placements = vec![Placement { page: 0, x: 0, y: 0 }; shapes.len()];
    for index in order {
        let (x, y) = page.place(&shapes[*index], height)?;
        placements[*index] = Placement { page: 0, x, y };
    }
    Some(Packing { placements, pages: vec![page.used] })
}

/// Fills one page of the largest size after the other.
fn many_pages(shapes: &[Shape], order: &[usize], max: usize) -> Option<Packing> {
    let mut pages: Vec<Page> = Vec::new();
    let mut placements = vec![Placement { page: 0, x: 0, y: 0 }; shapes.len()];
    for index in order {
        let shape = &shapes[*index];
        let found = pages
            .iter_mut()
            .enumerate()
            .find_map(|(number, page)| page.place(shape, max).map(|place| (number, place)));
        let (number, (x, y)) = match found {
            Some(found) => found,
            None => {
                let mut page = Page::new(max);
                let place = page.place(shape, max)?;
                pages.push(page);
                (pages.len() - 1, place)
            }
        };
        placements[*index] = Placement { page: number, x, y };
    }
    Some(Packing { placements, pages: pages.into_iter().map(|page| page.used).collect() })
}

/// A page being filled.
struct Page {
    width: usize,
    stride: usize,
    /// Occupied cells; bits beyond the width are set.
    rows: Vec<u64>,
    /// Rows above this one (towards 0) have no free cell.
    first_free: usize,
    used: [usize; 2],
    blocked: Vec<u64>,
    scratch: Vec<u64>,
}

impl Page {
    fn new(width: usize) -> Self {
        let stride = width.div_ceil(64);
        Self {
            width,
            stride,
            rows: Vec::new(),
            first_free: 0,
            used: [0; 2],
            blocked: vec![0; stride],
            scratch: vec![0; stride],
        }
    }

    fn height(&self) -> usize {
        self.rows.len() / self.stride
    }

    fn grow(&mut self, height: usize) {
        while self.height() < height {
            let start = self.rows.len();
            self.rows.resize(start + self.stride, 0);
            if !self.width.is_multiple_of(64) {
                self.rows[start + self.stride - 1] = !0 << (self.width % 64);
            }
        }
    }

    /// Puts the shape at its lowest, then leftmost place; `None` where it would end below `max`
    /// rows.
    fn place(&mut self, shape: &Shape, max: usize) -> Option<(usize, usize)> {
        if shape.size[0] > self.width {
            return None;
        }
        let mut y = self.first_free;
        while y + shape.size[1] <= max {
            self.grow(y + shape.size[1]);
            if let Some(x) = self.fit(shape, y) {
                for [row, start, end] in &shape.runs {
                    let row = (y + *row as usize) * self.stride;
                    let row = &mut self.rows[row..row + self.stride];
                    set(row, x + *start as usize, x + *end as usize);
                }
                self.used[0] = self.used[0].max(x + shape.size[0]);
                self.used[1] = self.used[1].max(y + shape.size[1]);
                while self.first_free < self.height()
                    && self.rows[self.first_free * self.stride..][..self.stride]
                        .iter()
                        .all(|word| *word == !0)
                {
                    self.first_free += 1;
                }
                return Some((x, y));
            }
            y += 1;
        }
        None
    }

    /// The leftmost column where the shape fits at row `y`.
    fn fit(&mut self, shape: &Shape, y: usize) -> Option<usize> {
        self.blocked.fill(0);
        for [row, start, end] in &shape.runs {
            let row = (y + *row as usize) * self.stride;
            self.scratch.copy_from_slice(&self.rows[row..row + self.stride]);
            // Bit x: some cell of x..x + length is occupied; doubling the length each time.
            let length = (end - start) as usize;
            let mut reached = 1;
            while reached < length {
                let by = reached.min(length - reached);
                or_shifted(&mut self.scratch, by);
                reached += by;
            }
            let mut all = !0;
            for (word, blocked) in self.blocked.iter_mut().enumerate() {
                *blocked |= shifted(&self.scratch, word, *start as usize);
                all &= *blocked;
            }
            if all == !0 {
                return None;
            }
        }
        self.blocked
            .iter()
            .position(|word| *word != !0)
            .map(|word| word * 64 + (!self.blocked[word]).trailing_zeros() as usize)
    }
}

/// A word of the row shifted towards 0; what comes in from beyond the page is occupied.
fn shifted(row: &[u64], word: usize, by: usize) -> u64 {
    let (words, bits) = (by / 64, by % 64);
    let low = row.get(word + words).copied().unwrap_or(!0);
    if bits == 0 {
        return low;
    }
    let high = row.get(word + words + 1).copied().unwrap_or(!0);
    low >> bits | high << (64 - bits)
}

/// `row |= row >> by`.
fn or_shifted(row: &mut [u64], by: usize) {
    // Words are read at or above the one that is written, so upwards is in place.
    for word in 0..row.len() {
        row[word] |= shifted(row, word, by);
    }
}

/// Sets `start..end`, which is not empty.
fn set(row: &mut [u64], start: usize, end: usize) {
    let (first, last) = (start / 64, (end - 1) / 64);
    for (word, bits) in row.iter_mut().enumerate().take(last + 1).skip(first) {
        let mut mask = !0u64;
        if word == first {
            mask &= !0 << (start % 64);
        }
        if word == last {
            mask &= !0 >> (63 - (end - 1) % 64);
        }
        *bits |= mask;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(width: usize, height: usize) -> Shape {
        Shape {
            size: [width, height],
            runs: (0..height as u32).map(|row| [row, 0, width as u32]).collect(),
        }
    }

    /// An L: the lower left of a square without its upper right.
    fn corner(size: u32) -> Shape {
        let runs =
            (0..size).map(|row| [row, 0, if row < size / 2 { size / 2 } else { size }]).collect();
        Shape { size: [size as usize; 2], runs }
    }

    fn refs(shapes: &[Shape]) -> Vec<&Shape> {
        shapes.iter().collect()
    }

    fn check(shapes: &[Shape], packing: &Packing, max: usize) {
        let mut pages: Vec<Vec<bool>> =
            packing.pages.iter().map(|[w, h]| vec![false; w * h]).collect();
        assert!(packing.pages.iter().all(|[w, h]| *w <= max && *h <= max));
        for (shape, placement) in shapes.iter().zip(&packing.placements) {
            let [width, _] = packing.pages[placement.page];
            for [row, start, end] in &shape.runs {
                for x in *start..*end {
                    assert!(placement.x + (x as usize) < width);
                    let cell = (placement.y + *row as usize) * width + placement.x + x as usize;
                    let cell = &mut pages[placement.page][cell];
                    assert!(!*cell, "two shapes share a cell");
                    *cell = true;
                }
            }
        }
    }

    #[test]
    fn many_shapes_never_overlap() {
        let mut seed = 1u32;
        let mut random = |below: u32| {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            (seed >> 16) % below
        };
        for round in 0..30 {
            let shapes: Vec<Shape> = (0..1 + random(80))
                .map(|_| match random(2) {
                    0 => block(1 + random(40) as usize, 1 + random(90) as usize),
                    _ => corner(2 + random(70)),
                })
                .collect();
            let max = if round % 2 == 0 { 4096 } else { 100 };
            check(&shapes, &pack(&refs(&shapes), max).expect("fits"), max);
        }
    }

    #[test]
    fn shapes_nest_where_boxes_would_not() {
        // Two corners fill a rectangle with a block in their notches.
        let shapes = [corner(8), block(4, 4), corner(8), block(4, 4)];
        let packing = pack(&refs(&shapes), 64).expect("fits");
        check(&shapes, &packing, 64);
        assert!(packing.area() <= 8 * 16 + 16, "{:?}", packing.pages);
    }

    #[test]
    fn large_sets_go_to_a_coarser_grid_and_several_pages() {
        let shapes: Vec<Shape> = (0..60).map(|i| block(150 + i, 130 + i)).collect();
        let one = pack(&refs(&shapes), 4096).expect("fits");
        check(&shapes, &one, 4096);
        assert_eq!(one.pages.len(), 1);
        let many = pack(&refs(&shapes), 400).expect("fits");
        check(&shapes, &many, 400);
        assert!(many.pages.len() > 10);
        assert_eq!(pack(&refs(&shapes), 200), None);
    }

    #[test]
    fn nothing_packs_to_nothing() {
        assert_eq!(pack(&[], 10).map(|packing| packing.area()), Some(0));
    }
}
