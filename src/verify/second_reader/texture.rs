//! Mean colours of textured triangles, by a few texels of each.

use std::collections::BTreeMap;
use std::path::Path;

use super::content::MaterialContent;
use crate::color::srgb_to_linear;
use crate::mesh::Wrap;

/// Triangles of a material of which [`FINE`]² points are looked at; of all others one is.
const FINE_TRIANGLES: usize = 2048;
const FINE: u32 = 5;

/// A textured triangle.
pub(super) struct Sample {
    pub texcoords: [[f32; 2]; 3],
    pub area: f64,
    /// The factor of the texture.
    pub light: [f64; 3],
}

/// The triangles of one texture, by name of material.
#[derive(Default)]
pub(super) struct Samples(BTreeMap<String, Vec<Sample>>);

impl Samples {
    pub fn push(&mut self, material: &str, sample: Sample) {
        match self.0.get_mut(material) {
            Some(samples) => samples.push(sample),
            None => {
                self.0.insert(material.to_owned(), vec![sample]);
            }
        }
    }

    /// Adds the colours that the texture gives them to their materials.
    pub fn take(
        &self,
        image: &Image,
        wrap: [Wrap; 2],
        materials: &mut BTreeMap<String, MaterialContent>,
    ) {
        for (name, samples) in &self.0 {
            let content = materials.entry(name.clone()).or_default();
            for (number, sample) in samples.iter().enumerate() {
                let steps = if number < FINE_TRIANGLES { FINE } else { 1 };
                let share = sample.area / f64::from(steps * steps);
                for at in points(sample.texcoords, steps) {
                    let texel = image.light(at, wrap);
                    content.add(share, [0, 1, 2].map(|c| texel[c] * sample.light[c]));
                }
            }
        }
    }
}

/// The centroids of the `steps`² equal triangles that a triangle is divided into.
fn points([a, b, c]: [[f32; 2]; 3], steps: u32) -> impl Iterator<Item = [f64; 2]> {
    let place = move |u: f64, v: f64| {
        [0, 1].map(|axis| {
            let [a, b, c] = [a, b, c].map(|corner| f64::from(corner[axis]));
            a + (b - a) * u / f64::from(steps) + (c - a) * v / f64::from(steps)
        })
    };
    let upright = (0..steps).flat_map(move |i| (0..steps - i).map(move |j| (i, j, 1.0 / 3.0)));
    let turned = (1..steps).flat_map(move |i| (0..steps - i).map(move |j| (i - 1, j, 2.0 / 3.0)));
    let at =
        move |(i, j, third): (u32, u32, f64)| place(f64::from(i) + third, f64::from(j) + third);
    upright.chain(turned).map(at)
}

/// A decoded image, rows from the top.
pub(super) struct Image {
    pub size: [u32; 2],
    pub channels: usize,
    pub pixels: Vec<u8>,
}

impl Image {
    /// Reads a file by its extension or content, without the project's decoder.
    pub fn open(path: &Path) -> Option<Self> {
        let reader = image::ImageReader::open(path).ok()?.with_guessed_format().ok()?;
        Some(Self::of(&reader.decode().ok()?))
    }

    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        Some(Self::of(&image::load_from_memory(bytes).ok()?))
    }

    fn of(image: &image::DynamicImage) -> Self {
        let image = image.to_rgb8();
        Self { size: [image.width(), image.height()], channels: 3, pixels: image.into_raw() }
    }

    /// The nearest texel, linear light; v grows downwards.
    fn light(&self, at: [f64; 2], wrap: [Wrap; 2]) -> [f64; 3] {
        let texel = |axis: usize| {
            let within = match wrap[axis] {
                Wrap::Repeat => at[axis] - at[axis].floor(),
                Wrap::Mirror => {
                    let twice = (at[axis] * 0.5 - (at[axis] * 0.5).floor()) * 2.0;
                    twice.min(2.0 - twice)
                }
                Wrap::Clamp => at[axis].clamp(0.0, 1.0),
            };
            // NaN becomes 0.
            ((within * f64::from(self.size[axis])) as usize).min(self.size[axis] as usize - 1)
        };
        let first = (texel(1) * self.size[0] as usize + texel(0)) * self.channels;
        let texel = &self.pixels[first..];
        [0, 1, 2].map(|channel| srgb_to_linear(f64::from(texel[channel]) / 255.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_spread_evenly() {
        let triangle = [[0.0, 0.0], [3.0, 0.0], [0.0, 6.0]];
        for steps in [1, 2, 5] {
            let points: Vec<[f64; 2]> = points(triangle, steps).collect();
            assert_eq!(points.len() as u32, steps * steps);
            let mean =
                |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64;
            assert!((mean(0) - 1.0).abs() < 1e-9 && (mean(1) - 2.0).abs() < 1e-9);
            assert!(
                points.iter().all(|p| p[0] > 0.0 && p[1] > 0.0 && p[0] / 3.0 + p[1] / 6.0 < 1.0)
            );
        }
    }
}
