//! Binary glTF 2.0 with the textures inside.
//!
//! The sizes of all parts must be known before the first byte of the JSON, which comes first; so
//! the binary chunk is streamed into a scratch file and appended at the end.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;

use serde_json::{Value, json};

use super::block::texcoord;
use super::scan::{STEPS_PER_METRE, Scan};
use super::staging::{Staging, failed};
use super::summary::BlockFacts;
use super::{City, CitySummary, Jpeg, stream};
use crate::{Error, Result};

/// glTF's numbers for component types and buffer targets.
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;
const CLAMP_TO_EDGE: u32 = 33071;
const MAGIC: u32 = 0x4654_6c67;
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BIN_CHUNK: u32 = 0x004e_4942;

/// Linear light; the same colours as the OBJ's.
const FACADE_COLOR: [f64; 4] = [0.570, 0.507, 0.420, 1.0];
const ROOF_COLOR: [f64; 4] = [0.263, 0.263, 0.285, 1.0];
/// glTF is y up, the city z up: (x, y, z) becomes (x, z, −y). Column-major.
const Z_UP_TO_Y_UP: [f64; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// What of a part of the binary chunk the JSON must tell.
enum Kind {
    Vectors { components: usize, bounds: Option<[[f32; 3]; 2]> },
    Indices,
    Texture,
}

/// One part of the binary chunk.
struct Section {
    kind: Kind,
    bytes: Vec<u8>,
}

/// A block's part of the file.
struct Encoded {
    index: usize,
    facade: Vec<Section>,
    rest: Vec<Section>,
    texture: Option<Section>,
    facts: BlockFacts,
}

/// Writes the city with a node for each block.
pub(super) fn write(city: &City, out: &Path) -> Result<CitySummary> {
    let name = out
        .file_name()
        .and_then(|name| name.to_str())
        .ok_or_else(|| Error::Usage(format!("{}: expected a UTF-8 file name", out.display())))?;
    if out.is_dir() {
        return Err(Error::output(out, "there is a folder of that name; choose another"));
    }
    let mut staging = Staging::new(out.parent().unwrap_or(Path::new("")))?;
    let mut chunk = staging.scratch_file("binary-chunk")?;
    let mut document = Document::default();
    let mut summary = CitySummary::new(city);
    stream::in_order(
        city.len(),
        |index| Ok((city.scan(&city.plans[index]), city.jpeg(index)?)),
        |_| (),
        |index, (scan, jpeg), ()| Ok(encode(city, index, &scan, jpeg)),
        |block| {
            summary.add(&block.facts);
            document
                .add(city, block, &mut |bytes| chunk.write_all(bytes).map_err(failed(out, "write")))
        },
    )?;
    let mut file = staging.file(name)?;
    summary.bytes = assemble(document, chunk, &mut file, out)?;
    staging.commit()?;
    Ok(summary)
}

fn assemble(document: Document, mut chunk: File, file: &mut File, out: &Path) -> Result<u64> {
    let chunk_bytes = document.bytes;
    let mut json = serde_json::to_vec(&document.into_json())
        .map_err(|error| Error::Internal(format!("glTF JSON: {error}")))?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() as u64 + 8 + chunk_bytes;
    let too_large = || {
        Error::output(
            out,
            format!("the GLB would have {total} bytes, but 4294967295 are the most; write an OBJ"),
        )
    };
    let total_field = u32::try_from(total).map_err(|_| too_large())?;
    let mut head = Vec::with_capacity(json.len() + 28);
    for word in [MAGIC, 2, total_field, json.len() as u32, JSON_CHUNK] {
        head.extend_from_slice(&word.to_le_bytes());
    }
    head.extend_from_slice(&json);
    for word in [chunk_bytes as u32, BIN_CHUNK] {
        head.extend_from_slice(&word.to_le_bytes());
    }
    file.write_all(&head)
        .and_then(|()| chunk.rewind())
        .and_then(|()| io::copy(&mut chunk, file))
        .map_err(failed(out, "write"))?;
    Ok(total)
}

fn encode(city: &City, index: usize, scan: &Scan, jpeg: Option<Jpeg>) -> Encoded {
    let facts = BlockFacts::new(city.origin(&city.plans[index]), scan, jpeg.as_ref());
    let (facade, rest) = scan.triangles.split_at(scan.facade_triangles);
    let facade_vertices = scan.texcoords.len();

    let mut facade_sections = vec![positions(scan.positions[..facade_vertices].iter())];
    if city.is_textured() {
        let bytes = scan.texcoords.iter().flat_map(|&steps| texcoord(steps));
        let kind = Kind::Vectors { components: 2, bounds: None };
        let bytes = bytes.flat_map(f32::to_le_bytes).collect();
        facade_sections.push(Section { kind, bytes });
    }
    facade_sections.push(indices(facade));

    // Welded vertices are used by both parts, so the second gets its own, in order of first use.
    let mut numbers = vec![u32::MAX; scan.positions.len()];
    let mut used = Vec::new();
    let rest: Vec<[u32; 3]> = rest
        .iter()
        .map(|triangle| {
            triangle.map(|vertex| {
                let number = &mut numbers[vertex as usize];
                if *number == u32::MAX {
                    *number = used.len() as u32;
                    used.push(scan.positions[vertex as usize]);
                }
                *number
            })
        })
        .collect();
    let rest_sections = vec![positions(used.iter()), indices(&rest)];
    let texture = jpeg.map(|jpeg| Section { kind: Kind::Texture, bytes: jpeg.bytes });
    Encoded { index, facade: facade_sections, rest: rest_sections, texture, facts }
}

fn positions<'a>(steps: impl ExactSizeIterator<Item = &'a [i32; 3]>) -> Section {
    let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let mut bytes = Vec::with_capacity(12 * steps.len());
    for position in steps {
        for axis in 0..3 {
            let metres = (f64::from(position[axis]) / STEPS_PER_METRE) as f32;
            bounds[0][axis] = bounds[0][axis].min(metres);
            bounds[1][axis] = bounds[1][axis].max(metres);
            bytes.extend_from_slice(&metres.to_le_bytes());
        }
    }
    Section { kind: Kind::Vectors { components: 3, bounds: Some(bounds) }, bytes }
}

fn indices(triangles: &[[u32; 3]]) -> Section {
    let bytes = triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()).collect();
    Section { kind: Kind::Indices, bytes }
}

/// The JSON in the making.
#[derive(Default)]
struct Document {
    bytes: u64,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    is_textured: bool,
}

impl Document {
    fn add(
        &mut self,
        city: &City,
        block: Encoded,
        write: &mut dyn FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        let name = city.block_name(block.index);
        let mut attributes = Vec::new();
        for section in block.facade {
            attributes.push(self.accessor(section, write)?);
        }
        let facade = match attributes[..] {
            [positions, texcoords, indices] => json!({
                "attributes": { "POSITION": positions, "TEXCOORD_0": texcoords },
                "indices": indices,
                "material": block.index + 1,
            }),
            [positions, indices] => json!({
                "attributes": { "POSITION": positions },
                "indices": indices,
                "material": block.index + 1,
            }),
            _ => return Err(Error::Internal(format!("{name}: parts of the façade"))),
        };
        let mut rest = Vec::new();
        for section in block.rest {
            rest.push(self.accessor(section, write)?);
        }
        let rest = json!({
            "attributes": { "POSITION": rest.first() },
            "indices": rest.last(),
            "material": 0,
        });
        let look = if let Some(texture) = block.texture {
            let view = self.view(&texture, write)?;
            let image = json!({ "name": name, "mimeType": "image/jpeg", "bufferView": view });
            self.images.push(image);
            self.is_textured = true;
            json!({
                "baseColorTexture": { "index": self.images.len() - 1 },
                "metallicFactor": 0.0,
            })
        } else {
            json!({ "baseColorFactor": FACADE_COLOR, "metallicFactor": 0.0 })
        };
        self.materials.push(json!({
            "name": format!("facade_{:04}", block.index),
            "pbrMetallicRoughness": look,
            "doubleSided": true,
        }));
        self.meshes.push(json!({ "name": name, "primitives": [facade, rest] }));
        self.nodes.push(json!({
            "name": name,
            "mesh": self.meshes.len() - 1,
            "translation": city.origin(&city.plans[block.index]).map(|metres| metres as f64),
        }));
        Ok(())
    }

    /// Writes a part of the chunk and returns the number of its buffer view.
    fn view(
        &mut self,
        section: &Section,
        write: &mut dyn FnMut(&[u8]) -> Result<()>,
    ) -> Result<usize> {
        write(&section.bytes)?;
        let padding = section.bytes.len().next_multiple_of(4) - section.bytes.len();
        write(&[0; 3][..padding])?;
        let mut view = json!({
            "buffer": 0,
            "byteOffset": self.bytes,
            "byteLength": section.bytes.len(),
        });
        match section.kind {
            Kind::Vectors { .. } => view["target"] = ARRAY_BUFFER.into(),
            Kind::Indices => view["target"] = ELEMENT_ARRAY_BUFFER.into(),
            Kind::Texture => {}
        }
        self.bytes += (section.bytes.len() + padding) as u64;
        self.views.push(view);
        Ok(self.views.len() - 1)
    }

    fn accessor(
        &mut self,
        section: Section,
        write: &mut dyn FnMut(&[u8]) -> Result<()>,
    ) -> Result<usize> {
        let view = self.view(&section, write)?;
        let words = section.bytes.len() / 4;
        let accessor = match section.kind {
            Kind::Vectors { components, bounds } => {
                let mut accessor = json!({
                    "bufferView": view,
                    "componentType": FLOAT,
                    "count": words / components,
                    "type": if components == 2 { "VEC2" } else { "VEC3" },
                });
                if let Some([low, high]) = bounds {
                    accessor["min"] = json!(low.map(f64::from));
                    accessor["max"] = json!(high.map(f64::from));
                }
                accessor
            }
            _ => json!({
                "bufferView": view,
                "componentType": UNSIGNED_INT,
                "count": words,
                "type": "SCALAR",
            }),
        };
        self.accessors.push(accessor);
        Ok(self.accessors.len() - 1)
    }

    fn into_json(mut self) -> Value {
        let roof_ground = json!({
            "name": "roof_ground",
            "pbrMetallicRoughness": { "baseColorFactor": ROOF_COLOR, "metallicFactor": 0.0 },
            "doubleSided": true,
        });
        self.materials.insert(0, roof_ground);
        let children: Vec<usize> = (1..=self.nodes.len()).collect();
        let city = json!({ "name": "city", "matrix": Z_UP_TO_Y_UP, "children": children });
        self.nodes.insert(0, city);
        let mut root = json!({
            "asset": {
                "version": "2.0",
                "generator": concat!("make-city ", env!("CARGO_PKG_VERSION")),
            },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes }],
        });
        if self.is_textured {
            let textures: Vec<Value> = (0..self.images.len())
                .map(|image| json!({ "sampler": 0, "source": image }))
                .collect();
            root["textures"] = textures.into();
            root["images"] = self.images.into();
            root["samplers"] = json!([{
                "magFilter": LINEAR,
                "minFilter": LINEAR_MIPMAP_LINEAR,
                "wrapS": CLAMP_TO_EDGE,
                "wrapT": CLAMP_TO_EDGE,
            }]);
        }
        root
    }
}
