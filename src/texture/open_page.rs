//! Packing onto pages whose sides do not meet: what is too long for a wrapped page, or too much
//! for one.
//!
//! Shapes are placed largest first at the lowest, then leftmost position where they fit (as xatlas
//! does by brute force); all positions of a row are tried at once, 64 to a machine word.

use super::packing::{Packing, Placement};
use super::shape::Shape;

/// Widths that are tried for one page, relative to the side of a square of the shapes' area.
const WIDTHS: [f64; 4] = [1.0, 1.2, 0.85, 1.6];

/// Packs in the order given onto one page of at most `max` cells a side, or if need be several.
pub(crate) fn pack(shapes: &[Shape], order: &[usize], max: usize) -> Option<Packing> {
    let widest = shapes.iter().map(|shape| shape.size[0]).max().unwrap_or(1).min(max);
    let side = (shapes.iter().map(Shape::area).sum::<usize>() as f64).sqrt();
    let mut best: Option<Packing> = None;
    for relative in WIDTHS {
        let width = ((side * relative).ceil() as usize).clamp(widest, max);
        let limit = best.as_ref().map_or(max, |best| max.min(best.area() / width));
        if let Some(packing) = one_page(shapes, order, width, limit) {
            best = Some(packing);
        }
    }
    best.or_else(|| many_pages(shapes, order, max))
}

/// All shapes on one page of at most this size, or `None`.
fn one_page(shapes: &[Shape], order: &[usize], width: usize, height: usize) -> Option<Packing> {
    let mut page = Page::new(width);
    let mut placements = vec![Placement::default(); shapes.len()];
    for index in order {
        let (x, y) = page.place(&shapes[*index], height)?;
        placements[*index] = Placement { page: 0, x, y, transposed: false };
    }
    Some(Packing { placements, pages: vec![page.used], wraps: false })
}

/// Fills one page of the largest size after the other.
fn many_pages(shapes: &[Shape], order: &[usize], max: usize) -> Option<Packing> {
    let mut pages: Vec<Page> = Vec::new();
    let mut placements = vec![Placement::default(); shapes.len()];
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
        placements[*index] = Placement { page: number, x, y, transposed: false };
    }
    Some(Packing {
        placements,
        wraps: false,
        pages: pages.into_iter().map(|page| page.used).collect(),
    })
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

    /// Puts the shape at its lowest, then leftmost position; `None` where it would end below `max`
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
