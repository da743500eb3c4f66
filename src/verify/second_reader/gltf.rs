//! glTF and GLB by the crate `gltf`.

use std::collections::BTreeMap;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3};
use gltf::accessor::DataType;
use gltf::mesh::Mode;
use gltf::texture::WrappingMode;
use gltf::{Gltf, Semantic};

use super::content::{Content, Polygons, area};
use super::texture::{Image, Sample, Samples};
use crate::mesh::Wrap;
use crate::side_file;

/// Extensions that change neither shape nor base colour, or whose colours are left alone.
const UNDERSTOOD: [&str; 2] = ["KHR_texture_transform", "KHR_lights_punctual"];

/// Extensions that move or hide triangles. Files that have them are left alone, also where
/// `extensionsUsed` does not name them.
const PLACING: [&str; 3] = ["EXT_mesh_gpu_instancing", "CESIUM_RTC", "KHR_node_visibility"];

/// Nodes below nodes, at most: files may name nodes in a circle.
const DEEPEST: usize = 256;

struct Reader<'a> {
    document: &'a gltf::Document,
    buffers: Vec<Vec<u8>>,
    folder: &'a Path,
    /// The number of materials of each name.
    names: BTreeMap<&'a str, usize>,
    polygons: Polygons,
    /// The entries are by the texture's image and wrapping.
    samples: BTreeMap<(usize, [u8; 2]), Samples>,
    content: Content,
}

/// Reads a glTF or GLB file; or says why it is left alone.
pub(super) fn read(file: &Path) -> Result<Content, String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let is_named = |name: &&&str| memchr::memmem::find(&bytes, name.as_bytes()).is_some();
    if let Some(name) = PLACING.iter().find(is_named) {
        return Err(format!("uses {name}"));
    }
    let unchecked =
        Gltf::from_slice_without_validation(&bytes).map_err(|error| error.to_string())?;
    check_accessors(unchecked.document.as_json())?;
    let Gltf { document, blob } = Gltf::from_slice(&bytes).map_err(|error| error.to_string())?;
    let is_understood =
        |name: &str| UNDERSTOOD.contains(&name) || name.starts_with("KHR_materials_");
    if let Some(other) = document.extensions_used().find(|name| !is_understood(name)) {
        return Err(format!("uses {other}"));
    }
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut blob = blob;
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        buffers.push(match buffer.source() {
            gltf::buffer::Source::Bin => blob.take().ok_or("no binary part")?,
            gltf::buffer::Source::Uri(uri) => bytes_of(uri, folder)?,
        });
    }
    let mut names = BTreeMap::new();
    for name in document.materials().filter_map(|material| material.name()) {
        *names.entry(name).or_insert(0) += 1;
    }
    let (polygons, samples, content) = Default::default();
    let document = &document;
    let mut reader = Reader { document, buffers, folder, names, polygons, samples, content };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let scene = scene.ok_or("has no scene")?;
    for node in scene.nodes() {
        reader.node(&node, DMat4::IDENTITY, 0)?;
    }
    reader.take_samples();
    Ok(reader.content)
}

/// Refuses primitives that name accessors that are not there: the crate's own validation indexes
/// accessors by them.
fn check_accessors(root: &gltf::json::Root) -> Result<(), String> {
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let is_missing = |primitive: &gltf::json::mesh::Primitive| {
        let mut named = primitive.attributes.values().chain(&primitive.indices);
        named.any(|accessor| accessor.value() >= root.accessors.len())
    };
    match primitives.any(is_missing) {
        true => Err("a primitive names an accessor that is not there".into()),
        false => Ok(()),
    }
}

fn bytes_of(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    if let Some((_, encoded)) =
        uri.strip_prefix("data:").and_then(|data| data.split_once(";base64,"))
    {
        return STANDARD.decode(encoded).map_err(|error| error.to_string());
    }
    if uri.contains(['%', ':']) {
        return Err(format!("{uri} is no plain file name"));
    }
    side_file::read(&folder.join(uri), side_file::MOST_BYTES)
        .map_err(|error| format!("{uri}: {error}"))
}

impl Reader<'_> {
    fn node(&mut self, node: &gltf::Node, above: DMat4, depth: usize) -> Result<(), String> {
        if depth > DEEPEST {
            return Err(format!("nodes are more than {DEEPEST} deep"));
        }
        if node.skin().is_some() && node.mesh().is_some() {
            return Err("has skins".into());
        }
        let columns = node.transform().matrix().map(|column| column.map(f64::from));
        let world = above * DMat4::from_cols_array_2d(&columns);
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            self.primitive(&primitive, world)?;
        }
        node.children().try_for_each(|child| self.node(&child, world, depth + 1))
    }

    fn primitive(&mut self, primitive: &gltf::Primitive, world: DMat4) -> Result<(), String> {
        if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let positions =
            primitive.get(&Semantic::Positions).ok_or("a primitive has no positions")?;
        if positions.data_type() != DataType::F32 {
            return Err("positions are not f32".into());
        }
        let buffers = &self.buffers;
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let unreadable = "a primitive cannot be read";
        let positions: Vec<DVec3> = reader
            .read_positions()
            .ok_or(unreadable)?
            .map(|at| world.transform_point3(DVec3::from(at.map(f64::from))))
            .collect();
        let indices: Vec<u32> = match (primitive.indices().is_some(), reader.read_indices()) {
            (false, _) => (0..positions.len() as u32).collect(),
            (true, indices) => indices.ok_or(unreadable)?.into_u32().collect(),
        };
        if indices.iter().any(|&vertex| vertex as usize >= positions.len()) {
            return Err("a primitive names vertices that are not there".into());
        }
        let material = primitive.material();
        let pbr = material.pbr_metallic_roughness();
        let info = pbr.base_color_texture();
        let set = info.as_ref().map_or(0, |info| info.tex_coord());
        let texcoords: Vec<[f32; 2]> = match reader.read_tex_coords(set) {
            Some(texcoords) if info.is_some() => texcoords.into_f32().collect(),
            _ => Vec::new(),
        };
        let unnamed =
            material.index().map_or("default".into(), |index| format!("material {index}"));
        let name = material.name().filter(|name| !name.is_empty()).map_or(unnamed, str::to_owned);
        // The importer gives the second of a name another one.
        let is_only = self.names.get(&name[..]).is_none_or(|&count| count == 1);
        let is_colored = primitive.get(&Semantic::Colors(0)).is_some();
        let is_moved = info.as_ref().is_some_and(|info| info.texture_transform().is_some());
        let is_known = is_only && !is_colored && !is_moved;
        let is_known = is_known && material.pbr_specular_glossiness().is_none();
        let [r, g, b, _] = pbr.base_color_factor();
        let light = [r, g, b].map(f64::from);
        let texture = info.as_ref().map(|info| {
            let texture = info.texture();
            let sampler = texture.sampler();
            let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|wrap| match wrap {
                WrappingMode::Repeat => 0,
                WrappingMode::MirroredRepeat => 1,
                WrappingMode::ClampToEdge => 2,
            });
            (texture.source().index(), wrap)
        });
        for corners in triangles(primitive.mode(), &indices) {
            let places = corners.map(|vertex| positions[vertex as usize]);
            self.polygons.add(&places, &name, &mut self.content);
            let area = area(places);
            let of_material = self.content.materials.entry(name.clone()).or_default();
            if area.is_nan() {
                continue;
            }
            of_material.area += area;
            match texture {
                _ if !is_known => {}
                None => of_material.add(area, light),
                Some(texture) => {
                    let at = corners.map(|vertex| texcoords.get(vertex as usize).copied());
                    if let [Some(a), Some(b), Some(c)] = at {
                        let sample = Sample { texcoords: [a, b, c], area, light };
                        self.samples.entry(texture).or_default().push(&name, sample);
                    }
                }
            }
        }
        Ok(())
    }

    fn take_samples(&mut self) {
        for (&(image, wrap), samples) in &self.samples {
            let Some(source) = self.document.images().nth(image) else { continue };
            let image = match source.source() {
                gltf::image::Source::View { view, .. } => {
                    let bytes = self.buffers.get(view.buffer().index());
                    let range = view.offset()..view.offset() + view.length();
                    bytes.and_then(|bytes| bytes.get(range)).and_then(Image::from_bytes)
                }
                gltf::image::Source::Uri { uri, .. } => {
                    bytes_of(uri, self.folder).ok().and_then(|bytes| Image::from_bytes(&bytes))
                }
            };
            let wrap =
                wrap.map(|wrap| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][usize::from(wrap)]);
            if let Some(image) = image {
                samples.take(&image, wrap, &mut self.content.materials);
            }
        }
    }
}

/// The triangles of a primitive.
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let triangle = |(at, corners): (usize, &[u32])| match at % 2 {
                0 => [corners[0], corners[1], corners[2]],
                _ => [corners[1], corners[0], corners[2]],
            };
            indices.windows(3).enumerate().map(triangle).collect()
        }
        Mode::TriangleFan => {
            let others = indices.get(1..).unwrap_or_default();
            others.windows(2).map(|pair| [indices[0], pair[0], pair[1]]).collect()
        }
        _ => indices.as_chunks::<3>().0.to_vec(),
    }
}
