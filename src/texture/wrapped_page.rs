//! A page whose opposite sides meet: what leaves it on the right comes back on the left, and
//! below at the top, as a repeating texture is sampled.
//!
//! Parts of a city end at parallel planes, so the sides of their charts are slanted alike. On
//! such a page one side's slant fills the other's.

use super::shape::Shape;

/// Most columns of a page: one machine word holds a row.
pub(crate) const MAX_COLUMNS: usize = 128;

/// A run of a shape: `length, row, start`.
type Run = (u32, u32, u32);

/// A shape as a page takes it.
#[derive(Debug)]
pub(crate) struct PageShape {
    pub size: [usize; 2],
    /// Longest first: these fail soonest.
    runs: Vec<Run>,
    tallest_row: u32,
}

impl PageShape {
    pub fn new(shape: &Shape) -> Self {
        let mut runs: Vec<Run> =
            shape.runs.iter().map(|[row, start, end]| (end - start, *row, *start)).collect();
        runs.sort_unstable_by_key(|(length, row, start)| (u32::MAX - length, *row, *start));
        let tallest_row = runs.iter().map(|(_, row, _)| *row).max().unwrap_or(0);
        Self { size: shape.size, runs, tallest_row }
    }
}

/// Occupied cells of a page whose sides meet.
pub(crate) struct WrappedPage {
    columns: u32,
    height: usize,
    /// The bits of a row that are cells.
    cells: u128,
    rows: Vec<u128>,
    /// The longest run of free cells of each row.
    gaps: Vec<u32>,
}

impl WrappedPage {
    /// An empty page; `columns` are 1 to [`MAX_COLUMNS`].
    pub fn new(columns: usize, height: usize) -> Self {
        let cells = !0 >> (MAX_COLUMNS - columns);
        let columns = columns as u32;
        Self { columns, height, cells, rows: vec![0; height], gaps: vec![columns; height] }
    }

    /// Bit `x` of the result is the cell `x + by` of the row.
    fn moved(&self, row: u128, by: u32) -> u128 {
        if by == 0 { row } else { (row >> by | row << (self.columns - by)) & self.cells }
    }

    /// The cells `start..start + length`, at most a whole row.
    fn span(&self, start: u32, length: u32) -> u128 {
        let bits = !0 >> (MAX_COLUMNS as u32 - length);
        let start = start % self.columns;
        if start == 0 {
            bits
        } else {
            (bits << start | bits >> (self.columns - start)) & self.cells
        }
    }

    /// Bit `x`: some cell of `x..x + length` is occupied.
    fn blocked(&self, row: usize, length: u32) -> u128 {
        let mut bits = self.rows[row];
        let mut reached = 1;
        while bits != 0 && reached < length {
            let by = reached.min(length - reached);
            bits |= self.moved(bits, by);
            reached += by;
        }
        bits
    }

    fn row(&self, y: usize, row: u32) -> usize {
        let row = y + row as usize;
        if row < self.height { row } else { row % self.height }
    }

    /// True where the shape, which may be larger than the page, does not meet itself on it.
    fn holds(&self, shape: &PageShape) -> bool {
        if shape.runs.first().is_some_and(|(longest, ..)| *longest > self.columns) {
            return false;
        }
        if shape.size[0] <= self.columns as usize && (shape.tallest_row as usize) < self.height {
            return true;
        }
        let mut own = vec![0; self.height];
        shape.runs.iter().all(|(length, row, start)| {
            let bits = self.span(*start, *length);
            let own = &mut own[*row as usize % self.height];
            let free = *own & bits == 0;
            *own |= bits;
            free
        })
    }

    /// The first row above `limit`, then leftmost column, where the shape fits.
    pub fn find(&self, shape: &PageShape, limit: usize) -> Option<[usize; 2]> {
        if !self.holds(shape) {
            return None;
        }
        (0..limit.min(self.height)).find_map(|y| {
            if shape.runs.iter().any(|(length, row, _)| *length > self.gaps[self.row(y, *row)]) {
                return None;
            }
            let mut blocked = 0;
            for (length, row, start) in &shape.runs {
                let row = self.blocked(self.row(y, *row), *length);
                blocked |= self.moved(row, *start % self.columns);
                if blocked == self.cells {
                    return None;
                }
            }
            Some([(!blocked).trailing_zeros() as usize, y])
        })
    }

    /// Occupies the shape's cells at a position that [`find`](Self::find) gave.
    pub fn put(&mut self, shape: &PageShape, [x, y]: [usize; 2]) {
        for (length, row, start) in &shape.runs {
            let row = self.row(y, *row);
            self.rows[row] |= self.span(x as u32 + start, *length);
        }
        for row in 0..self.height.min(shape.tallest_row as usize + 1) {
            let row = self.row(y, row as u32);
            self.gaps[row] = self.gap(row);
        }
    }

    /// The longest run of free cells of a row.
    fn gap(&self, row: usize) -> u32 {
        let free = !self.rows[row] & self.cells;
        if free == self.cells {
            return self.columns;
        }
        // By power of two: where runs of that length begin.
        let mut begins = [free; 8];
        for power in 1..begins.len() {
            let shorter = begins[power - 1];
            begins[power] = if 1 << power < self.columns {
                shorter & self.moved(shorter, 1 << (power - 1))
            } else {
                0
            };
        }
        let mut longest = 0;
        let mut starts = self.cells;
        for (power, begins) in begins.iter().enumerate().rev() {
            let longer = starts & self.moved(*begins, longest % self.columns);
            if longer != 0 {
                starts = longer;
                longest += 1 << power;
            }
        }
        longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of `width` cells, each one further to the right.
    fn slanted(width: u32, height: u32) -> Shape {
        Shape {
            size: [(width + height - 1) as usize, height as usize],
            runs: (0..height).map(|row| [row, row, row + width]).collect(),
        }
    }

    #[test]
    fn slanted_shapes_fill_a_page_whose_sides_meet() {
        for columns in [1, 7, 63, 64, 100, 127, 128] {
            let mut page = WrappedPage::new(columns, 10);
            let half = PageShape::new(&slanted(columns as u32, 5));
            assert_eq!(page.find(&half, 10), Some([0, 0]));
            page.put(&half, [0, 0]);
            assert_eq!(page.find(&half, 5), None);
            assert_eq!(page.find(&half, 10), Some([0, 5]));
            page.put(&half, [0, 5]);
            assert!(page.rows.iter().all(|row| *row == page.cells));
            assert!(page.gaps.iter().all(|gap| *gap == 0));
        }
    }

    #[test]
    fn what_would_meet_itself_is_refused() {
        let page = WrappedPage::new(6, 4);
        assert_eq!(page.find(&PageShape::new(&slanted(7, 1)), 4), None);
        assert_eq!(page.find(&PageShape::new(&slanted(4, 4)), 4), Some([0, 0]));
        // Row 4 comes back to row 0, four cells further to the right.
        assert_eq!(page.find(&PageShape::new(&slanted(3, 5)), 4), None);
        assert_eq!(page.find(&PageShape::new(&slanted(2, 5)), 4), Some([0, 0]));
    }

    #[test]
    fn runs_and_gaps_go_over_the_side() {
        let mut page = WrappedPage::new(10, 1);
        let three = PageShape::new(&slanted(3, 1));
        page.put(&three, [8, 0]);
        assert_eq!(page.rows[0], 0b11_0000_0001);
        assert_eq!(page.gaps[0], 7);
        assert_eq!(page.find(&PageShape::new(&slanted(7, 1)), 1), Some([1, 0]));
        assert_eq!(page.find(&PageShape::new(&slanted(8, 1)), 1), None);
    }
}
