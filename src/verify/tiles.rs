//! The numbered tiles of generated cities, where the source is one: misplaced texels show another
//! number.

use super::report::TileFigures;
use super::source::Source;
use super::surface_appearance::{Color, SurfaceAppearance};
use crate::city::{TileCode, TileGrid};
use crate::decode::{DecodedTexture, decode_texture};
use crate::mesh::{TextureData, TextureSource};

/// Places of an image, along each side, at which its own tiles are read to know it as one.
const PROBES: u32 = 40;
/// Share of these that must read right.
const READABLE: f64 = 0.98;
/// A tile is told where its edge is at least this many of the level's texels away: one for the
/// filter, one for the average that made the texel, one for chroma, which JPEG halves.
const CLEAR_TEXELS: f64 = 3.0;

/// The tiles of each image of the source, where it has them.
pub(super) struct Tiles(Vec<Option<(TileGrid, TileCode)>>);

/// A tile that a point shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    /// Its number.
    number: u32,
    /// Source texels to its nearest edge.
    clearance: f64,
    code: TileCode,
}

impl Tiles {
    /// Finds the tiles of the source's images; `None` where no image has any.
    pub fn find(source: &Source) -> Option<Self> {
        let tiles: Vec<_> = source.images().map(|(_, image)| tiles_of(image)).collect();
        tiles.iter().any(Option::is_some).then_some(Self(tiles))
    }

    /// The tile at a point of the source.
    pub fn at(&self, appearance: &SurfaceAppearance) -> Option<Tile> {
        let (grid, code) = self.0.get(appearance.image? as usize)?.as_ref()?;
        let sample = grid.at(appearance.texcoord)?;
        Some(Tile { number: sample.tile, clearance: sample.clearance, code: *code })
    }
}

/// The tiles of an image that a city's block has: its name ends in the block's number, and its
/// texels show what the tiles at their place should.
fn tiles_of(source: &TextureSource) -> Option<(TileGrid, TileCode)> {
    let name = match &source.data {
        TextureData::File(path) => path.file_stem()?.to_string_lossy().into_owned(),
        TextureData::Embedded(_) => source.name.clone(),
    };
    let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
    let before_digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let block: usize = stem[before_digits..].parse().ok()?;
    let image = decode_texture(source).ok()?;
    let grid = TileGrid::new([image.width, image.height]);
    let code = TileCode::new(block);
    let (mut probes, mut right) = (0u32, 0u32);
    for x in 0..PROBES {
        for y in 0..PROBES {
            let texcoord = [x, y].map(|i| (f64::from(i) + 0.5) / f64::from(PROBES));
            let Some(sample) = grid.at(texcoord).filter(|s| s.clearance >= CLEAR_TEXELS) else {
                continue;
            };
            probes += 1;
            right += u32::from(code.tile(texel(&image, texcoord)) == Some(sample.tile));
        }
    }
    (probes > 0 && f64::from(right) >= READABLE * f64::from(probes)).then_some((grid, code))
}

fn texel(image: &DecodedTexture, texcoord: [f64; 2]) -> [u8; 3] {
    let x = ((texcoord[0] * f64::from(image.width)) as u32).min(image.width - 1);
    let y = ((texcoord[1] * f64::from(image.height)) as u32).min(image.height - 1);
    let at = (y as usize * image.width as usize + x as usize) * usize::from(image.channels);
    [0, 1, 2].map(|channel| image.pixels[at + channel])
}

/// Counts what a node shows where the source shows `tile`; `scale` is the width of the node's
/// texels in source texels.
pub(super) fn count(figures: &mut TileFigures, tile: &Tile, shown: Color, scale: f64) {
    figures.samples += 1;
    if tile.clearance < CLEAR_TEXELS * scale {
        return;
    }
    figures.clear += 1;
    match tile.code.tile(shown.map(|channel| channel.round().clamp(0.0, 255.0) as u8)) {
        Some(number) if number == tile.number => {}
        Some(_) => figures.wrong += 1,
        None => figures.unreadable += 1,
    }
}

impl TileFigures {
    /// Takes over all of another.
    pub(super) fn extend(&mut self, other: &Self) {
        self.samples += other.samples;
        self.clear += other.clear;
        self.wrong += other.wrong;
        self.unreadable += other.unreadable;
    }

    /// Share of the clear samples that show another tile; `None` where none is clear.
    pub fn wrong_share(&self) -> Option<f64> {
        (self.clear > 0).then(|| self.wrong as f64 / self.clear as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_images_may_be_in_any_script() {
        for name in ["大地形", "地7形", "形7", "Straße.é", "7", ""] {
            let data = TextureData::Embedded(Vec::new().into());
            let source = TextureSource { name: name.to_owned(), data, opacity: None };
            assert!(tiles_of(&source).is_none(), "{name}");
        }
    }
}
