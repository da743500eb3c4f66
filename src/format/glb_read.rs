//! Reads a node's file: the exact inverse of `write_glb`, and of nothing else. Nothing in the
//! file is trusted, and what is read never takes more memory than a small multiple of its size.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::TEXTURES_URI;
use super::bytes::Cursor;
use super::corner_normals::join_vertices;
use super::file_name::is_plain_file_name;
use super::glb_packed::decode;
use super::glb_schema::{self as schema, *};
use super::node_mesh::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use super::quantized::{from_share, from_steps};
use crate::mesh::{AlphaMode, Normal, Wrap};
use crate::{Error, Result};

/// What is wrong with the file; the path is added at the end.
type Parsed<T> = Result<T, String>;

/// Reads the bytes of a file that [`write_glb`](super::write_glb) wrote; `path` is for messages
/// only.
pub fn read_glb(bytes: &[u8], path: &Path) -> Result<NodeMesh> {
    parse(bytes, true).map_err(|what| Error::input(path, format!("not a node file: {what}")))
}

/// [`read_glb`] without normals, in less time: for all who shade triangles by their planes.
pub fn read_glb_without_normals(bytes: &[u8], path: &Path) -> Result<NodeMesh> {
    parse(bytes, false).map_err(|what| Error::input(path, format!("not a node file: {what}")))
}

fn parse(bytes: &[u8], with_normals: bool) -> Parsed<NodeMesh> {
    let (json, bin) = chunks(bytes)?;
    let root: Root = serde_json::from_slice(json).map_err(|error| format!("JSON: {error}"))?;
    let Root { asset, scene: 0, scenes, nodes, .. } = &root else {
        return Err(format!("expected scene 0, found {}", root.scene));
    };
    if asset.version != "2.0" {
        return Err(format!("expected glTF version 2.0, found {}", asset.version));
    }
    let ([scene], [node]) = (&scenes[..], &nodes[..]) else {
        let found = (scenes.len(), nodes.len());
        return Err(format!("expected one scene and one node, found {} and {}", found.0, found.1));
    };
    if scene.nodes != [0] {
        return Err(format!("expected the scene to be of node 0, found {:?}", scene.nodes));
    }
    let primitives = match (node.mesh, &root.meshes[..]) {
        (None, []) => &[][..],
        (Some(0), [mesh]) => &mesh.primitives[..],
        (found, meshes) => {
            return Err(format!("mesh {found:?} of {}: expected all or none", meshes.len()));
        }
    };
    let spent = vec![false; root.buffer_views.len()];
    let (origin, step) = placement(node)?;
    let mut reader = Reader { root: &root, bin: buffer(&root, bin)?, step, with_normals, spent };
    let primitives = primitives
        .iter()
        .zip(0..)
        .map(|(primitive, number)| {
            reader.primitive(primitive).map_err(|what| format!("primitive {number}: {what}"))
        })
        .collect::<Parsed<_>>()?;
    let images = root
        .images
        .iter()
        .zip(0..)
        .map(|(image, number)| {
            reader.image(image).map_err(|what| format!("image {number}: {what}"))
        })
        .collect::<Parsed<_>>()?;
    Ok(NodeMesh { origin, images, primitives })
}

/// The JSON and, where there is one, the binary chunk.
fn chunks(bytes: &[u8]) -> Parsed<(&[u8], Option<&[u8]>)> {
    let mut cursor = Cursor::new(bytes);
    word(&mut cursor, "magic", MAGIC)?;
    word(&mut cursor, "container version", 2)?;
    let length = u32::try_from(bytes.len()).map_err(|_| "longer than 4 GiB")?;
    word(&mut cursor, "length", length)?;
    let json = chunk(&mut cursor, CHUNK_JSON)?;
    let bin = if cursor.left() > 0 { Some(chunk(&mut cursor, CHUNK_BIN)?) } else { None };
    match cursor.left() {
        0 => Ok((json, bin)),
        left => Err(format!("expected the end after the binary chunk, found {left} bytes more")),
    }
}

fn word(cursor: &mut Cursor<'_>, what: &'static str, expected: u32) -> Parsed<()> {
    match cursor.u32(what).map_err(|cut| cut.to_string())? {
        found if found == expected => Ok(()),
        found => Err(format!("{what}: expected {expected:#x}, found {found:#x}")),
    }
}

fn chunk<'a>(cursor: &mut Cursor<'a>, kind: u32) -> Parsed<&'a [u8]> {
    let length = cursor.u32("chunk length").map_err(|cut| cut.to_string())?;
    word(cursor, "chunk type", kind)?;
    cursor.take(u64::from(length), "chunk").map_err(|cut| cut.to_string())
}

/// The bytes of the one buffer.
fn buffer<'a>(root: &Root, bin: Option<&'a [u8]>) -> Parsed<&'a [u8]> {
    match (&root.buffers[..], bin) {
        ([], None) => Ok(&[]),
        ([buffer], Some(bin)) | ([buffer, _], Some(bin)) if is_sound(&root.buffers) => {
            bin.get(..buffer.byte_length).ok_or_else(|| {
                format!("buffer: expected {} bytes, found {}", buffer.byte_length, bin.len())
            })
        }
        (buffers, bin) => {
            let found = (buffers.len(), usize::from(bin.is_some()));
            Err(format!("found {} buffers and {} binary chunks", found.0, found.1))
        }
    }
}

/// At most the one buffer that is in the file, and one that stands for what is compressed.
fn is_sound(buffers: &[Buffer]) -> bool {
    let is_fallback = |buffer: &Buffer| {
        buffer.extensions.as_ref().is_some_and(|extensions| extensions.meshopt.fallback)
    };
    buffers.iter().zip(0..).all(|(buffer, number)| match number {
        0 => buffer.extensions.is_none(),
        _ => is_fallback(buffer),
    })
}

/// The local origin in source coordinates, from the one or the other form that is written, and the
/// length of a step.
fn placement(node: &Placement) -> Parsed<([f64; 3], f32)> {
    let single = |value: f64| value as f32;
    let (translation, scale) =
        (node.translation.map(|t| t.map(single)), node.scale.map(|s| s.map(single)));
    let matrix = node.matrix.map(|matrix| matrix.map(single));
    let is_step = |step: f32| step > 0.0 && step.is_finite();
    let (origin, step) = match (translation, scale, matrix) {
        (Some(translation), None, None) => (translation, 1.0),
        (Some(translation), Some(scale), None) if is_step(scale[0]) && scale == [scale[0]; 3] => {
            (translation, scale[0])
        }
        (None, None, Some(matrix))
            if is_step(matrix[0])
                && matrix[..12] == Z_UP.map(|entry| entry as f32 * matrix[0])
                && matrix[15] == 1.0 =>
        {
            ([matrix[12], -matrix[14], matrix[13]], matrix[0])
        }
        (translation, scale, matrix) => {
            return Err(format!(
                "expected a translation and one scale, or a matrix that turns Z up into Y up, \
                 found {translation:?}, {scale:?} and {matrix:?}"
            ));
        }
    };
    finite("origin", &origin)?;
    Ok((origin.map(f64::from), step))
}

fn finite(what: &str, values: &[f32]) -> Parsed<()> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(found) => Err(format!("{what}: expected finite numbers, found {found}")),
        None => Ok(()),
    }
}

fn entry<'a, T>(list: &'a [T], what: &str, index: usize) -> Parsed<&'a T> {
    list.get(index)
        .ok_or_else(|| format!("{what}: expected an index below {}, found {index}", list.len()))
}

struct Reader<'a> {
    root: &'a Root,
    bin: &'a [u8],
    /// The length of a step; 1 where positions are metres.
    step: f32,
    with_normals: bool,
    /// The buffer views that have been read. Each is read once, so that a small file cannot ask
    /// for the same bytes again and again.
    spent: Vec<bool>,
}

impl<'a> Reader<'a> {
    fn primitive(&mut self, primitive: &schema::Primitive) -> Parsed<Primitive> {
        let schema::Primitive { attributes, indices, material, extras } = primitive;
        let positions = self.positions(attributes.position)?;
        finite("positions", positions.as_flattened())?;
        let texcoords: Vec<[f32; 2]> = match attributes.texcoord {
            Some(accessor) => self.texcoords(accessor)?,
            None => Vec::new(),
        };
        finite("texture coordinates", texcoords.as_flattened())?;
        let colors: Vec<[u16; 4]> = match attributes.color {
            Some(accessor) => {
                self.read(accessor, "colours", Shape::Vec4, UNSIGNED_SHORT, true, quad)?
            }
            None => Vec::new(),
        };
        let normals: Vec<Normal> = match attributes.normal {
            Some(accessor) if self.with_normals => self.normals(accessor)?,
            _ => Vec::new(),
        };
        let vertices = positions.len();
        for (what, length) in [
            ("texture coordinates", texcoords.len()),
            ("colours", colors.len()),
            ("normals", normals.len()),
        ] {
            if length != 0 && length != vertices {
                return Err(format!("{what}: expected {vertices}, found {length}"));
            }
        }
        let indices = self.indices(*indices, vertices)?;
        let skirt_triangles = extras.as_ref().map_or(0, |extras| extras.skirt_triangles);
        if skirt_triangles > indices.len() / 3 {
            let triangles = indices.len() / 3;
            return Err(format!("expected at most {triangles} skirts, found {skirt_triangles}"));
        }
        let surface = self.surface(*material)?;
        if surface.image.is_some() && texcoords.is_empty() {
            return Err("expected texture coordinates, found none".into());
        }
        let mut primitive = Primitive {
            positions,
            texcoords,
            colors,
            normals: Vec::new(),
            indices,
            skirt_triangles,
            surface,
        };
        if attributes.normal.is_some() {
            join_vertices(&mut primitive, &normals);
        }
        Ok(primitive)
    }

    /// Unit vectors of 32 bits, or of 8 that a fourth number fills up to 4 bytes.
    fn normals(&mut self, accessor: usize) -> Parsed<Vec<Normal>> {
        let what = "normals";
        let normal = |parts: [f64; 3]| {
            let vector = DVec3::from(parts);
            // Components of 8 bits are off by 1/254 at most.
            let is_unit = (vector.length() - 1.0).abs() < 0.01;
            if is_unit { Normal::along(vector) } else { Normal::NONE }
        };
        let Accessor { component_type, buffer_view, .. } =
            *entry(&self.root.accessors, what, accessor)?;
        let stride = entry(&self.root.buffer_views, what, buffer_view)?.byte_stride;
        let normals = match (component_type, stride) {
            (BYTE, Some(4)) => {
                let short = |&[x, y, z, _]: &[u8; 4]| {
                    normal([x, y, z].map(|part| f64::from(part.cast_signed()) / 127.0))
                };
                self.read(accessor, what, Shape::Vec3, BYTE, true, short)?
            }
            (BYTE, stride) => {
                return Err(format!(
                    "{what}: expected 4 bytes from one to the next, found {stride:?}"
                ));
            }
            _ => {
                let long = |bytes: &[u8; 12]| normal(triple(bytes).map(f64::from));
                self.read(accessor, what, Shape::Vec3, FLOAT, false, long)?
            }
        };
        if normals.contains(&Normal::NONE) {
            return Err(format!("{what}: expected unit vectors"));
        }
        Ok(normals)
    }

    /// Metres, or steps that a fourth number fills up to 8 bytes.
    fn positions(&mut self, accessor: usize) -> Parsed<Vec<[f32; 3]>> {
        let what = "positions";
        let Accessor { component_type, buffer_view, .. } =
            *entry(&self.root.accessors, what, accessor)?;
        let stride = entry(&self.root.buffer_views, what, buffer_view)?.byte_stride;
        match (component_type, stride) {
            (UNSIGNED_SHORT, Some(8)) => {
                let step = self.step;
                let position = |bytes: &[u8; 8]| {
                    let [x, y, z, _] = quad(bytes);
                    from_steps([x, y, z], step)
                };
                self.read(accessor, what, Shape::Vec3, UNSIGNED_SHORT, false, position)
            }
            (UNSIGNED_SHORT, stride) => {
                Err(format!("{what}: expected 8 bytes from one to the next, found {stride:?}"))
            }
            _ if self.step != 1.0 => Err(format!("{what}: expected steps of {} m", self.step)),
            _ => self.read(accessor, what, Shape::Vec3, FLOAT, false, triple),
        }
    }

    fn texcoords(&mut self, accessor: usize) -> Parsed<Vec<[f32; 2]>> {
        let what = "texture coordinates";
        let short =
            |&[a, b, c, d]: &[u8; 4]| [[a, b], [c, d]].map(u16::from_le_bytes).map(from_share);
        match entry(&self.root.accessors, what, accessor)?.component_type {
            UNSIGNED_SHORT => self.read(accessor, what, Shape::Vec2, UNSIGNED_SHORT, true, short),
            _ => self.read(accessor, what, Shape::Vec2, FLOAT, false, pair),
        }
    }

    fn indices(&mut self, accessor: usize, vertices: usize) -> Parsed<Vec<u32>> {
        let what = "indices";
        let indices: Vec<u32> = if vertices <= MOST_SHORT_VERTICES {
            let short = |bytes: &[u8; 2]| u32::from(u16::from_le_bytes(*bytes));
            self.read(accessor, what, Shape::Scalar, UNSIGNED_SHORT, false, short)?
        } else {
            let long = |bytes: &[u8; 4]| u32::from_le_bytes(*bytes);
            self.read(accessor, what, Shape::Scalar, UNSIGNED_INT, false, long)?
        };
        if indices.is_empty() || !indices.len().is_multiple_of(3) {
            return Err(format!("expected whole triangles, found {} corners", indices.len()));
        }
        match indices.iter().find(|&&index| index as usize >= vertices) {
            Some(found) => Err(format!("{what}: expected below {vertices}, found {found}")),
            None => Ok(indices),
        }
    }

    /// The elements of an accessor, `N` bytes each.
    fn read<T, const N: usize>(
        &mut self,
        accessor: usize,
        what: &str,
        shape: Shape,
        component_type: u32,
        normalized: bool,
        element: impl Fn(&[u8; N]) -> T,
    ) -> Parsed<Vec<T>> {
        let accessor = entry(&self.root.accessors, what, accessor)?;
        if (accessor.shape, accessor.component_type) != (shape, component_type) {
            return Err(format!(
                "{what}: expected {shape:?} of type {component_type}, found {:?} of type {}",
                accessor.shape, accessor.component_type
            ));
        }
        if accessor.normalized != normalized {
            return Err(format!("{what}: found normalized {}", accessor.normalized));
        }
        let bytes = self.view(accessor.buffer_view, what)?;
        let (elements, rest) = bytes.as_ref().as_chunks::<N>();
        if elements.len() != accessor.count || !rest.is_empty() {
            return Err(format!(
                "{what}: expected {} elements of {N} bytes, found {} bytes",
                accessor.count,
                bytes.len()
            ));
        }
        Ok(elements.iter().map(element).collect())
    }

    fn view(&mut self, index: usize, what: &str) -> Parsed<Cow<'a, [u8]>> {
        let view = entry(&self.root.buffer_views, what, index)?;
        if std::mem::replace(&mut self.spent[index], true) {
            return Err(format!("{what}: buffer view {index} is used twice"));
        }
        if let Some(ViewExtensions { meshopt }) = &view.extensions {
            let Compressed { buffer, byte_offset, byte_length, byte_stride, count, mode } = meshopt;
            let bytes = self.slice(*buffer, *byte_offset, *byte_length, what)?;
            return decode(bytes, mode, *count, *byte_stride)
                .map(Cow::Owned)
                .map_err(|found| format!("{what}: {found}"));
        }
        let BufferView { buffer, byte_offset, byte_length, .. } = *view;
        self.slice(buffer, byte_offset, byte_length, what).map(Cow::Borrowed)
    }

    fn slice(
        &self,
        buffer: usize,
        byte_offset: usize,
        byte_length: usize,
        what: &str,
    ) -> Parsed<&'a [u8]> {
        byte_offset
            .checked_add(byte_length)
            .filter(|_| buffer == 0)
            .and_then(|end| self.bin.get(byte_offset..end))
            .ok_or_else(|| {
                let bytes = self.bin.len();
                format!(
                    "{what}: expected a view within buffer 0 of {bytes} bytes, found \
                     {byte_length} at {byte_offset} of buffer {buffer}"
                )
            })
    }

    fn surface(&self, material: usize) -> Parsed<Surface> {
        let material = entry(&self.root.materials, "material", material)?;
        let base_color = material.pbr_metallic_roughness.base_color_factor;
        if !base_color.iter().all(|channel| (0.0..=1.0).contains(channel)) {
            return Err(format!("expected a colour within 0–1, found {base_color:?}"));
        }
        let alpha = match (&material.alpha_mode, material.alpha_cutoff) {
            (None, None) => AlphaMode::Opaque,
            (Some(schema::AlphaMode::Blend), None) => AlphaMode::Blend,
            (Some(schema::AlphaMode::Mask), Some(cutoff)) if (0.0..=1.0).contains(&cutoff) => {
                AlphaMode::Mask { cutoff }
            }
            (_, cutoff) => return Err(format!("alpha mode and cutoff {cutoff:?} do not agree")),
        };
        let (image, wrap) = match &material.pbr_metallic_roughness.base_color_texture {
            None => (None, [Wrap::Repeat; 2]),
            Some(info) => {
                let texture = entry(&self.root.textures, "texture", info.index)?;
                entry(&self.root.images, "image", texture.source)?;
                let sampler = entry(&self.root.samplers, "sampler", texture.sampler)?;
                (Some(texture.source), [wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?])
            }
        };
        let double_sided = material.double_sided;
        let is_unlit = image.is_none() && material.extensions.is_some();
        Ok(Surface { base_color, image, wrap, alpha, double_sided, is_unlit })
    }

    fn image(&mut self, image: &schema::Image) -> Parsed<NodeImage> {
        let schema::Image { name, buffer_view, mime_type, uri, extras } = image;
        let data = match (buffer_view, mime_type.as_deref(), uri, name) {
            (Some(view), Some(mime), None, name) => {
                let mime = match mime {
                    "image/jpeg" => "image/jpeg",
                    "image/png" => "image/png",
                    other => return Err(format!("expected JPEG or PNG, found {other}")),
                };
                if let Some(name) = name.as_ref().filter(|name| !is_plain_file_name(name)) {
                    return Err(format!("expected a plain file name, found {name:?}"));
                }
                NodeImageData::Embedded {
                    mime,
                    bytes: self.view(*view, "image")?.to_vec(),
                    file_name: name.as_deref().map(Arc::from),
                }
            }
            (None, None, Some(uri), None) => {
                let file_name = uri
                    .strip_prefix(TEXTURES_URI)
                    .and_then(|uri| uri.strip_prefix('/'))
                    .filter(|name| is_plain_file_name(name))
                    .ok_or_else(|| format!("expected {TEXTURES_URI}/NAME, found {uri:?}"))?;
                NodeImageData::Shared { file_name: Arc::from(file_name) }
            }
            _ => return Err("expected a buffer view and its type, or a URI".into()),
        };
        Ok(NodeImage { width: extras.width, height: extras.height, data })
    }
}

fn wrap(mode: u32) -> Parsed<Wrap> {
    match mode {
        REPEAT => Ok(Wrap::Repeat),
        MIRRORED_REPEAT => Ok(Wrap::Mirror),
        CLAMP_TO_EDGE => Ok(Wrap::Clamp),
        other => Err(format!("expected a wrapping mode, found {other}")),
    }
}

fn pair(bytes: &[u8; 8]) -> [f32; 2] {
    let [a, b, c, d, e, f, g, h] = *bytes;
    [f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h])]
}

fn triple(bytes: &[u8; 12]) -> [f32; 3] {
    let [a, b, c, d, e, f, g, h, i, j, k, l] = *bytes;
    [
        f32::from_le_bytes([a, b, c, d]),
        f32::from_le_bytes([e, f, g, h]),
        f32::from_le_bytes([i, j, k, l]),
    ]
}

fn quad(bytes: &[u8; 8]) -> [u16; 4] {
    let [a, b, c, d, e, f, g, h] = *bytes;
    [[a, b], [c, d], [e, f], [g, h]].map(u16::from_le_bytes)
}
