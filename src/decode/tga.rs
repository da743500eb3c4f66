//! Truevision TGA. The format has no signature, so a file is TGA if its header is consistent and no other format
//! claims its first bytes.
//!
//! `image` decodes the pixels. It takes the number of attribute bits literally and refuses files whose number does
//! not suit the pixel size, so the number is set to what the pixel size implies. Alpha is used only if the header
//! declares attribute bits and some alpha is above 0: many exporters write 32-bit files with a zero alpha channel.

use std::io::{Cursor, Read};

use image::DynamicImage;
use image::codecs::tga::TgaDecoder;

/// Bytes of the header.
const HEADER_BYTES: usize = 18;

/// Pixels of the longest run-length packet.
const LONGEST_RUN: u64 = 128;

/// The fields of a header that decide how the pixels are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    bytes: [u8; HEADER_BYTES],
    /// Width in texels, from 1.
    pub(super) width: u32,
    /// Height in texels, from 1.
    pub(super) height: u32,
    /// Bytes of a stored pixel, 1–4: of an index where the image has a colour map.
    pixel_bytes: u64,
    is_run_length_encoded: bool,
    map_entries: u32,
    /// Attribute bits that the pixel size implies.
    attribute_bits: u8,
}

impl Header {
    /// Reads the header from the first bytes of a file; `None` if they are not a consistent TGA header.
    pub(super) fn read(head: &[u8]) -> Option<Self> {
        let bytes: [u8; HEADER_BYTES] = *head.first_chunk()?;
        let word = |at: usize| u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let [_, map_type, image_type, ..] = bytes;
        let (map_entries, map_entry_bits, depth) = (word(5), bytes[7], bytes[16]);
        let has_map =
            map_type == 1 && map_entries > 0 && matches!(map_entry_bits, 15 | 16 | 24 | 32);
        // Bits of a decoded pixel.
        let bits = match (image_type & !8, depth) {
            (1, 8 | 16) if has_map => map_entry_bits,
            (2, 15 | 16 | 24 | 32) | (3, 8 | 16) if map_type <= 1 => depth,
            _ => return None,
        };
        let is_grey = image_type & !8 == 3;
        let (width, height) = (word(12), word(14));
        (width > 0 && height > 0).then_some(Self {
            bytes,
            width,
            height,
            pixel_bytes: u64::from(depth.div_ceil(8)),
            is_run_length_encoded: image_type & 8 != 0,
            map_entries,
            attribute_bits: if bits == 32 || (is_grey && bits == 16) { 8 } else { 0 },
        })
    }

    /// Decodes the file that begins with this header.
    pub(super) fn decode(&self, file: &[u8]) -> Result<DynamicImage, String> {
        let body = &file[HEADER_BYTES.min(file.len())..];
        let texels = u64::from(self.width) * u64::from(self.height);
        let least_bytes = match self.is_run_length_encoded {
            true => texels.div_ceil(LONGEST_RUN) * (1 + self.pixel_bytes),
            false => texels * self.pixel_bytes,
        };
        if (body.len() as u64) < least_bytes {
            let (width, height, found) = (self.width, self.height, body.len());
            return Err(format!(
                "is a truncated TGA of {width} x {height} texels: expected at least {least_bytes} bytes behind \
                 its header, found {found}"
            ));
        }
        let mut header = self.bytes;
        let declared_bits = header[17] & 0xf;
        header[17] = header[17] & 0xf0 | self.attribute_bits;
        if self.map_entries == 0 {
            // Announced, but empty.
            header[1] = 0;
        }
        let reader = Cursor::new(header).chain(body);
        let image = TgaDecoder::new(reader).and_then(DynamicImage::from_decoder);
        let image = image.map_err(|error| error.to_string())?;
        if !image.color().has_alpha() {
            return Ok(image);
        }
        let image = image.into_rgba8();
        match declared_bits > 0 && image.pixels().any(|pixel| pixel[3] > 0) {
            true => Ok(image.into()),
            false => Ok(DynamicImage::from(image).into_rgb8().into()),
        }
    }
}
