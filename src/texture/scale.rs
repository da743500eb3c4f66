//! Making images smaller: area averages in linear light, weighted by coverage or alpha.
//!
//! A texel of the smaller image is the mean of the source's area that it covers (exact box
//! filter at any ratio). Texels that nothing uses have no weight, so that an atlas's background
//! never mixes into what is seen.

use crate::color;

/// Full weight, and white.
const FULL: u16 = u16::MAX;

/// An image in linear light.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LinearImage {
    pub width: usize,
    pub height: usize,
    /// Three per texel, linear, 65535 is 1; zero where the weight is zero.
    pub rgb: Vec<u16>,
    /// One per texel, 65535 is full: coverage, or alpha; empty where every texel is full.
    pub weight: Vec<u16>,
}

/// Rows of an image as the scaler reads them: in order, each at most once.
pub(crate) trait Rows {
    fn size(&self) -> [usize; 2];

    /// True where some texel may have less than full weight.
    fn weighted(&self) -> bool;

    /// Writes linear light, multiplied by the weight, and (where [`weighted`](Self::weighted))
    /// the weight of a row.
    fn read(&mut self, y: usize, rgb: &mut [u16], weight: &mut [u16]) -> Weights;
}

/// What is known of the weights of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weights {
    /// All are zero; the row need not be written.
    None,
    /// All are full; the weight row need not be written.
    Full,
    /// Neither is known.
    Mixed,
}

/// Which source texels one texel of the result averages, and their weights.
struct Taps {
    start: usize,
    /// Sum to 65536.
    weights: Vec<u32>,
}

/// The taps of a result texel that covers `step` source texels.
fn taps(index: usize, step: f64, size: usize) -> Taps {
    let low = (index as f64 * step).min(size as f64 - 1.0);
    let high = ((index + 1) as f64 * step).min(size as f64).max(low + 1e-6);
    let start = low as usize;
    let end = (high.ceil() as usize).clamp(start + 1, size);
    let mut weights: Vec<u32> = (start..end)
        .map(|texel| {
            let overlap = high.min(texel as f64 + 1.0) - low.max(texel as f64);
            (overlap.max(0.0) / (high - low) * 65536.0).round() as u32
        })
        .collect();
    let sum: u32 = weights.iter().sum();
    let largest = (0..weights.len()).max_by_key(|tap| weights[*tap]).unwrap_or(0);
    weights[largest] = (weights[largest] + 65536).saturating_sub(sum);
    Taps { start, weights }
}

/// The size of an image of `size` texels when `step` source texels become one.
pub(crate) fn scaled_size(size: usize, step: f64) -> usize {
    // A last texel of which less than a thousandth is covered is rounding, not image.
    ((size as f64 / step - 1e-3).ceil() as usize).max(1)
}

/// Scales by the area filter; `step` is the number of source texels per result texel, at least 1,
/// along each axis.
pub(crate) fn area(source: &mut dyn Rows, step: [f64; 2]) -> LinearImage {
    let [source_width, source_height] = source.size();
    let size = [scaled_size(source_width, step[0]), scaled_size(source_height, step[1])];
    let weighted = source.weighted();
    let columns = Columns::new(size[0], step[0], source_width);

    let mut result = LinearImage {
        width: size[0],
        height: size[1],
        rgb: vec![0; size[0] * size[1] * 3],
        weight: if weighted { vec![0; size[0] * size[1]] } else { Vec::new() },
    };
    let mut row = Row::new(source_width, weighted);
    let mut sum = Row::new(source_width, weighted);
    for y in 0..size[1] {
        let taps = taps(y, step[1], source_height);
        // Half a unit for each tap's truncation.
        sum.clear(taps.weights.len() as u16 / 2);
        let (mut some, mut all) = (false, true);
        for (tap, factor) in taps.weights.iter().enumerate() {
            row.load(source, taps.start + tap);
            some |= row.weights != Weights::None;
            all &= row.weights == Weights::Full;
            sum.add(&row, (*factor).min(65535) as u16, weighted);
        }
        if !some {
            continue;
        }
        let rgb = &mut result.rgb[y * size[0] * 3..][..size[0] * 3];
        columns.scale_rgb(&sum.rgb, rgb);
        if weighted {
            let weight = &mut result.weight[y * size[0]..][..size[0]];
            if all {
                weight.fill(FULL);
            } else {
                columns.scale_weight(&sum.weight, weight);
                divide_by_weight(rgb, weight);
            }
        }
    }
    result
}

/// Turns sums of colour times weight into colours.
fn divide_by_weight(rgb: &mut [u16], weights: &mut [u16]) {
    for (texel, weight) in rgb.as_chunks_mut::<3>().0.iter_mut().zip(weights) {
        if *weight >= FULL - 8 {
            *weight = FULL;
        } else if *weight < 8 {
            // Rounding of nothing.
            *weight = 0;
            *texel = [0; 3];
        } else {
            let reciprocal = f32::from(FULL) / f32::from(*weight);
            *texel = texel.map(|channel| (f32::from(channel) * reciprocal + 0.5) as u16);
        }
    }
}

/// A row being read or summed.
struct Row {
    rgb: Vec<u16>,
    weight: Vec<u16>,
    weights: Weights,
    index: usize,
}

impl Row {
    fn new(width: usize, weighted: bool) -> Self {
        Self {
            rgb: vec![0; width * 3],
            weight: vec![0; if weighted { width } else { 0 }],
            weights: Weights::None,
            index: usize::MAX,
        }
    }

    fn clear(&mut self, value: u16) {
        self.rgb.fill(value);
        self.weight.fill(value);
    }

    /// Reads a row of the source unless it is there already.
    fn load(&mut self, source: &mut dyn Rows, y: usize) {
        if self.index != y {
            self.weights = source.read(y, &mut self.rgb, &mut self.weight);
            self.index = y;
        }
    }

    /// Adds `factor`/65536 of another row.
    fn add(&mut self, row: &Row, factor: u16, weighted: bool) {
        if row.weights == Weights::None {
            return;
        }
        accumulate(&mut self.rgb, &row.rgb, factor);
        if weighted {
            if row.weights == Weights::Full {
                let part = product(FULL, factor);
                self.weight.iter_mut().for_each(|sum| *sum = sum.saturating_add(part));
            } else {
                accumulate(&mut self.weight, &row.weight, factor);
            }
        }
    }
}

/// The upper half of a product; one instruction for eight values.
fn product(value: u16, factor: u16) -> u16 {
    ((u32::from(value) * u32::from(factor)) >> 16) as u16
}

fn accumulate(sums: &mut [u16], values: &[u16], factor: u16) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum = sum.saturating_add(product(*value, factor));
    }
}

/// The horizontal half of the filter.
struct Columns {
    /// First source texel of each result texel.
    starts: Vec<u32>,
    /// As many for each result texel as the widest has, then zero.
    weights: Vec<u32>,
    count: usize,
}

impl Columns {
    fn new(width: usize, step: f64, source_width: usize) -> Self {
        let taps: Vec<Taps> = (0..width).map(|x| taps(x, step, source_width)).collect();
        let widest = taps.iter().map(|taps| taps.weights.len()).max().unwrap_or(1);
        let count = widest.min(source_width);
        let mut starts = Vec::with_capacity(width);
        let mut weights = vec![0; width * count];
        for (x, taps) in taps.iter().enumerate() {
            // Padding must not read past the row, so the last texels begin earlier.
            let start = taps.start.min(source_width - count);
            let skip = taps.start - start;
            weights[x * count + skip..][..taps.weights.len()].copy_from_slice(&taps.weights);
            starts.push(start as u32);
        }
        Self { starts, weights, count }
    }

    fn scale_rgb(&self, source: &[u16], result: &mut [u16]) {
        match self.count {
            1 => self.rgb_of::<1>(source, result),
            2 => self.rgb_of::<2>(source, result),
            3 => self.rgb_of::<3>(source, result),
            _ => self.rgb_of_any(source, result),
        }
    }

    fn rgb_of<const N: usize>(&self, source: &[u16], result: &mut [u16]) {
        let source = source.as_chunks::<3>().0;
        let result = result.as_chunks_mut::<3>().0;
        let weights = self.weights.as_chunks::<N>().0;
        for ((texel, start), weights) in result.iter_mut().zip(&self.starts).zip(weights) {
            let mut sum = [32768u32; 3];
            let Some(taps) = source.get(*start as usize..*start as usize + N) else { continue };
            for (tap, weight) in taps.iter().zip(weights) {
                for channel in 0..3 {
                    sum[channel] += u32::from(tap[channel]) * weight;
                }
            }
            *texel = sum.map(|sum| (sum >> 16) as u16);
        }
    }

    fn rgb_of_any(&self, source: &[u16], result: &mut [u16]) {
        let source = source.as_chunks::<3>().0;
        for (x, texel) in result.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let mut sum = [32768u32; 3];
            let taps = &source[self.starts[x] as usize..][..self.count];
            for (tap, weight) in taps.iter().zip(&self.weights[x * self.count..]) {
                for channel in 0..3 {
                    sum[channel] += u32::from(tap[channel]) * weight;
                }
            }
            *texel = sum.map(|sum| (sum >> 16) as u16);
        }
    }

    fn scale_weight(&self, source: &[u16], result: &mut [u16]) {
        for (x, weight) in result.iter_mut().enumerate() {
            let taps = &source[self.starts[x] as usize..][..self.count];
            let sum = taps
                .iter()
                .zip(&self.weights[x * self.count..])
                .fold(32768u32, |sum, (tap, weight)| sum + u32::from(*tap) * weight);
            *weight = (sum >> 16) as u16;
        }
    }
}

impl LinearImage {
    /// Back to sRGB bytes, three a texel.
    pub fn to_rgb8(&self) -> Vec<u8> {
        let table = color::linear_to_byte();
        self.rgb.iter().map(|value| table.of(*value)).collect()
    }

    /// Back to sRGB bytes with the weight as alpha, four a texel.
    pub fn to_rgba8(&self) -> Vec<u8> {
        let table = color::linear_to_byte();
        let mut pixels = Vec::with_capacity(self.width * self.height * 4);
        for (index, texel) in self.rgb.as_chunks::<3>().0.iter().enumerate() {
            let alpha = self.weight.get(index).copied().unwrap_or(FULL);
            pixels.extend(texel.map(|value| table.of(value)));
            pixels.push(((u32::from(alpha) + 128) / 257) as u8);
        }
        pixels
    }
}

#[cfg(test)]
impl Rows for &LinearImage {
    fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    fn weighted(&self) -> bool {
        !self.weight.is_empty()
    }

    fn read(&mut self, y: usize, rgb: &mut [u16], weight: &mut [u16]) -> Weights {
        rgb.copy_from_slice(&self.rgb[y * self.width * 3..][..self.width * 3]);
        if self.weight.is_empty() {
            return Weights::Full;
        }
        weight.copy_from_slice(&self.weight[y * self.width..][..self.width]);
        let (texels, _) = rgb.as_chunks_mut::<3>();
        for (texel, weight) in texels.iter_mut().zip(weight) {
            if *weight != FULL {
                *texel = texel.map(|value| (u32::from(value) * u32::from(*weight) / 65535) as u16);
            }
        }
        Weights::Mixed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, value: impl Fn(usize, usize) -> u16) -> LinearImage {
        let rgb = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .flat_map(|(x, y)| [value(x, y); 3])
            .collect();
        LinearImage { width, height, rgb, weight: Vec::new() }
    }

    #[test]
    fn a_checker_averages_in_linear_light() {
        let checker = image(16, 16, |x, y| if (x + y) % 2 == 0 { FULL } else { 0 });
        let scaled = area(&mut &checker, [2.0, 2.0]);
        assert_eq!((scaled.width, scaled.height), (8, 8));
        assert!(scaled.to_rgb8().iter().all(|byte| *byte == 188));
    }

    #[test]
    fn a_flat_image_stays_flat_at_any_ratio() {
        for value in [0, 20, 1000, 33333, FULL] {
            let flat = image(37, 23, |_, _| value);
            for step in [1.0, 1.01, 1.37, 2.0, 2.5, 7.3] {
                let scaled = area(&mut &flat, [step, step * 1.1]);
                assert_eq!(scaled.to_rgb8(), vec![flat.to_rgb8()[0]; scaled.rgb.len()], "{step}");
            }
        }
    }

    #[test]
    fn a_ramp_keeps_its_mean_where_a_texel_lies() {
        let ramp = image(300, 1, |x, _| (x * 200) as u16);
        let step = 1.7;
        let scaled = area(&mut &ramp, [step, 1.0]);
        for x in 0..scaled.width - 1 {
            let centre = (x as f64 + 0.5) * step - 0.5;
            let found = f64::from(scaled.rgb[x * 3]);
            assert!((found - centre * 200.0).abs() < 60.0, "{x}: {found}");
        }
    }

    #[test]
    fn texels_without_weight_do_not_mix_in() {
        let mut half = image(33, 9, |x, _| if x < 15 { 40000 } else { 0 });
        half.weight = (0..33 * 9).map(|i| if i % 33 < 15 { FULL } else { 0 }).collect();
        let mut chain = area(&mut &half, [1.3, 1.3]);
        for _ in 0..3 {
            for (texel, weight) in chain.rgb.chunks(3).zip(&chain.weight) {
                assert!(*weight == 0 || (texel[0] as i32 - 40000).abs() < 300, "{texel:?}");
            }
            assert!(chain.weight.iter().any(|weight| *weight > 0));
            chain = area(&mut &chain, [2.0, 2.0]);
        }
    }
}
