//! glTF 2.0 and GLB.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf_json::accessor::ComponentType;
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;
use gltf_json::{Index, Root};
use serde_json::Value;

use super::clean::{CleanStats, clean};
use super::gltf_buffers::{Buffers, Vectors, container};
use super::gltf_materials::{GltfMaterial, Materials, texture_images};
use super::gltf_meshopt::Compression;
use super::gltf_nodes::{InstanceAccessors, Placement, placements, unit_quaternion};
use super::gltf_unread;
use super::paths::Finder;
use super::vertices::NONE;
use crate::color::unorm16;
use crate::mesh::{Group, Model, Normal, Part, SAME_NORMAL, UpAxis, Warnings};
use crate::{Error, Result};

/// Bytes of a GLB before its JSON: its header and that of the first chunk.
const GLB_HEAD_BYTES: u64 = 20;

/// Most triangles that a file may add by placing its meshes more than once: 2^26, a few gigabytes.
const MOST_REPEATED_TRIANGLES: u64 = 1 << 26;

/// Triangles that take as much memory as a part has beside them.
const PART_TRIANGLES: u64 = 8;

/// Normals of 8 bits that are closer than this are the same: the cosine of 1.2°, twice what they are
/// rounded by.
const SAME_ROUNDED_NORMAL: f64 = 0.999_78;

/// Reads the glTF or GLB at `path`.
pub(super) fn load(path: &Path) -> Result<Model> {
    let mut bytes = Vec::new();
    super::open(path)?
        .read_to_end(&mut bytes)
        .map_err(|error| Error::input(path, format!("cannot be read: {error}")))?;
    read(path, &bytes).map_err(|what| Error::input(path, what)).and_then(super::assemble)
}

/// `asset.copyright`, from the JSON alone; `None` if there is none or it cannot be read.
pub(super) fn copyright(path: &Path) -> Option<String> {
    #[derive(serde::Deserialize)]
    struct Document {
        asset: Asset,
    }
    #[derive(serde::Deserialize)]
    struct Asset {
        copyright: String,
    }
    let mut file = super::open(path).ok()?;
    let mut bytes = Vec::new();
    file.by_ref().take(GLB_HEAD_BYTES).read_to_end(&mut bytes).ok()?;
    if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(*bytes.get(12..)?.first_chunk()?);
        bytes.clear();
        file.take(length.into()).read_to_end(&mut bytes).ok()?;
    } else {
        file.read_to_end(&mut bytes).ok()?;
    }
    let document: Document = serde_json::from_slice(without_mark(&bytes)).ok()?;
    Some(document.asset.copyright)
}

/// JSON without the byte-order mark that some editors begin a text with.
fn without_mark(json: &[u8]) -> &[u8] {
    json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json)
}

fn read(path: &Path, bytes: &[u8]) -> Result<Model, String> {
    if bytes.is_empty() {
        return Err("is empty; expected glTF 2.0".to_owned());
    }
    let (json, binary) = container(bytes)?;
    let mut json: Value = serde_json::from_slice(without_mark(json))
        .map_err(|error| format!("is not glTF: {error}"))?;
    let version = json["asset"]["version"].as_str().unwrap_or("unknown");
    if !version.starts_with("2.") {
        return Err(format!("is glTF version {version}; expected 2.0"));
    }
    let mut warnings = Warnings::default();
    gltf_unread::check_required(&json)?;
    let placements = placements(&json)?;
    gltf_unread::warn(path, &json, &placements, &mut warnings);
    let images = texture_images(&json);
    let compression = Compression::read(&json)?;
    let root = typed(&mut json)?;
    drop(json);
    check_repeats(&root, &placements)?;

    let mut finder = Finder::new(path);
    let mut dependencies = vec![path.to_path_buf()];
    let buffers = Buffers::read(&root, &compression, binary, &mut finder, &mut dependencies)?;
    let mut scene = Scene {
        path,
        root: &root,
        buffers,
        finder,
        makers: Materials::new(&root, &images, path.display().to_string()),
        warnings,
        stats: CleanStats::default(),
        materials: Vec::new(),
        material_of_index: BTreeMap::new(),
        groups: Vec::new(),
        parts: Vec::new(),
        numbers: Vec::new(),
    };
    for placement in &placements {
        scene.add(placement).map_err(|what| format!("node {}: {what}", placement.node))?;
    }
    if scene.parts.is_empty() && scene.stats == CleanStats::default() {
        return Err("no triangle in any mesh of its scene; expected at least one".to_owned());
    }
    scene.stats.report(path, &mut scene.warnings);
    dependencies.extend(scene.makers.textures.dependencies());
    dependencies.extend(scene.finder.absent());
    Ok(Model {
        source: path.to_path_buf(),
        dependencies,
        groups: scene.groups,
        parts: scene.parts,
        materials: scene.materials.into_iter().map(|made| made.material).collect(),
        textures: scene.makers.textures.list,
        up: Some(UpAxis::Y),
        warnings: scene.warnings,
    })
}

/// Refuses a file that places its meshes so often that their triangles do not fit in memory.
fn check_repeats(root: &Root, placements: &[Placement]) -> Result<(), String> {
    let elements = |accessor: Option<usize>| {
        accessor.and_then(|index| root.accessors.get(index)).map(|accessor| accessor.count.0)
    };
    let mut is_placed = vec![false; root.meshes.len()];
    let mut repeated = 0_u64;
    for placement in placements {
        let Some(mesh) = root.meshes.get(placement.mesh) else { continue };
        let triangles = mesh.primitives.iter().map(|primitive| {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let corners = primitive.indices.or(positions.copied());
            let corners = elements(corners.map(|index| index.value())).unwrap_or(0);
            let is_list = primitive.mode == Checked::Valid(Mode::Triangles);
            (if is_list { corners / 3 } else { corners }).saturating_add(PART_TRIANGLES)
        });
        let triangles = triangles.fold(0, u64::saturating_add);
        let placed = elements(placement.instances.and_then(|instances| instances.any()));
        let first = u64::from(!std::mem::replace(&mut is_placed[placement.mesh], true));
        let repeats = placed.unwrap_or(1).saturating_sub(first);
        repeated = repeated.saturating_add(repeats.saturating_mul(triangles));
    }
    if repeated > MOST_REPEATED_TRIANGLES {
        return Err(format!(
            "places its meshes so often that {repeated} triangles are added; expected at most \
             {MOST_REPEATED_TRIANGLES}; divide the file"
        ));
    }
    Ok(())
}

/// The JSON as gltf's types.
///
/// Indices are checked where they are used. gltf's own validation is not called: it panics at some
/// indices that are out of range (a primitive's positions), and refuses files over bounds that
/// are missing and not needed.
fn typed(json: &mut Value) -> Result<Root, String> {
    // gltf wants an image of each texture; those of extensions have none, and theirs is looked up
    // apart (`texture_images`).
    let mut placeholder = false;
    if let Some(textures) = json.get_mut("textures").and_then(Value::as_array_mut) {
        for texture in textures.iter_mut().filter_map(Value::as_object_mut) {
            placeholder |= !texture.contains_key("source");
            texture.entry("source").or_insert(0.into());
        }
    }
    if placeholder && json.get("images").is_none() {
        json["images"] = serde_json::json!([{ "uri": "" }]);
    }
    serde::Deserialize::deserialize(&*json).map_err(|error| format!("is not glTF 2.0: {error}"))
}

/// The state of reading one file.
struct Scene<'a> {
    path: &'a Path,
    root: &'a Root,
    buffers: Buffers<'a>,
    finder: Finder,
    makers: Materials<'a>,
    warnings: Warnings,
    stats: CleanStats,
    materials: Vec<GltfMaterial>,
    /// By glTF's material, `None` being its default.
    material_of_index: BTreeMap<Option<usize>, u32>,
    groups: Vec<Group>,
    parts: Vec<Part>,
    /// See [`compact`].
    numbers: Vec<u32>,
}

/// A primitive's triangles in the coordinates of its mesh.
struct Decoded {
    positions: Vec<[f64; 3]>,
    /// Three per triangle, into the other fields.
    corners: Vec<u32>,
    /// One per position if the material has a texture, else empty.
    texcoords: Vec<[f32; 2]>,
    /// One per position.
    colors: Option<Vec<[u16; 4]>>,
    /// One per position, where the material has no texture and is lit: what has a texture is not.
    normals: Option<Vec<[f64; 3]>>,
}

impl Scene<'_> {
    /// Adds a placed mesh: each instance as a group of its own.
    fn add(&mut self, placement: &Placement) -> Result<(), String> {
        let mesh = self
            .root
            .meshes
            .get(placement.mesh)
            .ok_or_else(|| format!("there is no mesh {}", placement.mesh))?;
        let transforms = self.transforms(placement)?;
        let mut instances: Vec<Vec<Part>> = vec![Vec::new(); transforms.len()];
        // By material; the same of all instances.
        let mut part_of: BTreeMap<u32, usize> = BTreeMap::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let in_primitive =
                |what| format!("mesh {}, primitive {number}: {what}", placement.mesh);
            let material = primitive.material.map(|material| material.value());
            if let Some(index) = material.filter(|index| *index >= self.root.materials.len()) {
                return Err(format!("there is no material {index}"));
            }
            let material = self.material(material);
            let Some(decoded) = self.decode(primitive, material).map_err(in_primitive)? else {
                continue;
            };
            let next = part_of.len();
            let at = *part_of.entry(material).or_insert(next);
            for (parts, world) in instances.iter_mut().zip(&transforms) {
                if at == parts.len() {
                    parts.push(Part { material, ..Part::default() });
                }
                append(&mut parts[at], &decoded, world).map_err(in_primitive)?;
            }
        }
        let node = self.root.nodes.get(placement.node).and_then(|node| node.name.clone());
        let name = [node, mesh.name.clone()].into_iter().flatten().find(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| super::stem(self.path));
        let plane = self.plane_cosine(mesh);
        for mut parts in instances {
            for part in &mut parts {
                part.group = self.groups.len() as u32;
                self.stats.normals_dropped += divide_normals(part, plane);
                clean(part, &mut self.stats);
            }
            parts.retain(|part| !part.indices.is_empty());
            if !parts.is_empty() {
                self.groups.push(Group { name: name.clone() });
                self.parts.append(&mut parts);
            }
        }
        Ok(())
    }

    /// Where a mesh is placed: the transform of each instance, from its coordinates to the scene's.
    fn transforms(&self, placement: &Placement) -> Result<Vec<DMat4>, String> {
        let mut world = placement.world;
        if let Some(skin) = placement.skin.and_then(|skin| self.root.skins.get(skin))
            && let Some(accessor) = skin.inverse_bind_matrices
            && let Some(first) = self.buffers.vectors::<16>(accessor)?.first()
        {
            world *= DMat4::from_cols_array(first);
        }
        let Some(accessors) = placement.instances else { return Ok(vec![world]) };
        let InstanceAccessors { translation, rotation, scale } = accessors;
        let translations = self.instance_vectors(translation)?;
        let rotations = self.instance_vectors(rotation)?;
        let scales = self.instance_vectors(scale)?;
        let lengths = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let count = lengths.into_iter().flatten().next().unwrap_or(0);
        if let Some(other) = lengths.into_iter().flatten().find(|length| *length != count) {
            return Err(format!(
                "EXT_mesh_gpu_instancing: expected as many of each attribute, found {count} and {other}"
            ));
        }
        let transform = |at: usize| {
            let translation = translations.as_ref().map_or(DVec3::ZERO, |all| all[at].into());
            let rotation =
                rotations.as_ref().map_or(DQuat::IDENTITY, |all| unit_quaternion(all[at]));
            let scale = scales.as_ref().map_or(DVec3::ONE, |all| all[at].into());
            world * DMat4::from_scale_rotation_translation(scale, rotation, translation)
        };
        Ok((0..count).map(transform).collect())
    }

    fn instance_vectors<const N: usize>(
        &self,
        accessor: Option<usize>,
    ) -> Result<Option<Vec<[f64; N]>>, String> {
        let Some(index) = accessor else { return Ok(None) };
        let index = u32::try_from(index).map_err(|_| format!("there is no accessor {index}"))?;
        let vectors = self.buffers.vectors(Index::new(index));
        vectors.map(Some).map_err(|what| format!("EXT_mesh_gpu_instancing: {what}"))
    }

    fn material(&mut self, index: Option<usize>) -> u32 {
        if let Some(material) = self.material_of_index.get(&index) {
            return *material;
        }
        let made = self.makers.make(index, &self.buffers, &mut self.finder, &mut self.warnings);
        let material = self.materials.len() as u32;
        self.materials.push(made);
        self.material_of_index.insert(index, material);
        material
    }

    /// The triangles of a primitive with the attributes that its material uses; `None` if it has none.
    fn decode(&mut self, primitive: &Primitive, material: u32) -> Result<Option<Decoded>, String> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err("unknown mode".to_owned());
        };
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(position_accessor) = attribute(Semantic::Positions) else {
            // Nothing is drawn without positions (glTF 2.0, section 3.7.2.1).
            return Ok(None);
        };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.stats.not_triangles += 1;
            return Ok(None);
        }
        let positions = self.buffers.vector_elements::<3>(position_accessor)?;
        let count = positions.len();
        let corners = match primitive.indices {
            Some(accessor) => self.buffers.indices(accessor)?,
            None => (0..u32::try_from(count).map_err(|_| "too many vertices")?).collect(),
        };
        if let Some(index) = corners.iter().find(|index| **index as usize >= count) {
            return Err(format!("vertex index {index} of {count}"));
        }
        let made = &self.materials[material as usize];
        let texcoords = match made.material.texture {
            Some(_) => attribute(Semantic::TexCoords(made.texcoord_set))
                .map(|accessor| self.buffers.vector_elements::<2>(accessor))
                .transpose()?,
            None => None,
        };
        let colors =
            attribute(Semantic::Colors(0)).map(|at| Colors::new(&self.buffers, at)).transpose()?;
        let lengths = [texcoords.as_ref().map(Vectors::len), colors.as_ref().map(Colors::len)];
        for length in lengths {
            if length.is_some_and(|length| length != count) {
                return Err(format!(
                    "{count} positions, but {} texture coordinates or colours",
                    length.unwrap_or(0)
                ));
            }
        }
        if mode == Mode::Triangles && !corners.len().is_multiple_of(3) {
            let what =
                "list of triangles whose number of corners is no multiple of 3, the last left out";
            self.warnings.add(format!("{}: {what}", self.path.display()), 1);
        }
        let mut corners = triangles(corners, mode);
        // Nodes of this crate's own results end with skirts, which are no surface.
        let skirts = primitive.extras.as_ref().and_then(|extras| {
            serde_json::from_str::<Value>(extras.get()).ok()?["skirtTriangles"].as_u64()
        });
        let skirts = usize::try_from(skirts.unwrap_or(0)).unwrap_or(usize::MAX);
        corners.truncate(corners.len().saturating_sub(skirts.saturating_mul(3)));
        let textured = made.material.texture.is_some();
        if textured && texcoords.is_none() {
            self.stats.untextured_faces += corners.len() as u64 / 3;
        }

        let normals: Option<Vectors<3>> = match attribute(Semantic::Normals) {
            Some(accessor) if !textured && !made.material.is_unlit => {
                let normals = normals_of(&self.buffers, accessor, count).map_err(|what| {
                    let what =
                        format!("NORMAL of a primitive: {what}; its faces' normals are used");
                    self.warnings.add(format!("{}: {what}", self.path.display()), 1);
                });
                normals.ok()
            }
            _ => None,
        };

        // Only what the triangles use: primitives often share accessors much larger than they.
        let used = compact(&mut corners, &mut self.numbers);
        let normals: Option<Vec<[f64; 3]>> = normals
            .map(|normals| used.iter().map(|vertex| normals.get(*vertex as usize)).collect());
        let has_none = |vector: &&[f64; 3]| Normal::along(DVec3::from(**vector)) == Normal::NONE;
        let nowhere = normals.iter().flatten().filter(has_none).count();
        self.stats.normals_dropped += nowhere as u64;
        let mut texcoord = |vertex: &u32| {
            let Some(texcoords) = &texcoords else { return [0.0; 2] };
            let uv = made.transform.apply(texcoords.get(*vertex as usize));
            let is_finite = uv.iter().all(|value| value.is_finite());
            self.stats.texcoords_not_finite += u64::from(!is_finite);
            if is_finite { uv } else { [0.0; 2] }
        };
        Ok(Some(Decoded {
            positions: used.iter().map(|vertex| positions.get(*vertex as usize)).collect(),
            corners,
            texcoords: match textured {
                true => used.iter().map(&mut texcoord).collect(),
                false => Vec::new(),
            },
            colors: colors
                .map(|colors| used.iter().map(|vertex| colors.get(*vertex as usize)).collect()),
            normals,
        }))
    }

    /// The cosine of the angle within which normals of a mesh are those of their triangles' planes.
    fn plane_cosine(&self, mesh: &gltf_json::Mesh) -> f64 {
        let is_float = |primitive: &Primitive| {
            let accessor = primitive.attributes.get(&Checked::Valid(Semantic::Normals))?;
            let accessor = self.root.accessors.get(accessor.value())?;
            match accessor.component_type {
                Checked::Valid(kind) => Some(kind.0 == ComponentType::F32),
                Checked::Invalid => None,
            }
        };
        let is_rounded = mesh.primitives.iter().any(|primitive| is_float(primitive) == Some(false));
        if is_rounded { SAME_ROUNDED_NORMAL } else { SAME_NORMAL }
    }
}

/// The normals of a primitive with so many positions.
fn normals_of<'b>(
    buffers: &'b Buffers,
    accessor: Index<gltf_json::Accessor>,
    positions: usize,
) -> Result<Vectors<'b, 3>, String> {
    let normals: Vectors<3> = buffers.vector_elements(accessor)?;
    match normals.len() == positions {
        true => Ok(normals),
        false => Err(format!(
            "accessor {} has {} elements; expected {positions}, one for each position",
            accessor.value(),
            normals.len()
        )),
    }
}

/// Vertex colours, which glTF gives in linear light.
enum Colors<'b> {
    Rgb(Vectors<'b, 3>),
    Rgba(Vectors<'b, 4>),
}

impl<'b> Colors<'b> {
    fn new(buffers: &'b Buffers, accessor: Index<gltf_json::Accessor>) -> Result<Self, String> {
        Ok(match buffers.components(accessor)? {
            4 => Self::Rgba(buffers.vector_elements(accessor)?),
            _ => Self::Rgb(buffers.vector_elements(accessor)?),
        })
    }

    fn len(&self) -> usize {
        match self {
            Self::Rgb(colors) => colors.len(),
            Self::Rgba(colors) => colors.len(),
        }
    }

    fn get(&self, at: usize) -> [u16; 4] {
        let color = match self {
            Self::Rgb(colors) => {
                let [r, g, b] = colors.get(at);
                [r, g, b, 1.0]
            }
            Self::Rgba(colors) => colors.get(at),
        };
        color.map(unorm16)
    }
}

/// Renumbers the vertices that corners use by their first use; returns their old numbers. `numbers` has
/// [`NONE`] for each vertex before and after, so that it need not be made anew for each primitive.
fn compact(corners: &mut [u32], numbers: &mut Vec<u32>) -> Vec<u32> {
    let vertices = corners.iter().max().map_or(0, |last| *last as usize + 1);
    numbers.resize(vertices.max(numbers.len()), NONE);
    let mut used = Vec::new();
    for corner in corners {
        let number = &mut numbers[*corner as usize];
        if *number == NONE {
            *number = used.len() as u32;
            used.push(*corner);
        }
        *corner = *number;
    }
    used.iter().for_each(|vertex| numbers[*vertex as usize] = NONE);
    used
}

/// Adds a primitive's triangles and vertices to `part`.
fn append(part: &mut Part, primitive: &Decoded, world: &DMat4) -> Result<(), String> {
    let Decoded { positions, corners, texcoords, colors, normals } = primitive;
    let first = part.positions.len();
    let vertices = first + positions.len();
    if vertices >= NONE as usize {
        return Err("too many vertices of one material; divide the file".to_owned());
    }
    let transformed = positions.iter().map(|&position| world.transform_point3(position.into()));
    part.positions.extend(transformed.map(|position| position.to_array()));
    part.texcoords.extend_from_slice(texcoords);
    let white = [u16::MAX; 4];
    if let Some(colors) = colors {
        part.colors.resize(first, white);
        part.colors.extend_from_slice(colors);
    } else if !part.colors.is_empty() {
        part.colors.resize(vertices, white);
    }
    if let Some(normals) = normals {
        // Normals of a surface that is stretched turn against the stretch. Not finite where it is
        // pressed flat, which leaves no normal.
        let turn = DMat3::from_mat4(*world).inverse().transpose();
        part.normals.resize(first, Normal::NONE);
        part.normals
            .extend(normals.iter().map(|&normal| Normal::along(turn * DVec3::from(normal))));
    } else if !part.normals.is_empty() {
        part.normals.resize(vertices, Normal::NONE);
    }
    // A mirrored mesh shows its triangles from behind.
    let order = if world.determinant() < 0.0 { [0, 2, 1] } else { [0, 1, 2] };
    for triangle in corners.as_chunks::<3>().0 {
        part.indices.extend(order.map(|corner| first as u32 + triangle[corner]));
    }
    Ok(())
}

/// Leaves out normals that say nothing; returns how many were wrong. Those within an angle of their
/// triangle's, whose cosine is `plane`, are the triangle's.
fn divide_normals(part: &mut Part, plane: f64) -> u64 {
    let normals = std::mem::take(&mut part.normals);
    if normals.is_empty() {
        return 0;
    }
    let corners = part.indices.iter().map(|&vertex| normals[vertex as usize]).collect();
    part.set_normals(corners, plane)
}

/// Corners in the order of a list of triangles (glTF 2.0, section 3.7.2.1); a rest is dropped.
fn triangles(corners: Vec<u32>, mode: Mode) -> Vec<u32> {
    let each = |triangle: fn(usize, &[u32]) -> [u32; 3]| -> Vec<u32> {
        (0..corners.len().saturating_sub(2)).flat_map(|at| triangle(at, &corners)).collect()
    };
    match mode {
        Mode::TriangleStrip => {
            each(|at, corners| [corners[at], corners[at + 1 + at % 2], corners[at + 2 - at % 2]])
        }
        Mode::TriangleFan => each(|at, corners| [corners[at + 1], corners[at + 2], corners[0]]),
        _ => {
            let mut corners = corners;
            corners.truncate(corners.len() / 3 * 3);
            corners
        }
    }
}

#[cfg(test)]
mod tests;
