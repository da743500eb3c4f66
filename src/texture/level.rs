//! The part of a texture that a block uses, at the resolution of each level.

use std::sync::Arc;

use super::bits::BitGrid;
use super::fill;
use super::scale::{self, LinearImage, Rows, Weights};
use super::srgb;
use crate::import::Picture;

/// How far, in texels, the source's own texels are extended into unused ones: as far as a node's
/// atlas copies texels around a chart (half a cell of reach and the rest of the last cell).
const SOURCE_DILATION: usize = 12;

/// Which texels of a texture a block uses.
#[derive(Debug)]
pub(crate) struct Region {
    /// First column and row; outside 0..size where charts cross the picture's border.
    pub origin: [i64; 2],
    /// Columns and rows, at least 1.
    pub size: [usize; 2],
    /// The texels that some triangle uses; `None` where it is (nearly) all of them.
    pub covered: Option<BitGrid>,
}

/// A region at one level's resolution.
#[derive(Debug)]
pub(crate) struct LevelPicture {
    /// Columns and rows.
    pub size: [usize; 2],
    /// 3 or 4.
    pub channels: usize,
    /// Source texels per texel; exact.
    pub step: f64,
    pixels: Pixels,
}

#[derive(Debug)]
enum Pixels {
    /// The source's own, from this column and row on.
    Source(Arc<Picture>, [usize; 2]),
    Own(Vec<u8>),
}

impl LevelPicture {
    /// `start..start + count` of a row; the caller keeps to the size.
    pub fn row(&self, y: usize, start: usize, count: usize) -> &[u8] {
        let (pixels, width, x, y) = match &self.pixels {
            Pixels::Source(picture, offset) => {
                (&picture.pixels, picture.width as usize, start + offset[0], y + offset[1])
            }
            Pixels::Own(pixels) => (pixels, self.size[0], start, y),
        };
        &pixels[(y * width + x) * self.channels..][..count * self.channels]
    }

    /// The same at half the resolution, for atlases that are larger than allowed.
    pub fn halved(&self) -> Self {
        let mut rows = PictureRows::new(self);
        let image = scale::area(&mut rows, [2.0; 2]);
        Self {
            size: [image.width, image.height],
            channels: self.channels,
            step: self.step * 2.0,
            pixels: Pixels::Own(bytes(&image, self.channels)),
        }
    }
}

/// The bytes of a scaled picture, texels that nothing uses filled in.
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

/// Makes the pictures of all levels; `steps` are source texels per texel along each axis, the
/// finest (1) last.
///
/// The finest is the source itself. The next is scaled from it; each coarser one from the one
/// before, by exact two-by-two means where the ratio is 2.
pub(crate) fn level_pictures(
    picture: &Arc<Picture>,
    region: &Region,
    steps: &[f64],
) -> Vec<LevelPicture> {
    let source = source_level(picture, region);
    let mut levels = Vec::with_capacity(steps.len());
    let mut finer: Option<(LinearImage, f64)> = None;
    for step in steps.iter().rev() {
        if *step <= 1.0 {
            levels.push(None);
            continue;
        }
        let image = match &finer {
            None => {
                let mut rows = PictureRows::new(&source);
                // Alpha is the weight already: what is transparent has no colour to give.
                rows.covered = region.covered.as_ref().filter(|_| source.channels == 3);
                scale::area(&mut rows, [*step; 2])
            }
            Some((image, previous)) if (step / previous - 2.0).abs() < 1e-9 => image.halve(),
            Some((image, previous)) => scale::area(&mut &*image, [step / previous; 2]),
        };
        levels.push(Some(LevelPicture {
            size: [image.width, image.height],
            channels: source.channels,
            step: *step,
            pixels: Pixels::Own(bytes(&image, source.channels)),
        }));
        finer = Some((image, *step));
    }
    levels.reverse();
    // Levels at full resolution are the source; more than one only where a caller repeats it.
    let mut source = Some(source);
    levels
        .into_iter()
        .map(|level| {
            level.unwrap_or_else(|| source.take().unwrap_or_else(|| source_level(picture, region)))
        })
        .collect()
}

/// The region at full resolution: the source's texels as they are, unused ones near used ones
/// replaced by their neighbours' colours.
fn source_level(picture: &Arc<Picture>, region: &Region) -> LevelPicture {
    let channels = usize::from(picture.channels);
    let [width, height] = region.size;
    let source = [picture.width as usize, picture.height as usize];
    let inside = (0..2).all(|axis| {
        region.origin[axis] >= 0 && region.origin[axis] as usize + region.size[axis] <= source[axis]
    });
    let pixels = if inside && region.covered.is_none() {
        Pixels::Source(Arc::clone(picture), region.origin.map(|start| start as usize))
    } else {
        let mut pixels = Vec::with_capacity(width * height * channels);
        for y in 0..height {
            let row = (region.origin[1] + y as i64).rem_euclid(source[1] as i64) as usize;
            let row = &picture.pixels[row * source[0] * channels..][..source[0] * channels];
            let mut x = region.origin[0].rem_euclid(source[0] as i64) as usize;
            let mut left = width;
            while left > 0 {
                let count = left.min(source[0] - x);
                pixels.extend_from_slice(&row[x * channels..(x + count) * channels]);
                left -= count;
                x = 0;
            }
        }
        if let Some(covered) = &region.covered {
            fill::dilate(&mut pixels, channels, &mut covered.clone(), SOURCE_DILATION);
        }
        Pixels::Own(pixels)
    };
    LevelPicture { size: region.size, channels, step: 1.0, pixels }
}

/// Rows of a level picture for the scaler.
struct PictureRows<'a> {
    picture: &'a LevelPicture,
    covered: Option<&'a BitGrid>,
}

impl<'a> PictureRows<'a> {
    fn new(picture: &'a LevelPicture) -> Self {
        Self { picture, covered: None }
    }
}

impl Rows for PictureRows<'_> {
    fn size(&self) -> [usize; 2] {
        self.picture.size
    }

    fn weighted(&self) -> bool {
        self.picture.channels == 4 || self.covered.is_some()
    }

    fn read(&mut self, y: usize, rgb: &mut [u16], weight: &mut [u16]) -> Weights {
        let table = srgb::to_linear();
        let width = self.picture.size[0];
        if self.picture.channels == 4 {
            let row = self.picture.row(y, 0, width).as_chunks::<4>().0;
            let texels = rgb.as_chunks_mut::<3>().0.iter_mut().zip(weight);
            for (source, (texel, weight)) in row.iter().zip(texels) {
                let alpha = u32::from(source[3]);
                *weight = (alpha * 257) as u16;
                for channel in 0..3 {
                    let linear = u32::from(table[usize::from(source[channel])]);
                    texel[channel] = ((linear * alpha + 127) / 255) as u16;
                }
            }
            return Weights::Mixed;
        }
        let linear = |rgb: &mut [u16], row: &[u8]| {
            for (value, byte) in rgb.iter_mut().zip(row) {
                *value = table[usize::from(*byte)];
            }
        };
        let Some(covered) = self.covered else {
            linear(rgb, self.picture.row(y, 0, width));
            return Weights::Full;
        };
        if covered.row_is_empty(y) {
            return Weights::None;
        }
        if covered.row_is_full(y) {
            linear(rgb, self.picture.row(y, 0, width));
            return Weights::Full;
        }
        rgb.fill(0);
        weight.fill(0);
        for (start, end) in covered.runs(y) {
            linear(&mut rgb[start * 3..end * 3], self.picture.row(y, start, end - start));
            weight[start..end].fill(u16::MAX);
        }
        Weights::Mixed
    }
}

/// A whole picture at another size, for repeating textures.
pub(crate) fn resize_whole(picture: &Arc<Picture>, size: [usize; 2]) -> Picture {
    let whole = [picture.width as usize, picture.height as usize];
    let channels = usize::from(picture.channels);
    let view = LevelPicture {
        size: whole,
        channels,
        step: 1.0,
        pixels: Pixels::Source(Arc::clone(picture), [0, 0]),
    };
    let step = [0, 1].map(|axis| whole[axis] as f64 / size[axis] as f64);
    let image = scale::area(&mut PictureRows::new(&view), step);
    Picture {
        width: image.width as u32,
        height: image.height as u32,
        channels: picture.channels,
        pixels: bytes(&image, channels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, channels: u8) -> Arc<Picture> {
        let pixels =
            (0..width * height * usize::from(channels)).map(|i| (i * 7 % 251) as u8).collect();
        Arc::new(Picture { width: width as u32, height: height as u32, channels, pixels })
    }

    #[test]
    fn the_finest_level_is_the_source_itself() {
        let source = picture(16, 9, 3);
        let region = Region { origin: [3, 2], size: [10, 5], covered: None };
        let levels = level_pictures(&source, &region, &[2.6, 1.3, 1.0]);
        assert_eq!(levels[2].row(4, 1, 3), &source.pixels[(6 * 16 + 4) * 3..][..9]);
        assert_eq!(levels[1].size, [8, 4]);
        assert_eq!(levels[0].size, [4, 2]);
    }

    #[test]
    fn a_region_over_the_border_wraps() {
        let source = picture(16, 9, 3);
        let region = Region { origin: [-2, 7], size: [20, 4], covered: None };
        let level = &level_pictures(&source, &region, &[1.0])[0];
        assert_eq!(level.row(0, 0, 1), &source.pixels[(7 * 16 + 14) * 3..][..3]);
        assert_eq!(level.row(2, 18, 1), &source.pixels[..3]);
    }

    #[test]
    fn black_background_does_not_reach_any_level() {
        let mut source =
            Picture { width: 64, height: 64, channels: 3, pixels: vec![0; 64 * 64 * 3] };
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
        for level in &level_pictures(&Arc::new(source), &region, &[12.0, 6.0, 3.0, 1.5]) {
            for y in 0..level.size[1] {
                for texel in level.row(y, 0, level.size[0]).chunks(3) {
                    assert!(texel[0].abs_diff(180) <= 1 && texel[1].abs_diff(90) <= 1);
                }
            }
        }
    }

    #[test]
    fn transparent_texels_give_no_colour() {
        let pixels = [[200, 100, 50, 255], [0, 0, 0, 0]].concat().repeat(32);
        let source = Arc::new(Picture { width: 8, height: 8, channels: 4, pixels });
        let region = Region { origin: [0; 2], size: [8; 2], covered: None };
        let level = &level_pictures(&source, &region, &[2.0])[0];
        assert!(level.row(1, 0, 4).chunks(4).all(|texel| texel[0].abs_diff(200) <= 1
            && texel[2].abs_diff(50) <= 1
            && texel[3].abs_diff(128) <= 1));
    }

    #[test]
    fn whole_pictures_get_exactly_the_size_asked_for() {
        let resized = resize_whole(&picture(75, 50, 3), [37, 25]);
        assert_eq!((resized.width, resized.height), (37, 25));
        assert_eq!(resized.pixels.len(), 37 * 25 * 3);
    }
}
