//! What can be asked of a city, with units, ranges and defaults.

use crate::{Error, Result};

/// How large each block's texture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureSize {
    /// No textures and no texture coordinates.
    None,
    /// Texels of a block's texture for each of the block's triangles, in the façade's own aspect.
    /// 0.1–10,000. Lakhia's data has 105.
    PerTriangle(f64),
    /// Width and height in texels, each 16–16,384.
    Fixed(u32, u32),
}

/// Parameters of a generated city. The same parameters give the same city on every machine.
#[derive(Clone, Debug, PartialEq)]
pub struct CityOptions {
    /// Façade rows, each one side of a city block and one group of the file. 1–100,000, default 9.
    pub blocks: usize,
    /// Triangles of the whole city, reached within 1 %. At least 2,000 and at most 20 million a
    /// block. Default 200,000. The sample spacing of the façades follows from it.
    pub triangles: u64,
    /// Default 17 texels a triangle.
    pub texture: TextureSize,
    /// Charts that each block's texture is torn into, shuffled as in the atlases of scans; 1, the
    /// default, leaves it whole. 1–100,000, at most one for each cell of the façade's grid.
    pub charts: u32,
    /// World position of the city's corner in metres, each component within ±16,000,000 so that
    /// an f32 holds its whole metres; rounded to 0.1 mm. Default 0.
    pub offset: [f64; 3],
    /// Draws another city of the same kind. Default 1.
    pub seed: u64,
    /// No occlusion holes and no ragged borders: façade, roofs and ground of each block are welded
    /// into one closed surface. Default false.
    pub watertight: bool,
    /// Quality of the JPEG textures, 1–100, default 85.
    pub jpeg_quality: u8,
    /// OBJ only: a folder with one `.obj`, `.mtl` and texture for each block. Default false.
    pub split: bool,
}

impl Default for CityOptions {
    fn default() -> Self {
        Self {
            blocks: 9,
            triangles: 200_000,
            texture: TextureSize::PerTriangle(17.0),
            charts: 1,
            offset: [0.0; 3],
            seed: 1,
            watertight: false,
            jpeg_quality: 85,
            split: false,
        }
    }
}

/// Fewer triangles do not hold a block's houses apart.
pub(super) const MIN_TRIANGLES_PER_BLOCK: u64 = 2_000;
/// Keeps a block's indices and buffers far below 32 bits.
pub(super) const MAX_TRIANGLES_PER_BLOCK: u64 = 20_000_000;
/// Largest side of a texture: the limit of most graphics cards.
pub(super) const MAX_TEXTURE_SIDE: u32 = 16_384;
/// Smallest side of a texture: one tile.
pub(super) const MIN_TEXTURE_SIDE: u32 = 16;

impl CityOptions {
    /// Refuses what is out of range, naming the option, the range and what was given.
    pub fn validate(&self) -> Result<()> {
        let usage = |text: String| Err(Error::Usage(text));
        if !(1..=100_000).contains(&self.blocks) {
            return usage(format!("--blocks: expected 1 to 100000, found {}", self.blocks));
        }
        let blocks = self.blocks as u64;
        let (least, most) = (blocks * MIN_TRIANGLES_PER_BLOCK, blocks * MAX_TRIANGLES_PER_BLOCK);
        if !(least..=most).contains(&self.triangles) {
            return usage(format!(
                "--triangles: {blocks} blocks need {least} to {most}, found {}",
                self.triangles
            ));
        }
        if !(1..=100_000).contains(&self.charts) {
            return usage(format!("--charts: expected 1 to 100000, found {}", self.charts));
        }
        if let Some(found) = self.offset.iter().find(|x| !(-16e6..=16e6).contains(*x)) {
            return usage(format!(
                "--offset: expected metres within ±16000000 on each axis, found {found}"
            ));
        }
        if !(1..=100).contains(&self.jpeg_quality) {
            return usage(format!(
                "--jpeg-quality: expected 1 to 100, found {}",
                self.jpeg_quality
            ));
        }
        match self.texture {
            TextureSize::PerTriangle(texels) if !(0.1..=10_000.0).contains(&texels) => {
                usage(format!("--texels-per-triangle: expected 0.1 to 10000, found {texels}"))
            }
            TextureSize::Fixed(width, height)
                if [width, height]
                    .iter()
                    .any(|side| !(MIN_TEXTURE_SIDE..=MAX_TEXTURE_SIDE).contains(side)) =>
            {
                usage(format!(
                    "--texture-size: expected {MIN_TEXTURE_SIDE} to {MAX_TEXTURE_SIDE} texels on \
                     each side, found {width}x{height}"
                ))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_bad_option_is_named() {
        let good = CityOptions::default();
        assert!(good.validate().is_ok());
        let bad = [
            (CityOptions { blocks: 0, ..good.clone() }, "--blocks"),
            (CityOptions { charts: 0, ..good.clone() }, "--charts"),
            (CityOptions { triangles: 17_999, ..good.clone() }, "--triangles"),
            (CityOptions { offset: [0.0, f64::NAN, 0.0], ..good.clone() }, "--offset"),
            (CityOptions { offset: [0.0, 0.0, -2e7], ..good.clone() }, "--offset"),
            (CityOptions { jpeg_quality: 0, ..good.clone() }, "--jpeg-quality"),
            (
                CityOptions { texture: TextureSize::PerTriangle(f64::INFINITY), ..good.clone() },
                "--texels-per-triangle",
            ),
            (
                CityOptions { texture: TextureSize::Fixed(16, 16_385), ..good.clone() },
                "--texture-size",
            ),
        ];
        for (options, name) in bad {
            let error = options.validate().unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().starts_with(name), "{error}");
        }
    }
}
