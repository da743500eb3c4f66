//! Node files: round trip, what other readers see, and damage.

use std::path::Path;

use super::encoding::Encoding;
use super::glb_write::{NodeLabel, write_glb, write_glb_encoded};
use super::node_id::NodeId;
use super::node_mesh::{NodeImageData, NodeMesh, Primitive};
use super::test_mesh::mesh;
use super::{glb_read::read_glb, glb_schema};
use crate::mesh::{AlphaMode, UpAxis, Wrap};

const LABEL: NodeLabel = NodeLabel { id: NodeId(u64::MAX), level: 2 };

fn write(mesh: &NodeMesh, up: UpAxis) -> Vec<u8> {
    write_glb(mesh, up, LABEL).unwrap()
}

fn read(bytes: &[u8]) -> crate::Result<NodeMesh> {
    read_glb(bytes, Path::new("out/nodes/n.glb"))
}

/// `==` takes −0 for 0; bits do not.
fn bits(mesh: &NodeMesh) -> Vec<u32> {
    let flat = |p: &Primitive| {
        let floats = p.positions.as_flattened().iter().chain(p.texcoords.as_flattened());
        floats.map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    mesh.primitives.iter().flat_map(flat).collect()
}

#[test]
fn reads_back_what_it_wrote_bit_for_bit() {
    for up in [UpAxis::Y, UpAxis::Z] {
        let mesh = mesh();
        let bytes = write(&mesh, up);
        assert_eq!(bytes.len() % 4, 0);
        let back = read(&bytes).unwrap();
        assert_eq!(back, mesh);
        assert_eq!(bits(&back), bits(&mesh));
        assert_eq!(write(&mesh, up), bytes);
    }
}

#[test]
fn unlit_surfaces_without_an_image_stay_so() {
    let mut mesh = mesh();
    let primitive = mesh.primitives.iter_mut().find(|primitive| primitive.surface.image.is_none());
    let primitive = primitive.unwrap();
    primitive.surface.is_unlit = true;
    primitive.normals.clear();
    mesh.primitives.retain(|primitive| primitive.surface.image.is_none());
    mesh.images.clear();
    let bytes = write(&mesh, UpAxis::Z);
    assert_eq!(json_of(&bytes)["extensionsUsed"], serde_json::json!(["KHR_materials_unlit"]));
    assert_eq!(read(&bytes).unwrap(), mesh);
}

/// A mesh on a lattice of a quarter, as a quantised build makes it.
fn mesh_in_quarters() -> NodeMesh {
    let mut mesh = mesh();
    for position in mesh.primitives.iter_mut().flat_map(|primitive| &mut primitive.positions) {
        *position = position.map(|coordinate| (coordinate * 4.0).round() / 4.0 + 100.0);
    }
    mesh.primitives[0].texcoords = vec![[0.0, 1.0 / 3.0], [1.0, 0.1], [1.0, 1.0], [0.0, 0.7]];
    mesh
}

const QUARTERS: Encoding = Encoding { step: Some(0.25), compress: false };

/// Its file.
fn file_in_quarters(up: UpAxis) -> Vec<u8> {
    let mut mesh = mesh_in_quarters();
    QUARTERS.prepare(&mut mesh);
    write_glb_encoded(&mesh, up, LABEL, QUARTERS, None).unwrap()
}

fn json_of(bytes: &[u8]) -> serde_json::Value {
    serde_json::from_slice(&bytes[20..20 + json_length(bytes)]).unwrap()
}

/// Every encoding gives back what was prepared for it; compression may turn triangles.
#[test]
fn encodings_lose_nothing_that_was_prepared() {
    for up in [UpAxis::Y, UpAxis::Z] {
        for (step, compress) in
            [(None, false), (None, true), (Some(0.25), false), (Some(0.25), true)]
        {
            let encoding = Encoding { step, compress };
            let mut mesh = if step.is_some() { mesh_in_quarters() } else { mesh() };
            encoding.prepare(&mut mesh);
            let bytes = write_glb_encoded(&mesh, up, LABEL, encoding, None).unwrap();
            let mut back = read(&bytes).unwrap();
            for (found, expected) in back.primitives.iter_mut().zip(&mesh.primitives) {
                let turned = |indices: &[u32]| -> Vec<[u32; 3]> {
                    let turn = |&[a, b, c]: &[u32; 3]| {
                        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
                    };
                    indices.as_chunks::<3>().0.iter().map(turn).collect()
                };
                assert_eq!(turned(&found.indices), turned(&expected.indices));
                found.indices.clone_from(&expected.indices);
            }
            assert_eq!(back, mesh, "{encoding:?}");
            assert_eq!(bits(&back), bits(&mesh), "{encoding:?}");
            let required = json_of(&bytes)["extensionsRequired"].to_string();
            assert_eq!(required.contains("EXT_meshopt_compression"), compress);
            assert_eq!(required.contains("KHR_mesh_quantization"), step.is_some());
        }
    }
}

/// Positions are where they were, in integers of 16 bits, 8 bytes apart, and bounded as stored.
#[test]
fn steps_are_stored_as_gltf_wants_them() {
    let (before, mut mesh) = (mesh_in_quarters(), mesh_in_quarters());
    QUARTERS.prepare(&mut mesh);
    // Vertices are in another order.
    let positions = |mesh: &NodeMesh, primitive: &Primitive| {
        let position = |p: &[f32; 3]| {
            std::array::from_fn(|axis| (mesh.origin[axis] + f64::from(p[axis])).to_bits())
        };
        let corners = primitive.indices.iter().map(|&vertex| &primitive.positions[vertex as usize]);
        let mut positions: Vec<[u64; 3]> = corners.map(position).collect();
        positions.sort_unstable();
        positions
    };
    for (one, other) in before.primitives.iter().zip(&mesh.primitives) {
        assert_eq!(positions(&before, one), positions(&mesh, other));
    }
    for up in [UpAxis::Y, UpAxis::Z] {
        let json = json_of(&file_in_quarters(up));
        let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
        let accessor = |name: &str| &json["accessors"][attributes[name].as_u64().unwrap() as usize];
        let positions = accessor("POSITION");
        assert_eq!(positions["componentType"], 5123);
        assert_eq!(positions["normalized"], serde_json::Value::Null);
        let view = &json["bufferViews"][positions["bufferView"].as_u64().unwrap() as usize];
        assert_eq!((view["byteStride"].as_u64(), view["byteLength"].as_u64()), (Some(8), Some(32)));
        for bound in ["min", "max"] {
            for steps in positions[bound].as_array().unwrap() {
                let steps = steps.as_f64().unwrap();
                assert!(steps.fract() == 0.0 && (0.0..=65535.0).contains(&steps));
            }
        }
        let texcoords = accessor("TEXCOORD_0");
        assert_eq!(
            (&texcoords["componentType"], &texcoords["normalized"]),
            (&5123.into(), &true.into())
        );
        let repeated = &json["meshes"][0]["primitives"][1]["attributes"]["TEXCOORD_0"];
        let repeated = &json["accessors"][repeated.as_u64().unwrap() as usize];
        assert_eq!(repeated["componentType"], 5126, "beyond 0 to 1");
        let node = &json["nodes"][0];
        assert_eq!(node["scale"].is_array(), up == UpAxis::Y);
        let number = |list: &serde_json::Value, at: usize| list[at].as_f64().unwrap();
        let origin = match up {
            UpAxis::Y => [0, 1, 2].map(|at| number(&node["translation"], at)),
            UpAxis::Z => [12, 14, 13].map(|at| number(&node["matrix"], at)),
        };
        assert_eq!(origin.map(f64::abs), mesh.origin.map(f64::abs), "with all digits");
    }
}

/// What has no place in 16 bits keeps 32, in a file that needs no extension.
#[test]
fn what_does_not_fit_in_steps_keeps_32_bits() {
    let mut wide = mesh_in_quarters();
    wide.primitives[0].positions[0][1] = 20_000.0;
    for mut mesh in [wide, mesh()] {
        let before = mesh.clone();
        QUARTERS.prepare(&mut mesh);
        assert_eq!(mesh.origin, before.origin);
        let bytes = write_glb_encoded(&mesh, UpAxis::Z, LABEL, QUARTERS, None).unwrap();
        assert!(!json_of(&bytes)["extensionsUsed"].to_string().contains("KHR_mesh_quantization"));
        assert_eq!(read(&bytes).unwrap(), mesh);
    }
}

#[test]
fn lies_about_steps_are_refused() {
    let (upright, turned) = (file_in_quarters(UpAxis::Y), file_in_quarters(UpAxis::Z));
    let cases = [
        (&upright, "\"scale\":[0.25", "\"scale\":[0.5", "one scale"),
        (&upright, "\"scale\":[0.25,0.25,0.25]", "\"scale\":[0,0,0]", "one scale"),
        (&upright, "\"scale\":[0.25,0.25,0.25]", "\"scale\":[1e38,1e38,1e38]", "finite"),
        (&upright, "\"byteStride\":8,", "\"byteStride\":12,", "8 bytes from one"),
        (&upright, "\"byteStride\":8,", "", "8 bytes from one"),
        (&upright, "\"normalized\":true,", "", "normalized false"),
        (&upright, "\"componentType\":5123,", "\"componentType\":5126,", "expected steps"),
        (&turned, "\"matrix\":[0.25", "\"matrix\":[0.5", "a matrix that turns"),
    ];
    for (bytes, from, to, words) in cases {
        let message = read(&edit(bytes, from, to)).unwrap_err().to_string();
        assert!(message.contains(words), "{to}: expected {words:?}, found {message}");
    }
}

#[test]
fn a_flipped_bit_in_a_quantised_file_is_an_error_or_another_sound_mesh() {
    let bytes = file_in_quarters(UpAxis::Z);
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(mesh) = read(&flipped) {
            drop(write_glb(&mesh, UpAxis::Z, LABEL).unwrap());
        }
    }
}

fn json_length(bytes: &[u8]) -> usize {
    u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize
}

/// A byte that is wrong gives an error or another mesh, never a panic or much memory.
#[test]
fn damaged_compressed_files_do_no_harm() {
    let encoding = Encoding { step: None, compress: true };
    let mut mesh = mesh();
    encoding.prepare(&mut mesh);
    let bytes = write_glb_encoded(&mesh, UpAxis::Z, LABEL, encoding, None).unwrap();
    for place in 0..bytes.len() {
        for wrong in [0, 0x7F, 0xFF] {
            let mut damaged = bytes.clone();
            damaged[place] = wrong;
            drop(read(&damaged));
        }
    }
    for (honest, wrong) in
        [("\"count\":4,", "\"count\":9999999,"), ("\"count\":6,", "\"count\":12,")]
    {
        let json = String::from_utf8(bytes[20..20 + json_length(&bytes)].to_vec()).unwrap();
        let json = json.trim_end().replace(honest, wrong);
        let width = json.len().next_multiple_of(4);
        let json = format!("{json:<width$}");
        let mut damaged = bytes[..12].to_vec();
        damaged.extend((json.len() as u32).to_le_bytes());
        damaged.extend(&bytes[16..20]);
        damaged.extend(json.as_bytes());
        damaged.extend(&bytes[20 + json_length(&bytes)..]);
        let length = (damaged.len() as u32).to_le_bytes();
        damaged[8..12].copy_from_slice(&length);
        read(&damaged).unwrap_err();
    }
}

#[test]
fn a_node_without_geometry_is_a_file() {
    let empty = NodeMesh { origin: [1.0, 2.0, 3.0], images: vec![], primitives: vec![] };
    let bytes = write(&empty, UpAxis::Z);
    gltf::Gltf::from_slice(&bytes).unwrap();
    assert_eq!(read(&bytes).unwrap(), empty);
}

#[test]
fn indices_take_two_bytes_while_they_fit() {
    for (vertices, kind) in
        [(0xFFFF, glb_schema::UNSIGNED_SHORT), (0x1_0000, glb_schema::UNSIGNED_INT)]
    {
        let mut mesh = mesh();
        mesh.images.clear();
        mesh.primitives.drain(..3);
        mesh.primitives[0].positions = (0..vertices).map(|i| [i as f32, 0.5, 0.0]).collect();
        mesh.primitives[0].indices = vec![0, 1, vertices as u32 - 1];
        let bytes = write(&mesh, UpAxis::Y);
        assert_eq!(read(&bytes).unwrap(), mesh);
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        assert_eq!(primitive.indices().unwrap().data_type().as_gl_enum(), kind);
    }
}

/// Another reader sees the same vertices at the same place, Y up.
#[test]
fn other_readers_see_the_city_upright() {
    let mesh = mesh();
    for up in [UpAxis::Y, UpAxis::Z] {
        let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&write(&mesh, up)).unwrap();
        let blob = blob.unwrap();
        let node = document.default_scene().unwrap().nodes().next().unwrap();
        let matrix = glam::Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        let first = node.mesh().unwrap().primitives().next().unwrap();
        let read = first.reader(|_| Some(&blob));
        let positions = read.read_positions().unwrap();
        for (seen, ours) in positions.zip(&mesh.primitives[0].positions) {
            let seen = matrix.transform_point3(glam::Vec3::from(seen).as_dvec3());
            let source = glam::Vec3::from(*ours).as_dvec3() + glam::DVec3::from(mesh.origin);
            let expected = match up {
                UpAxis::Y => source,
                UpAxis::Z => glam::DVec3::new(source.x, source.z, -source.y),
            };
            assert_eq!(seen, expected);
        }
    }
}

#[test]
fn other_readers_see_the_same_surfaces() {
    let bytes = write(&mesh(), UpAxis::Z);
    let document = gltf::Gltf::from_slice(&bytes).unwrap().document;
    assert_eq!(document.materials().count(), 3, "equal surfaces share a material");
    let primitives: Vec<_> = document.meshes().next().unwrap().primitives().collect();
    let material = |index: usize| primitives[index].material();
    assert!(material(0).unlit() && material(1).unlit() && !material(2).unlit());
    assert!(!material(0).double_sided() && material(2).double_sided());
    assert_eq!(material(1).alpha_mode(), gltf::material::AlphaMode::Mask);
    assert_eq!(material(1).alpha_cutoff(), Some(0.1));
    assert_eq!(material(2).index(), material(3).index());
    let texture = material(1).pbr_metallic_roughness().base_color_texture().unwrap().texture();
    assert_eq!(texture.sampler().wrap_t(), gltf::texture::WrappingMode::MirroredRepeat);
    assert!(matches!(
        texture.source().source(),
        gltf::image::Source::Uri { uri: "textures/fence-64.png", .. }
    ));
    let colors = primitives[1].get(&gltf::Semantic::Colors(0)).unwrap();
    assert!(colors.normalized());
}

#[test]
fn what_breaks_a_promise_is_not_written() {
    let cases: &[(&str, fn(&mut NodeMesh))] = &[
        ("fit in 32 bits", |m| m.origin[0] = 0.1),
        ("fit in 32 bits", |m| m.origin[0] = f64::NAN),
        ("finite", |m| m.primitives[0].positions[1][2] = f32::NAN),
        ("finite", |m| m.primitives[0].texcoords[1][1] = f32::INFINITY),
        ("texture coordinates: expected 4", |m| m.primitives[1].texcoords.truncate(3)),
        ("found none", |m| m.primitives[1].texcoords.clear()),
        ("colours: expected 4", |m| m.primitives[2].colors.truncate(3)),
        ("indices below 4, found 4", |m| m.primitives[0].indices[0] = 4),
        ("whole triangles", |m| m.primitives[0].indices.truncate(5)),
        ("whole triangles", |m| m.primitives[0].indices.clear()),
        ("colour within", |m| m.primitives[0].surface.base_color[1] = 1.5),
        ("cutoff", |m| m.primitives[0].surface.alpha = AlphaMode::Mask { cutoff: f32::NAN }),
        ("image below 2", |m| m.primitives[0].surface.image = Some(2)),
        ("plain file name", |m| {
            m.images[0].data = NodeImageData::Shared { file_name: "../x.png".into() };
        }),
        ("plain file name", |m| {
            let NodeImageData::Embedded { file_name, .. } = &mut m.images[0].data else { return };
            *file_name = Some("../x.png".into());
        }),
        ("JPEG or PNG", |m| {
            m.images[0].data =
                NodeImageData::Embedded { mime: "image/bmp", bytes: vec![1], file_name: None };
        }),
    ];
    for (words, spoil) in cases {
        let mut mesh = mesh();
        spoil(&mut mesh);
        let message = write_glb(&mesh, UpAxis::Y, LABEL).unwrap_err().to_string();
        assert!(message.contains(words), "{words}: {message}");
    }
}

/// The wrapping of a surface without a picture means nothing, and is not kept.
#[test]
fn wrapping_without_a_picture_is_not_kept() {
    let mut mesh = mesh();
    mesh.primitives[2].surface.wrap = [Wrap::Clamp; 2];
    let bytes = write(&mesh, UpAxis::Y);
    assert_eq!(gltf::Gltf::from_slice(&bytes).unwrap().materials().count(), 3);
    mesh.primitives[2].surface.wrap = [Wrap::Repeat; 2];
    assert_eq!(read(&bytes).unwrap(), mesh);
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = write(&mesh(), UpAxis::Z);
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "{length}");
        if length >= 12 {
            let mut sealed = bytes[..length].to_vec();
            sealed[8..12].copy_from_slice(&(length as u32).to_le_bytes());
            assert!(read(&sealed).is_err(), "{length} with its length corrected");
        }
    }
}

/// What is accepted in spite of a flipped bit can be written, so it keeps every promise.
#[test]
fn a_flipped_bit_is_an_error_or_another_sound_mesh() {
    let bytes = write(&mesh(), UpAxis::Z);
    let mut refused = 0;
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        match read(&flipped) {
            Ok(mesh) => drop(write_glb(&mesh, UpAxis::Z, LABEL).unwrap()),
            Err(error) => {
                assert!(error.to_string().starts_with("out/nodes/n.glb: not a node file: "));
                refused += 1;
            }
        }
    }
    assert!(refused > bytes.len() * 4, "{refused} of {} bits", bytes.len() * 8);
}

/// Replaces a piece of the JSON by another, and puts lengths right.
fn edit(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = std::str::from_utf8(&bytes[20..20 + length]).unwrap();
    assert!(json.contains(from), "{from} not in {json}");
    let json = json.replacen(from, to, 1);
    let mut out = bytes[..20].to_vec();
    out[12..16].copy_from_slice(&(json.len() as u32).to_le_bytes());
    out.extend(json.as_bytes());
    out.extend(&bytes[20 + length..]);
    let length = out.len() as u32;
    out[8..12].copy_from_slice(&length.to_le_bytes());
    out
}

#[test]
fn lies_in_the_json_are_refused() {
    let bytes = write(&mesh(), UpAxis::Z);
    let cases = [
        ("\"count\":4,", "\"count\":4000000000,", "expected 4000000000 elements"),
        ("\"count\":4,", "\"count\":3,", "expected 3 elements"),
        ("\"byteLength\":48,", "\"byteLength\":18446744073709551615,", "within buffer 0"),
        ("\"byteOffset\":0,", "\"byteOffset\":18446744073709551615,", "within buffer 0"),
        ("\"buffer\":0,", "\"buffer\":1,", "buffer 1"),
        ("{\"bufferView\":1,", "{\"bufferView\":0,", "used twice"),
        ("{\"bufferView\":1,", "{\"bufferView\":99,", "found 99"),
        ("\"POSITION\":0", "\"POSITION\":77", "found 77"),
        ("\"POSITION\":0", "\"POSITION\":1", "expected Vec3"),
        ("\"material\":0", "\"material\":9", "found 9"),
        ("\"sampler\":0", "\"sampler\":9", "found 9"),
        ("\"source\":0", "\"source\":9", "found 9"),
        ("\"mesh\":0", "\"mesh\":1", "mesh Some(1) of 1"),
        ("\"textures/", "\"../textures/", "expected textures/NAME"),
        ("textures/", "textures/../", "expected textures/NAME"),
        ("\"uri\":", "\"name\":\"x\",\"uri\":", "expected a buffer view"),
        ("\"mimeType\":", "\"name\":\"../x\",\"mimeType\":", "plain file name"),
        ("\"image/png\"", "\"image/gif\"", "found image/gif"),
        ("\"matrix\":[1.0", "\"matrix\":[2.0", "a matrix that turns"),
        ("\"MASK\"", "\"BLEND\"", "do not agree"),
        ("\"version\":\"2.0\"", "\"version\":\"3.0\"", "found 3.0"),
        ("\"scene\":0", "\"scene\":0,\"cameras\":[]", "unknown field `cameras`"),
        ("\"meshes\":", "\"animations\":", "unknown field `animations`"),
    ];
    for (from, to, words) in cases {
        let message = read(&edit(&bytes, from, to)).unwrap_err().to_string();
        assert!(message.contains(words), "{to}: expected {words:?}, found {message}");
    }
}

#[test]
fn an_index_past_the_vertices_is_refused() {
    let mut mesh = mesh();
    mesh.images.clear();
    mesh.primitives.drain(..3);
    let mut bytes = write(&mesh, UpAxis::Y);
    let at = bytes.len() - 8; // 2 1 0 as u16, and two bytes of padding
    assert_eq!(bytes[at..], [2, 0, 1, 0, 0, 0, 0, 0]);
    bytes[at] = 3;
    assert!(read(&bytes).unwrap_err().to_string().contains("expected below 3, found 3"));
}
