//! Two pictures whose differences are known from elsewhere.

use image::{Rgb, RgbImage};

/// 64 × 48 pixels.
pub fn picture(color: fn(u32, u32) -> [u8; 3]) -> RgbImage {
    RgbImage::from_fn(64, 48, |x, y| Rgb(color(x, y)))
}

/// Ramps and a checkerboard.
pub fn plain(x: u32, y: u32) -> [u8; 3] {
    let check = (x / 8 + y / 6) % 2;
    [(4 * x % 256) as u8, (5 * y % 256) as u8, (60 + 130 * check) as u8]
}

/// The same with a line, two squares of other colours, and one pixel to the side below.
pub fn changed(x: u32, y: u32) -> [u8; 3] {
    let [r, g, b] = plain(if y > 32 { x + 1 } else { x }, y);
    match (x, y) {
        (45, _) => [0; 3],
        (12..28, 10..24) => [r.saturating_add(40), g, b],
        (50..60, 5..15) => [g, b, r],
        _ => [r, g, b],
    }
}
