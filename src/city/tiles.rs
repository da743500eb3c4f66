//! The numbered tiles of a texture, and the code that tells a tile's number from its colour.
//!
//! A code has one of six levels in each channel, 38 apart. A texel may therefore be off by up to
//! 18 in each channel (gradient, darkened windows, JPEG noise) and still be told from all others;
//! anything farther off (digits, blends of two tiles) is told to be no code.

/// Levels of a channel.
const LEVELS: u32 = 6;
/// Distance of two levels.
const STEP: u32 = 38;
/// The lowest level; black and white lie outside of all codes.
const BASE: u32 = 30;
/// The most tiles that a texture has: one for each code.
pub(super) const MAX_TILES: u32 = LEVELS * LEVELS * LEVELS;
/// Farther off than this in any channel, a colour is no code.
const TOLERANCE: u32 = 18;

/// Tells colours and tile numbers of one block's texture from each other. Neighbouring tiles have
/// far colours, and a number has another colour in another block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileCode {
    factor: u32,
    inverse: u32,
    shift: u32,
}

impl TileCode {
    /// The code of a block's texture.
    pub fn new(block: usize) -> Self {
        // Any factor that has no divisor of 6 permutes the codes; these step far.
        const FACTORS: [u32; 6] = [85, 91, 95, 121, 125, 131];
        let factor = FACTORS[block % FACTORS.len()];
        let inverse = (1..MAX_TILES).find(|x| x * factor % MAX_TILES == 1).unwrap_or(1);
        Self { factor, inverse, shift: (block as u64 * 89 % u64::from(MAX_TILES)) as u32 }
    }

    /// The 8-bit sRGB colour of a tile.
    pub fn color(&self, tile: u32) -> [u8; 3] {
        let code = (tile % MAX_TILES * self.factor + self.shift) % MAX_TILES;
        let level = |digit: u32| (BASE + STEP * (digit % LEVELS)) as u8;
        [level(code / (LEVELS * LEVELS)), level(code / LEVELS), level(code)]
    }

    /// The tile whose colour is nearest, or `None` where the colour is none of the code's.
    pub fn tile(&self, color: [u8; 3]) -> Option<u32> {
        let mut code = 0;
        for channel in color {
            let above = u32::from(channel).saturating_sub(BASE);
            let digit = ((above + STEP / 2) / STEP).min(LEVELS - 1);
            if u32::from(channel).abs_diff(BASE + STEP * digit) > TOLERANCE {
                return None;
            }
            code = code * LEVELS + digit;
        }
        Some((code + MAX_TILES - self.shift) * self.inverse % MAX_TILES)
    }
}

/// The tiles of a texture, numbered row by row from the upper left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileGrid {
    /// Texels of the texture, across and down.
    pub size: [u32; 2],
    /// Texels along a tile's side, a multiple of 16 so that JPEG's blocks do not straddle tiles.
    pub tile: u32,
    /// Tiles across and down; the last may be cut off.
    pub tiles: [u32; 2],
}

/// What a texture shows at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileSample {
    /// The tile's number.
    pub tile: u32,
    /// Texels to the nearest edge of a tile or of a number's box; 0 within the box. Farther from
    /// it than a filter reaches, the texture shows the tile's colour alone.
    pub clearance: f64,
}

/// Side of the blocks that JPEG encodes together at a quality below 90, texels.
const JPEG_BLOCK: u32 = 16;
/// Texels from the left end of a digit to that of the next, before scaling.
pub(super) const DIGIT_ADVANCE: u32 = 4;
/// Texels of a digit's height, before scaling.
pub(super) const DIGIT_HEIGHT: u32 = 5;

impl TileGrid {
    /// Tiles of 64 texels, larger where there would be too many of them and smaller where the
    /// texture is small.
    pub fn new(size: [u32; 2]) -> Self {
        let size = size.map(|side| side.max(1));
        let mut tile = JPEG_BLOCK * (size[0].min(size[1]) / 64).clamp(2, 4);
        loop {
            let tiles = size.map(|side| side.div_ceil(tile));
            if u64::from(tiles[0]) * u64::from(tiles[1]) <= u64::from(MAX_TILES) {
                return Self { size, tile, tiles };
            }
            tile += JPEG_BLOCK;
        }
    }

    /// The number of tiles.
    pub fn count(&self) -> u32 {
        self.tiles[0] * self.tiles[1]
    }

    /// The tile at a texture coordinate (v grows downwards), `None` outside 0–1.
    pub fn at(&self, texcoord: [f64; 2]) -> Option<TileSample> {
        if !texcoord.iter().all(|t| (0.0..=1.0).contains(t)) {
            return None;
        }
        let texel = [0, 1].map(|axis| texcoord[axis] * f64::from(self.size[axis]));
        let side = f64::from(self.tile);
        let cell = [0, 1].map(|axis| ((texel[axis] / side) as u32).min(self.tiles[axis] - 1));
        let tile = cell[1] * self.tiles[0] + cell[0];
        let (low, high) = self.bounds(tile);
        let to_edge = (0..2)
            .map(|axis| {
                (texel[axis] - f64::from(low[axis])).min(f64::from(high[axis]) - texel[axis])
            })
            .fold(f64::INFINITY, f64::min);
        let (low, high) = self.number_box(tile);
        let to_number = (0..2)
            .map(|axis| {
                (f64::from(low[axis]) - texel[axis]).max(texel[axis] - f64::from(high[axis]))
            })
            .fold(0.0, f64::max);
        Some(TileSample { tile, clearance: to_edge.min(to_number).max(0.0) })
    }

    /// Upper left and lower right texel corner of a tile, cut off at the texture's border.
    pub(super) fn bounds(&self, tile: u32) -> ([u32; 2], [u32; 2]) {
        let low = [tile % self.tiles[0] * self.tile, tile / self.tiles[0] * self.tile];
        (low, [0, 1].map(|axis| (low[axis] + self.tile).min(self.size[axis])))
    }

    /// Texels of a digit's dot.
    pub(super) fn digit_scale(&self) -> u32 {
        (self.tile / 20).max(1)
    }

    /// Texels of a number's digits, across and down.
    fn number_extent(&self, tile: u32) -> [u32; 2] {
        let digits = tile.checked_ilog10().unwrap_or(0) + 1;
        let scale = self.digit_scale();
        [(digits * DIGIT_ADVANCE - 1) * scale, DIGIT_HEIGHT * scale]
    }

    /// Corners of the box around a tile's number, cut off at the texture's border. It consists of
    /// whole JPEG blocks, so that the digits' ringing stays within.
    pub(super) fn number_box(&self, tile: u32) -> ([u32; 2], [u32; 2]) {
        let extent = self.number_extent(tile).map(|side| side.next_multiple_of(JPEG_BLOCK));
        let (corner, _) = self.bounds(tile);
        let inset = extent.map(|side| self.tile.saturating_sub(side) / 2 / JPEG_BLOCK * JPEG_BLOCK);
        let low = [0, 1].map(|axis| (corner[axis] + inset[axis]).min(self.size[axis]));
        let high = [0, 1].map(|axis| (low[axis] + extent[axis]).min(self.size[axis]));
        (low, high)
    }

    /// Upper left texel of a tile's digits, in the middle of their box.
    pub(super) fn number_corner(&self, tile: u32) -> [u32; 2] {
        let (low, _) = self.number_box(tile);
        let extent = self.number_extent(tile);
        [0, 1]
            .map(|axis| low[axis] + (extent[axis].next_multiple_of(JPEG_BLOCK) - extent[axis]) / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_has_its_colour_in_every_block() {
        for block in [0, 1, 2, 3, 4, 5, 1234] {
            let code = TileCode::new(block);
            let mut colors: Vec<_> = (0..MAX_TILES).map(|tile| code.color(tile)).collect();
            for (tile, &color) in (0..).zip(&colors) {
                assert_eq!(code.tile(color), Some(tile));
                for noise in [-18i16, 18] {
                    let noisy = color.map(|channel| (i16::from(channel) + noise) as u8);
                    assert_eq!(code.tile(noisy), Some(tile), "{color:?} {noise}");
                }
            }
            colors.sort_unstable();
            colors.dedup();
            assert_eq!(colors.len() as u32, MAX_TILES);
        }
    }

    #[test]
    fn digits_and_blends_are_no_code() {
        let code = TileCode::new(0);
        assert_eq!(code.tile([0; 3]), None);
        assert_eq!(code.tile([255; 3]), None);
        assert_eq!(code.tile([30, 30 + 19, 30]), None);
    }

    #[test]
    fn neighbours_are_far_apart() {
        for block in 0..6 {
            let code = TileCode::new(block);
            for tile in 0..MAX_TILES - 1 {
                let (a, b) = (code.color(tile), code.color(tile + 1));
                let far = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b))).sum::<u32>();
                assert!(far >= 2 * STEP, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn places_map_to_tiles_row_by_row() {
        let grid = TileGrid::new([256, 128]);
        assert_eq!((grid.tile, grid.tiles), (32, [8, 4]));
        assert_eq!(grid.at([0.0, 0.0]).map(|sample| sample.tile), Some(0));
        assert_eq!(grid.at([1.0, 1.0]).map(|sample| sample.tile), Some(31));
        // Tile 9 covers 32..64 in both directions, its number's box 32..48.
        let sample = |x: f64, y: f64| grid.at([x / 256.0, y / 128.0]).unwrap();
        assert_eq!(sample(60.0, 50.0), TileSample { tile: 9, clearance: 4.0 });
        assert_eq!(sample(51.0, 40.0), TileSample { tile: 9, clearance: 3.0 });
        assert_eq!(sample(40.0, 40.0), TileSample { tile: 9, clearance: 0.0 });
        assert_eq!(grid.at([1.01, 0.5]), None);
        assert_eq!(grid.at([f64::NAN, 0.5]), None);
    }

    #[test]
    fn any_texture_has_few_enough_tiles() {
        for size in [[16, 16], [16_384, 16], [16, 16_384], [16_384, 16_384], [1000, 777], [0, 0]] {
            let grid = TileGrid::new(size);
            assert!((1..=MAX_TILES).contains(&grid.count()), "{grid:?}");
            assert_eq!(grid.tile % JPEG_BLOCK, 0);
        }
    }
}
