//! An image of which only tiles with used texels are kept: the charts that a block of a scan uses lie scattered
//! over large images.

use super::bits::BitGrid;
use crate::color;

/// Texels along each side of a tile; a power of two.
pub(crate) const SIDE: usize = 16;

/// If more than this share of the tiles is used, the image is kept whole, whose rows are read faster.
const MOST_KEPT: f64 = 0.75;

/// The tiles of an image that are kept. All other texels have the mean colour of these and are transparent.
#[derive(Clone, Debug)]
pub(crate) struct Tiles {
    channels: usize,
    /// The number of tiles in a row of tiles.
    columns: usize,
    /// By tile, row by row, its number among those that are kept, from 1 on; 0 if it is not kept.
    numbers: Vec<u32>,
    /// The texels of each tile that is kept, row by row.
    texels: Vec<u8>,
}

impl Tiles {
    /// Makes room for the tiles that have a texel within `reach` of a used one; `None` where these are
    /// nearly all.
    pub fn around(used: &BitGrid, reach: usize, channels: usize) -> Option<Self> {
        let columns = used.width().div_ceil(SIDE);
        let mut kept = BitGrid::new(columns, used.height().div_ceil(SIDE));
        for y in 0..used.height() {
            let rows = y.saturating_sub(reach) / SIDE..=(y + reach) / SIDE;
            let rows = *rows.start()..(rows.end() + 1).min(kept.height());
            for (start, end) in used.runs(y) {
                let first = start.saturating_sub(reach) / SIDE;
                let last = ((end - 1 + reach) / SIDE).min(columns - 1);
                rows.clone().for_each(|row| kept.set_span(row, first, last + 1));
            }
        }
        if kept.count() as f64 > MOST_KEPT * (columns * kept.height()) as f64 {
            return None;
        }
        let mut numbers = vec![0; columns * kept.height()];
        let mut count = 0;
        for row in 0..kept.height() {
            for column in kept.runs(row).flat_map(|(start, end)| start..end) {
                count += 1;
                numbers[row * columns + column] = count;
            }
        }
        let texels = vec![0; (count as usize + 1) * SIDE * SIDE * channels];
        Some(Self { channels, columns, numbers, texels })
    }

    /// Takes over the texels of a row of the image that are kept.
    pub fn write_row(&mut self, y: usize, row: &[u8]) {
        let numbers = &self.numbers[y / SIDE * self.columns..][..self.columns];
        for (&number, texels) in numbers.iter().zip(row.chunks(SIDE * self.channels)) {
            if number != 0 {
                let start = self.row_of(number, y);
                self.texels[start..start + texels.len()].copy_from_slice(texels);
            }
        }
    }

    /// Computes the colour of texels that are not kept, once all rows are written.
    pub fn finish(&mut self) {
        let (light, byte) = (color::byte_to_light(), color::linear_to_byte());
        let length = SIDE * SIDE * self.channels;
        let (others, kept) = self.texels.split_at_mut(length);
        // One texel of each tile is enough for a mean.
        let middle = (SIDE / 2 * SIDE + SIDE / 2) * self.channels;
        let count = (kept.len() / length).max(1) as f32;
        let mean: [u8; 3] = std::array::from_fn(|channel| {
            let values = kept.chunks_exact(length).map(|tile| tile[middle + channel]);
            let sum: f32 = values.map(|value| light[usize::from(value)]).sum();
            byte.of((sum / count * 65535.0) as u16)
        });
        for texel in others.chunks_exact_mut(self.channels) {
            texel[..3].copy_from_slice(&mean);
        }
    }

    /// Returns where a tile's part of a row of the image begins in `texels`.
    fn row_of(&self, number: u32, y: usize) -> usize {
        (number as usize * SIDE + y % SIDE) * SIDE * self.channels
    }

    /// Copies texels of a row, from `start` on, which must lie inside of the image.
    pub fn copy_row(&self, y: usize, start: usize, texels: &mut [u8]) {
        let numbers = &self.numbers[y / SIDE * self.columns..][..self.columns];
        let mut skipped = start % SIDE;
        let mut rest = texels;
        for &number in &numbers[start / SIDE..] {
            let count = (SIDE - skipped).min(rest.len() / self.channels);
            let (part, after) = rest.split_at_mut(count * self.channels);
            let from = self.row_of(number, y) + skipped * self.channels;
            part.copy_from_slice(&self.texels[from..from + part.len()]);
            if after.is_empty() {
                return;
            }
            (rest, skipped) = (after, 0);
        }
    }

    /// Returns the number of channels, 3 or 4.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Returns the bytes from one row to the next of a window with these first and last columns and rows; `None` if
    /// it lies in several tiles.
    #[inline]
    pub fn row_within(&self, columns: [usize; 2], rows: [usize; 2]) -> Option<usize> {
        let is_one = |[first, last]: [usize; 2]| first / SIDE == last / SIDE;
        (is_one(columns) && is_one(rows)).then_some(SIDE * self.channels)
    }

    /// Returns all texels. That of a column and row begins at [`start`](Self::start).
    pub fn texels(&self) -> &[u8] {
        &self.texels
    }

    /// Returns where a texel begins among all.
    #[inline]
    pub fn start(&self, x: usize, y: usize) -> usize {
        let number = self.numbers[y / SIDE * self.columns + x / SIDE];
        self.row_of(number, y) + x % SIDE * self.channels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn what_is_used_and_what_is_near_is_as_in_the_image() {
        let (width, height, channels, reach) = (203, 77, 3, 5);
        let mut random = Random::new(7, 0);
        let mut used = BitGrid::new(width, height);
        for _ in 0..4 {
            let (x, y) = (random.below(150), random.below(60));
            (y..y + 9).for_each(|y| used.set_span(y, x, x + 17));
        }
        let row = |y: usize| -> Vec<u8> {
            (0..width * channels).map(|i| ((i * 31 + y * 57) % 251) as u8).collect()
        };
        let mut tiles = Tiles::around(&used, reach, channels).expect("few are used");
        (0..height).for_each(|y| tiles.write_row(y, &row(y)));
        tiles.finish();
        assert!(tiles.texels().len() < width * height * channels / 2);
        let mut absent = 0;
        for y in 0..height {
            let expected = row(y);
            let mut all = vec![0; width * channels];
            tiles.copy_row(y, 0, &mut all);
            for x in 0..width {
                let texel = &all[x * channels..][..channels];
                assert_eq!(texel, &tiles.texels()[tiles.start(x, y)..][..channels]);
                let mut one = [0; 3];
                tiles.copy_row(y, x, &mut one);
                assert_eq!(texel, one);
                let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
                let mut rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
                if rows.any(|y| columns.clone().any(|x| used.get(x, y))) {
                    assert_eq!(texel, &expected[x * channels..][..channels], "{x} {y}");
                } else if texel != &expected[x * channels..][..channels] {
                    absent += 1;
                }
            }
        }
        assert!(absent > width * height / 2, "{absent}");
    }

    #[test]
    fn an_image_that_is_used_nearly_everywhere_is_kept_whole() {
        let mut used = BitGrid::new(64, 64);
        (0..52).for_each(|y| used.set_span(y, 0, 64));
        assert!(Tiles::around(&used, 0, 3).is_none());
    }
}
