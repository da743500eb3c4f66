//! The nodes below one as a small model: read from their files, so that neither a source nor
//! a build has to be in memory, nor on this machine.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use crate::builder::emit::disk_sink::NodeRecord;
use crate::format::{
    NODES_DIR, NodeImage, NodeImageData, NodeMesh, Surface, TEXTURES_DIR, read_glb,
};
use crate::lattice::Lattice;
use crate::mesh::{Group, Material, Model, Part, TextureData, TextureSource, Warnings, all_differ};
use crate::{Error, Result};

/// Normals within this angle of their triangle's are the triangle's own, rounded: the cosine of 2°.
/// Normals of 8 bits are off by 0.6°, and positions are rounded once more.
const SAME_PLANE: f64 = 0.9994;

/// Reads nodes of the folder `out`, with all positions on a lattice. Pictures that stand in their files are
/// [read](read_pictures) when they are needed: surfaces of several nodes may be in memory together.
pub fn read<'a>(
    out: &Path,
    records: impl Iterator<Item = &'a NodeRecord>,
    lattice: Lattice,
) -> Result<Model> {
    let mut reader = Reader {
        out,
        lattice,
        model: Model {
            source: out.to_path_buf(),
            dependencies: Vec::new(),
            groups: vec![Group { name: String::new() }],
            parts: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            up: None,
            warnings: Warnings::default(),
        },
        repeating: BTreeMap::new(),
    };
    for record in records {
        reader.add(record)?;
    }
    Ok(reader.model)
}

/// Reads the pictures that stand in the files of the nodes that a model was [`read`] from.
pub fn read_pictures<'a>(
    out: &Path,
    records: impl Iterator<Item = &'a NodeRecord>,
    model: &mut Model,
) -> Result<()> {
    for record in records.filter(|record| !record.pictures.is_empty()) {
        for (number, image) in read_node(out, record)?.images.into_iter().enumerate() {
            let NodeImageData::Embedded { bytes, file_name: None, .. } = image.data else {
                continue;
            };
            let name = name_of(&record.file, number);
            let texture = model.textures.iter_mut().find(|texture| texture.name == name);
            if let Some(texture) = texture {
                texture.data = TextureData::Embedded(bytes.into());
            }
        }
    }
    Ok(())
}

fn read_node(out: &Path, record: &NodeRecord) -> Result<NodeMesh> {
    let path = out.join(NODES_DIR).join(&record.file);
    let bytes = crate::format::read_regular(&path)
        .map_err(|error| Error::output(&path, format!("cannot be read again: {error}")))?;
    read_glb(&bytes, &path)
}

/// What a picture of a node's file is called in the model.
fn name_of(file: &str, number: usize) -> String {
    format!("{file} {number}")
}

struct Reader<'a> {
    out: &'a Path,
    lattice: Lattice,
    model: Model,
    /// The repeating textures of the model, by file name.
    repeating: BTreeMap<String, u32>,
}

impl Reader<'_> {
    fn add(&mut self, record: &NodeRecord) -> Result<()> {
        let NodeMesh { origin, images, primitives } = read_node(self.out, record)?;
        let textures: Vec<u32> = images
            .into_iter()
            .enumerate()
            .map(|(number, image)| self.texture(image, &record.file, number))
            .collect();
        for primitive in primitives {
            let texture = primitive.surface.image.map(|image| textures[image]);
            let material = self.material(&primitive.surface, texture);
            let place = |position: &[f32; 3]| -> [f64; 3] {
                std::array::from_fn(|axis| {
                    self.lattice.round(origin[axis] + f64::from(position[axis]))
                })
            };
            let positions: Vec<[f64; 3]> = primitive.positions.iter().map(place).collect();
            let source = primitive.indices.len() - 3 * primitive.skirt_triangles;
            let surface = &primitive.indices[..source];
            let (mut indices, mut normals) = (Vec::new(), Vec::new());
            for (number, corners) in surface.as_chunks::<3>().0.iter().enumerate() {
                if all_differ(corners.map(|corner| positions[corner as usize])) {
                    indices.extend(corners);
                    normals
                        .extend(primitive.normals.get(3 * number..3 * number + 3).unwrap_or(&[]));
                }
            }
            if !indices.is_empty() {
                let mut part = Part {
                    group: 0,
                    material,
                    positions,
                    texcoords: primitive.texcoords,
                    colors: primitive.colors,
                    normals: Vec::new(),
                    indices,
                };
                if !normals.is_empty() {
                    part.set_normals(normals, SAME_PLANE);
                }
                self.model.parts.push(part);
            }
        }
        Ok(())
    }

    /// The texture of an image; of a repeating one there is one, however many nodes have it.
    fn texture(&mut self, image: NodeImage, file: &str, number: usize) -> u32 {
        let next = self.model.textures.len() as u32;
        let repeating = image.repeating().cloned();
        if let Some(name) = &repeating {
            let known = *self.repeating.entry(name.to_string()).or_insert(next);
            if known != next {
                return known;
            }
        }
        let data = match image.data {
            // Read when it is needed: an atlas may be large.
            NodeImageData::Embedded { file_name: None, .. } => TextureData::Embedded(Arc::from([])),
            NodeImageData::Embedded { bytes, .. } => TextureData::Embedded(bytes.into()),
            NodeImageData::Shared { file_name } => {
                TextureData::File(self.out.join(TEXTURES_DIR).join(&*file_name))
            }
        };
        let name = match repeating {
            Some(name) => name_at_full_resolution(&name),
            None => name_of(file, number),
        };
        self.model.textures.push(TextureSource { name, data, opacity: None });
        next
    }

    /// The material of a surface, of which there is one.
    fn material(&mut self, surface: &Surface, texture: Option<u32>) -> u32 {
        let materials = &mut self.model.materials;
        let material = Material {
            name: String::new(),
            base_color: surface.base_color,
            texture,
            wrap: surface.wrap,
            alpha: surface.alpha,
            double_sided: surface.double_sided,
            is_unlit: surface.is_unlit,
        };
        let same = |known: &Material| Material { name: String::new(), ..known.clone() } == material;
        let known = materials.iter().position(same).unwrap_or_else(|| {
            let name = materials.len().to_string();
            materials.push(Material { name, ..material });
            materials.len() - 1
        });
        known as u32
    }
}

/// The file name of a repeating texture without what says how large it is, which it will say again.
fn name_at_full_resolution(file_name: &str) -> String {
    let mut parts = file_name.rsplitn(3, '-');
    match (parts.next(), parts.next(), parts.next()) {
        (Some(_), Some(_), Some(stem)) => stem.into(),
        _ => file_name.into(),
    }
}
