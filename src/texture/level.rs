//! The part of a texture that a block uses, at the resolution of each level.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3, Vec4};

use super::bits::BitGrid;
use super::fill::{self, Texels};
use super::scale::{self, LinearImage, Rows, Weights};
use crate::color;
use crate::decode::DecodedTexture;

/// How far, in texels, used texels are extended into unused ones at every level: no block of a
/// JPEG (16 a side, with half the colour resolution) that holds a used texel holds a foreign one,
/// and atlases copy less around a chart (half a cell of reach and the rest of the last cell).
const REACH: usize = 16;

/// Which texels of a texture a block uses.
#[derive(Debug)]
pub(crate) struct Region {
    /// First column and row; outside 0..size where charts cross the image's border.
    pub origin: [i64; 2],
    /// Columns and rows, at least 1.
    pub size: [usize; 2],
    /// The texels that some triangle uses; `None` where it is (nearly) all of them.
    pub covered: Option<BitGrid>,
}

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

/// An image's texels in linear light.
#[derive(Clone, Copy)]
pub(crate) struct Sampler<'a> {
    /// From the first texel on.
    bytes: &'a [u8],
    channels: usize,
    /// Bytes from one row to the next.
    row: usize,
    size: [usize; 2],
    /// The middle of the last texel from that of the first.
    last: DVec2,
    light: &'static [f32; 256],
}

impl Sampler<'_> {
    /// The colour at a position in texels by bilinear sampling, linear light, 0–1, and 1; beyond
    /// the image its border texels go on.
    #[inline]
    pub fn at(&self, at: DVec2) -> Vec4 {
        let low = (at - 0.5).clamp(DVec2::ZERO, self.last);
        // As i32, to which and from which processors convert in one step.
        let [x, y] = [low.x as i32, low.y as i32];
        let [along, down] = [(low.x - f64::from(x)) as f32, (low.y - f64::from(y)) as f32];
        let [x, y] = [x as usize, y as usize];
        let next = if x + 1 < self.size[0] { self.channels } else { 0 };
        let below = if y + 1 < self.size[1] { self.row } else { 0 };
        let first = y * self.row + x * self.channels;
        let mix = |start: usize| {
            let (one, other) = (self.texel(start), self.texel(start + next));
            one + (other - one) * along
        };
        let (upper, lower) = (mix(first), mix(first + below));
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
            let texel = |column: usize| self.texel(row * self.row + column * self.channels);
            let (one, other) = (texel(left), texel(right));
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
        let middle = y * self.row + x * self.channels;
        let left = if x > 0 { self.channels } else { 0 };
        let right = if x + 1 < self.size[0] { self.channels } else { 0 };
        let above = if y > 0 { self.row } else { 0 };
        let below = if y + 1 < self.size[1] { self.row } else { 0 };
        let row = |start: usize| {
            let (one, two) = (self.texel(start - left), self.texel(start));
            one + (self.texel(start + right) - one) * along + two
        };
        let (one, two) = (row(middle - above), row(middle));
        (one + (row(middle + below) - one) * down + two) * 0.25
    }

    #[inline]
    fn texel(&self, start: usize) -> Vec4 {
        let texel = &self.bytes[start..start + 3];
        let [r, g, b] = [texel[0], texel[1], texel[2]].map(|byte| self.light[usize::from(byte)]);
        Vec4::new(r, g, b, 1.0)
    }
}

#[derive(Clone, Debug)]
enum Pixels {
    /// The source's own, from this column and row on.
    Source(Arc<DecodedTexture>, [usize; 2]),
    Own(Vec<u8>),
}

impl LevelImage {
    /// `start..start + count` of a row; the caller keeps to the size.
    pub fn row(&self, y: usize, start: usize, count: usize) -> &[u8] {
        let (pixels, width, x, y) = match &self.pixels {
            Pixels::Source(image, offset) => {
                (&image.pixels, image.width as usize, start + offset[0], y + offset[1])
            }
            Pixels::Own(pixels) => (pixels, self.size[0], start, y),
        };
        &pixels[(y * width + x) * self.channels..][..count * self.channels]
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
        };
        Sampler {
            bytes: &bytes[(y * width + x) * self.channels..],
            channels: self.channels,
            row: width * self.channels,
            size: self.size,
            last: DVec2::from(self.size.map(|side| side as f64 - 1.0)),
            light: color::byte_to_light(),
        }
    }

    /// The mean colour, linear light, 0–1.
    pub fn mean(&self) -> Vec3 {
        let light = color::byte_to_light();
        let [width, height] = self.size;
        let mut sum = DVec3::ZERO;
        for y in 0..height {
            for texel in self.row(y, 0, width).chunks_exact(self.channels) {
                let of = |channel: usize| light[usize::from(texel[channel])];
                sum += Vec3::new(of(0), of(1), of(2)).as_dvec3();
            }
        }
        (sum / (width * height) as f64).as_vec3()
    }

    /// The same at half the resolution.
    pub fn halved(&self) -> Self {
        self.reduced(2.0)
    }

    /// The same with `ratio` times fewer texels along each axis; at least 1.
    fn reduced(&self, ratio: f64) -> Self {
        let (size, pixels) = if self.channels == 3 && (ratio - 2.0).abs() < 1e-9 {
            (self.size.map(|side| side.div_ceil(2)), self.halved_rgb())
        } else {
            let image = scale::area(&mut ImageRows { image: self }, [ratio; 2]);
            ([image.width, image.height], bytes(&image, self.channels))
        };
        Self { size, channels: self.channels, step: self.step * ratio, pixels: Pixels::Own(pixels) }
    }

    /// Means of two by two texels in linear light; where a side is odd, of what there is.
    fn halved_rgb(&self) -> Vec<u8> {
        let (linear, byte) = (color::byte_to_linear(), color::linear_to_byte());
        let light = |value: u8| u32::from(linear[usize::from(value)]);
        let [width, height] = self.size;
        let columns = width.div_ceil(2);
        let mut pixels = vec![0; columns * height.div_ceil(2) * 3];
        for (index, result) in pixels.chunks_exact_mut(columns * 3).enumerate() {
            let (y, below) = (2 * index, (2 * index + 1).min(height - 1));
            let (upper, last) = self.row(y, 0, width).as_chunks::<6>();
            let (lower, last_lower) = self.row(below, 0, width).as_chunks::<6>();
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

    /// Extends the used texels of an image that is its own.
    fn extend(&mut self, used: &BitGrid) {
        if let Pixels::Own(pixels) = &mut self.pixels {
            let (channels, stride) = (self.channels, self.size[0]);
            fill::extend(&mut Texels { pixels, channels, stride, origin: [0; 2] }, used, REACH);
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

/// Makes the images of all levels; `steps` are source texels per texel along each axis, the
/// finest (1) last.
///
/// The finest is the source itself, each other one is scaled from the next finer. Unused texels
/// near used ones take these's colours first, so that no mean mixes in a foreign one.
pub(crate) fn level_images(
    image: Arc<DecodedTexture>,
    region: &Region,
    steps: &[f64],
) -> Vec<LevelImage> {
    let source = source_level(image, region);
    let mut used = region.covered.clone();
    let mut coarser = |finer: &LevelImage, step: f64| {
        let ratio = step / finer.step;
        // Exact, whatever the products round to.
        let mut level = LevelImage { step, ..finer.reduced(ratio) };
        if let Some(used) = &mut used {
            *used = used.coarser(ratio, level.size[0], level.size[1]);
            level.extend(used);
        }
        level
    };
    let mut levels: Vec<LevelImage> = Vec::with_capacity(steps.len());
    let mut steps = steps.iter().rev();
    match steps.next() {
        Some(finest) if *finest > source.step => levels.push(coarser(&source, *finest)),
        Some(_) => levels.push(source),
        None => return levels,
    }
    for step in steps {
        let finer = &levels[levels.len() - 1];
        let level = if *step > finer.step { coarser(finer, *step) } else { finer.clone() };
        levels.push(level);
    }
    levels.reverse();
    levels
}

/// The region at full resolution: the source's texels as they are, unused ones near used ones
/// replaced by their neighbours' colours. Nothing is copied where nobody else has the image.
fn source_level(mut image: Arc<DecodedTexture>, region: &Region) -> LevelImage {
    let channels = usize::from(image.channels);
    let [width, height] = region.size;
    let source = [image.width as usize, image.height as usize];
    let inside = (0..2).all(|axis| {
        region.origin[axis] >= 0 && region.origin[axis] as usize + region.size[axis] <= source[axis]
    });
    let origin = region.origin.map(|start| start.max(0) as usize);
    let level = |pixels| LevelImage { size: region.size, channels, step: 1.0, pixels };
    if inside {
        let Some(covered) = &region.covered else {
            return level(Pixels::Source(image, origin));
        };
        if let Some(own) = Arc::get_mut(&mut image) {
            let pixels = &mut own.pixels[..];
            fill::extend(
                &mut Texels { pixels, channels, stride: source[0], origin },
                covered,
                REACH,
            );
            return level(Pixels::Source(image, origin));
        }
    }
    let mut pixels = Vec::with_capacity(width * height * channels);
    for y in 0..height {
        let row = (region.origin[1] + y as i64).rem_euclid(source[1] as i64) as usize;
        let row = &image.pixels[row * source[0] * channels..][..source[0] * channels];
        let mut x = region.origin[0].rem_euclid(source[0] as i64) as usize;
        let mut left = width;
        while left > 0 {
            let count = left.min(source[0] - x);
            pixels.extend_from_slice(&row[x * channels..(x + count) * channels]);
            left -= count;
            x = 0;
        }
    }
    let mut level = level(Pixels::Own(pixels));
    if let Some(covered) = &region.covered {
        level.extend(covered);
    }
    level
}

/// Rows of a level image for the scaler.
struct ImageRows<'a> {
    image: &'a LevelImage,
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
        let row = self.image.row(y, 0, self.image.size[0]);
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
    let resized = scale::area(&mut ImageRows { image: &view }, step);
    DecodedTexture {
        width: resized.width as u32,
        height: resized.height as u32,
        channels: image.channels,
        pixels: bytes(&resized, channels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, channels: u8) -> Arc<DecodedTexture> {
        let pixels =
            (0..width * height * usize::from(channels)).map(|i| (i * 7 % 251) as u8).collect();
        Arc::new(DecodedTexture { width: width as u32, height: height as u32, channels, pixels })
    }

    #[test]
    fn the_finest_level_is_the_source_itself() {
        let source = image(16, 9, 3);
        let region = Region { origin: [3, 2], size: [10, 5], covered: None };
        let levels = level_images(Arc::clone(&source), &region, &[2.6, 1.3, 1.0]);
        assert_eq!(levels[2].row(4, 1, 3), &source.pixels[(6 * 16 + 4) * 3..][..9]);
        assert_eq!(levels[1].size, [8, 4]);
        assert_eq!(levels[0].size, [4, 2]);
    }

    #[test]
    fn a_region_over_the_border_wraps() {
        let source = image(16, 9, 3);
        let region = Region { origin: [-2, 7], size: [20, 4], covered: None };
        let level = &level_images(Arc::clone(&source), &region, &[1.0])[0];
        assert_eq!(level.row(0, 0, 1), &source.pixels[(7 * 16 + 14) * 3..][..3]);
        assert_eq!(level.row(2, 18, 1), &source.pixels[..3]);
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
        for steps in [[12.0, 6.0, 3.0, 1.5, 1.0], [16.0, 8.0, 4.0, 2.0, 1.0]] {
            for level in &level_images(Arc::new(source.clone()), &region, &steps) {
                for y in 0..level.size[1] {
                    for (x, texel) in level.row(y, 0, level.size[0]).chunks(3).enumerate() {
                        // Sixteen texels along one axis are as many or more on the diagonal.
                        let distance = (x as f64).hypot(y as f64) - 50.0 / level.step;
                        if distance < 16.0 {
                            assert!(texel[0].abs_diff(180) <= 1 && texel[1].abs_diff(90) <= 1);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_image_that_others_have_too_stays_as_it_is() {
        let shared = image(16, 9, 3);
        let mut covered = BitGrid::new(16, 9);
        covered.set(8, 4);
        let region = Region { origin: [0; 2], size: [16, 9], covered: Some(covered) };
        let before = shared.pixels.clone();
        let of_shared = level_images(Arc::clone(&shared), &region, &[2.0, 1.0]);
        assert_eq!(shared.pixels, before);
        let of_own = level_images(shared, &region, &[2.0, 1.0]);
        for (a, b) in of_shared.iter().zip(&of_own) {
            assert!((0..a.size[1]).all(|y| a.row(y, 0, a.size[0]) == b.row(y, 0, b.size[0])));
            assert_eq!(a.row(0, 0, 1), a.row(a.size[1] - 1, a.size[0] - 1, 1));
        }
    }

    #[test]
    fn halves_are_means_in_linear_light_and_odd_sides_average_what_there_is() {
        let checker = (0..48).flat_map(|i| [if (i % 8 + i / 8) % 2 == 0 { 255 } else { 0 }; 3]);
        let [width, height] = [8, 6];
        let source = DecodedTexture { width, height, channels: 3, pixels: checker.collect() };
        let region = Region { origin: [0; 2], size: [8, 6], covered: None };
        let level = &level_images(Arc::new(source), &region, &[2.0])[0];
        assert!((0..3).all(|y| level.row(y, 0, 4).iter().all(|byte| *byte == 188)));

        let pixels = [[0; 3], [255; 3], [9; 3]].concat();
        let odd = DecodedTexture { width: 3, height: 1, channels: 3, pixels };
        let region = Region { origin: [0; 2], size: [3, 1], covered: None };
        let level = &level_images(Arc::new(odd), &region, &[2.0, 1.0])[0];
        assert_eq!((level.size, level.row(0, 0, 2)), ([2, 1], &[188, 188, 188, 9, 9, 9][..]));
    }

    #[test]
    fn transparent_texels_give_no_colour() {
        let pixels = [[200, 100, 50, 255], [0, 0, 0, 0]].concat().repeat(32);
        let source = Arc::new(DecodedTexture { width: 8, height: 8, channels: 4, pixels });
        let region = Region { origin: [0; 2], size: [8; 2], covered: None };
        let level = &level_images(source, &region, &[2.0])[0];
        assert!(level.row(1, 0, 4).chunks(4).all(|texel| texel[0].abs_diff(200) <= 1
            && texel[2].abs_diff(50) <= 1
            && texel[3].abs_diff(128) <= 1));
    }

    #[test]
    fn wide_samples_are_means_of_two_by_two_texels_anywhere() {
        let source = image(9, 7, 3);
        let region = Region { origin: [0; 2], size: [9, 7], covered: None };
        let level = &level_images(Arc::clone(&source), &region, &[1.0])[0];
        let light = |x: f64, y: f64| {
            let texel = level.row(y.clamp(0.0, 6.0) as usize, x.clamp(0.0, 8.0) as usize, 1);
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
        let level = &level_images(Arc::clone(&source), &region, &[1.0])[0];
        let around = Region { origin: [-1, -1], size: [7, 6], covered: None };
        let around = &level_images(source, &around, &[1.0])[0];
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
    fn whole_images_get_exactly_the_size_asked_for() {
        let resized = resize_whole(&image(75, 50, 3), [37, 25]);
        assert_eq!((resized.width, resized.height), (37, 25));
        assert_eq!(resized.pixels.len(), 37 * 25 * 3);
    }
}
