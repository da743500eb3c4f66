//! What content will take in memory, from a scene's figures alone.

use super::Vertex;

/// Bytes of a vertex.
pub const VERTEX_BYTES: u64 = size_of::<Vertex>() as u64;

/// Most vertices that 16-bit indices refer to.
pub(super) const MOST_SHORT_VERTICES: u64 = 1 << 16;

/// Bytes that a node with so many vertices and triangles and with own pictures of these sizes
/// takes: [`Content::bytes`](super::Content::bytes), before its file is read.
pub fn held_bytes(vertices: u32, triangles: u32, pictures: &[[u32; 2]]) -> u64 {
    let vertices = u64::from(vertices);
    let index_bytes = if vertices <= MOST_SHORT_VERTICES { 2 } else { 4 };
    let indices = (u64::from(triangles) * 3 * index_bytes).next_multiple_of(4);
    let pictures = pictures.iter().map(|&[width, height]| picture_bytes(width, height));
    vertices * VERTEX_BYTES + indices + pictures.sum::<u64>()
}

/// Bytes that a picture takes: RGBA in 8 bits at all sizes, each half of the one before, to one
/// texel.
pub fn picture_bytes(width: u32, height: u32) -> u64 {
    level_sizes(width, height).map(level_bytes).sum()
}

/// Width and height of a picture and of its smaller versions, down to one texel. A size of zero
/// counts as one.
pub(crate) fn level_sizes(width: u32, height: u32) -> impl Iterator<Item = [u32; 2]> {
    let levels = width.max(height).max(1).ilog2() + 1;
    (0..levels).map(move |level| [width, height].map(|side| (side >> level).max(1)))
}

/// Bytes of one level.
pub(crate) fn level_bytes([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height) * 4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_go_down_to_one_texel() {
        let sizes: Vec<_> = level_sizes(10, 3).collect();
        assert_eq!(sizes, [[10, 3], [5, 1], [2, 1], [1, 1]]);
        assert_eq!(level_sizes(1, 1).count(), 1);
        assert_eq!(picture_bytes(10, 3), 4 * (30 + 5 + 2 + 1));
        assert_eq!(picture_bytes(4, 4), 4 * 21);
    }

    #[test]
    fn indices_grow_where_they_must() {
        assert_eq!(held_bytes(3, 1, &[]), 3 * 24 + 8);
        assert_eq!(held_bytes(65_536, 2, &[]), 65_536 * 24 + 12);
        assert_eq!(held_bytes(65_537, 2, &[]), 65_537 * 24 + 24);
        assert_eq!(held_bytes(0, 0, &[[1, 1], [2, 2]]), 4 + 20);
        assert!(held_bytes(u32::MAX, u32::MAX, &[[u32::MAX; 2]]) > 0);
    }
}
