//! glTF 2.0 and GLB.

use std::collections::BTreeMap;
use std::path::Path;

use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;
use gltf_json::{Index, Root};
use serde_json::Value;

use super::clean::{CleanStats, clean};
use super::gltf_buffers::{Buffers, container};
use super::gltf_materials::{GltfMaterial, Materials, texture_images};
use super::gltf_nodes::{Instance, instances};
use super::paths::Finder;
use super::vertices::NONE;
use crate::color::unorm16;
use crate::mesh::{Group, Model, Part, UpAxis, Warnings};
use crate::{Error, Result};

/// Extensions without which a file that requires them would look wrong, and that are read.
const READ_EXTENSIONS: [&str; 5] = [
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "EXT_texture_webp",
];

/// Reads the glTF or GLB at `path`.
pub(super) fn load(path: &Path) -> Result<Model> {
    super::open(path)?;
    let bytes = std::fs::read(path)
        .map_err(|error| Error::input(path, format!("cannot be read: {error}")))?;
    read(path, &bytes).map_err(|what| Error::input(path, what)).and_then(super::assemble)
}

fn read(path: &Path, bytes: &[u8]) -> Result<Model, String> {
    if bytes.is_empty() {
        return Err("is empty; expected glTF 2.0".to_owned());
    }
    let (json, binary) = container(bytes)?;
    let mut json: Value =
        serde_json::from_slice(json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json))
            .map_err(|error| format!("is not glTF: {error}"))?;
    let version = json["asset"]["version"].as_str().unwrap_or("unknown");
    if !version.starts_with("2.") {
        return Err(format!("is glTF version {version}; expected 2.0"));
    }
    let mut warnings = Warnings::default();
    check_extensions(path, &json, &mut warnings)?;
    let placed = instances(&json)?;
    let images = texture_images(&json);
    let root = typed(&mut json)?;
    drop(json);

    let mut finder = Finder::new(path);
    let mut dependencies = vec![path.to_path_buf()];
    let buffers = Buffers::read(&root, binary, &mut finder, &mut dependencies)?;
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
    };
    for instance in &placed {
        scene.add(instance).map_err(|what| format!("node {}: {what}", instance.node))?;
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

/// Refuses, by name, what a file requires and is not read.
fn check_extensions(path: &Path, json: &Value, warnings: &mut Warnings) -> Result<(), String> {
    let required = json["extensionsRequired"].as_array().map_or(&[][..], Vec::as_slice);
    let mut refused = Vec::new();
    for name in required.iter().filter_map(Value::as_str) {
        if READ_EXTENSIONS.contains(&name) {
        } else if name.starts_with("KHR_materials_") || name == "KHR_lights_punctual" {
            // Reflections and light: the diffuse texture, all that is kept, is there without.
            warnings.add(format!("{}: extension {name}, ignored", path.display()), 1);
        } else {
            refused.push(name);
        }
    }
    if refused.is_empty() {
        return Ok(());
    }
    Err(format!("requires {}, which is not read; export it without", refused.join(", ")))
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
}

impl Scene<'_> {
    /// Adds a placed mesh as a group of its own.
    fn add(&mut self, instance: &Instance) -> Result<(), String> {
        let mesh = self
            .root
            .meshes
            .get(instance.mesh)
            .ok_or_else(|| format!("there is no mesh {}", instance.mesh))?;
        let group = self.groups.len() as u32;
        let mut parts: Vec<Part> = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let material = primitive.material.map(|material| material.value());
            if let Some(index) = material.filter(|index| *index >= self.root.materials.len()) {
                return Err(format!("there is no material {index}"));
            }
            let material = self.material(material);
            let at = parts.iter().position(|part| part.material == material);
            let mut part = match at {
                Some(at) => std::mem::take(&mut parts[at]),
                None => Part { group, material, ..Part::default() },
            };
            self.append(&mut part, primitive, instance)
                .map_err(|what| format!("mesh {}, primitive {number}: {what}", instance.mesh))?;
            match at {
                Some(at) => parts[at] = part,
                None => parts.push(part),
            }
        }
        for part in &mut parts {
            clean(part, &mut self.stats);
        }
        parts.retain(|part| !part.indices.is_empty());
        if !parts.is_empty() {
            let node = self.root.nodes.get(instance.node).and_then(|node| node.name.clone());
            let name =
                [node, mesh.name.clone()].into_iter().flatten().find(|name| !name.is_empty());
            self.groups.push(Group { name: name.unwrap_or_else(|| super::stem(self.path)) });
            self.parts.append(&mut parts);
        }
        Ok(())
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

    /// Adds a primitive's triangles and the vertices that they use to `part`.
    fn append(
        &mut self,
        part: &mut Part,
        primitive: &Primitive,
        instance: &Instance,
    ) -> Result<(), String> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err("unknown mode".to_owned());
        };
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(position_accessor) = attribute(Semantic::Positions) else {
            // Nothing is drawn without positions (glTF 2.0, section 3.7.2.1).
            return Ok(());
        };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.stats.not_triangles += 1;
            return Ok(());
        }
        let positions: Vec<[f64; 3]> = self.buffers.vectors(position_accessor)?;
        let count = positions.len();
        let mut corners = match primitive.indices {
            Some(accessor) => self.buffers.indices(accessor)?,
            None => (0..u32::try_from(count).map_err(|_| "too many vertices")?).collect(),
        };
        if let Some(index) = corners.iter().find(|index| **index as usize >= count) {
            return Err(format!("vertex index {index} of {count}"));
        }
        corners = triangles(corners, mode);
        if instance.world.determinant() < 0.0 {
            // A mirrored mesh shows its triangles from behind.
            corners.as_chunks_mut::<3>().0.iter_mut().for_each(|corner| corner.swap(1, 2));
        }
        let made = &self.materials[part.material as usize];
        let texcoords: Option<Vec<[f64; 2]>> = match made.material.texture {
            Some(_) => attribute(Semantic::TexCoords(made.texcoord_set))
                .map(|accessor| self.buffers.vectors(accessor))
                .transpose()?,
            None => None,
        };
        let colors =
            attribute(Semantic::Colors(0)).map(|accessor| self.colors(accessor)).transpose()?;
        for length in [texcoords.as_ref().map(Vec::len), colors.as_ref().map(Vec::len)] {
            if length.is_some_and(|length| length != count) {
                return Err(format!(
                    "{count} positions, but {} texture coordinates or colours",
                    length.unwrap_or(0)
                ));
            }
        }
        let textured = made.material.texture.is_some();
        if textured && texcoords.is_none() {
            self.stats.untextured_faces += corners.len() as u64 / 3;
        }

        // Only what the triangles use: primitives often share accessors much larger than they.
        let first = corners.iter().copied().min().unwrap_or(0);
        let last = corners.iter().copied().max().unwrap_or(0);
        let mut new_index = vec![NONE; (last - first) as usize + 1];
        let white = [u16::MAX; 4];
        if colors.is_some() {
            part.colors.resize(part.positions.len(), white);
        }
        let colored = !part.colors.is_empty() || colors.is_some();
        if part.positions.len() + new_index.len() >= NONE as usize {
            return Err("too many vertices of one material; divide the file".to_owned());
        }
        part.indices.reserve(corners.len());
        for corner in corners {
            let slot = &mut new_index[(corner - first) as usize];
            if *slot == NONE {
                *slot = part.positions.len() as u32;
                let corner = corner as usize;
                let position = instance.world.transform_point3(positions[corner].into());
                part.positions.push(position.to_array());
                if textured {
                    let uv = texcoords
                        .as_ref()
                        .map_or([0.0; 2], |texcoords| made.transform.apply(texcoords[corner]));
                    let finite = uv.iter().all(|value| value.is_finite());
                    self.stats.texcoords_not_finite += u64::from(!finite);
                    part.texcoords.push(if finite { uv } else { [0.0; 2] });
                }
                if colored {
                    part.colors.push(colors.as_ref().map_or(white, |colors| colors[corner]));
                }
            }
            part.indices.push(*slot);
        }
        Ok(())
    }

    /// Vertex colours, RGB or RGBA, which glTF gives in linear light.
    fn colors(&self, accessor: Index<gltf_json::Accessor>) -> Result<Vec<[u16; 4]>, String> {
        if self.buffers.components(accessor)? == 4 {
            let colors = self.buffers.vectors::<4>(accessor)?;
            return Ok(colors.iter().map(|color| color.map(unorm16)).collect());
        }
        let colors = self.buffers.vectors::<3>(accessor)?;
        let opaque = |&[r, g, b]: &[f64; 3]| [r, g, b, 1.0].map(unorm16);
        Ok(colors.iter().map(opaque).collect())
    }
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
