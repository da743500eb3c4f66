//! Giving texels that nothing uses the colours of their neighbours, so that filtering near the
//! border of a chart finds no foreign background. Alpha stays as it is.

use super::bits::BitGrid;

/// Texels in rows that may be part of a larger image's.
pub(crate) struct Texels<'a> {
    pub pixels: &'a mut [u8],
    pub channels: usize,
    /// Texels from one row to the next.
    pub stride: usize,
    /// Of the first texel.
    pub origin: [usize; 2],
}

impl Texels<'_> {
    fn at(&self, x: usize, y: usize) -> usize {
        ((y + self.origin[1]) * self.stride + x + self.origin[0]) * self.channels
    }

    /// Gives `start..end` of a row the colour of one texel.
    fn repeat(&mut self, y: usize, start: usize, end: usize, from: usize) {
        let from = self.at(from, y);
        let color = [self.pixels[from], self.pixels[from + 1], self.pixels[from + 2]];
        let (start, end) = (self.at(start, y), self.at(end, y));
        for texel in self.pixels[start..end].chunks_exact_mut(self.channels) {
            texel[..3].copy_from_slice(&color);
        }
    }

    /// Copies the colours of `start..end` of a row to another row.
    fn copy(&mut self, from: usize, to: usize, start: usize, end: usize) {
        let (from, to) = (self.at(start, from), self.at(start, to));
        let length = (end - start) * self.channels;
        if self.channels == 3 {
            self.pixels.copy_within(from..from + length, to);
            return;
        }
        for texel in (0..length).step_by(self.channels) {
            self.pixels.copy_within(from + texel..from + texel + 3, to + texel);
        }
    }
}

/// Extends the colours of the known texels by `reach` texels along both axes: each new texel is
/// like the nearest known one of its row, or where its row has none so near, of its column.
pub(crate) fn extend(texels: &mut Texels, known: &BitGrid, reach: usize) {
    let (width, height) = (known.width(), known.height());
    let mut known = known.clone();
    let mut open = Vec::new();
    let mut gaps = Vec::new();
    for y in 0..height {
        if known.row_is_full(y) {
            continue;
        }
        gaps.clear();
        let mut before = 0;
        for (start, end) in known.runs(y).chain([(width, width)]) {
            if start > before && (before > 0 || start < width) {
                gaps.push((before, start));
            }
            before = end;
        }
        for &(start, end) in &gaps {
            let from_left = if start == 0 { 0 } else { reach };
            let from_right = if end == width { 0 } else { reach };
            let half = (end - start) / 2;
            let left = from_left.min(if from_right == 0 { end - start } else { half });
            let right = from_right.min(end - start - left);
            if left > 0 {
                texels.repeat(y, start, start + left, start - 1);
            }
            if right > 0 {
                texels.repeat(y, end - right, end, end);
            }
            known.set_span(y, start, start + left);
            known.set_span(y, end - right, end);
        }
        if !known.row_is_full(y) {
            open.push(y);
        }
    }
    let mut found: Vec<(usize, usize, u64, u64)> = Vec::new();
    for _ in 0..reach {
        for &y in &open {
            for (word, here) in known.row(y).iter().enumerate() {
                let above = if y > 0 { known.row(y - 1)[word] } else { 0 } & !here;
                let below = if y + 1 < height { known.row(y + 1)[word] } else { 0 } & !here;
                if above | below != 0 {
                    found.push((y, word, above, below & !above));
                }
            }
        }
        if found.is_empty() {
            return;
        }
        for (y, word, above, below) in found.drain(..) {
            for (start, end) in runs_of(above) {
                texels.copy(y - 1, y, word * 64 + start, word * 64 + end);
            }
            for (start, end) in runs_of(below) {
                texels.copy(y + 1, y, word * 64 + start, word * 64 + end);
            }
            known.row_mut(y)[word] |= above | below;
        }
    }
}

/// The runs of set bits of a word, from the lowest.
fn runs_of(mut bits: u64) -> impl Iterator<Item = (usize, usize)> {
    std::iter::from_fn(move || {
        if bits == 0 {
            return None;
        }
        let start = bits.trailing_zeros();
        let length = (bits >> start).trailing_ones();
        let end = start + length;
        bits &= if end == 64 { 0 } else { !0 << end };
        Some((start as usize, end as usize))
    })
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

    fn extended(pixels: &mut [u8], known: &BitGrid, reach: usize) {
        let stride = known.width();
        extend(&mut Texels { pixels, channels: 3, stride, origin: [0; 2] }, known, reach);
    }

    #[test]
    fn colours_reach_as_far_as_asked_and_no_further() {
        let (width, height) = (130, 20);
        let mut known = BitGrid::new(width, height);
        known.set(64, 10);
        let mut pixels = vec![0u8; width * height * 3];
        pixels[(10 * width + 64) * 3..][..3].copy_from_slice(&[9, 8, 7]);
        extended(&mut pixels, &known, 3);
        for y in 0..height {
            for x in 0..width {
                let near = x.abs_diff(64) <= 3 && y.abs_diff(10) <= 3;
                let expected = if near { [9, 8, 7] } else { [0; 3] };
                assert_eq!(pixels[(y * width + x) * 3..][..3], expected);
            }
        }
    }

    #[test]
    fn between_two_the_nearer_wins() {
        for transposed in [false, true] {
            let at = |along: usize| if transposed { (0, along) } else { (along, 0) };
            let [width, height] = if transposed { [1, 200] } else { [200, 1] };
            let mut known = BitGrid::new(width, height);
            let mut pixels = vec![0u8; 600];
            for (along, color) in [(100, 50), (107, 90)] {
                known.set(at(along).0, at(along).1);
                pixels[along * 3..][..3].fill(color);
            }
            extended(&mut pixels, &known, 5);
            let found: Vec<u8> = pixels.iter().copied().step_by(3).collect();
            assert_eq!(found[94..114], [&[0][..], &[50; 9], &[90; 9], &[0]].concat());
        }
    }

    #[test]
    fn a_part_of_an_image_leaves_the_rest_and_its_alpha_alone() {
        let mut pixels = [7, 7, 7, 1].repeat(8 * 8);
        let mut known = BitGrid::new(4, 4);
        known.set(0, 0);
        let texels = &mut Texels { pixels: &mut pixels, channels: 4, stride: 8, origin: [2, 3] };
        texels.pixels[(3 * 8 + 2) * 4..][..4].copy_from_slice(&[50, 60, 70, 80]);
        extend(texels, &known, 9);
        for (index, texel) in pixels.as_chunks::<4>().0.iter().enumerate() {
            let (x, y) = (index % 8, index / 8);
            let inside = (2..6).contains(&x) && (3..7).contains(&y);
            let alpha = if (x, y) == (2, 3) { 80 } else { 1 };
            let color = if inside { [50, 60, 70] } else { [7; 3] };
            assert_eq!(*texel, [color[0], color[1], color[2], alpha], "{x} {y}");
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
        extended(&mut pixels, &BitGrid::new(2, 2), 4);
        assert_eq!(pixels.len(), 12);
    }
}
