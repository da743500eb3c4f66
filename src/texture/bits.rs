//! A grid of bits: which texels or cells are used.

use std::ops::Range;

/// Rows of bits, each row padded to whole words with zeros.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BitGrid {
    width: usize,
    height: usize,
    stride: usize,
    words: Vec<u64>,
}

impl BitGrid {
    /// All zero.
    pub fn new(width: usize, height: usize) -> Self {
        let stride = width.div_ceil(64);
        Self { width, height, stride, words: vec![0; stride * height] }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    pub fn height(&self) -> usize {
        self.height
    }

    /// The words of a row, lowest bit leftmost.
    pub fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..(y + 1) * self.stride]
    }

    pub fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.stride..(y + 1) * self.stride]
    }

    pub fn get(&self, x: usize, y: usize) -> bool {
        self.words[y * self.stride + x / 64] >> (x % 64) & 1 != 0
    }

    pub fn set(&mut self, x: usize, y: usize) {
        self.words[y * self.stride + x / 64] |= 1 << (x % 64);
    }

    /// Sets `start..end` of a row; `end` is at most the width.
    pub fn set_span(&mut self, y: usize, start: usize, end: usize) {
        if start >= end {
            return;
        }
        let row = self.row_mut(y);
        let (first, last) = (start / 64, (end - 1) / 64);
        let head = !0u64 << (start % 64);
        let tail = !0u64 >> (63 - (end - 1) % 64);
        if first == last {
            row[first] |= head & tail;
        } else {
            row[first] |= head;
            row[first + 1..last].fill(!0);
            row[last] |= tail;
        }
    }

    /// On a grid of this size whose cells are `step` as wide: each that some set cell overlaps.
    pub fn coarser(&self, step: f64, width: usize, height: usize) -> Self {
        let mut coarse = Self::new(width, height);
        // What overlaps by a thousandth is rounding.
        let span = |start: usize, end: usize, limit: usize| {
            let first = ((start as f64 / step + 1e-3) as usize).min(limit - 1);
            (first, ((end as f64 / step - 1e-3).ceil() as usize).clamp(first + 1, limit))
        };
        for y in 0..self.height {
            let (top, bottom) = span(y, y + 1, height);
            for (start, end) in self.runs(y) {
                let (left, right) = span(start, end, width);
                (top..bottom).for_each(|y| coarse.set_span(y, left, right));
            }
        }
        coarse
    }

    /// Returns some rows as a grid of their own.
    pub fn rows(&self, rows: Range<usize>) -> Self {
        let words = self.words[rows.start * self.stride..rows.end * self.stride].to_vec();
        Self { height: rows.len(), words, ..*self }
    }

    /// How many bits are set.
    pub fn count(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// True where every bit of `start..end` of the row is set.
    pub fn row_is_full(&self, y: usize) -> bool {
        let row = self.row(y);
        let (whole, rest) = (self.width / 64, self.width % 64);
        row[..whole].iter().all(|word| *word == !0)
            && (rest == 0 || row[whole] == (1u64 << rest) - 1)
    }

    /// The runs of set bits of a row, `start..end`, from the left.
    pub fn runs(&self, y: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let row = self.row(y);
        let mut x = 0;
        std::iter::from_fn(move || {
            let start = next_bit(row, x, self.width, true)?;
            let end = next_bit(row, start, self.width, false).unwrap_or(self.width);
            x = end;
            Some((start, end))
        })
    }
}

/// The first bit at or after `from` that equals `value`.
fn next_bit(row: &[u64], from: usize, width: usize, value: bool) -> Option<usize> {
    let flip = if value { 0 } else { !0 };
    let mut word = from / 64;
    if from >= width {
        return None;
    }
    let mut bits = (row[word] ^ flip) & (!0 << (from % 64));
    loop {
        if bits != 0 {
            let found = word * 64 + bits.trailing_zeros() as usize;
            return (found < width).then_some(found);
        }
        word += 1;
        if word >= row.len() {
            return None;
        }
        bits = row[word] ^ flip;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_and_runs_agree() {
        let mut grid = BitGrid::new(200, 2);
        for (start, end) in [(0, 1), (3, 64), (64, 66), (100, 200)] {
            grid.set_span(1, start, end);
        }
        assert_eq!(grid.runs(1).collect::<Vec<_>>(), [(0, 1), (3, 66), (100, 200)]);
        assert_eq!(grid.runs(0).count(), 0);
        assert_eq!(grid.count(), 1 + 63 + 100);
        assert!(grid.get(199, 1) && !grid.get(2, 1) && !grid.get(5, 0));
    }

    #[test]
    fn coarser_cells_are_set_where_any_of_theirs_is() {
        let mut grid = BitGrid::new(7, 5);
        grid.set(6, 4);
        grid.set_span(0, 1, 3);
        let half = grid.coarser(2.0, 4, 3);
        assert_eq!(half.runs(0).collect::<Vec<_>>(), [(0, 2)]);
        assert_eq!(half.runs(1).count(), 0);
        assert_eq!(half.runs(2).collect::<Vec<_>>(), [(3, 4)]);
        // Texel 6..7 lies in 4..6 of cells 1.5 wide.
        assert_eq!(grid.coarser(1.5, 5, 4).runs(2).collect::<Vec<_>>(), [(4, 5)]);
    }

    #[test]
    fn a_row_is_full_only_with_its_last_bit() {
        for width in [1, 63, 64, 65, 128, 130] {
            let mut grid = BitGrid::new(width, 1);
            grid.set_span(0, 0, width - 1);
            assert!(!grid.row_is_full(0));
            grid.set(width - 1, 0);
            assert!(grid.row_is_full(0), "{width}");
        }
    }
}
