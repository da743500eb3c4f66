//! Looks up colours of an image between its texels.

use glam::{DVec2, Vec4};

use super::tiles::Tiles;
use crate::color;

/// An image's texels in linear light.
#[derive(Clone, Copy)]
pub(crate) struct Sampler<'a> {
    bytes: &'a [u8],
    channels: usize,
    order: Order<'a>,
    size: [usize; 2],
    /// The middle of the last texel from that of the first.
    last: DVec2,
    light: &'static [f32; 256],
}

/// The order of an image's texels.
#[derive(Clone, Copy)]
enum Order<'a> {
    /// Row by row, with so many bytes from one row to the next.
    Rows(usize),
    Tiles(&'a Tiles),
}

impl<'a> Sampler<'a> {
    /// Samples an image whose rows follow each other: `bytes` begin with its first texel, and there are `row` bytes
    /// from one row to the next.
    pub fn of_rows(bytes: &'a [u8], size: [usize; 2], channels: usize, row: usize) -> Self {
        Self::new(bytes, size, channels, Order::Rows(row))
    }

    /// Samples an image of tiles.
    pub fn of_tiles(tiles: &'a Tiles, size: [usize; 2]) -> Self {
        Self::new(tiles.texels(), size, tiles.channels(), Order::Tiles(tiles))
    }

    fn new(bytes: &'a [u8], size: [usize; 2], channels: usize, order: Order<'a>) -> Self {
        let last = DVec2::from(size.map(|side| side as f64 - 1.0));
        Self { bytes, channels, order, size, last, light: color::byte_to_light() }
    }

    /// The colour at a position in texels by bilinear sampling, linear light, 0–1, and 1; beyond
    /// the image its border texels go on.
    #[inline]
    pub fn at(&self, at: DVec2) -> Vec4 {
        let low = (at - 0.5).clamp(DVec2::ZERO, self.last);
        // As i32, to which and from which processors convert in one step.
        let [x, y] = [low.x as i32, low.y as i32];
        let [along, down] = [(low.x - f64::from(x)) as f32, (low.y - f64::from(y)) as f32];
        let [x, y] = [x as usize, y as usize];
        let [right, below] = [(x + 1).min(self.size[0] - 1), (y + 1).min(self.size[1] - 1)];
        let [one, two, three, four] = match self.window([x, right], [y, below]) {
            Some((first, row)) => {
                let (next, under) = (self.channels * (right - x), row * (below - y));
                [first, first + next, first + under, first + under + next]
            }
            None => [(x, y), (right, y), (x, below), (right, below)].map(|(x, y)| self.start(x, y)),
        };
        let mix = |start: usize, next: usize| {
            let (one, other) = (self.texel(start), self.texel(next));
            one + (other - one) * along
        };
        let (upper, lower) = (mix(one, two), mix(three, four));
        upper + (lower - upper) * down
    }

    /// Returns the colour at a position inside of an image that goes on at its other side along the axes where it
    /// `repeats`, linear light, 0–1, and 1.
    pub fn at_repeating(&self, at: DVec2, repeats: [bool; 2]) -> Vec4 {
        // Two texels, and the share of the second.
        let pair = |axis: usize| {
            let (size, low) = (self.size[axis], at[axis] - 0.5);
            if !repeats[axis] {
                let low = low.clamp(0.0, self.last[axis]);
                let first = low as usize;
                return (first, (first + 1).min(size - 1), (low - first as f64) as f32);
            }
            let second = (low.floor() + 1.0) as usize % size;
            ((second + size - 1) % size, second, (low - low.floor()) as f32)
        };
        let ((left, right, along), (top, bottom, down)) = (pair(0), pair(1));
        let mix = |row: usize| {
            let (one, other) =
                (self.texel(self.start(left, row)), self.texel(self.start(right, row)));
            one + (other - one) * along
        };
        let (upper, lower) = (mix(top), mix(bottom));
        upper + (lower - upper) * down
    }

    /// The mean of the square of two by two texels around a position, linear light, 0–1, and 1;
    /// beyond the image its border texels go on.
    #[inline]
    pub fn mean_at(&self, at: DVec2) -> Vec4 {
        let at = at.clamp(DVec2::ZERO, self.last + 0.999_999);
        let [x, y] = [at.x as i32, at.y as i32];
        let [along, down] = [(at.x - f64::from(x)) as f32, (at.y - f64::from(y)) as f32];
        let [x, y] = [x as usize, y as usize];
        let [left, above] = [x.saturating_sub(1), y.saturating_sub(1)];
        let [right, below] = [(x + 1).min(self.size[0] - 1), (y + 1).min(self.size[1] - 1)];
        match self.window([left, right], [above, below]) {
            Some((first, row)) => {
                let start =
                    |x: usize, y: usize| first + (y - above) * row + (x - left) * self.channels;
                self.mean([left, x, right], [above, y, below], [along, down], start)
            }
            None => {
                let start = |x, y| self.start(x, y);
                self.mean([left, x, right], [above, y, below], [along, down], start)
            }
        }
    }

    /// Returns the mean of a square of two by two texels that lies on three by three texels. `along` and `down` are
    /// the shares of the last column and row, those of the first are 1 less these.
    #[inline]
    fn mean(
        &self,
        [left, x, right]: [usize; 3],
        [above, y, below]: [usize; 3],
        [along, down]: [f32; 2],
        start: impl Fn(usize, usize) -> usize,
    ) -> Vec4 {
        let row = |y: usize| {
            let before = self.texel(start(left, y));
            before + (self.texel(start(right, y)) - before) * along + self.texel(start(x, y))
        };
        let (one, two) = (row(above), row(y));
        (one + (row(below) - one) * down + two) * 0.25
    }

    /// Returns where the first texel of a window begins, and the bytes from one of its rows to the next; `None` if
    /// it lies in several tiles. The window has a first and a last column and row.
    #[inline]
    fn window(&self, columns: [usize; 2], rows: [usize; 2]) -> Option<(usize, usize)> {
        let row = match self.order {
            Order::Rows(row) => row,
            Order::Tiles(tiles) => tiles.row_within(columns, rows)?,
        };
        Some((self.start(columns[0], rows[0]), row))
    }

    /// Returns where a texel begins.
    #[inline]
    fn start(&self, x: usize, y: usize) -> usize {
        match self.order {
            Order::Rows(row) => y * row + x * self.channels,
            Order::Tiles(tiles) => tiles.start(x, y),
        }
    }

    #[inline]
    fn texel(&self, start: usize) -> Vec4 {
        let texel = &self.bytes[start..start + 3];
        let [r, g, b] = [texel[0], texel[1], texel[2]].map(|byte| self.light[usize::from(byte)]);
        Vec4::new(r, g, b, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::texture::bits::BitGrid;
    use crate::texture::level::pyramid;
    use crate::texture::level::tests::image;
    use crate::texture::region::Region;

    #[test]
    fn wide_samples_are_means_of_two_by_two_texels_anywhere() {
        let source = image(9, 7, 3);
        let region = Region { origin: [0; 2], size: [9, 7], covered: None };
        let level = &pyramid(Arc::clone(&source), &region, 1.0)[0];
        let light = |x: f64, y: f64| {
            let texel = level.texels(y.clamp(0.0, 6.0) as usize, x.clamp(0.0, 8.0) as usize, 1);
            DVec2::from([0, 2].map(|c| f64::from(color::byte_to_light()[usize::from(texel[c])])))
        };
        for at in [[4.25, 3.75], [4.5, 3.0], [0.25, 0.5], [8.75, 6.5], [5.0, -2.0], [12.0, 3.5]] {
            let at = DVec2::from(at);
            // From beyond the image its border is seen.
            let near = at.clamp(DVec2::ZERO, DVec2::new(9.0, 7.0));
            let parts = (0..64).flat_map(|i| (0..64).map(move |j| (i, j)));
            let mean = parts
                .map(|(i, j)| {
                    let step = |part: i32| (f64::from(part) + 0.5) / 32.0 - 1.0;
                    light(near.x + step(i), near.y + step(j))
                })
                .sum::<DVec2>()
                / 4096.0;
            let found = level.sampler().mean_at(at);
            assert!((f64::from(found.x) - mean.x).abs() < 1e-4, "{at} {found} {mean}");
            assert!((f64::from(found.z) - mean.y).abs() < 1e-4, "{at} {found} {mean}");
        }
    }

    #[test]
    fn an_image_that_repeats_goes_on_at_its_other_side() {
        let source = image(5, 4, 3);
        let region = Region { origin: [0; 2], size: [5, 4], covered: None };
        let level = &pyramid(Arc::clone(&source), &region, 1.0)[0];
        let around = Region { origin: [-1, -1], size: [7, 6], covered: None };
        let around = &pyramid(source, &around, 1.0)[0];
        for (x, y) in (0..20).flat_map(|y| (0..25).map(move |x| (x, y))) {
            let at = DVec2::new(f64::from(x), f64::from(y)) * 0.2 + 0.01;
            let found = level.sampler().at_repeating(at, [true; 2]);
            let expected = around.sampler().at(at + 1.0);
            assert!((found - expected).abs().max_element() < 1e-6, "{at}: {found} {expected}");
            let clamped = level.sampler().at_repeating(at, [false; 2]);
            assert!((clamped - level.sampler().at(at)).abs().max_element() < 1e-6, "{at}");
        }
    }

    #[test]
    fn tiles_are_sampled_as_rows_are() {
        let source = image(120, 80, 3);
        let mut used = BitGrid::new(120, 80);
        (30..50).for_each(|y| used.set_span(y, 40, 70));
        let mut tiles = Tiles::around(&used, 2, 3).expect("little is used");
        source.pixels.chunks_exact(360).enumerate().for_each(|(y, row)| tiles.write_row(y, row));
        tiles.finish();
        let rows = Sampler::of_rows(&source.pixels, [120, 80], 3, 360);
        let tiles = Sampler::of_tiles(&tiles, [120, 80]);
        for (x, y) in (0..200).flat_map(|y| (0..300).map(move |x| (x, y))) {
            let at = DVec2::new(40.05 + 0.1 * f64::from(x), 30.05 + 0.1 * f64::from(y));
            assert_eq!(tiles.at(at), rows.at(at), "{at}");
            assert_eq!(tiles.mean_at(at), rows.mean_at(at), "{at}");
            assert_eq!(tiles.at_repeating(at, [true; 2]), rows.at_repeating(at, [true; 2]), "{at}");
        }
    }
}
