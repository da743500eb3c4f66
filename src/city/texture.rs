//! Draws a façade's texture: numbered tiles, each with a gradient across, darker in the windows.

use image::RgbImage;

use super::facade::Facade;
use super::tiles::{DIGIT_ADVANCE, TileCode, TileGrid};

/// Brightness of walls and windows against the tile's code, and half the gradient across a tile.
/// Their sum stays well within what [`TileCode`] tolerates, with room for JPEG's noise.
const WALL: i16 = 7;
const WINDOW: i16 = -9;
const GRADIENT: i16 = 3;

/// Rows of 3 dots, from the upper left, of the digits 0 to 9.
const DIGITS: [u16; 10] = [
    0b111_101_101_101_111,
    0b010_110_010_010_111,
    0b111_001_111_100_111,
    0b111_001_111_001_111,
    0b101_101_111_001_001,
    0b111_100_111_001_111,
    0b111_100_111_101_111,
    0b111_001_010_010_010,
    0b111_101_111_101_111,
    0b111_101_111_001_111,
];

/// Draws the texture of one façade.
pub(super) fn draw(facade: &Facade, grid: &TileGrid, code: &TileCode) -> RgbImage {
    let [width, height] = grid.size;
    let mut image = RgbImage::new(width, height);
    draw_tiles(&mut image, grid, code);
    draw_windows(&mut image, facade);
    (0..grid.count()).for_each(|tile| draw_number(&mut image, grid, code, tile));
    image
}

/// All rows of texels of a row of tiles are alike, so each is drawn once.
fn draw_tiles(image: &mut RgbImage, grid: &TileGrid, code: &TileCode) {
    let row_bytes = 3 * grid.size[0] as usize;
    let tile_row_bytes = row_bytes * grid.tile as usize;
    for (rows, first) in image.chunks_mut(tile_row_bytes).zip((0..).step_by(grid.tiles[0] as usize))
    {
        let (row, others) = rows.split_at_mut(row_bytes);
        for (texels, tile) in row.chunks_mut(3 * grid.tile as usize).zip(first..) {
            let color = code.color(tile);
            for (texel, x) in texels.chunks_exact_mut(3).zip(0i16..) {
                let gradient = (2 * GRADIENT + 1) * x / grid.tile as i16 - GRADIENT;
                for (channel, base) in texel.iter_mut().zip(color) {
                    *channel = (i16::from(base) + WALL + gradient).clamp(0, 255) as u8;
                }
            }
        }
        others.chunks_exact_mut(row_bytes).for_each(|other| other.copy_from_slice(row));
    }
}

fn draw_windows(image: &mut RgbImage, facade: &Facade) {
    let (width, height) = image.dimensions();
    let texel = |metres: f64, of: f64, side: u32| {
        ((metres / of * f64::from(side)).round().max(0.0) as u32).min(side) as usize
    };
    let darkening = (WALL - WINDOW) as u8;
    for window in facade.houses.iter().flat_map(|house| house.windows()) {
        let [left, right] = window.x.map(|x| texel(x, facade.length, width));
        let [bottom, top] = window.z.map(|z| texel(facade.height - z, facade.height, height));
        for row in image.chunks_mut(3 * width as usize).take(bottom).skip(top) {
            row[3 * left..3 * right].iter_mut().for_each(|channel| *channel -= darkening);
        }
    }
}

fn draw_number(image: &mut RgbImage, grid: &TileGrid, code: &TileCode, tile: u32) {
    let [red, green, blue] = code.color(tile).map(u32::from);
    let is_bright = 2 * red + 5 * green + blue > 8 * 128;
    let ink = image::Rgb(if is_bright { [0; 3] } else { [255; 3] });
    let corner = grid.number_corner(tile);
    let scale = grid.digit_scale();
    let mut draw_dot = |column: u32, row: u32| {
        let [left, top] = [corner[0] + column * scale, corner[1] + row * scale];
        for y in top..(top + scale).min(image.height()) {
            for x in left..(left + scale).min(image.width()) {
                image.put_pixel(x, y, ink);
            }
        }
    };
    for (place, character) in (0..).zip(tile.to_string().bytes()) {
        let dots = DIGITS[usize::from(character - b'0')];
        for dot in (0..15).filter(|dot| dots >> (14 - dot) & 1 == 1) {
            draw_dot(place * DIGIT_ADVANCE + dot % 3, dot / 3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_readable_dots() {
        let grid = TileGrid::new([64, 64]);
        assert_eq!((grid.tile, grid.digit_scale()), (32, 1));
        let code = TileCode::new(0);
        let mut image = RgbImage::from_pixel(64, 64, image::Rgb([1, 2, 3]));
        draw_number(&mut image, &grid, &code, 3);
        let low = grid.number_corner(3);
        let drawn: Vec<String> = (0..5)
            .map(|y| {
                (0..3)
                    .map(|x| {
                        let is_ink = image.get_pixel(low[0] + x, low[1] + y).0 != [1, 2, 3];
                        if is_ink { '#' } else { '.' }
                    })
                    .collect()
            })
            .collect();
        assert_eq!(drawn, ["###", "..#", "###", "..#", "###"]);
    }
}
