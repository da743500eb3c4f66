//! Buffer views compressed with meshoptimizer's codecs (`EXT_meshopt_compression`).

use super::glb_schema::Mode;

/// Compressed bytes blow up by at most this factor when a node is read: the vertex codec stores 16
/// equal bytes in 4 bits at best, the index codec a triangle of 12 bytes in one byte.
const MOST_BLOW_UP: usize = 64;
/// Bytes of a block's first vertex and the like, which small views have beside.
const HEADERS: usize = 4096;

/// Compresses vertices of `stride` bytes: 4, 8 or 12.
pub(super) fn encode_vertices(bytes: &[u8], stride: usize) -> Option<Vec<u8>> {
    // Version 0 of the codec, the one that the extension knows.
    const VERSION: Option<i32> = Some(0);
    const LEVEL: i32 = 2;
    match stride {
        4 => meshopt::encode_vertex_buffer_level(bytes.as_chunks::<4>().0, LEVEL, VERSION).ok(),
        8 => meshopt::encode_vertex_buffer_level(bytes.as_chunks::<8>().0, LEVEL, VERSION).ok(),
        12 => meshopt::encode_vertex_buffer_level(bytes.as_chunks::<12>().0, LEVEL, VERSION).ok(),
        _ => None,
    }
}

/// Compresses the corners of triangles; each may be turned, so that another corner is first.
pub(super) fn encode_triangles(indices: &[u32], vertices: usize) -> Option<Vec<u8>> {
    meshopt::encode_index_buffer(indices, vertices).ok()
}

/// The bytes of `count` elements of `stride` bytes.
pub(super) fn decode(
    bytes: &[u8],
    mode: &Mode,
    count: usize,
    stride: usize,
) -> Result<Vec<u8>, String> {
    let most = bytes.len().saturating_mul(MOST_BLOW_UP).saturating_add(HEADERS);
    if count.checked_mul(stride).is_none_or(|length| length > most) {
        let given = bytes.len();
        return Err(format!("{count} elements of {stride} bytes do not fit in {given} bytes"));
    }
    let broken = |_| "damaged compressed data".to_owned();
    match (mode, stride) {
        (Mode::Attributes, 4) => {
            meshopt::decode_vertex_buffer::<[u8; 4]>(bytes, count).map(|v| v.into_flattened())
        }
        (Mode::Attributes, 8) => {
            meshopt::decode_vertex_buffer::<[u8; 8]>(bytes, count).map(|v| v.into_flattened())
        }
        (Mode::Attributes, 12) => {
            meshopt::decode_vertex_buffer::<[u8; 12]>(bytes, count).map(|v| v.into_flattened())
        }
        (Mode::Triangles, 2) if count.is_multiple_of(3) => {
            meshopt::decode_index_buffer::<u16>(bytes, count)
                .map(|indices| indices.into_iter().flat_map(u16::to_le_bytes).collect())
        }
        (Mode::Triangles, 4) if count.is_multiple_of(3) => {
            meshopt::decode_index_buffer::<u32>(bytes, count)
                .map(|indices| indices.into_iter().flat_map(u32::to_le_bytes).collect())
        }
        _ => return Err(format!("{mode:?} of {count} elements of {stride} bytes")),
    }
    .map_err(broken)
}
