//! Decoding of pictures to what the graphics card samples.

use std::fmt;
use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, ImageReader};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::TextureFormat::{self, Bc7, Rgba8};
use super::held::{level_sizes, picture_bytes};
use super::{bc7, mips};
use crate::{Error, Result};

/// Longest side of a picture, in texels.
const LONGEST_SIDE: u32 = 32_768;

/// The last two bytes of a JPEG.
const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];

/// A decoded picture and its smaller versions, sRGB-encoded RGBA, alpha not premultiplied.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    format: TextureFormat,
    /// All levels, from the largest to that of one texel, without gaps.
    levels: Vec<u8>,
}

impl fmt::Debug for Picture {
    /// Without its texels, which are many.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, format, .. } = self;
        let mut picture = f.debug_struct("Picture");
        picture.field("width", width).field("height", height).field("format", format).finish()
    }
}

impl Picture {
    /// Makes the smaller versions of a picture: means in linear light, by how opaque texels are.
    /// `None` where there are not four bytes a texel, or no texels.
    pub fn new(width: u32, height: u32, mut rgba: Vec<u8>) -> Option<Self> {
        let bytes = Rgba8.level_bytes([width, height]);
        if bytes == 0 || rgba.len() as u64 != bytes {
            return None;
        }
        rgba.resize(usize::try_from(picture_bytes([width, height], Rgba8)).ok()?, 0);
        Some(Self::with_room(width, height, rgba))
    }

    /// Decodes the bytes of a JPEG or PNG file that is `size` texels wide and high, as the scene
    /// or the node says; another size is refused. `file` is for messages only.
    pub fn decode(file: &Path, bytes: &[u8], size: [u32; 2]) -> Result<Self> {
        Self::decode_sized(bytes, size).map_err(|what| Error::input(file, what))
    }

    pub(super) fn decode_sized(bytes: &[u8], size: [u32; 2]) -> Result<Self, String> {
        let [width, height] = size;
        if width == 0 || height == 0 || width.max(height) > LONGEST_SIDE {
            return Err(format!("a picture of {width} x {height} texels cannot be drawn"));
        }
        let levels = if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
            decode_jpeg(bytes, size)
        } else {
            decode_png(bytes, size)
        };
        Ok(Self::with_room(width, height, levels?))
    }

    /// `levels` has room for all levels, and the first is there.
    fn with_room(width: u32, height: u32, mut levels: Vec<u8>) -> Self {
        mips::fill(width, height, &mut levels);
        Self { width, height, format: Rgba8, levels }
    }

    /// The same in another format, as far as it [can be](TextureFormat::of_picture). What is
    /// compressed stays so.
    pub fn stored_as(self, format: TextureFormat) -> Self {
        let format = format.of_picture([self.width, self.height]);
        if format != Bc7 || self.format == Bc7 {
            return self;
        }
        let encode = |([width, _], texels): ([u32; 2], &[u8])| {
            bc7::encode(width as usize, texels.as_chunks().0)
        };
        Self { format, levels: self.levels().flat_map(encode).collect(), ..self }
    }

    /// Width in texels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in texels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// How its texels are stored.
    pub fn format(&self) -> TextureFormat {
        self.format
    }

    /// Bytes of all levels: [`picture_bytes`] of its size.
    pub fn bytes(&self) -> u64 {
        self.levels.len() as u64
    }

    /// Size in texels and bytes of each level, from the largest to that of one texel.
    pub fn levels(&self) -> impl Iterator<Item = ([u32; 2], &[u8])> {
        let mut rest = &self.levels[..];
        level_sizes(self.width, self.height).map(move |size| {
            let (level, after) = rest.split_at(self.format.level_bytes(size) as usize);
            rest = after;
            (size, level)
        })
    }
}

/// Refuses a picture that is not as large as was said.
fn check_size(found: [u32; 2], expected: [u32; 2]) -> Result<(), String> {
    if found == expected {
        return Ok(());
    }
    let [[width, height], [w, h]] = [expected, found];
    Err(format!("expected a picture of {width} x {height} texels, found {w} x {h}"))
}

/// Room for all levels.
fn room(size: [u32; 2]) -> Result<Vec<u8>, String> {
    let bytes = usize::try_from(picture_bytes(size, Rgba8)).map_err(|error| error.to_string())?;
    Ok(vec![0; bytes])
}

fn decode_jpeg(bytes: &[u8], size: [u32; 2]) -> Result<Vec<u8>, String> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(LONGEST_SIDE as usize)
        .set_max_height(LONGEST_SIDE as usize)
        .jpeg_set_out_colorspace(ColorSpace::RGBA);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let refuse = |error: &dyn std::fmt::Display| format!("not a JPEG that can be decoded: {error}");
    // The decoder fills up what is cut short; what the build writes has nothing after its end.
    if !bytes.ends_with(&END_OF_IMAGE) {
        return Err(refuse(&"it is cut short"));
    }
    decoder.decode_headers().map_err(|error| refuse(&error))?;
    let info = decoder.info().ok_or_else(|| refuse(&"no header"))?;
    check_size([info.width.into(), info.height.into()], size)?;
    let mut levels = room(size)?;
    let first = &mut levels[..Rgba8.level_bytes(size) as usize];
    if decoder.output_buffer_size() != Some(first.len()) {
        return Err(refuse(&"its colours are not RGB or grey"));
    }
    decoder.decode_into(first).map_err(|error| refuse(&error))?;
    Ok(levels)
}

fn decode_png(bytes: &[u8], size: [u32; 2]) -> Result<Vec<u8>, String> {
    let refuse = |error: image::ImageError| format!("not a PNG that can be decoded: {error}");
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(size[0]);
    limits.max_image_height = Some(size[1]);
    reader.limits(limits);
    let image = reader.decode().map_err(refuse)?;
    check_size([image.width(), image.height()], size)?;
    let mut levels = image.into_rgba8().into_raw();
    let bytes = usize::try_from(picture_bytes(size, Rgba8)).map_err(|e| e.to_string())?;
    levels.resize(bytes, 0);
    Ok(levels)
}
