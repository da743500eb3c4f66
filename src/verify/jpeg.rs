//! How much JPEG alone changes the source's images: the measure for the leaves' texels.

use rayon::prelude::*;

use super::source::Source;
use super::surface_appearance::{Color, squared_difference};
use crate::decode::{DecodedTexture, decode_texture};
use crate::mesh::{TextureData, TextureSource};
use crate::texture::encode::encode;

/// Cut off from the left and the top of an image before it is encoded, so that JPEG's blocks
/// stand elsewhere than in the source's own JPEG, as they do in an atlas.
const SHIFT: u32 = 3;
/// Texels of an image that are looked at, from the top.
const MOST_TEXELS: usize = 1 << 22;

/// RMS difference between the source's images and themselves, encoded at `quality` and decoded,
/// 0–255; `None` without images.
pub(super) fn jpeg_rms(source: &Source, quality: u8) -> Option<f64> {
    let images: Vec<&TextureSource> = source.images().map(|(_, image)| image).collect();
    let sums: Vec<(f64, u64)> =
        images.par_iter().filter_map(|image| error_of(image, quality)).collect();
    let (sum, count) = sums.iter().fold((0.0, 0), |(a, b), &(sum, count)| (a + sum, b + count));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

fn error_of(source: &TextureSource, quality: u8) -> Option<(f64, u64)> {
    let image = decode_texture(source).ok()?.into_opaque();
    let [width, height] = [image.width, image.height]
        .map(|side| if side > 2 * SHIFT { side - SHIFT } else { side } as usize);
    let height = height.min((MOST_TEXELS / width).max(1));
    let left = image.width as usize - width;
    let top = (image.height as usize).saturating_sub(height).min(SHIFT as usize);
    let rows = image.pixels.chunks_exact(3 * image.width as usize).skip(top).take(height);
    let cut: Vec<u8> = rows.flat_map(|row| &row[3 * left..]).copied().collect();
    let bytes = encode(&cut, [width, height], 3, quality).ok()?.bytes;
    let again: DecodedTexture = decode_texture(&TextureSource {
        name: source.name.clone(),
        data: TextureData::Embedded(bytes.into()),
        opacity: None,
    })
    .ok()?;
    let color = |texel: &[u8; 3]| -> Color { texel.map(f32::from) };
    let pairs = cut.as_chunks::<3>().0.iter().zip(again.pixels.as_chunks::<3>().0);
    let sum = pairs.map(|(a, b)| squared_difference(color(a), color(b))).sum();
    Some((sum, (width * height) as u64))
}
