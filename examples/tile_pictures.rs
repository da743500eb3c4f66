//! Puts pictures of one size beside each other, two to a row with a white line between them.
//!
//! usage: tile_pictures IMAGE.png PICTURE...

use std::error::Error;

use image::{Rgb, RgbImage};

/// Width of the line, in texels.
const LINE: u32 = 4;

fn main() -> Result<(), Box<dyn Error>> {
    let mut paths = std::env::args_os().skip(1);
    let out = paths.next().ok_or("usage: tile_pictures IMAGE.png PICTURE...")?;
    let pictures: Vec<RgbImage> = paths
        .map(|path| Ok(image::open(path)?.into_rgb8()))
        .collect::<Result<_, image::ImageError>>()?;
    let (width, height) = pictures.first().ok_or("no picture")?.dimensions();
    if pictures.iter().any(|picture| picture.dimensions() != (width, height)) {
        return Err("pictures of different sizes".into());
    }
    let rows = pictures.len().div_ceil(2) as u32;
    let size = [width * 2 + LINE, height * rows + LINE * (rows - 1)];
    let mut sheet = RgbImage::from_pixel(size[0], size[1], Rgb([255; 3]));
    for (picture, number) in pictures.iter().zip(0i64..) {
        let at = |place: i64, side: u32| place * i64::from(side + LINE);
        image::imageops::replace(
            &mut sheet,
            picture,
            at(number % 2, width),
            at(number / 2, height),
        );
    }
    sheet.save(out)?;
    Ok(())
}
