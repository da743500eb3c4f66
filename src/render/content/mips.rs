//! Smaller versions of pictures: each texel is the mean of the area that it covers in the level
//! above, in linear light, weighted by alpha, so that what is cut away lends no colour.

use super::TextureFormat::Rgba8;
use super::held::level_sizes;
use crate::color;

/// Linear RGB and alpha, 65535 is 1; not premultiplied.
type Texel = [u16; 4];

/// Fills all levels from the first; `levels` has room for them.
pub(super) fn fill(width: u32, height: u32, levels: &mut [u8]) {
    let (first, mut rest) = levels.split_at_mut(Rgba8.level_bytes([width, height]) as usize);
    let opaque = first.as_chunks::<4>().0.iter().all(|texel| texel[3] == 255);
    let mut size = [width as usize, height as usize];
    let mut source = Source::Bytes(first.as_chunks().0);
    for half in level_sizes(width, height).skip(1) {
        let (level, after) = rest.split_at_mut(Rgba8.level_bytes(half) as usize);
        rest = after;
        let half = half.map(|side| side as usize);
        let linear =
            if opaque { halve_opaque(&source, size, half) } else { halve(&source, size, half) };
        encode(&linear, level.as_chunks_mut().0);
        source = Source::Linear(linear);
        size = half;
    }
}

/// A level to be halved.
enum Source<'a> {
    /// The first one. It is never in memory in 16 bits as a whole.
    Bytes(&'a [[u8; 4]]),
    /// Another, still unrounded.
    Linear(Vec<Texel>),
}

impl Source<'_> {
    /// Writes a row in linear light.
    fn read(&self, y: usize, row: &mut [Texel]) {
        let range = y * row.len()..(y + 1) * row.len();
        match self {
            Self::Linear(texels) => row.copy_from_slice(&texels[range]),
            Self::Bytes(bytes) => {
                let table = color::byte_to_linear();
                for (texel, &[r, g, b, a]) in row.iter_mut().zip(&bytes[range]) {
                    let [r, g, b] = [r, g, b].map(|byte| table[usize::from(byte)]);
                    *texel = [r, g, b, u16::from(a) * 257];
                }
            }
        }
    }
}

fn encode(linear: &[Texel], bytes: &mut [[u8; 4]]) {
    let table = color::linear_to_byte();
    for (bytes, &[r, g, b, a]) in bytes.iter_mut().zip(linear) {
        let alpha = (u32::from(a) + 128) / 257;
        *bytes = [table.of(r), table.of(g), table.of(b), alpha as u8];
    }
}

/// As [`halve`] where every texel weighs the same: first down, then across.
fn halve_opaque(source: &Source<'_>, size: [usize; 2], half: [usize; 2]) -> Vec<Texel> {
    let mut row = vec![[0u16; 4]; size[0]];
    let mut sums = vec![[0f32; 4]; size[0]];
    let mut result = Vec::with_capacity(half[0] * half[1]);
    let columns: Vec<Taps> = (0..half[0]).map(|x| taps(x, size[0], half[0])).collect();
    let even = size[0] == 2 * half[0];
    let rounded = |sum: [f32; 4]| sum.map(|sum| (sum + 0.5) as u16);
    for y in 0..half[1] {
        let down = taps(y, size[1], half[1]);
        sums.fill([0.0; 4]);
        for (tap, weight) in down.weights[..down.count].iter().enumerate() {
            source.read(down.first + tap, &mut row);
            for (sum, texel) in sums.iter_mut().zip(&row) {
                for channel in 0..4 {
                    sum[channel] += f32::from(texel[channel]) * weight;
                }
            }
        }
        if even {
            let pairs = sums.as_chunks::<2>().0.iter();
            result.extend(pairs.map(|[a, b]| {
                rounded(std::array::from_fn(|channel| (a[channel] + b[channel]) * 0.5))
            }));
        } else {
            result.extend(columns.iter().map(|across| {
                let mut mean = [0.0; 4];
                let texels = &sums[across.first..][..across.count];
                for (texel, weight) in texels.iter().zip(across.weights) {
                    for channel in 0..4 {
                        mean[channel] += texel[channel] * weight;
                    }
                }
                rounded(mean)
            }));
        }
    }
    result
}

fn halve(source: &Source<'_>, size: [usize; 2], half: [usize; 2]) -> Vec<Texel> {
    let mut rows = [(); 3].map(|()| vec![[0u16; 4]; size[0]]);
    let mut result = Vec::with_capacity(half[0] * half[1]);
    let columns: Vec<Taps> = (0..half[0]).map(|x| taps(x, size[0], half[0])).collect();
    for y in 0..half[1] {
        let down = taps(y, size[1], half[1]);
        for (row, tap) in rows.iter_mut().zip(0..down.count) {
            source.read(down.first + tap, row);
        }
        result.extend(columns.iter().map(|across| mean(&rows, &down, across)));
    }
    result
}

/// The texels that one of half the size covers along one axis, and their weights, which sum to 1.
struct Taps {
    first: usize,
    count: usize,
    weights: [f32; 3],
}

/// Of an odd number of texels, 2n + 1, each of the n that they become covers 2 + 1/n.
fn taps(index: usize, size: usize, half: usize) -> Taps {
    let first = index * size / half;
    let (index, half, size) = (index as f32, half as f32, size as f32);
    if size == 1.0 {
        Taps { first, count: 1, weights: [1.0, 0.0, 0.0] }
    } else if size == 2.0 * half {
        Taps { first, count: 2, weights: [0.5, 0.5, 0.0] }
    } else {
        let weights = [(half - index) / size, half / size, (index + 1.0) / size];
        Taps { first, count: 3, weights }
    }
}

fn mean(rows: &[Vec<Texel>; 3], down: &Taps, across: &Taps) -> Texel {
    let rows = rows.iter().zip(down.weights).take(down.count);
    weighted(rows.flat_map(|(row, down)| {
        let texels = row[across.first..][..across.count].iter();
        texels.zip(across.weights).map(move |(texel, across)| (texel, down * across))
    }))
}

/// The mean of texels whose weights sum to 1. Where all are transparent the colour is their plain
/// mean, since filtering may mix it with a neighbour's.
fn weighted<'a>(texels: impl Iterator<Item = (&'a Texel, f32)> + Clone) -> Texel {
    let alpha: f32 = texels.clone().map(|(texel, weight)| f32::from(texel[3]) * weight).sum();
    let mut sum = [0.5f32; 3];
    for (texel, weight) in texels {
        let part = if alpha > 0.0 { weight * f32::from(texel[3]) / alpha } else { weight };
        for channel in 0..3 {
            sum[channel] += f32::from(texel[channel]) * part;
        }
    }
    let [r, g, b] = sum.map(|sum| sum as u16);
    [r, g, b, (alpha + 0.5) as u16]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::content::{Picture, picture_bytes};

    fn levels(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<Vec<[u8; 4]>> {
        let rgba = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let rgba = rgba.flat_map(|(x, y)| texel(x, y)).collect();
        let picture = Picture::new(width, height, rgba).unwrap();
        assert_eq!(picture.bytes(), picture_bytes([width, height], Rgba8));
        picture.levels().map(|(_, level)| level.as_chunks().0.to_vec()).collect()
    }

    #[test]
    fn a_checker_is_half_of_white_in_linear_light_at_every_size() {
        for size in [[8, 8], [16, 2], [64, 32]] {
            let levels = levels(size[0], size[1], |x, y| {
                let white = 255 * ((x + y) % 2) as u8;
                [white, white, white, 255]
            });
            for level in &levels[1..] {
                assert!(level.iter().all(|texel| *texel == [188, 188, 188, 255]), "{level:?}");
            }
        }
    }

    #[test]
    fn a_flat_picture_stays_flat_at_any_size() {
        for color in [[0, 0, 0, 255], [1, 20, 200, 255], [255; 4], [9, 90, 200, 77], [3, 4, 5, 0]] {
            for size in [[1, 1], [7, 1], [1, 9], [13, 7], [6, 5], [5, 6], [31, 33]] {
                let levels = levels(size[0], size[1], |_, _| color);
                assert!(levels.iter().flatten().all(|texel| *texel == color), "{size:?} {color:?}");
            }
        }
    }

    #[test]
    fn every_texel_of_an_odd_picture_counts_the_same() {
        // One white texel among black ones weighs as much wherever it is: the last level is the
        // mean of all.
        for size in [[3, 3], [5, 1], [7, 5], [6, 7]] {
            for white in 0..size[0] * size[1] {
                let levels = levels(size[0], size[1], |x, y| {
                    let white = if y * size[0] + x == white { 255 } else { 0 };
                    [white, white, white, 255]
                });
                let mean = 65535.0 / f64::from(size[0] * size[1]);
                let found =
                    f64::from(color::byte_to_linear()[usize::from(levels.last().unwrap()[0][0])]);
                let step = mean * 0.025;
                assert!((found - mean).abs() < step, "{size:?} {white}: {found}, not {mean}");
            }
        }
    }

    #[test]
    fn what_is_transparent_lends_no_colour() {
        for size in [[8, 8], [7, 9]] {
            let levels =
                levels(
                    size[0],
                    size[1],
                    |x, _| {
                        if x < 3 { [200, 100, 50, 255] } else { [0, 255, 0, 0] }
                    },
                );
            for texel in levels.iter().flatten() {
                let near = texel[0].abs_diff(200) <= 1 && texel[1].abs_diff(100) <= 1;
                assert!(texel[3] == 0 || near, "{texel:?}");
                assert!(texel[3] > 0 || texel[1] == 255, "{texel:?}");
            }
            assert!((90..120).contains(&levels.last().unwrap()[0][3]), "{levels:?}");
        }
    }
}
