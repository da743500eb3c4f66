//! Buffer views that are compressed with meshoptimizer's codecs: EXT_meshopt_compression and its successor
//! KHR_meshopt_compression.

use bytemuck::{cast_slice, cast_slice_mut};
use meshopt::encoding::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat,
    decode_index_sequence, decode_vertex_version,
};
use serde::Deserialize;
use serde_json::Value;

/// The names of the extension.
pub(super) const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Bytes to which a compressed byte can grow at most, by version of the vertex codec: version 0 stores 16 equal
/// bytes in 2 bits, version 1 stores 256 equal bytes in 2 bits. Indices grow less.
const MOST_GROWTH: [usize; 2] = [64, 1024];

/// Bytes that a compressed view may have beyond [`MOST_GROWTH`]: a first vertex and the like.
const HEADER_BYTES: usize = 4096;

/// The compressed form of a buffer view, as the file describes it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    /// The buffer with the compressed bytes.
    pub(super) buffer: usize,
    /// Their first byte.
    #[serde(default)]
    pub(super) byte_offset: usize,
    /// Their number.
    pub(super) byte_length: usize,
    /// Bytes of an element.
    byte_stride: usize,
    /// Elements.
    count: usize,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// What a file says of its compressed buffer views, before anything is decoded.
#[derive(Debug, Default)]
pub(super) struct Compression {
    /// By buffer view; `None` where it is not compressed.
    pub(super) views: Vec<Option<Compressed>>,
    /// By buffer: true if it only stands in for decoded data and need not be read.
    pub(super) is_fallback: Vec<bool>,
}

impl Compression {
    pub(super) fn read(json: &Value) -> Result<Self, String> {
        let array = |field: &str| json[field].as_array().map_or(&[][..], Vec::as_slice);
        let extension = |object: &'_ Value| {
            NAMES.into_iter().find(|name| object["extensions"][name].is_object())
        };
        let view = |(number, view): (usize, &Value)| {
            let Some(name) = extension(view) else { return Ok(None) };
            Compressed::deserialize(&view["extensions"][name])
                .map(Some)
                .map_err(|error| format!("buffer view {number}: {name}: {error}"))
        };
        let is_fallback = |buffer: &Value| {
            extension(buffer).is_some_and(|name| buffer["extensions"][name]["fallback"] == true)
        };
        Ok(Self {
            views: array("bufferViews").iter().enumerate().map(view).collect::<Result<_, _>>()?,
            is_fallback: array("buffers").iter().map(is_fallback).collect(),
        })
    }
}

impl Compressed {
    /// The elements as plain bytes, `byte_stride` each, from their compressed bytes.
    pub(super) fn decode(&self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let Self { count, byte_stride: stride, mode, filter, .. } = *self;
        let version = match mode {
            Mode::Attributes => decode_vertex_version(bytes).unwrap_or(0),
            _ => 0,
        };
        let growth = MOST_GROWTH[usize::from(version > 0)];
        let most = bytes.len().saturating_mul(growth).saturating_add(HEADER_BYTES);
        let length = count.checked_mul(stride).filter(|length| *length <= most);
        let length = length.ok_or_else(|| {
            format!("{count} elements of {stride} bytes do not fit in {} bytes", bytes.len())
        })?;
        let indices = |decoded: Option<Vec<u16>>| decoded.map(|all| cast_slice(&all).to_vec());
        let long_indices = |decoded: Option<Vec<u32>>| decoded.map(|all| cast_slice(&all).to_vec());
        let decoded: Option<Vec<u8>> = match (mode, stride) {
            (Mode::Attributes, 4..=256) if filter.suits(stride) => {
                let mut words = vec![0_u32; length / 4];
                decode_vertices(bytes, stride, &mut words).then(|| {
                    filter.apply(&mut words, stride);
                    cast_slice(&words).to_vec()
                })
            }
            (Mode::Triangles, 2) if count.is_multiple_of(3) => {
                indices(meshopt::decode_index_buffer(bytes, count).ok())
            }
            (Mode::Triangles, 4) if count.is_multiple_of(3) => {
                long_indices(meshopt::decode_index_buffer(bytes, count).ok())
            }
            (Mode::Indices, 2) => indices(decode_index_sequence(bytes, count).ok()),
            (Mode::Indices, 4) => long_indices(decode_index_sequence(bytes, count).ok()),
            _ => {
                return Err(format!("{mode:?} of {count} elements of {stride} bytes, {filter:?}"));
            }
        };
        decoded.ok_or_else(|| "damaged compressed data".to_owned())
    }
}

/// Decodes vertices of `stride` bytes, a multiple of 4 up to 256, into `words`. Returns whether they are intact.
fn decode_vertices(bytes: &[u8], stride: usize, words: &mut [u32]) -> bool {
    let count = words.len() * 4 / stride;
    // SAFETY: the decoder checks `bytes` and writes `count * stride` bytes, which `words` has.
    let status = unsafe {
        meshopt::ffi::meshopt_decodeVertexBuffer(
            words.as_mut_ptr().cast(),
            count,
            stride,
            bytes.as_ptr(),
            bytes.len(),
        )
    };
    status == 0
}

impl Filter {
    /// True if the filter is defined for vertices of `stride` bytes.
    fn suits(self, stride: usize) -> bool {
        match self {
            Self::None | Self::Exponential => stride.is_multiple_of(4),
            Self::Octahedral | Self::Color => matches!(stride, 4 | 8),
            Self::Quaternion => stride == 8,
        }
    }

    /// Turns filtered vertices into plain ones.
    fn apply(self, words: &mut [u32], stride: usize) {
        match (self, stride) {
            (Self::None, _) => {}
            (Self::Octahedral, 4) => decode_filter_oct::<i8>(cast_slice_mut(words)),
            (Self::Octahedral, _) => decode_filter_oct::<i16>(cast_slice_mut(words)),
            (Self::Quaternion, _) => decode_filter_quat(cast_slice_mut(words)),
            (Self::Exponential, _) => decode_filter_exp::<1>(cast_slice_mut(words)),
            (Self::Color, 4) => decode_filter_color::<u8>(cast_slice_mut(words)),
            (Self::Color, _) => decode_filter_color::<u16>(cast_slice_mut(words)),
        }
    }
}
