//! How much JPEG alone changes the source's pictures: the measure for the leaves' texels.

use rayon::prelude::*;

use super::look::{Color, squared_difference};
use super::source::Source;
use crate::import::{Picture, decode_texture};
use crate::mesh::{TextureData, TextureSource};
use crate::texture::encode::encode;

/// Cut off from the left and the top of a picture before it is encoded, so that JPEG's blocks
/// stand elsewhere than in the source's own JPEG, as they do in an atlas.
const SHIFT: u32 = 3;
/// Texels of a picture that are looked at, from the top.
const MOST_TEXELS: usize = 1 << 22;

/// RMS difference between the source's pictures and themselves, encoded at `quality` and decoded,
/// 0–255; `None` without pictures.
pub(super) fn jpeg_rms(source: &Source, quality: u8) -> Option<f64> {
    let pictures: Vec<&TextureSource> = source.pictures().map(|(_, picture)| picture).collect();
    let sums: Vec<(f64, u64)> =
        pictures.par_iter().filter_map(|picture| error_of(picture, quality)).collect();
    let (sum, count) = sums.iter().fold((0.0, 0), |(a, b), &(sum, count)| (a + sum, b + count));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

fn error_of(source: &TextureSource, quality: u8) -> Option<(f64, u64)> {
    let picture = decode_texture(source).ok()?.into_opaque();
    let [width, height] = [picture.width, picture.height]
        .map(|side| if side > 2 * SHIFT { side - SHIFT } else { side } as usize);
    let height = height.min((MOST_TEXELS / width).max(1));
    let left = picture.width as usize - width;
    let top = (picture.height as usize).saturating_sub(height).min(SHIFT as usize);
    let rows = picture.pixels.chunks_exact(3 * picture.width as usize).skip(top).take(height);
    let cut: Vec<u8> = rows.flat_map(|row| &row[3 * left..]).copied().collect();
    let bytes = encode(&cut, [width, height], 3, quality).ok()?.bytes;
    let again: Picture = decode_texture(&TextureSource {
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
