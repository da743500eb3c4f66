//! Encoding images: JPEG, or PNG where alpha is needed.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder};

use crate::{Error, Result};

/// Largest side of a JPEG.
pub(crate) const MAX_SIDE: usize = 65535;

/// An encoded image.
pub(crate) struct Encoded {
    pub mime: &'static str,
    pub bytes: Vec<u8>,
}

/// The file extension that [`encode`] will choose.
pub(crate) fn extension(channels: usize) -> &'static str {
    if channels == 4 { "png" } else { "jpg" }
}

/// The quality of a coarse level's images where leaves have this one: a quarter as far from the best.
/// Each of their texels stands for many, and their charts are small, so that the colours of 4:2:0 run
/// from one into the next.
pub(crate) fn coarse_quality(quality: u8) -> u8 {
    100 - (100 - quality.clamp(1, 100)) / 4
}

/// Encodes RGB as JPEG (4:2:0 below quality 90, else 4:4:4) and RGBA as PNG.
pub(crate) fn encode(
    pixels: &[u8],
    size: [usize; 2],
    channels: usize,
    quality: u8,
) -> Result<Encoded> {
    let failed = |what: String| Error::Internal(format!("texture {size:?} not encoded: {what}"));
    if size.iter().any(|side| *side > MAX_SIDE) {
        return Err(failed(format!("a side is longer than {MAX_SIDE}")));
    }
    let mut bytes = Vec::with_capacity(size[0] * size[1] / 4 + 1024);
    if channels == 4 {
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
            .write_image(pixels, size[0] as u32, size[1] as u32, ExtendedColorType::Rgba8)
            .map_err(|error| failed(error.to_string()))?;
        return Ok(Encoded { mime: "image/png", bytes });
    }
    let mut encoder = Encoder::new(&mut bytes, quality.clamp(1, 100));
    // Else one of four is taken.
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    encoder
        .encode(pixels, size[0] as u16, size[1] as u16, ColorType::Rgb)
        .map_err(|error| failed(error.to_string()))?;
    Ok(Encoded { mime: "image/jpeg", bytes })
}
