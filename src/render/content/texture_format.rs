//! How texels are stored.

use serde::Serialize;

/// Longest side of a picture that is compressed, in texels: what any card takes whole that samples
/// BC7. Of a larger one the largest levels may have to be left away, and what then comes first need
/// not be whole blocks.
pub(crate) const LONGEST_COMPRESSED: u32 = 8_192;

/// How texels are stored in memory, here as on the graphics card.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TextureFormat {
    /// Four bytes a texel, as decoded.
    #[default]
    Rgba8,
    /// One byte a texel: blocks of 4 × 4 texels in 16 bytes each, at a PSNR of some 42 dB.
    Bc7,
}

impl TextureFormat {
    /// The format of a picture of this size where `self` is asked for. Compressed are pictures both
    /// of whose sides are multiples of four texels, as graphics interfaces demand, and at most 8,192
    /// long; the others stay RGBA8. All atlases are such; of textures that repeat, which keep the
    /// size of their source, those that are not cannot be padded without a seam.
    pub fn of_picture(self, [width, height]: [u32; 2]) -> Self {
        let whole = |side: u32| {
            side.is_multiple_of(Self::Bc7.block_side()) && (1..=LONGEST_COMPRESSED).contains(&side)
        };
        if whole(width) && whole(height) { self } else { Self::Rgba8 }
    }

    /// Texels along the side of a block.
    pub fn block_side(self) -> u32 {
        match self {
            Self::Rgba8 => 1,
            Self::Bc7 => 4,
        }
    }

    /// Bytes of a block.
    pub fn block_bytes(self) -> u32 {
        match self {
            Self::Rgba8 => 4,
            Self::Bc7 => 16,
        }
    }

    /// Blocks across and up a level of so many texels; those at its ends may reach beyond it.
    pub fn blocks(self, size: [u32; 2]) -> [u32; 2] {
        size.map(|side| side.div_ceil(self.block_side()))
    }

    /// Bytes of a level of so many texels.
    pub(crate) fn level_bytes(self, size: [u32; 2]) -> u64 {
        let [across, up] = self.blocks(size).map(u64::from);
        across * up * u64::from(self.block_bytes())
    }
}
