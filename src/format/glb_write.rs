//! Writes a node as GLB, the binary form of glTF 2.0.

use super::TEXTURES_URI;
use super::corner_normals::divide_vertices;
use super::encoding::Encoding;
use super::file_name::is_plain_file_name;
use super::glb_packed::{encode_triangles, encode_vertices};
use super::glb_schema::{self as schema, *};
use super::node_id::NodeId;
use super::node_mesh::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use super::quantized::{in_shares, in_steps, is_in_steps};
use crate::mesh::{AlphaMode, Normal, UpAxis, Wrap};
use crate::{Error, Result};

/// Where a node stands in its scene; goes into the file for people and tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeLabel {
    /// [`Node::id`](super::Node::id).
    pub id: NodeId,
    /// [`Node::level`](super::Node::level) as it is where no coarse node is left out: the depth of its
    /// division.
    pub level: u32,
}

/// The bytes of a node's file. They depend on the arguments and this crate's version alone.
///
/// glTF is Y up: where `up` is Z the node's transform turns it, and the vertices stay in source
/// axes. Surfaces with a picture are unlit, since photographs hold their light; others are lit. The
/// wrapping of a surface without a picture is not kept. A mesh
/// without primitives is a file without geometry.
///
/// Fails where the mesh breaks its own promises: arrays of different lengths, indices out of
/// range, numbers that are not finite, an origin that does not fit in f32.
pub fn write_glb(mesh: &NodeMesh, up: UpAxis, label: NodeLabel) -> Result<Vec<u8>> {
    write_glb_encoded(mesh, up, label, Encoding::default(), None)
}

/// [`write_glb`] in another encoding, with a copyright notice. Compression loses nothing, but may turn triangles, so that
/// another corner is first.
pub fn write_glb_encoded(
    mesh: &NodeMesh,
    up: UpAxis,
    label: NodeLabel,
    encoding: Encoding,
    copyright: Option<&str>,
) -> Result<Vec<u8>> {
    // One transform for all primitives: all are in steps or none is.
    let steps = encoding.step.filter(|&step| is_in_steps(mesh, step));
    let mut writer = Writer {
        compress: encoding.compress,
        steps,
        short_texcoords: encoding.step.is_some(),
        unpacked: 0,
        root: Root {
            asset: Asset {
                version: "2.0".into(),
                generator: concat!("hlod ", env!("CARGO_PKG_VERSION")).into(),
                copyright: copyright.map(str::to_owned),
            },
            extensions_used: Vec::new(),
            extensions_required: Vec::new(),
            scene: 0,
            scenes: vec![SceneRoots { nodes: vec![0] }],
            nodes: vec![placement(mesh, up, steps, label)?],
            meshes: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            samplers: Vec::new(),
            images: Vec::new(),
            accessors: Vec::new(),
            buffer_views: Vec::new(),
            buffers: Vec::new(),
        },
        bin: Vec::with_capacity(bin_size(mesh)),
    };
    let mut primitives = Vec::with_capacity(mesh.primitives.len());
    for (primitive, number) in mesh.primitives.iter().zip(0..) {
        check(primitive, mesh.images.len())
            .map_err(|what| broken(format!("primitive {number}: {what}")))?;
        primitives.push(writer.primitive(primitive));
    }
    if !primitives.is_empty() {
        writer.root.meshes.push(schema::Mesh { primitives });
    }
    for (image, number) in mesh.images.iter().zip(0..) {
        writer.image(image).map_err(|what| broken(format!("image {number}: {what}")))?;
    }
    writer.finish()
}

fn broken(what: impl std::fmt::Display) -> Error {
    Error::Internal(format!("node mesh: {what}"))
}

/// Bytes of geometry and pictures, near enough to allocate once.
fn bin_size(mesh: &NodeMesh) -> usize {
    let geometry: usize = mesh
        .primitives
        .iter()
        .map(|p| {
            // Corners of three faces at a vertex, each with a normal of its own, are usual.
            let vertices = if p.normals.is_empty() { 1 } else { 3 };
            vertices * (12 * p.positions.len() + 8 * (p.texcoords.len() + p.colors.len()))
                + 4 * (p.indices.len() + p.normals.len())
        })
        .sum();
    let pictures: usize = mesh
        .images
        .iter()
        .map(|image| match &image.data {
            NodeImageData::Embedded { bytes, .. } => bytes.len() + 4,
            NodeImageData::Shared { .. } => 0,
        })
        .sum();
    geometry + pictures
}

fn placement(
    mesh: &NodeMesh,
    up: UpAxis,
    steps: Option<f64>,
    label: NodeLabel,
) -> Result<Placement> {
    let origin = mesh.origin.map(|coordinate| coordinate as f32);
    if mesh.origin.iter().zip(origin).any(|(&exact, single)| f64::from(single) != exact) {
        return Err(broken(format!("origin {:?}: expected to fit in 32 bits", mesh.origin)));
    }
    let origin @ [x, y, z] = mesh.origin;
    let (translation, scale, matrix) = match up {
        UpAxis::Y => (Some(origin), steps.map(|step| [step; 3]), None),
        UpAxis::Z => {
            let mut matrix = [0.0; 16];
            // Adding 0 turns -0 into 0.
            matrix[..12].copy_from_slice(&Z_UP.map(|entry| entry * steps.unwrap_or(1.0) + 0.0));
            matrix[12..].copy_from_slice(&[x, z, -y, 1.0]);
            (None, None, Some(matrix))
        }
    };
    let NodeLabel { id, level } = label;
    Ok(Placement {
        mesh: (!mesh.primitives.is_empty()).then_some(0),
        translation,
        scale,
        matrix,
        extras: Extras { id, level },
    })
}

/// What glTF and [`NodeMesh`] demand of a primitive.
fn check(primitive: &Primitive, images: usize) -> Result<(), String> {
    let Primitive { positions, texcoords, colors, normals, indices, skirt_triangles, surface } =
        primitive;
    let vertices = positions.len();
    if vertices == 0 || indices.is_empty() || !indices.len().is_multiple_of(3) {
        return Err(format!("expected whole triangles, found {} corners", indices.len()));
    }
    if *skirt_triangles > indices.len() / 3 {
        let triangles = indices.len() / 3;
        return Err(format!("expected at most {triangles} skirts, found {skirt_triangles}"));
    }
    for (name, length) in [("texture coordinates", texcoords.len()), ("colours", colors.len())] {
        if length != 0 && length != vertices {
            return Err(format!("{name}: expected {vertices} or none, found {length}"));
        }
    }
    if !normals.is_empty() && normals.len() != indices.len() {
        let (expected, found) = (indices.len(), normals.len());
        return Err(format!("normals: expected {expected} or none, found {found}"));
    }
    if let Some(&found) = indices.iter().find(|&&index| index as usize >= vertices) {
        return Err(format!("expected indices below {vertices}, found {found}"));
    }
    if !positions.as_flattened().iter().chain(texcoords.as_flattened()).all(|v| v.is_finite()) {
        return Err("expected finite coordinates".into());
    }
    if !surface.base_color.iter().all(|channel| (0.0..=1.0).contains(channel)) {
        return Err(format!("expected a colour within 0–1, found {:?}", surface.base_color));
    }
    if let AlphaMode::Mask { cutoff } = surface.alpha
        && !(0.0..=1.0).contains(&cutoff)
    {
        return Err(format!("expected an alpha cutoff within 0–1, found {cutoff}"));
    }
    match surface.image {
        Some(image) if image >= images => {
            Err(format!("expected an image below {images}, found {image}"))
        }
        Some(_) if texcoords.is_empty() => Err("expected texture coordinates, found none".into()),
        _ => Ok(()),
    }
}

struct Writer {
    root: Root,
    bin: Vec<u8>,
    compress: bool,
    /// The length of the steps that positions are stored in.
    steps: Option<f64>,
    /// Texture coordinates are stored in 16 bits where nothing is lost.
    short_texcoords: bool,
    /// Bytes that compressed views have without compression.
    unpacked: usize,
}

impl Writer {
    fn primitive(&mut self, primitive: &Primitive) -> schema::Primitive {
        let divided = (!primitive.normals.is_empty()).then(|| divide_vertices(primitive));
        let (primitive, normals) = match &divided {
            Some((primitive, normals)) => (primitive, &normals[..]),
            None => (primitive, &[][..]),
        };
        let Primitive { positions, texcoords, colors, indices, skirt_triangles, surface, .. } =
            primitive;
        let vertices = positions.len();
        let position = self.positions(positions);
        let normal = (!normals.is_empty()).then(|| self.normals(normals));
        let texcoord = (!texcoords.is_empty()).then(|| self.texcoords(texcoords));
        let color = (!colors.is_empty()).then(|| {
            let accessor = self.vertices(vertices, UNSIGNED_SHORT, Shape::Vec4, 8, |bin| {
                extend(bin, colors.as_flattened(), u16::to_le_bytes);
            });
            self.root.accessors[accessor].normalized = true;
            accessor
        });
        let short = vertices <= MOST_SHORT_VERTICES;
        let packed = self.compress.then(|| encode_triangles(indices, vertices)).flatten();
        let indices = if let Some(packed) = packed {
            let (kind, stride) = if short { (UNSIGNED_SHORT, 2) } else { (UNSIGNED_INT, 4) };
            let view = self.packed(&packed, indices.len(), stride, Mode::Triangles);
            self.push_accessor(view, indices.len(), kind, Shape::Scalar)
        } else if short {
            let short: Vec<u16> = indices.iter().map(|&index| index as u16).collect();
            self.accessor(short.len(), UNSIGNED_SHORT, Shape::Scalar, |bin| {
                extend(bin, &short, u16::to_le_bytes);
            })
        } else {
            self.accessor(indices.len(), UNSIGNED_INT, Shape::Scalar, |bin| {
                extend(bin, indices, u32::to_le_bytes);
            })
        };
        let material = self.material(surface);
        let extras = (*skirt_triangles > 0)
            .then_some(schema::PrimitiveExtras { skirt_triangles: *skirt_triangles });
        schema::Primitive {
            attributes: Attributes { position, normal, texcoord, color },
            indices,
            material,
            extras,
        }
    }

    fn positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let (min, max) = positions.iter().fold(
            ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]),
            |(min, max): ([f32; 3], [f32; 3]), p| {
                (
                    std::array::from_fn(|axis| min[axis].min(p[axis])),
                    std::array::from_fn(|axis| max[axis].max(p[axis])),
                )
            },
        );
        let vertices = positions.len();
        let (accessor, unit) = match self.steps {
            Some(step) => {
                let steps = in_steps(positions, step);
                let accessor = self.vertices(vertices, UNSIGNED_SHORT, Shape::Vec3, 8, |bin| {
                    extend(bin, steps.as_flattened(), u16::to_le_bytes);
                });
                (accessor, step as f32)
            }
            None => {
                let accessor = self.vertices(vertices, FLOAT, Shape::Vec3, 12, |bin| {
                    extend(bin, positions.as_flattened(), f32::to_le_bytes);
                });
                (accessor, 1.0)
            }
        };
        self.root.accessors[accessor].min = Some(min.map(|least| least / unit));
        self.root.accessors[accessor].max = Some(max.map(|most| most / unit));
        accessor
    }

    /// Unit vectors: in 8 bits beside positions in steps, in 32 bits elsewhere.
    fn normals(&mut self, normals: &[Normal]) -> usize {
        // glTF wants a unit vector of each vertex, of those without a direction too.
        let up = Normal::along(glam::DVec3::Z);
        let normals =
            normals.iter().map(|&normal| if normal == Normal::NONE { up } else { normal });
        if self.steps.is_some() {
            let short: Vec<[i8; 4]> = normals
                .map(|normal| {
                    let [x, y, z] = normal.to_8_bits();
                    [x, y, z, 0]
                })
                .collect();
            let accessor = self.vertices(short.len(), BYTE, Shape::Vec3, 4, |bin| {
                extend(bin, short.as_flattened(), i8::to_le_bytes);
            });
            self.root.accessors[accessor].normalized = true;
            return accessor;
        }
        let long: Vec<[f32; 3]> = normals
            .map(|normal| normal.vector().unwrap_or_default().as_vec3().to_array())
            .collect();
        self.vertices(long.len(), FLOAT, Shape::Vec3, 12, |bin| {
            extend(bin, long.as_flattened(), f32::to_le_bytes);
        })
    }

    fn texcoords(&mut self, texcoords: &[[f32; 2]]) -> usize {
        let Some(shares) = self.short_texcoords.then(|| in_shares(texcoords)).flatten() else {
            return self.vertices(texcoords.len(), FLOAT, Shape::Vec2, 8, |bin| {
                extend(bin, texcoords.as_flattened(), f32::to_le_bytes);
            });
        };
        let accessor = self.vertices(texcoords.len(), UNSIGNED_SHORT, Shape::Vec2, 4, |bin| {
            extend(bin, shares.as_flattened(), u16::to_le_bytes);
        });
        self.root.accessors[accessor].normalized = true;
        accessor
    }

    /// Adds an accessor of vertices of `stride` bytes with a buffer view of its own.
    fn vertices(
        &mut self,
        count: usize,
        component_type: u32,
        shape: Shape,
        stride: usize,
        fill: impl FnOnce(&mut Vec<u8>),
    ) -> usize {
        let accessor = if self.compress {
            let mut bytes = Vec::with_capacity(count * stride);
            fill(&mut bytes);
            if let Some(packed) = encode_vertices(&bytes, stride) {
                let view = self.packed(&packed, count, stride, Mode::Attributes);
                return self.push_accessor(view, count, component_type, shape);
            }
            self.accessor(count, component_type, shape, |bin| bin.extend(bytes))
        } else {
            self.accessor(count, component_type, shape, fill)
        };
        // Without a stride vertices follow each other closely: not those of three short numbers.
        if shape == Shape::Vec3 && component_type != FLOAT {
            let view = self.root.accessors[accessor].buffer_view;
            self.root.buffer_views[view].byte_stride = Some(stride);
        }
        accessor
    }

    /// Adds a compressed buffer view.
    fn packed(&mut self, packed: &[u8], count: usize, stride: usize, mode: Mode) -> usize {
        pad(&mut self.bin, 0);
        let compressed = Compressed {
            buffer: 0,
            byte_offset: self.bin.len(),
            byte_length: packed.len(),
            byte_stride: stride,
            count,
            mode,
        };
        self.bin.extend_from_slice(packed);
        let vertices = mode == Mode::Attributes;
        let byte_offset = self.unpacked.next_multiple_of(4);
        self.unpacked = byte_offset + count * stride;
        self.root.buffer_views.push(BufferView {
            buffer: 1,
            byte_offset,
            byte_length: count * stride,
            byte_stride: vertices.then_some(stride),
            target: Some(if vertices { ARRAY_BUFFER } else { ELEMENT_ARRAY_BUFFER }),
            extensions: Some(ViewExtensions { meshopt: compressed }),
        });
        self.root.buffer_views.len() - 1
    }

    /// Adds an accessor with a buffer view of its own.
    fn accessor(
        &mut self,
        count: usize,
        component_type: u32,
        shape: Shape,
        fill: impl FnOnce(&mut Vec<u8>),
    ) -> usize {
        let target = if shape == Shape::Scalar { ELEMENT_ARRAY_BUFFER } else { ARRAY_BUFFER };
        let buffer_view = self.view(Some(target), fill);
        self.push_accessor(buffer_view, count, component_type, shape)
    }

    fn push_accessor(
        &mut self,
        buffer_view: usize,
        count: usize,
        component_type: u32,
        shape: Shape,
    ) -> usize {
        self.root.accessors.push(Accessor {
            buffer_view,
            component_type,
            normalized: false,
            count,
            shape,
            min: None,
            max: None,
        });
        self.root.accessors.len() - 1
    }

    fn view(&mut self, target: Option<u32>, fill: impl FnOnce(&mut Vec<u8>)) -> usize {
        pad(&mut self.bin, 0);
        let byte_offset = self.bin.len();
        fill(&mut self.bin);
        let byte_length = self.bin.len() - byte_offset;
        let view = BufferView {
            buffer: 0,
            byte_offset,
            byte_length,
            byte_stride: None,
            target,
            extensions: None,
        };
        self.root.buffer_views.push(view);
        self.root.buffer_views.len() - 1
    }

    /// The material of a surface: one for all that look alike.
    fn material(&mut self, surface: &Surface) -> usize {
        let base_color_texture =
            surface.image.map(|image| TextureInfo { index: self.texture(image, surface.wrap) });
        let is_unlit = surface.image.is_some() || surface.is_unlit;
        if is_unlit && self.root.extensions_used.is_empty() {
            self.root.extensions_used.push(UNLIT.into());
        }
        let (alpha_mode, alpha_cutoff) = match surface.alpha {
            AlphaMode::Opaque => (None, None),
            AlphaMode::Mask { cutoff } => (Some(schema::AlphaMode::Mask), Some(cutoff)),
            AlphaMode::Blend => (Some(schema::AlphaMode::Blend), None),
        };
        let material = schema::Material {
            extensions: is_unlit.then_some(MaterialExtensions { unlit: Unlit {} }),
            pbr_metallic_roughness: Pbr {
                base_color_factor: surface.base_color,
                base_color_texture,
                metallic_factor: 0.0,
                roughness_factor: 1.0,
            },
            alpha_mode,
            alpha_cutoff,
            double_sided: surface.double_sided,
        };
        find_or_push(&mut self.root.materials, material)
    }

    fn texture(&mut self, source: usize, wrap: [Wrap; 2]) -> usize {
        let [wrap_s, wrap_t] = wrap.map(|wrap| match wrap {
            Wrap::Repeat => REPEAT,
            Wrap::Mirror => MIRRORED_REPEAT,
            Wrap::Clamp => CLAMP_TO_EDGE,
        });
        let sampler =
            Sampler { mag_filter: LINEAR, min_filter: LINEAR_MIPMAP_LINEAR, wrap_s, wrap_t };
        let sampler = find_or_push(&mut self.root.samplers, sampler);
        find_or_push(&mut self.root.textures, Texture { sampler, source })
    }

    fn image(&mut self, image: &NodeImage) -> Result<(), String> {
        if let Some(name) = image.repeating()
            && !is_plain_file_name(name)
        {
            return Err(format!("expected a plain file name, found {name:?}"));
        }
        let extras = ImageSize { width: image.width, height: image.height };
        let image = match &image.data {
            NodeImageData::Embedded { mime, bytes, file_name } => {
                if !["image/jpeg", "image/png"].contains(mime) || bytes.is_empty() {
                    return Err(format!("expected JPEG or PNG, found {mime}"));
                }
                Image {
                    name: file_name.as_deref().map(str::to_owned),
                    buffer_view: Some(self.view(None, |bin| bin.extend_from_slice(bytes))),
                    mime_type: Some((*mime).to_owned()),
                    uri: None,
                    extras,
                }
            }
            NodeImageData::Shared { file_name } => Image {
                name: None,
                buffer_view: None,
                mime_type: None,
                uri: Some(format!("{TEXTURES_URI}/{file_name}")),
                extras,
            },
        };
        self.root.images.push(image);
        Ok(())
    }

    fn finish(mut self) -> Result<Vec<u8>> {
        if !self.bin.is_empty() {
            self.root.buffers.push(Buffer { byte_length: self.bin.len(), extensions: None });
        }
        let mut require = |extension: &str| {
            self.root.extensions_used.push(extension.into());
            self.root.extensions_required.push(extension.into());
        };
        if self.steps.is_some() && !self.root.meshes.is_empty() {
            require(QUANTIZATION);
        }
        if self.unpacked > 0 {
            require(MESHOPT);
            self.root.buffers.push(Buffer {
                byte_length: self.unpacked,
                extensions: Some(BufferExtensions { meshopt: Fallback { fallback: true } }),
            });
        }
        pad(&mut self.bin, 0);
        let mut json = serde_json::to_vec(&self.root).map_err(broken)?;
        pad(&mut json, b' ');
        let bin_chunk = if self.bin.is_empty() { 0 } else { 8 + self.bin.len() };
        let length = 12 + 8 + json.len() + bin_chunk;
        let too_long = |_| broken(format!("{length} bytes, and GLB ends at 4 GiB"));
        let mut out = Vec::with_capacity(length);
        for word in [MAGIC, 2, u32::try_from(length).map_err(too_long)?] {
            out.extend_from_slice(&word.to_le_bytes());
        }
        let mut chunk = |kind: u32, bytes: &[u8]| {
            out.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
            out.extend_from_slice(&kind.to_le_bytes());
            out.extend_from_slice(bytes);
        };
        chunk(CHUNK_JSON, &json);
        if !self.bin.is_empty() {
            chunk(CHUNK_BIN, &self.bin);
        }
        Ok(out)
    }
}

/// Appends values in little-endian order: in one copy where memory has that order already.
fn extend<T: bytemuck::NoUninit, const N: usize>(
    bytes: &mut Vec<u8>,
    values: &[T],
    little_endian: impl Fn(T) -> [u8; N],
) {
    if cfg!(target_endian = "little") {
        bytes.extend_from_slice(bytemuck::cast_slice(values));
    } else {
        values.iter().for_each(|&value| bytes.extend_from_slice(&little_endian(value)));
    }
}

fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}

fn find_or_push<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}
