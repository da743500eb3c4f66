//! Giving texels that nothing uses the colours of their neighbours, so that filtering near the
//! border of a chart finds no foreign background. Alpha stays as it is.

use super::bits::BitGrid;

/// Extends the known texels by `passes` texels in all eight directions; each new texel is the
/// mean of its neighbours that were known a pass before. `known` is extended alongside.
pub(crate) fn dilate(pixels: &mut [u8], channels: usize, known: &mut BitGrid, passes: usize) {
    let (width, height) = (known.width(), known.height());
    let mut found: Vec<(usize, [u8; 4])> = Vec::new();
    for _ in 0..passes {
        let before = known.clone();
        for y in 0..height {
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            for word in 0..before.row(y).len() {
                let spread =
                    rows.clone().fold(0, |spread, row| spread | widened(&before, row, word));
                let mut new = spread & !before.row(y)[word];
                if width < (word + 1) * 64 {
                    new &= (1u64 << (width % 64)) - 1;
                }
                known.row_mut(y)[word] |= new;
                while new != 0 {
                    let x = word * 64 + new.trailing_zeros() as usize;
                    new &= new - 1;
                    found.push((y * width + x, neighbours(pixels, channels, &before, x, y)));
                }
            }
        }
        if found.is_empty() {
            return;
        }
        for (texel, color) in found.drain(..) {
            pixels[texel * channels..][..3].copy_from_slice(&color[..3]);
        }
    }
}

/// A word of a row, each bit spread to its two neighbours.
fn widened(grid: &BitGrid, y: usize, word: usize) -> u64 {
    let row = grid.row(y);
    let here = row[word];
    let left = if word > 0 { row[word - 1] >> 63 } else { 0 };
    let right = row.get(word + 1).map_or(0, |next| next << 63);
    here | here << 1 | here >> 1 | left | right
}

/// The mean of the known among the eight neighbours; at least one is.
fn neighbours(pixels: &[u8], channels: usize, known: &BitGrid, x: usize, y: usize) -> [u8; 4] {
    let mut sums = [0u32; 4];
    let mut count = 0;
    for row in y.saturating_sub(1)..(y + 2).min(known.height()) {
        for column in x.saturating_sub(1)..(x + 2).min(known.width()) {
            if known.get(column, row) {
                count += 1;
                let texel = &pixels[(row * known.width() + column) * channels..][..channels];
                for (sum, value) in sums.iter_mut().zip(texel) {
                    *sum += u32::from(*value);
                }
            }
        }
    }
    sums.map(|sum| ((sum + count / 2) / count.max(1)) as u8)
}

/// Fills every unknown texel from coarser and coarser means of the known ones (push-pull).
pub(crate) fn fill_all(pixels: &mut [u8], channels: usize, known: &BitGrid) {
    let (width, height) = (known.width(), known.height());
    if (0..height).all(|y| known.row_is_full(y)) {
        return;
    }
    let half = [width.div_ceil(2), height.div_ceil(2)];
    let mut coarse = vec![0u8; half[0] * half[1] * channels];
    let mut coarse_known = BitGrid::new(half[0], half[1]);
    for y in 0..half[1] {
        for x in 0..half[0] {
            let mut sums = [0u32; 4];
            let mut count = 0;
            for row in 2 * y..(2 * y + 2).min(height) {
                for column in 2 * x..(2 * x + 2).min(width) {
                    if known.get(column, row) {
                        count += 1;
                        let texel = &pixels[(row * width + column) * channels..][..channels];
                        for (sum, value) in sums.iter_mut().zip(texel) {
                            *sum += u32::from(*value);
                        }
                    }
                }
            }
            if count != 0 {
                coarse_known.set(x, y);
                let texel = &mut coarse[(y * half[0] + x) * channels..][..channels];
                let mean = sums.map(|sum| (sum + count / 2) / count);
                for (value, mean) in texel.iter_mut().zip(mean) {
                    *value = mean as u8;
                }
            }
        }
    }
    if width > 1 || height > 1 {
        fill_all(&mut coarse, channels, &coarse_known);
    }
    for y in 0..height {
        if known.row_is_full(y) {
            continue;
        }
        for x in 0..width {
            if !known.get(x, y) {
                let from = (y / 2 * half[0] + x / 2) * channels;
                pixels[(y * width + x) * channels..][..3].copy_from_slice(&coarse[from..from + 3]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dilation_reaches_as_far_as_asked_and_no_further() {
        let (width, height) = (130, 20);
        let mut known = BitGrid::new(width, height);
        known.set(64, 10);
        let mut pixels = vec![0u8; width * height * 3];
        pixels[(10 * width + 64) * 3..][..3].copy_from_slice(&[9, 8, 7]);
        dilate(&mut pixels, 3, &mut known, 3);
        for y in 0..height {
            for x in 0..width {
                let near = x.abs_diff(64) <= 3 && y.abs_diff(10) <= 3;
                assert_eq!(known.get(x, y), near);
                let expected = if near { [9, 8, 7] } else { [0; 3] };
                assert_eq!(pixels[(y * width + x) * 3..][..3], expected);
            }
        }
    }

    #[test]
    fn filling_leaves_no_background_and_no_known_texel_changed() {
        let (width, height) = (21, 13);
        let mut known = BitGrid::new(width, height);
        let mut pixels = vec![0u8; width * height * 3];
        for (x, y) in [(0, 0), (20, 12), (7, 5)] {
            known.set(x, y);
            pixels[(y * width + x) * 3..][..3].copy_from_slice(&[200, 100, 50]);
        }
        fill_all(&mut pixels, 3, &known);
        assert!(pixels.chunks(3).all(|texel| texel == [200, 100, 50]));
    }

    #[test]
    fn nothing_known_is_left_alone() {
        let mut pixels = vec![3u8; 12];
        fill_all(&mut pixels, 3, &BitGrid::new(2, 2));
        dilate(&mut pixels, 3, &mut BitGrid::new(2, 2), 4);
        assert_eq!(pixels.len(), 12);
    }
}
