//! The bytes of a glTF file: container, buffers, views and accessors, every bound checked here.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Index, Root, buffer};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::gltf_meshopt::{Compressed, Compression};
use super::paths::Finder;
use crate::side_file;
use crate::stage_timer::StageTimer;

/// A `.glb` taken apart: its JSON and its binary chunk.
///
/// Bytes that are no GLB are the JSON themselves.
pub(super) fn container(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| -> Result<u32, String> {
        let word = bytes.get(at..).and_then(<[u8]>::first_chunk);
        word.map(|word| u32::from_le_bytes(*word)).ok_or_else(|| {
            format!("is truncated: expected a field at byte {at} of {}", bytes.len())
        })
    };
    let (version, length) = (word(4)?, word(8)? as usize);
    if version != 2 {
        return Err(format!("is GLB version {version}; expected 2"));
    }
    if length > bytes.len() {
        return Err(format!("is truncated: expected {length} bytes, found {}", bytes.len()));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at < length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let chunk =
            bytes[..length].get(at + 8..).and_then(|rest| rest.get(..size)).ok_or_else(|| {
                format!("is truncated: expected a chunk of {size} bytes at byte {at} of {length}")
            })?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        // Chunks are padded to four bytes by their own length; writers that forget are forgiven.
        at += 8 + size.next_multiple_of(4);
    }
    json.map(|json| (json, binary)).ok_or_else(|| "has no JSON chunk".to_owned())
}

/// The bytes of a URI: `data:` itself or a file beside the model, with that file's path.
pub(super) fn read_uri(
    uri: &str,
    finder: &mut Finder,
) -> Result<(Vec<u8>, Option<PathBuf>), String> {
    if let Some(data) = uri.strip_prefix("data:") {
        return Ok((data_uri(data)?, None));
    }
    let file = find_uri(uri, finder)?;
    match side_file::read(&file, side_file::MOST_BYTES) {
        Ok(bytes) => Ok((bytes, Some(file))),
        Err(error) => Err(format!("{} cannot be read: {error}", file.display())),
    }
}

/// The file that a relative URI means, its percent signs decoded or, failing that, as written. The
/// error says why there is none.
pub(super) fn find_uri(uri: &str, finder: &mut Finder) -> Result<PathBuf, String> {
    let decoded = percent_decoded(uri.as_bytes());
    std::str::from_utf8(&decoded)
        .ok()
        .and_then(|name| finder.find(name))
        .or_else(|| finder.find(uri))
        .ok_or_else(|| format!("{uri} {}", finder.why_missing(&decoded)))
}

/// What follows `data:`, decoded.
fn data_uri(data: &str) -> Result<Vec<u8>, String> {
    let (head, payload) = data.split_once(',').ok_or("data URI without a comma")?;
    if !head.ends_with(";base64") {
        return Ok(percent_decoded(payload.as_bytes()));
    }
    let config = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    GeneralPurpose::new(&STANDARD, config)
        .decode(payload.trim())
        .map_err(|error| format!("data URI is not base64: {error}"))
}

fn percent_decoded(text: &[u8]) -> Vec<u8> {
    let mut decoded = Vec::with_capacity(text.len());
    let mut rest = text;
    while let [first, tail @ ..] = rest {
        let digits = tail.first_chunk::<2>().and_then(|pair| std::str::from_utf8(pair).ok());
        let value = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match value {
            Some(value) if *first == b'%' => {
                decoded.push(value);
                rest = &tail[2..];
            }
            _ => {
                decoded.push(*first);
                rest = tail;
            }
        }
    }
    decoded
}

/// The buffers of a file, in memory.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    bytes: Vec<Cow<'a, [u8]>>,
    /// By buffer view: its bytes, if it was compressed.
    decoded: Vec<Option<Vec<u8>>>,
    /// Of the sparse accessors that were read.
    replaced: Mutex<BTreeMap<usize, Arc<Replaced>>>,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers and decodes what is compressed; the files among them are added to
    /// `dependencies`.
    pub(super) fn read(
        root: &'a Root,
        compression: &Compression,
        binary: Option<&'a [u8]>,
        finder: &mut Finder,
        dependencies: &mut Vec<PathBuf>,
    ) -> Result<Self, String> {
        let mut bytes = Vec::with_capacity(root.buffers.len());
        for (number, buffer) in root.buffers.iter().enumerate() {
            let is_fallback = compression.is_fallback.get(number) == Some(&true);
            let data: Cow<[u8]> = match (&buffer.uri, binary) {
                _ if is_fallback => Cow::Borrowed(&[]),
                (Some(uri), _) => {
                    let (data, file) =
                        read_uri(uri, finder).map_err(|what| format!("buffer {number}: {what}"))?;
                    dependencies.extend(file);
                    Cow::Owned(data)
                }
                (None, Some(binary)) if number == 0 => Cow::Borrowed(binary),
                // Refused where something reads it.
                _ => Cow::Borrowed(&[]),
            };
            let missing = is_fallback || (buffer.uri.is_none() && data.is_empty());
            if (data.len() as u64) < buffer.byte_length.0 && !missing {
                return Err(format!(
                    "buffer {number} is truncated: expected {} bytes, found {}",
                    buffer.byte_length.0,
                    data.len()
                ));
            }
            bytes.push(data);
        }
        let mut buffers = Self { root, bytes, decoded: Vec::new(), replaced: Mutex::default() };
        buffers.decoded = buffers.decode(&compression.views)?;
        Ok(buffers)
    }

    /// Decodes compressed views. None of their bytes may be decoded twice, so that a small file cannot ask for
    /// more than codecs can make of it.
    fn decode(&self, views: &[Option<Compressed>]) -> Result<Vec<Option<Vec<u8>>>, String> {
        let held: usize = self.bytes.iter().map(|bytes| bytes.len()).sum();
        let lengths = views.iter().flatten().map(|view| view.byte_length);
        let used = lengths.fold(0, usize::saturating_add);
        if used > held {
            return Err(format!(
                "compressed buffer views have {used} bytes, but all buffers have {held}"
            ));
        }
        let decode = |(number, view): (usize, &Option<Compressed>)| {
            let Some(view) = view else { return Ok(None) };
            let bytes = self.bytes.get(view.buffer).and_then(|bytes| {
                bytes.get(view.byte_offset..view.byte_offset.checked_add(view.byte_length)?)
            });
            let decoded = match bytes {
                Some(bytes) => view.decode(bytes),
                None => Err(format!(
                    "{} compressed bytes from {} are not in buffer {}",
                    view.byte_length, view.byte_offset, view.buffer
                )),
            };
            decoded.map(Some).map_err(|what| format!("buffer view {number}: {what}"))
        };
        let timer = StageTimer::current();
        views.par_iter().enumerate().map(|view| timer.time(|| decode(view))).collect()
    }

    /// The bytes of a view, its stride not considered.
    pub(super) fn view(&self, index: Index<buffer::View>) -> Result<&[u8], String> {
        let number = index.value();
        if let Some(Some(decoded)) = self.decoded.get(number) {
            return Ok(decoded);
        }
        let view =
            self.root.buffer_views.get(number).ok_or_else(|| no_such("buffer view", number))?;
        let owner = view.buffer.value();
        let bytes = self.bytes.get(owner).ok_or_else(|| no_such("buffer", owner))?;
        slice(bytes, view.byte_offset.unwrap_or_default(), view.byte_length).ok_or_else(|| {
            format!(
                "buffer view {number}: {} bytes from {}, but buffer {owner} has {}",
                view.byte_length.0,
                view.byte_offset.unwrap_or_default().0,
                bytes.len()
            )
        })
    }

    /// The elements of an accessor of `N` components, integers scaled where it is normalised.
    pub(super) fn vectors<const N: usize>(
        &self,
        index: Index<gltf_json::Accessor>,
    ) -> Result<Vec<[f64; N]>, String> {
        let vectors = self.vector_elements(index)?;
        Ok((0..vectors.len()).map(|at| vectors.get(at)).collect())
    }

    /// The same, of which none is decoded before it is asked for: many primitives may share an accessor that
    /// is much larger than what each of them uses.
    pub(super) fn vector_elements<const N: usize>(
        &self,
        index: Index<gltf_json::Accessor>,
    ) -> Result<Vectors<'_, N>, String> {
        let number = index.value();
        let accessor = self.layout(number)?;
        if accessor.components != N {
            return Err(format!(
                "accessor {number} has {} components; expected {N}",
                accessor.components
            ));
        }
        let elements = self.elements(number, &accessor)?;
        let (kind, normalized) = (accessor.component_type, accessor.normalized);
        Ok(Vectors { elements, kind, normalized })
    }

    /// The number of components of an accessor's elements.
    pub(super) fn components(&self, index: Index<gltf_json::Accessor>) -> Result<usize, String> {
        Ok(self.layout(index.value())?.components)
    }

    /// The elements of an accessor of whole numbers.
    pub(super) fn indices(&self, index: Index<gltf_json::Accessor>) -> Result<Vec<u32>, String> {
        let number = index.value();
        let accessor = self.layout(number)?;
        let kind = accessor.component_type;
        if accessor.components != 1 || !is_unsigned(kind) {
            return Err(format!("accessor {number} holds no indices; expected unsigned scalars"));
        }
        let elements = self.elements(number, &accessor)?;
        let index = |at: usize| elements.get(at).map_or(0, |element| unsigned(element, kind));
        Ok((0..accessor.count).map(index).collect())
    }

    /// The bytes of an accessor's elements, those that `sparse` replaces included.
    fn elements(&self, number: usize, accessor: &Layout) -> Result<Elements<'_>, String> {
        let (size, count) = (accessor.size(), accessor.count);
        let mut elements = Elements {
            bytes: None,
            stride: size,
            size,
            count,
            replaced: Arc::default(),
            values: &[],
        };
        match accessor.json.buffer_view {
            Some(view) => {
                if let Some(stride) = self.root.buffer_views[view.value()].byte_stride {
                    elements.stride = stride.0;
                }
                let offset = accessor.json.byte_offset.unwrap_or_default();
                let bytes = self.strided(number, view, offset, count, elements.stride, size)?;
                elements.bytes = Some(bytes);
            }
            None => {
                // All zero. No element without a byte somewhere, so that no count is believed.
                let held: usize = self.bytes.iter().map(|bytes| bytes.len()).sum();
                if accessor.json.sparse.is_none() || count > held {
                    return Err(format!("accessor {number} has no data"));
                }
            }
        }
        if let Some(sparse) = &accessor.json.sparse {
            let (values, replacing) = (&sparse.values, sparse.count.0 as usize);
            let offset = values.byte_offset;
            elements.values =
                self.strided(number, values.buffer_view, offset, replacing, size, size)?;
            elements.replaced = self.replaced(number, sparse, count)?;
        }
        Ok(elements)
    }

    /// The place among the values of each element that `sparse` replaces: the last, where there are
    /// several. Found once for each accessor.
    fn replaced(
        &self,
        number: usize,
        sparse: &gltf_json::accessor::sparse::Sparse,
        elements: usize,
    ) -> Result<Arc<Replaced>, String> {
        let mut known = self.replaced.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(replaced) = known.get(&number) {
            return Ok(Arc::clone(replaced));
        }
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err(format!("accessor {number}: unknown type of sparse indices"));
        };
        let (indices, count) = (&sparse.indices, sparse.count.0 as usize);
        let size = index_type.0.size();
        let bytes =
            self.strided(number, indices.buffer_view, indices.byte_offset, count, size, size)?;
        let mut replaced = Replaced::default();
        for at in 0..count {
            let index = unsigned(&bytes[at * size..][..size], index_type.0);
            if index as usize >= elements {
                return Err(format!("accessor {number}: sparse index {index} of {elements}"));
            }
            replaced.insert(index, at);
        }
        let replaced = Arc::new(replaced);
        known.insert(number, Arc::clone(&replaced));
        Ok(replaced)
    }

    /// The bytes of a view from `offset` in which `count` elements lie `stride` apart.
    fn strided(
        &self,
        number: usize,
        view: Index<buffer::View>,
        offset: USize64,
        count: usize,
        stride: usize,
        size: usize,
    ) -> Result<&[u8], String> {
        let bytes = self.view(view)?;
        let start = usize::try_from(offset.0).unwrap_or(usize::MAX);
        let needed = count
            .saturating_sub(1)
            .checked_mul(stride)
            .and_then(|bytes| bytes.checked_add(if count == 0 { 0 } else { size }));
        let end = needed.and_then(|needed| start.checked_add(needed));
        match end.and_then(|end| bytes.get(start..end)) {
            Some(_) if stride < size => {
                Err(format!("accessor {number}: stride {stride} for elements of {size} bytes"))
            }
            Some(bytes) => Ok(bytes),
            None => Err(format!(
                "accessor {number}: {count} elements from byte {start}, {stride} apart, but buffer \
                 view {} has {} bytes",
                view.value(),
                bytes.len()
            )),
        }
    }

    fn layout(&self, number: usize) -> Result<Layout<'a>, String> {
        let json = self.root.accessors.get(number).ok_or_else(|| no_such("accessor", number))?;
        let (Checked::Valid(GenericComponentType(component_type)), Checked::Valid(type_)) =
            (json.component_type, json.type_)
        else {
            return Err(format!("accessor {number} has an unknown type"));
        };
        let components = match type_ {
            Type::Scalar => 1,
            Type::Vec2 => 2,
            Type::Vec3 => 3,
            Type::Vec4 => 4,
            // Columns of 16 bytes, without padding.
            Type::Mat4 if component_type == ComponentType::F32 => 16,
            _ => return Err(format!("accessor {number} holds matrices of an unexpected type")),
        };
        if let Some(view) = json.buffer_view
            && view.value() >= self.root.buffer_views.len()
        {
            return Err(no_such("buffer view", view.value()));
        }
        let count = usize::try_from(json.count.0).unwrap_or(usize::MAX);
        Ok(Layout { json, component_type, components, count, normalized: json.normalized })
    }
}

/// By element, its place among the values that `sparse` gives.
type Replaced = FxHashMap<u32, usize>;

/// The bytes of an accessor's elements.
struct Elements<'b> {
    /// `None` where all are zero.
    bytes: Option<&'b [u8]>,
    stride: usize,
    size: usize,
    count: usize,
    replaced: Arc<Replaced>,
    values: &'b [u8],
}

impl Elements<'_> {
    /// The bytes of one; `None` where it is zero.
    #[inline]
    fn get(&self, at: usize) -> Option<&[u8]> {
        if !self.replaced.is_empty()
            && let Some(place) = self.replaced.get(&(at as u32))
        {
            return Some(&self.values[place * self.size..][..self.size]);
        }
        self.bytes.map(|bytes| &bytes[at * self.stride..][..self.size])
    }
}

/// The elements of an accessor of `N` components.
pub(super) struct Vectors<'b, const N: usize> {
    elements: Elements<'b>,
    kind: ComponentType,
    normalized: bool,
}

impl<const N: usize> Vectors<'_, N> {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.elements.count
    }

    /// One of them, integers scaled where the accessor is normalised.
    #[inline]
    pub(super) fn get(&self, at: usize) -> [f64; N] {
        let element = self.elements.get(at);
        let component =
            |at| element.map_or(0.0, |element| component(element, at, self.kind, self.normalized));
        std::array::from_fn(component)
    }
}

/// What an accessor says of its elements, checked.
struct Layout<'a> {
    json: &'a gltf_json::Accessor,
    component_type: ComponentType,
    components: usize,
    count: usize,
    normalized: bool,
}

impl Layout<'_> {
    /// Bytes of an element.
    fn size(&self) -> usize {
        self.component_type.size() * self.components
    }
}

fn no_such(what: &str, number: usize) -> String {
    format!("there is no {what} {number}")
}

fn slice(bytes: &[u8], offset: USize64, length: USize64) -> Option<&[u8]> {
    let start = usize::try_from(offset.0).ok()?;
    let end = start.checked_add(usize::try_from(length.0).ok()?)?;
    bytes.get(start..end)
}

fn is_unsigned(kind: ComponentType) -> bool {
    matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

/// An unsigned integer of 1, 2 or 4 bytes.
fn unsigned(bytes: &[u8], kind: ComponentType) -> u32 {
    match (kind, bytes) {
        (ComponentType::U8, &[a, ..]) => a.into(),
        (ComponentType::U16, &[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
        (_, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}

/// Component `at` of an element; normalised integers as glTF 2.0, section 3.6.2.2, maps them.
fn component(element: &[u8], at: usize, kind: ComponentType, normalized: bool) -> f64 {
    let bytes = &element[at * kind.size()..];
    let (value, largest) = match (kind, bytes) {
        (ComponentType::F32, &[a, b, c, d, ..]) => {
            return f64::from(f32::from_le_bytes([a, b, c, d]));
        }
        (ComponentType::I8, &[a, ..]) => (f64::from(a as i8), 127.0),
        (ComponentType::I16, &[a, b, ..]) => (f64::from(i16::from_le_bytes([a, b])), 32767.0),
        (ComponentType::U8, &[a, ..]) => (f64::from(a), 255.0),
        (ComponentType::U16, &[a, b, ..]) => (f64::from(u16::from_le_bytes([a, b])), 65535.0),
        (_, bytes) => (f64::from(unsigned(bytes, kind)), f64::from(u32::MAX)),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_decoded() {
        assert_eq!(percent_decoded(b"a%20b%2Fc%zz%4"), b"a b/c%zz%4");
        assert_eq!(data_uri("application/octet-stream;base64,AQID").unwrap(), [1, 2, 3]);
        assert_eq!(data_uri(";base64,AQI").unwrap(), [1, 2]);
        assert_eq!(data_uri("text/plain,a%20b").unwrap(), b"a b");
        assert!(data_uri("no comma").is_err());
        assert!(data_uri(";base64,!!!!").is_err());
    }

    #[test]
    fn containers_are_taken_apart_or_refused() {
        let mut glb =
            b"glTF\x02\0\0\0\0\0\0\0\x04\0\0\0JSON{}  \x02\0\0\0BIN\0\x01\x02\0\0".to_vec();
        glb[8] = glb.len() as u8;
        assert_eq!(container(&glb).unwrap(), (&b"{}  "[..], Some(&[1_u8, 2][..])));
        assert_eq!(container(b"{}").unwrap(), (&b"{}"[..], None));
        for length in 4..glb.len() {
            assert!(container(&glb[..length]).unwrap_err().contains("truncated"), "{length}");
        }
        glb[4] = 1;
        assert!(container(&glb).unwrap_err().contains("version 1"));
    }

    #[test]
    fn normalised_integers_reach_their_ends() {
        assert_eq!(component(&[255], 0, ComponentType::U8, true), 1.0);
        assert_eq!(component(&[0x80], 0, ComponentType::I8, true), -1.0);
        assert_eq!(component(&[0, 0xff, 0xff], 0, ComponentType::I16, false), -256.0);
        assert_eq!(component(&[0, 0, 0xff, 0xff], 1, ComponentType::U16, true), 1.0);
    }
}
