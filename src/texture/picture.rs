//! Decoded pictures.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::mesh::{TextureData, TextureSource};
use crate::{Error, Result};

/// A decoded picture: sRGB, 8 bits a channel, rows from the top without padding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// 3 (RGB) or 4 (RGBA, alpha not multiplied in).
    pub channels: u8,
    /// `width × height × channels` bytes.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// The number of texels.
    pub fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Without its alpha channel.
    pub fn into_opaque(self) -> Self {
        if self.channels == 3 {
            return self;
        }
        let pixels = self.pixels.chunks_exact(4).flat_map(|texel| [texel[0], texel[1], texel[2]]);
        Self { channels: 3, pixels: pixels.collect(), ..self }
    }

    /// True where some texel is not wholly opaque.
    pub fn has_transparency(&self) -> bool {
        self.channels == 4 && self.pixels.chunks_exact(4).any(|texel| texel[3] != 255)
    }
}

/// Decodes a picture from its source.
pub fn decode_texture(source: &TextureSource) -> Result<Picture> {
    let failed = |what: String| Error::input(&source.name, format!("picture not decoded: {what}"));
    let read;
    let bytes: &[u8] = match &source.data {
        TextureData::File(path) => {
            read = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
            &read
        }
        TextureData::Embedded(bytes) => bytes,
    };
    if bytes.starts_with(&[0xff, 0xd8]) {
        let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
        if let (Ok(pixels), Some((width, height))) = (decoder.decode(), decoder.dimensions())
            && pixels.len() == width * height * 3
        {
            let (width, height) = (width as u32, height as u32);
            return Ok(Picture { width, height, channels: 3, pixels });
        }
    }
    let picture = image::ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| failed(error.to_string()))?
        .decode()
        .map_err(|error| failed(error.to_string()))?;
    let (width, height) = (picture.width(), picture.height());
    if width == 0 || height == 0 {
        return Err(failed("it has no texels".into()));
    }
    let channels = if picture.color().has_alpha() { 4 } else { 3 };
    let pixels = if channels == 4 {
        picture.into_rgba8().into_raw()
    } else {
        picture.into_rgb8().into_raw()
    };
    Ok(Picture { width, height, channels, pixels })
}
