//! Decoding of textures to 8-bit RGB or RGBA.
//!
//! The format is recognised by a file's content, never by its name.

mod tga;

use std::borrow::Cow;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{DynamicImage, GrayImage, ImageReader, RgbImage};
use tga::Header;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::mesh::{TextureData, TextureSource};
use crate::{Error, Result, side_file};

/// Longest side of an image, in texels.
const LONGEST_SIDE: u32 = 32_768;

/// Most texels of an image: 2^29, which is 1.5 GiB as RGB.
const MOST_TEXELS: u64 = 1 << 29;

/// The formats that are read, for messages.
const EXPECTED: &str = "expected JPEG, PNG, BMP, TGA, TIFF, WebP or GIF";

/// A decoded image, rows from the top, sRGB-encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodedTexture {
    /// Width in texels, from 1.
    pub width: u32,
    /// Height in texels, from 1.
    pub height: u32,
    /// Bytes to a texel: 3 (RGB), or 4 (RGBA, alpha not premultiplied) where any alpha is below
    /// 255.
    pub channels: u8,
    /// `width * height * channels` bytes.
    pub pixels: Vec<u8>,
}

impl DecodedTexture {
    /// The number of texels.
    pub fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Without its alpha channel.
    pub fn into_opaque(self) -> Self {
        if self.channels == 3 {
            return self;
        }
        Self { channels: 3, pixels: without_alpha(&self.pixels), ..self }
    }

    /// True where some texel is not wholly opaque.
    pub fn has_transparency(&self) -> bool {
        self.channels == 4 && has_transparency(&self.pixels)
    }
}

/// Of RGBA texels: true where some alpha is below 255.
fn has_transparency(rgba: &[u8]) -> bool {
    rgba.as_chunks::<4>().0.iter().any(|texel| texel[3] < 255)
}

/// RGB of RGBA texels.
fn without_alpha(rgba: &[u8]) -> Vec<u8> {
    rgba.as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect()
}

/// Reads and decodes a texture: JPEG, PNG, BMP, TGA, TIFF, WebP or GIF (its first frame).
///
/// 16-bit, grey and palette images become 8-bit RGB. The result is RGBA only where some alpha is
/// below 255, from the image itself or from its opacity file, which may be of another size.
pub fn decode_texture(source: &TextureSource) -> Result<DecodedTexture> {
    decode_and_check(source).map(|(image, _)| image)
}

/// The same, and true if it is a JPEG without its end, whose last rows are made up.
pub(crate) fn decode_and_check(source: &TextureSource) -> Result<(DecodedTexture, bool)> {
    let file = file_of(source);
    let bytes = bytes_of(source)?;
    let is_cut_short = is_jpeg(&bytes) && is_without_end(&bytes);
    let image = decode(&bytes).map_err(|what| refusal(&file, source, what))?;
    drop(bytes);
    let Some(opacity) = &source.opacity else { return Ok((image, is_cut_short)) };
    let mask = decode(&bytes_of_file(opacity)?).map_err(|what| Error::input(opacity, what))?;
    Ok((with_opacity(image, &mask), is_cut_short))
}

/// The alpha of the image in `file`, or its luminance where it has no transparency; 255 there where
/// the image is a colour texture too, whose own alpha channel alone is opacity.
pub(crate) fn alpha_values(file: &Path, is_own_alpha: bool) -> Result<GrayImage> {
    let image = decode(&bytes_of_file(file)?).map_err(|what| Error::input(file, what))?;
    if is_own_alpha && image.channels == 3 {
        return Ok(GrayImage::from_pixel(1, 1, image::Luma([255])));
    }
    Ok(opacity_of(&image))
}

/// A BMP of one white texel: the colours of a texture that has opacity alone.
const WHITE_IMAGE: [u8; 58] = [
    b'B', b'M', 58, 0, 0, 0, 0, 0, 0, 0, 54, 0, 0, 0, // file header: size, first pixel
    40, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 24, 0, // 1 x 1, one plane of 24 bits
    0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, // not compressed
    255, 255, 255, 0,
];

/// The bytes of an image file of one white texel.
pub(crate) fn white_image() -> Arc<[u8]> {
    Arc::new(WHITE_IMAGE)
}

/// Width and height of a texture in texels, from its header and that of its opacity file alone.
pub fn texture_size(source: &TextureSource) -> Result<(u32, u32)> {
    let file = file_of(source);
    let size = match &source.data {
        TextureData::File(path) => size_of_file(path)?,
        TextureData::Embedded(bytes) => {
            size_of(Cursor::new(&bytes[..])).map_err(|what| refusal(&file, source, what))?
        }
    };
    match &source.opacity {
        Some(opacity) => Ok(combined_size(size, size_of_file(opacity)?)),
        None => Ok(size),
    }
}

fn size_of_file(path: &Path) -> Result<(u32, u32)> {
    let opened = side_file::open(path)
        .map_err(|error| Error::input(path, format!("cannot be opened: {error}")))?;
    size_of(BufReader::new(opened)).map_err(|what| Error::input(path, what))
}

/// The file to name in messages.
fn file_of(source: &TextureSource) -> PathBuf {
    match &source.data {
        TextureData::File(path) => path.clone(),
        TextureData::Embedded(_) => PathBuf::from(&source.name),
    }
}

fn refusal(file: &Path, source: &TextureSource, what: String) -> Error {
    match source.data {
        TextureData::File(_) => Error::input(file, what),
        TextureData::Embedded(_) => Error::input(file, format!("embedded image: {what}")),
    }
}

fn bytes_of(source: &TextureSource) -> Result<Cow<'_, [u8]>> {
    match &source.data {
        TextureData::Embedded(bytes) => Ok(Cow::Borrowed(&bytes[..])),
        TextureData::File(path) => bytes_of_file(path).map(Cow::Owned),
    }
}

/// The bytes of an image file. Its header is read first, so that a large file of something else is
/// not read whole.
fn bytes_of_file(path: &Path) -> Result<Vec<u8>> {
    size_of_file(path)?;
    side_file::read(path, side_file::MOST_BYTES)
        .map_err(|error| Error::input(path, format!("cannot be read: {error}")))
}

/// Refuses what would not fit in memory.
fn check_size(width: u32, height: u32) -> Result<(u32, u32), String> {
    if width == 0 || height == 0 {
        return Err(format!("is an image of {width} x {height} texels"));
    }
    let texels = u64::from(width) * u64::from(height);
    if width > LONGEST_SIDE || height > LONGEST_SIDE || texels > MOST_TEXELS {
        return Err(format!(
            "is an image of {width} x {height} texels; expected at most {LONGEST_SIDE} a side and \
             {MOST_TEXELS} in all"
        ));
    }
    Ok((width, height))
}

fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xd8, 0xff])
}

/// True if a JPEG has no end-of-image marker (ITU-T T.81, annex B). Those of thumbnails in its
/// segments do not count.
fn is_without_end(jpeg: &[u8]) -> bool {
    let mut at = 0;
    while let Some(rest) = jpeg.get(at..)
        && let Some(found) = memchr::memchr(0xff, rest)
    {
        at += found;
        at += match jpeg[at + 1..] {
            [0xd9, ..] => return false,
            // A fill byte; then stuffed zeros of compressed data and markers without a segment.
            [0xff, ..] => 1,
            [0x00 | 0x01 | 0xd0..=0xd8, ..] => 2,
            [_, high, low, ..] => 2 + usize::from(u16::from_be_bytes([high, low])),
            _ => return true,
        };
    }
    true
}

fn size_of(mut reader: impl BufRead + Seek) -> Result<(u32, u32), String> {
    let head = reader.fill_buf().map_err(|error| error.to_string())?;
    if is_jpeg(head) {
        let mut decoder = JpegDecoder::new_with_options(&mut reader, jpeg_options());
        if decoder.decode_headers().is_ok()
            && let Some(info) = decoder.info()
        {
            return check_size(info.width.into(), info.height.into());
        }
        reader.rewind().map_err(|error| error.to_string())?;
    }
    if let Some(header) = tga_header(reader.fill_buf().map_err(|error| error.to_string())?) {
        return check_size(header.width, header.height);
    }
    let (width, height) =
        recognised(reader)?.into_dimensions().map_err(|error| error.to_string())?;
    check_size(width, height)
}

/// The header of a TGA, from a file's first bytes; `None` for every other format.
fn tga_header(head: &[u8]) -> Option<Header> {
    image::guess_format(head).is_err().then(|| Header::read(head)).flatten()
}

/// A reader of the format that the content announces.
fn recognised<R: BufRead + Seek>(reader: R) -> Result<ImageReader<R>, String> {
    let reader =
        ImageReader::new(reader).with_guessed_format().map_err(|error| error.to_string())?;
    match reader.format() {
        Some(format) if format.reading_enabled() => Ok(reader),
        Some(format) => Err(format!("is {format:?}; {EXPECTED}")),
        None => Err(format!("is not an image of a known format; {EXPECTED}")),
    }
}

fn jpeg_options() -> DecoderOptions {
    DecoderOptions::default()
        .set_max_width(LONGEST_SIDE as usize)
        .set_max_height(LONGEST_SIDE as usize)
        .jpeg_set_out_colorspace(ColorSpace::RGB)
}

/// Decodes the bytes of an image file.
fn decode(bytes: &[u8]) -> Result<DecodedTexture, String> {
    let (width, height) = size_of(Cursor::new(bytes))?;
    if is_jpeg(bytes) {
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), jpeg_options());
        if let Ok(pixels) = decoder.decode()
            && pixels.len() as u64 == u64::from(width) * u64::from(height) * 3
        {
            return Ok(DecodedTexture { width, height, channels: 3, pixels });
        }
        // What the fast path cannot do (CMYK, for one) is left to `image`.
    }
    if let Some(header) = tga_header(bytes) {
        return header.decode(bytes).map(from_image);
    }
    let mut reader = recognised(Cursor::new(bytes))?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    // The widest texel is four times 32-bit float.
    limits.max_alloc = Some(u64::from(width) * u64::from(height) * 16 + (64 << 20));
    reader.limits(limits);
    let image = reader.decode().map_err(|error| error.to_string())?;
    Ok(from_image(image))
}

/// 8-bit RGB, or RGBA where any alpha is below 255.
fn from_image(image: DynamicImage) -> DecodedTexture {
    let (width, height) = (image.width(), image.height());
    if image.color().has_alpha() {
        let pixels = image.into_rgba8().into_raw();
        if has_transparency(&pixels) {
            return DecodedTexture { width, height, channels: 4, pixels };
        }
        return DecodedTexture { width, height, channels: 3, pixels: without_alpha(&pixels) };
    }
    DecodedTexture { width, height, channels: 3, pixels: image.into_rgb8().into_raw() }
}

/// Alpha, or luminance where the image has no transparency.
fn opacity_of(image: &DecodedTexture) -> GrayImage {
    let opacity: Vec<u8> = if image.channels == 4 {
        image.pixels.as_chunks::<4>().0.iter().map(|texel| texel[3]).collect()
    } else {
        // Rec. 709 weights in 1/256 on the encoded values, as renderers of MTL take the scalar.
        let luminance = |&[r, g, b]: &[u8; 3]| {
            ((54 * u32::from(r) + 183 * u32::from(g) + 19 * u32::from(b) + 128) >> 8) as u8
        };
        image.pixels.as_chunks::<3>().0.iter().map(luminance).collect()
    };
    GrayImage::from_raw(image.width, image.height, opacity).unwrap_or_default()
}

/// The size of an image and its opacity map, of these sizes, together: the larger along each side,
/// so that neither loses detail; that of the image where this is too large.
fn combined_size(image: (u32, u32), opacity: (u32, u32)) -> (u32, u32) {
    check_size(image.0.max(opacity.0), image.1.max(opacity.1)).unwrap_or(image)
}

/// `image` with the alpha of `mask`, or its luminance where it has no alpha, both resampled to their
/// [`combined_size`].
fn with_opacity(image: DecodedTexture, mask: &DecodedTexture) -> DecodedTexture {
    let (width, height) = combined_size((image.width, image.height), (mask.width, mask.height));
    let opacity = resized(opacity_of(mask), width, height);
    let colors = RgbImage::from_raw(image.width, image.height, image.into_opaque().pixels);
    let colors = resized(colors.unwrap_or_default(), width, height).into_raw();
    if opacity.iter().all(|alpha| *alpha == 255) {
        return DecodedTexture { width, height, channels: 3, pixels: colors };
    }
    let texels = colors.as_chunks::<3>().0.iter().zip(opacity.into_raw());
    let pixels = texels.flat_map(|(&[r, g, b], a)| [r, g, b, a]).collect();
    DecodedTexture { width, height, channels: 4, pixels }
}

/// An image in another size, filtered linearly.
fn resized<P: image::Pixel<Subpixel = u8> + 'static>(
    image: image::ImageBuffer<P, Vec<u8>>,
    width: u32,
    height: u32,
) -> image::ImageBuffer<P, Vec<u8>> {
    match image.dimensions() == (width, height) {
        true => image,
        false => {
            image::imageops::resize(&image, width, height, image::imageops::FilterType::Triangle)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, Rgba, RgbaImage};

    fn embedded(bytes: Vec<u8>) -> TextureSource {
        TextureSource {
            name: "facade".into(),
            data: TextureData::Embedded(bytes.into()),
            opacity: None,
        }
    }

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn two_texels(alpha: u8) -> DynamicImage {
        RgbaImage::from_fn(2, 1, |x, _| Rgba([x as u8 * 200, 100, 50, alpha])).into()
    }

    #[test]
    fn alpha_is_kept_only_where_it_says_something() {
        let opaque = embedded(encoded(&two_texels(255), ImageFormat::Png));
        let image = decode_texture(&opaque).unwrap();
        assert_eq!((image.width, image.height, image.channels), (2, 1, 3));
        assert_eq!(image.pixels, [0, 100, 50, 200, 100, 50]);
        assert_eq!(texture_size(&opaque).unwrap(), (2, 1));
        let image = decode_texture(&embedded(encoded(&two_texels(7), ImageFormat::Png))).unwrap();
        assert_eq!(image.pixels, [0, 100, 50, 7, 200, 100, 50, 7]);
    }

    #[test]
    fn a_jpeg_without_its_end_is_recognised() {
        let image = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 7]));
        let jpeg = encoded(&image.into(), ImageFormat::Jpeg);
        let is_cut_short = |bytes: &[u8]| decode_and_check(&embedded(bytes.to_vec())).unwrap().1;
        assert!(!is_cut_short(&jpeg));
        assert!(!is_cut_short(&[&jpeg[..], &[0; 99]].concat()), "padding");
        assert!(is_cut_short(&jpeg[..jpeg.len() - 2]) && is_cut_short(&jpeg[..jpeg.len() * 3 / 4]));
        // A segment with a whole thumbnail.
        let length = (jpeg.len() + 2) as u16;
        let segment = [&[0xff, 0xe5][..], &length.to_be_bytes(), &jpeg].concat();
        let with_thumbnail = [&jpeg[..2], &segment, &jpeg[2..]].concat();
        assert!(!is_cut_short(&with_thumbnail));
        assert!(is_cut_short(&with_thumbnail[..with_thumbnail.len() - 9]));
        for length in 0..jpeg.len() {
            assert!(is_without_end(&jpeg[..length]));
        }
    }

    #[test]
    fn deep_and_grey_images_become_8_bit_rgb() {
        let deep =
            DynamicImage::ImageLuma16(image::ImageBuffer::from_raw(1, 1, vec![0x8080]).unwrap());
        let image = decode_texture(&embedded(encoded(&deep, ImageFormat::Png))).unwrap();
        assert_eq!((image.channels, image.pixels), (3, vec![0x80; 3]));
    }

    #[test]
    fn jpegs_are_decoded_in_colour_and_grey() {
        for image in [
            DynamicImage::from(image::RgbImage::from_pixel(9, 5, image::Rgb([200, 30, 90]))),
            DynamicImage::from(image::GrayImage::from_pixel(9, 5, image::Luma([77]))),
        ] {
            let source = embedded(encoded(&image, ImageFormat::Jpeg));
            let decoded = decode_texture(&source).unwrap();
            assert_eq!((decoded.width, decoded.height, decoded.channels), (9, 5, 3));
            assert_eq!(texture_size(&source).unwrap(), (9, 5));
            let expected = image.to_rgb8().into_raw();
            let far = decoded.pixels.iter().zip(&expected).any(|(a, b)| a.abs_diff(*b) > 3);
            assert!(!far, "{:?}", &decoded.pixels[..3]);
        }
    }

    /// Colours of a test image: `x` and `y` from the top left.
    fn color(x: usize, y: usize) -> [u8; 4] {
        [(40 * x) as u8, (90 * y) as u8, (7 * x + 3 * y) as u8, (200 + 10 * x + y) as u8]
    }

    const TGA_SIZE: [usize; 2] = [5, 3];

    /// A TGA of [`color`]: `kind` 1 (colour map), 2 (colours) or 3 (grey) and, for run-length encoding, 8 more.
    /// Bits 5 and 4 of `descriptor` say that rows start at the top and pixels at the right.
    fn tga(kind: u8, bits: u8, descriptor: u8) -> Vec<u8> {
        let [width, height] = TGA_SIZE;
        let is_mapped = kind & 7 == 1;
        let pixel = |[r, g, b, a]: [u8; 4]| match bits {
            8 => vec![r],
            15 | 16 if kind & 7 == 3 => vec![r, a],
            15 | 16 => {
                let packed = u16::from(r >> 3) << 10 | u16::from(g >> 3) << 5 | u16::from(b >> 3);
                packed.to_le_bytes().to_vec()
            }
            24 => vec![b, g, r],
            _ => vec![b, g, r, a],
        };
        let mut order = Vec::new();
        for row in 0..height {
            for column in 0..width {
                let y = if descriptor & 0x20 != 0 { row } else { height - 1 - row };
                let x = if descriptor & 0x10 != 0 { width - 1 - column } else { column };
                order.push([x, y]);
            }
        }
        let mut file = vec![3, u8::from(is_mapped), kind, 0, 0];
        file.extend([if is_mapped { (width * height) as u8 } else { 0 }, 0]);
        file.extend([if is_mapped { bits } else { 0 }, 0, 0, 0, 0]);
        file.extend([width as u8, 0, height as u8, 0]);
        file.extend([if is_mapped { 8 } else { bits }, descriptor]);
        file.extend(b"id!");
        if is_mapped {
            file.extend((0..width * height).flat_map(|at| pixel(color(at % width, at / width))));
        }
        let pixels = order.iter().map(|&[x, y]| match is_mapped {
            true => vec![(y * width + x) as u8],
            false => pixel(color(x, y)),
        });
        for (number, pixel) in pixels.enumerate() {
            match (kind & 8 != 0, number) {
                (true, 0) => file.push(0x80),
                (true, 1) => file.push((width * height - 2) as u8),
                _ => {}
            }
            file.extend(pixel);
        }
        file
    }

    #[test]
    fn tga_files_of_every_kind_and_origin_are_read() {
        let [width, height] = TGA_SIZE;
        for kind in [1, 2, 3, 9, 10, 11] {
            let depths: &[u8] = if kind & 7 == 3 { &[8, 16] } else { &[15, 16, 24, 32] };
            for (bits, origin) in depths.iter().flat_map(|&bits| [0, 1, 2, 3].map(|at| (bits, at)))
            {
                // Files declare 0, too few or all attribute bits.
                for declared in [0, 1, 8] {
                    let what = format!("kind {kind}, {bits} bits, origin {origin}, {declared}");
                    let source = embedded(tga(kind, bits, origin << 4 | declared));
                    assert_eq!(texture_size(&source).unwrap(), (5, 3), "{what}");
                    let image = decode_texture(&source).unwrap();
                    let has_alpha = bits == 32 || (bits == 16 && kind & 7 == 3);
                    let channels = if has_alpha && declared > 0 { 4 } else { 3 };
                    assert_eq!(usize::from(image.channels), channels, "{what}");
                    let expected = (0..width * height).flat_map(|at| {
                        let mut texel = color(at % width, at / width);
                        match (kind & 7 == 3, bits) {
                            (true, _) => texel[..3].fill(color(at % width, at / width)[0]),
                            (_, 15 | 16) => texel = texel.map(|part| part >> 3 << 3),
                            _ => {}
                        }
                        texel.into_iter().take(channels).collect::<Vec<_>>()
                    });
                    // Five bits become eight by one of two common roundings.
                    let tolerance = if bits < 24 && kind & 7 != 3 { 8 } else { 0 };
                    let pairs = image.pixels.iter().zip(expected);
                    assert!(pairs.clone().count() == 15 * channels, "{what}");
                    for (found, expected) in pairs {
                        assert!(
                            found.abs_diff(expected) <= tolerance,
                            "{what}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_zero_alpha_channel_of_a_tga_is_ignored() {
        let mut file = tga(2, 32, 0x28);
        file[21..].as_chunks_mut::<4>().0.iter_mut().for_each(|texel| texel[3] = 0);
        assert_eq!(decode_texture(&embedded(file)).unwrap().channels, 3);
    }

    #[test]
    fn formats_are_recognised_by_content_whatever_the_name() {
        let folder = tempfile::tempdir().unwrap();
        let image = DynamicImage::from(image::RgbImage::from_fn(5, 3, |x, y| {
            let [r, g, b, _] = color(x as usize, y as usize);
            image::Rgb([r, g, b])
        }));
        let mut files = vec![tga(2, 24, 0), tga(10, 24, 0x20)];
        for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tiff, ImageFormat::WebP] {
            files.push(encoded(&image, format));
        }
        files.push(encoded(&image.to_rgba8().into(), ImageFormat::Gif));
        for (number, bytes) in files.into_iter().enumerate() {
            for name in ["a.jpg", "a.tga", "a.png", "a"] {
                let file = folder.path().join(name);
                std::fs::write(&file, &bytes).unwrap();
                let source =
                    TextureSource { data: TextureData::File(file), ..embedded(Vec::new()) };
                for source in [source, embedded(bytes.clone())] {
                    assert_eq!(texture_size(&source).unwrap(), (5, 3), "{number} {name}");
                    let found = decode_texture(&source).unwrap();
                    assert_eq!(found.pixels, image.to_rgb8().into_raw(), "{number} {name}");
                }
            }
        }
    }

    #[test]
    fn unknown_formats_are_named_with_those_that_are_read() {
        for bytes in [&b"\xabKTX 20\xbb\r\n\x1a\n"[..], b"DDS |\0\0\0", b"text text text text text"]
        {
            let error = decode_texture(&embedded(bytes.to_vec())).unwrap_err().to_string();
            assert!(error.contains("expected JPEG, PNG, BMP, TGA"), "{error}");
        }
    }

    #[test]
    fn an_image_and_its_opacity_file_get_the_larger_of_their_sizes() {
        let folder = tempfile::tempdir().unwrap();
        let mask = folder.path().join("mask.png");
        for (size, expected) in [((4, 2), (4, 2)), ((1, 1), (2, 1)), ((1, 3), (2, 3))] {
            DynamicImage::from(image::GrayImage::from_fn(size.0, size.1, |x, _| {
                image::Luma([if 2 * x < size.0 { 40 } else { 255 }])
            }))
            .save(&mask)
            .unwrap();
            let mut source = embedded(encoded(&two_texels(255), ImageFormat::Png));
            source.opacity = Some(mask.clone());
            let image = decode_texture(&source).unwrap();
            assert_eq!(texture_size(&source).unwrap(), expected);
            assert_eq!((image.width, image.height, image.channels), (expected.0, expected.1, 4));
            let texels = image.pixels.as_chunks::<4>().0;
            let last = texels[texels.len() - 1];
            assert_eq!([texels[0][0], last[0]], [0, 200]);
            assert_eq!([texels[0][3], last[3]], [40, if size.0 == 1 { 40 } else { 255 }]);
        }
    }

    #[test]
    fn what_is_no_image_is_refused_with_its_name() {
        let jpeg = encoded(&two_texels(255).to_rgb8().into(), ImageFormat::Jpeg);
        let png = encoded(&two_texels(9), ImageFormat::Png);
        for bytes in [b"text".to_vec(), Vec::new(), jpeg[..3].to_vec(), png[..20].to_vec()] {
            let error = decode_texture(&embedded(bytes)).unwrap_err();
            assert_eq!(error.exit_code(), 3);
            assert!(error.to_string().contains("facade"), "{error}");
        }
    }

    #[test]
    fn every_truncation_gives_an_image_or_an_error() {
        let jpeg = encoded(&two_texels(255).to_rgb8().into(), ImageFormat::Jpeg);
        let png = encoded(&two_texels(9), ImageFormat::Png);
        for bytes in [jpeg, png, tga(1, 16, 0), tga(2, 32, 8), tga(10, 24, 0)] {
            for length in 0..bytes.len() {
                let source = embedded(bytes[..length].to_vec());
                let _ = decode_texture(&source);
                let _ = texture_size(&source);
            }
        }
    }

    #[test]
    fn giant_images_are_refused_by_their_header() {
        let mut png = encoded(&two_texels(255), ImageFormat::Png);
        png[16..20].copy_from_slice(&40_000_u32.to_be_bytes());
        let crc = crc32fast::hash(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = decode_texture(&embedded(png)).unwrap_err().to_string();
        assert!(error.contains("40000 x 1"), "{error}");
    }
}
