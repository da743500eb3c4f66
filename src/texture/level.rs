//! The part of a texture that a block uses, at the resolution of each level.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::bits::BitGrid;
use super::fill::{self, Texels};
use super::region::{REACH, Region, RegionRows};
use super::sampler::Sampler;
use super::scale::{self, LinearImage, Rows, Weights};
use super::tiles::Tiles;
use crate::color;
use crate::decode::DecodedTexture;

/// A region at one level's resolution.
#[derive(Clone, Debug)]
pub(crate) struct LevelImage {
    /// Columns and rows.
    pub size: [usize; 2],
    /// 3 or 4.
    pub channels: usize,
    /// Source texels per texel; exact.
    pub step: f64,
    pixels: Pixels,
}

#[derive(Clone, Debug)]
enum Pixels {
    /// The source's own, from this column and row on.
    Source(Arc<DecodedTexture>, [usize; 2]),
    Own(Vec<u8>),
    /// Only tiles with used texels, of an image of which much is not used.
    Used(Tiles),
}

impl LevelImage {
    /// Copies texels of a row, from `start` on, which must lie inside of the image.
    pub fn copy_row(&self, y: usize, start: usize, texels: &mut [u8]) {
        match &self.pixels {
            Pixels::Source(image, [left, top]) => {
                let first = ((y + top) * image.width as usize + left + start) * self.channels;
                texels.copy_from_slice(&image.pixels[first..first + texels.len()]);
            }
            Pixels::Own(pixels) => {
                let first = (y * self.size[0] + start) * self.channels;
                texels.copy_from_slice(&pixels[first..first + texels.len()]);
            }
            Pixels::Used(tiles) => tiles.copy_row(y, start, texels),
        }
    }

    /// Returns `count` texels of a row, from `start` on.
    #[cfg(test)]
    pub fn texels(&self, y: usize, start: usize, count: usize) -> Vec<u8> {
        let mut texels = vec![0; count * self.channels];
        self.copy_row(y, start, &mut texels);
        texels
    }

    /// Returns the texels of a row. They are copied to `copy` if they do not lie side by side.
    fn row<'a>(&'a self, y: usize, copy: &'a mut Vec<u8>) -> &'a [u8] {
        let bytes = self.size[0] * self.channels;
        match &self.pixels {
            Pixels::Source(image, [left, top]) => {
                let first = ((y + top) * image.width as usize + left) * self.channels;
                &image.pixels[first..first + bytes]
            }
            Pixels::Own(pixels) => &pixels[y * bytes..(y + 1) * bytes],
            Pixels::Used(tiles) => {
                copy.resize(bytes, 0);
                tiles.copy_row(y, 0, copy);
                copy
            }
        }
    }

    /// An image of these bytes.
    pub fn own(size: [usize; 2], channels: usize, step: f64, pixels: Vec<u8>) -> Self {
        Self { size, channels, step, pixels: Pixels::Own(pixels) }
    }

    /// The image, to be sampled many times.
    pub fn sampler(&self) -> Sampler<'_> {
        let (bytes, width, [x, y]) = match &self.pixels {
            Pixels::Source(image, offset) => (&image.pixels[..], image.width as usize, *offset),
            Pixels::Own(pixels) => (&pixels[..], self.size[0], [0; 2]),
            Pixels::Used(tiles) => return Sampler::of_tiles(tiles, self.size),
        };
        let (texel, row) = (self.channels, width * self.channels);
        Sampler::of_rows(&bytes[y * row + x * texel..], self.size, texel, row)
    }

    /// The mean colour, linear light, 0–1.
    pub fn mean(&self) -> Vec3 {
        let light = color::byte_to_light();
        let [width, height] = self.size;
        let mut sum = DVec3::ZERO;
        let mut copy = Vec::new();
        for y in 0..height {
            for texel in self.row(y, &mut copy).chunks_exact(self.channels) {
                let of = |channel: usize| light[usize::from(texel[channel])];
                sum += Vec3::new(of(0), of(1), of(2)).as_dvec3();
            }
        }
        (sum / (width * height) as f64).as_vec3()
    }

    /// The same at half the resolution.
    pub fn halved(&self) -> Self {
        let step = 2.0 * self.step;
        if self.channels != 3 {
            return self.at_step(step);
        }
        let size = self.size.map(|side| side.div_ceil(2));
        Self { size, channels: 3, step, pixels: Pixels::Own(self.halved_rgb()) }
    }

    /// Returns the image with texels that are `step` source texels wide, no fewer than now.
    pub fn at_step(&self, step: f64) -> Self {
        let image = scale::area(&mut ImageRows::of(self), [step / self.step; 2]);
        let (size, pixels) = ([image.width, image.height], bytes(&image, self.channels));
        Self { size, channels: self.channels, step, pixels: Pixels::Own(pixels) }
    }

    /// Means of two by two texels in linear light; where a side is odd, of what there is.
    fn halved_rgb(&self) -> Vec<u8> {
        let (linear, byte) = (color::byte_to_linear(), color::linear_to_byte());
        let light = |value: u8| u32::from(linear[usize::from(value)]);
        let [width, height] = self.size;
        let columns = width.div_ceil(2);
        let mut pixels = vec![0; columns * height.div_ceil(2) * 3];
        let mut copies = [Vec::new(), Vec::new()];
        for (index, result) in pixels.chunks_exact_mut(columns * 3).enumerate() {
            let (y, below) = (2 * index, (2 * index + 1).min(height - 1));
            let [copy, copy_below] = &mut copies;
            let (upper, last) = self.row(y, copy).as_chunks::<6>();
            let (lower, last_lower) = self.row(below, copy_below).as_chunks::<6>();
            let (texels, last_texel) = result.split_at_mut(upper.len() * 3);
            for ((texel, upper), lower) in
                texels.as_chunks_mut::<3>().0.iter_mut().zip(upper).zip(lower)
            {
                for channel in 0..3 {
                    let sum = light(upper[channel])
                        + light(upper[channel + 3])
                        + light(lower[channel])
                        + light(lower[channel + 3]);
                    texel[channel] = byte.of(((sum + 2) >> 2) as u16);
                }
            }
            for ((value, upper), lower) in last_texel.iter_mut().zip(last).zip(last_lower) {
                *value = byte.of(((light(*upper) + light(*lower) + 1) >> 1) as u16);
            }
        }
        pixels
    }

    /// Extends the used texels of an image that is its own, and lets go of what is far from them.
    fn keep_used(&mut self, used: &BitGrid) {
        let Pixels::Own(pixels) = &mut self.pixels else { return };
        let (channels, stride) = (self.channels, self.size[0]);
        fill::extend(&mut Texels { pixels, channels, stride, origin: [0; 2] }, used, REACH);
        if let Some(mut tiles) = Tiles::around(used, REACH, channels) {
            let rows = pixels.chunks_exact(stride * channels);
            rows.enumerate().for_each(|(y, row)| tiles.write_row(y, row));
            tiles.finish();
            self.pixels = Pixels::Used(tiles);
        }
    }
}

/// The bytes of a scaled image. Where nothing was opaque, colours come from around.
fn bytes(image: &LinearImage, channels: usize) -> Vec<u8> {
    let mut pixels = if channels == 4 { image.to_rgba8() } else { image.to_rgb8() };
    if !image.weight.is_empty() {
        let mut known = BitGrid::new(image.width, image.height);
        for y in 0..image.height {
            for x in 0..image.width {
                if image.weight[y * image.width + x] > 0 {
                    known.set(x, y);
                }
            }
        }
        fill::fill_all(&mut pixels, channels, &known);
    }
    pixels
}

/// Makes the image of a region and its halves, down to texels that are `most` source texels wide. The coarsest
/// comes first.
///
/// Unused texels near used ones take the colours of these first, so that no mean mixes in a foreign one. If most
/// texels are neither used nor near used ones, these are not kept.
pub(crate) fn pyramid(image: Arc<DecodedTexture>, region: &Region, most: f64) -> Vec<LevelImage> {
    let mut levels = vec![source_level(image, region)];
    let mut used = region.covered.clone();
    while let Some(finer) = levels.last()
        && 2.0 * finer.step <= most * (1.0 + 1e-9)
        && finer.size != [1; 2]
    {
        let mut level = finer.halved();
        if let Some(used) = &mut used {
            *used = used.coarser(2.0, level.size[0], level.size[1]);
            level.keep_used(used);
        }
        levels.push(level);
    }
    levels.reverse();
    levels
}

/// The region at full resolution: the source's texels as they are, unused ones near used ones
/// replaced by their neighbours' colours.
fn source_level(image: Arc<DecodedTexture>, region: &Region) -> LevelImage {
    let channels = usize::from(image.channels);
    let level = |pixels| LevelImage { size: region.size, channels, step: 1.0, pixels };
    if let Some(origin) = region.first_if_shared(&image) {
        return level(Pixels::Source(image, origin));
    }
    let mut rows = RegionRows::new(&image, region);
    let tiles = region.covered.as_ref().and_then(|used| Tiles::around(used, REACH, channels));
    if let Some(mut tiles) = tiles {
        (0..region.size[1]).for_each(|y| tiles.write_row(y, rows.row(y)));
        tiles.finish();
        return level(Pixels::Used(tiles));
    }
    let mut pixels = Vec::with_capacity(region.size[0] * region.size[1] * channels);
    (0..region.size[1]).for_each(|y| pixels.extend_from_slice(rows.row(y)));
    level(Pixels::Own(pixels))
}

/// Rows of a level image for the scaler.
struct ImageRows<'a> {
    image: &'a LevelImage,
    copy: Vec<u8>,
}

impl<'a> ImageRows<'a> {
    fn of(image: &'a LevelImage) -> Self {
        Self { image, copy: Vec::new() }
    }
}

impl Rows for ImageRows<'_> {
    fn size(&self) -> [usize; 2] {
        self.image.size
    }

    fn weighted(&self) -> bool {
        self.image.channels == 4
    }

    fn read(&mut self, y: usize, rgb: &mut [u16], weight: &mut [u16]) -> Weights {
        let table = color::byte_to_linear();
        let row = self.image.row(y, &mut self.copy);
        if self.image.channels == 3 {
            for (value, byte) in rgb.iter_mut().zip(row) {
                *value = table[usize::from(*byte)];
            }
            return Weights::Full;
        }
        // Alpha is the weight: what is transparent has no colour to give.
        let texels = rgb.as_chunks_mut::<3>().0.iter_mut().zip(weight);
        for (source, (texel, weight)) in row.as_chunks::<4>().0.iter().zip(texels) {
            let alpha = u32::from(source[3]);
            *weight = (alpha * 257) as u16;
            for channel in 0..3 {
                let linear = u32::from(table[usize::from(source[channel])]);
                texel[channel] = ((linear * alpha + 127) / 255) as u16;
            }
        }
        Weights::Mixed
    }
}

/// A whole image at another size, for repeating textures.
pub(crate) fn resize_whole(image: &Arc<DecodedTexture>, size: [usize; 2]) -> DecodedTexture {
    let whole = [image.width as usize, image.height as usize];
    let channels = usize::from(image.channels);
    let view = LevelImage {
        size: whole,
        channels,
        step: 1.0,
        pixels: Pixels::Source(Arc::clone(image), [0, 0]),
    };
    let step = [0, 1].map(|axis| whole[axis] as f64 / size[axis] as f64);
    let resized = scale::area(&mut ImageRows::of(&view), step);
    DecodedTexture {
        width: resized.width as u32,
        height: resized.height as u32,
        channels: image.channels,
        pixels: bytes(&resized, channels),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Makes an image whose bytes differ from their neighbours.
    pub fn image(width: usize, height: usize, channels: u8) -> Arc<DecodedTexture> {
        let pixels =
            (0..width * height * usize::from(channels)).map(|i| (i * 7 % 251) as u8).collect();
        Arc::new(DecodedTexture { width: width as u32, height: height as u32, channels, pixels })
    }

    #[test]
    fn the_finest_level_is_the_source_itself() {
        let source = image(16, 9, 3);
        let region = Region { origin: [3, 2], size: [10, 5], covered: None };
        let levels = pyramid(Arc::clone(&source), &region, 4.0);
        let finest = &levels[2];
        assert_eq!(finest.texels(4, 1, 3), &source.pixels[(6 * 16 + 4) * 3..][..9]);
        assert_eq!(levels[1].size, [5, 3]);
        assert_eq!(levels[0].size, [3, 2]);
        let between = finest.at_step(1.3);
        assert_eq!((between.size, between.step), ([8, 4], 1.3));
    }

    #[test]
    fn a_region_over_the_border_wraps() {
        let source = image(16, 9, 3);
        let region = Region { origin: [-2, 7], size: [20, 4], covered: None };
        let level = &pyramid(Arc::clone(&source), &region, 1.0)[0];
        assert_eq!(level.texels(0, 0, 1), &source.pixels[(7 * 16 + 14) * 3..][..3]);
        assert_eq!(level.texels(2, 18, 1), &source.pixels[..3]);
    }

    #[test]
    fn black_background_does_not_reach_any_level() {
        let mut source =
            DecodedTexture { width: 64, height: 64, channels: 3, pixels: vec![0; 64 * 64 * 3] };
        let mut covered = BitGrid::new(64, 64);
        for y in 0..64 {
            for x in 0..64 {
                if (x * x + y * y) < 50 * 50 {
                    covered.set(x, y);
                    source.pixels[(y * 64 + x) * 3..][..3].copy_from_slice(&[180, 90, 40]);
                }
            }
        }
        let region = Region { origin: [0; 2], size: [64; 2], covered: Some(covered) };
        // Colours are extended by sixteen texels along one axis, which are as many or more on the diagonal. Of an
        // image that is scaled by 1.5, two thirds of them are left.
        let halves = pyramid(Arc::new(source), &region, 16.0);
        let between: Vec<LevelImage> =
            halves.iter().map(|level| level.at_step(1.5 * level.step)).collect();
        let halves = halves.iter().map(|level| (level, 16.0));
        for (level, reach) in halves.chain(between.iter().map(|level| (level, 10.0))) {
            for y in 0..level.size[1] {
                for (x, texel) in level.texels(y, 0, level.size[0]).chunks(3).enumerate() {
                    let distance = (x as f64).hypot(y as f64) - 50.0 / level.step;
                    if distance < reach {
                        assert!(texel[0].abs_diff(180) <= 1 && texel[1].abs_diff(90) <= 1);
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_far_from_all_that_is_used_is_not_kept() {
        let source = image(500, 300, 3);
        let mut used = BitGrid::new(500, 300);
        (100..150).for_each(|y| used.set_span(y, 200, 270));
        let region = |covered| Region { origin: [0; 2], size: [500, 300], covered };
        let whole = pyramid(Arc::clone(&source), &region(None), 4.0);
        let part = pyramid(source, &region(Some(used)), 4.0);
        for (whole, part) in whole.iter().zip(&part) {
            assert!(matches!(part.pixels, Pixels::Used(_)));
            let at = |side: f64| (side / part.step) as usize;
            for y in at(104.0)..at(144.0) {
                let [start, end] = [at(204.0), at(264.0)];
                assert_eq!(part.texels(y, start, end - start), whole.texels(y, start, end - start));
            }
        }
    }

    #[test]
    fn halves_are_means_in_linear_light_and_odd_sides_average_what_there_is() {
        let checker = (0..48).flat_map(|i| [if (i % 8 + i / 8) % 2 == 0 { 255 } else { 0 }; 3]);
        let [width, height] = [8, 6];
        let source = DecodedTexture { width, height, channels: 3, pixels: checker.collect() };
        let region = Region { origin: [0; 2], size: [8, 6], covered: None };
        let level = &pyramid(Arc::new(source), &region, 2.0)[0];
        assert!((0..3).all(|y| level.texels(y, 0, 4).iter().all(|byte| *byte == 188)));

        let pixels = [[0; 3], [255; 3], [9; 3]].concat();
        let odd = DecodedTexture { width: 3, height: 1, channels: 3, pixels };
        let region = Region { origin: [0; 2], size: [3, 1], covered: None };
        let level = &pyramid(Arc::new(odd), &region, 2.0)[0];
        assert_eq!(
            (level.size, &level.texels(0, 0, 2)[..]),
            ([2, 1], &[188, 188, 188, 9, 9, 9][..])
        );
    }

    #[test]
    fn transparent_texels_give_no_colour() {
        let pixels = [[200, 100, 50, 255], [0, 0, 0, 0]].concat().repeat(32);
        let source = Arc::new(DecodedTexture { width: 8, height: 8, channels: 4, pixels });
        let region = Region { origin: [0; 2], size: [8; 2], covered: None };
        let level = &pyramid(source, &region, 2.0)[0];
        assert!(level.texels(1, 0, 4).chunks(4).all(|texel| texel[0].abs_diff(200) <= 1
            && texel[2].abs_diff(50) <= 1
            && texel[3].abs_diff(128) <= 1));
    }

    #[test]
    fn whole_images_get_exactly_the_size_asked_for() {
        let resized = resize_whole(&image(75, 50, 3), [37, 25]);
        assert_eq!((resized.width, resized.height), (37, 25));
        assert_eq!(resized.pixels.len(), 37 * 25 * 3);
    }
}
