//! What content will take in memory, from a scene's figures alone.

use super::{TextureFormat, Vertex};

/// Bytes of a vertex.
pub const VERTEX_BYTES: u64 = size_of::<Vertex>() as u64;

/// Most vertices that 16-bit indices refer to.
pub(super) const MOST_SHORT_VERTICES: u64 = 1 << 16;

/// Bytes that a node with so many vertices and triangles and with own pictures of these sizes
/// takes where they are wanted in `format`: [`Content::bytes`](super::Content::bytes), before its file
/// is read.
pub fn held_bytes(
    vertices: u32,
    triangles: u32,
    pictures: &[[u32; 2]],
    format: TextureFormat,
) -> u64 {
    let vertices = u64::from(vertices);
    let index_bytes = if vertices <= MOST_SHORT_VERTICES { 2 } else { 4 };
    let indices = (u64::from(triangles) * 3 * index_bytes).next_multiple_of(4);
    let pictures = pictures.iter().map(|&size| picture_bytes(size, format));
    vertices * VERTEX_BYTES + indices + pictures.sum::<u64>()
}

/// Bytes that a picture takes that is wanted in `format`: all sizes, each half of the one before, to
/// one texel.
pub fn picture_bytes(size: [u32; 2], format: TextureFormat) -> u64 {
    let format = format.of_picture(size);
    level_sizes(size[0], size[1]).map(|level| format.level_bytes(level)).sum()
}

/// Width and height of a picture and of its smaller versions, down to one texel. A size of zero
/// counts as one.
pub(crate) fn level_sizes(width: u32, height: u32) -> impl Iterator<Item = [u32; 2]> {
    let levels = width.max(height).max(1).ilog2() + 1;
    (0..levels).map(move |level| [width, height].map(|side| (side >> level).max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use TextureFormat::{Bc7, Rgba8};

    #[test]
    fn levels_go_down_to_one_texel() {
        let sizes: Vec<_> = level_sizes(10, 3).collect();
        assert_eq!(sizes, [[10, 3], [5, 1], [2, 1], [1, 1]]);
        assert_eq!(level_sizes(1, 1).count(), 1);
        assert_eq!(picture_bytes([10, 3], Rgba8), 4 * (30 + 5 + 2 + 1));
        assert_eq!(picture_bytes([4, 4], Rgba8), 4 * 21);
    }

    #[test]
    fn compressed_levels_are_whole_blocks() {
        // 12 × 20, 6 × 10, 3 × 5, 1 × 2, 1 × 1.
        assert_eq!(picture_bytes([12, 20], Bc7), 16 * (3 * 5 + 2 * 3 + 2 + 1 + 1));
        assert_eq!(picture_bytes([4, 4], Bc7), 16 * 3);
        for size in [[10, 4], [4, 10], [3, 3], [8_196, 4], [4, 8_196], [0, 4]] {
            assert_eq!(picture_bytes(size, Bc7), picture_bytes(size, Rgba8), "{size:?}");
        }
        let quarter =
            picture_bytes([8_192, 8_192], Bc7) as f64 / picture_bytes([8_192, 8_192], Rgba8) as f64;
        assert!((quarter - 0.25).abs() < 1e-6, "{quarter}");
    }

    #[test]
    fn indices_grow_where_they_must() {
        assert_eq!(held_bytes(3, 1, &[], Rgba8), 3 * 24 + 8);
        assert_eq!(held_bytes(65_536, 2, &[], Rgba8), 65_536 * 24 + 12);
        assert_eq!(held_bytes(65_537, 2, &[], Rgba8), 65_537 * 24 + 24);
        assert_eq!(held_bytes(0, 0, &[[1, 1], [2, 2]], Rgba8), 4 + 20);
        assert_eq!(held_bytes(0, 0, &[[4, 4], [2, 2]], Bc7), 48 + 20);
        assert!(held_bytes(u32::MAX, u32::MAX, &[[u32::MAX; 2]], Bc7) > 0);
    }
}
