//! Pictures of what was drawn, encoded.

use image::RgbaImage;

use super::bits::BitGrid;
use super::encode::encode;
use super::fill::fill_all;
use crate::Result;

/// A part of a picture as JPEG: `size` pixels from `from` on. Where alpha is 0 nothing was drawn: colours
/// around go on there, so that neither the JPEG nor the smaller versions of the texture know of an edge.
pub(crate) fn face_picture(
    picture: &RgbaImage,
    from: [u32; 2],
    size: [u32; 2],
    quality: u8,
) -> Result<Vec<u8>> {
    let [width, height] = size.map(|side| side as usize);
    let mut pixels = Vec::with_capacity(width * height * 3);
    let mut known = BitGrid::new(width, height);
    for y in 0..height {
        for x in 0..width {
            let [r, g, b, alpha] = picture.get_pixel(from[0] + x as u32, from[1] + y as u32).0;
            pixels.extend([r, g, b]);
            if alpha > 0 {
                known.set(x, y);
            }
        }
    }
    fill_all(&mut pixels, 3, &known);
    Ok(encode(&pixels, [width, height], 3, quality)?.bytes)
}
