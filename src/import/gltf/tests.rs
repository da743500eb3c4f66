use serde_json::json;

use super::*;
use crate::mesh::{AlphaMode, TextureData, Wrap};

/// Reads a document whose only buffer holds `binary`, as a GLB.
fn read_glb(json: &Value, binary: &[u8]) -> Result<Model, String> {
    let bytes = glb(json, binary);
    read(Path::new("dir/city.glb"), &bytes)
}

fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    for word in [2, total as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

/// A unit square of two triangles: positions (48 bytes), texture coordinates (32), indices (12).
fn square() -> (Value, Vec<u8>) {
    let mut binary = Vec::new();
    for value in [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 1_f32]
    {
        binary.extend(value.to_le_bytes());
    }
    for index in [0_u16, 1, 2, 0, 2, 3] {
        binary.extend(index.to_le_bytes());
    }
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "square"}],
        "meshes": [{"primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
        ]}],
        "materials": [{"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 12}
        ],
        "buffers": [{"byteLength": 92}]
    });
    (json, binary)
}

/// The square's material with an embedded texture (of which only the bytes matter here).
fn textured() -> (Value, Vec<u8>) {
    let (mut json, mut binary) = square();
    binary.extend(b"PNG!");
    json["buffers"][0]["byteLength"] = 96.into();
    json["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({"buffer": 0, "byteOffset": 92, "byteLength": 4}));
    json["images"] = json!([{"bufferView": 3, "mimeType": "image/png", "name": "brick"}]);
    json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648}]);
    json["textures"] = json!([{"source": 0, "sampler": 0}]);
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    (json, binary)
}

#[test]
fn a_square_is_read_whole() {
    let (json, binary) = square();
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.up, Some(UpAxis::Y));
    assert_eq!(model.groups, [Group { name: "square".into() }]);
    assert_eq!(model.parts.len(), 1);
    let part = &model.parts[0];
    assert_eq!(part.indices, [0, 1, 2, 0, 2, 3]);
    assert_eq!(part.positions[2], [1.0, 1.0, 0.0]);
    assert!(part.texcoords.is_empty(), "no texture, no texture coordinates");
    assert_eq!(model.materials[0].base_color, [0.5, 0.25, 1.0, 1.0]);
    assert!(!model.materials[0].double_sided);
    assert!(model.warnings.is_empty());
}

#[test]
fn textures_wrap_alpha_and_transform_are_kept() {
    let (mut json, binary) = textured();
    json["materials"][0]["alphaMode"] = "MASK".into();
    json["materials"][0]["alphaCutoff"] = 0.25.into();
    json["materials"][0]["doubleSided"] = true.into();
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 3]}});
    let model = read_glb(&json, &binary).unwrap();
    let material = &model.materials[0];
    assert_eq!(material.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(material.alpha, AlphaMode::Mask { cutoff: 0.25 });
    assert!(material.double_sided);
    let texture = &model.textures[material.texture.unwrap() as usize];
    assert_eq!(texture.name, "brick");
    assert!(matches!(&texture.data, TextureData::Embedded(bytes) if bytes[..] == *b"PNG!"));
    assert_eq!(model.parts[0].texcoords, [[0.5, 0.0], [2.5, 0.0], [2.5, 3.0], [0.5, 3.0]]);
}

#[test]
fn the_texture_coordinate_set_can_be_another() {
    let (mut json, binary) = textured();
    let info = &mut json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["texCoord"] = 7.into();
    info["extensions"] = json!({"KHR_texture_transform": {"texCoord": 1}});
    let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"].take();
    attributes.as_object_mut().unwrap().remove("TEXCOORD_0");
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.parts[0].texcoords[2], [1.0, 1.0]);
    assert!(model.warnings.is_empty());
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"].take();
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.parts[0].texcoords[2], [0.0, 0.0]);
    assert_eq!(model.warnings.iter().next().unwrap().1, 2);
}

#[test]
fn specular_glossiness_gives_colour_and_texture() {
    let (mut json, binary) = textured();
    json["materials"][0] = json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.1, 0.2, 0.3, 1], "diffuseTexture": {"index": 0}}}});
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.materials[0].base_color, [0.1, 0.2, 0.3, 1.0]);
    assert_eq!(model.materials[0].texture, Some(0));
}

#[test]
fn instances_are_groups_and_mirrored_ones_are_turned() {
    let (mut json, binary) = square();
    json["scenes"][0]["nodes"] = json!([0, 1]);
    json["nodes"] = json!([
        {"mesh": 0, "translation": [678016.123, 0, 5403456.789]},
        {"mesh": 0, "name": "mirrored", "scale": [-1, 1, 1]}
    ]);
    json["meshes"][0]["name"] = "wall".into();
    let model = read_glb(&json, &binary).unwrap();
    let names: Vec<_> = model.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["wall", "mirrored"]);
    assert_eq!(model.parts[0].positions[1], [1.0 + 678_016.123, 0.0, 5_403_456.789]);
    assert_eq!((model.parts[1].group, model.parts[1].material), (1, 0));
    // Seen from +z both are counter-clockwise.
    for part in &model.parts {
        let [a, b, c] = [0, 1, 2].map(|at| part.positions[part.indices[at] as usize]);
        assert!((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0);
    }
}

#[test]
fn strips_and_fans_become_lists() {
    assert_eq!(triangles(vec![0, 1, 2, 3, 4], Mode::TriangleStrip), [0, 1, 2, 1, 3, 2, 2, 3, 4]);
    assert_eq!(triangles(vec![0, 1, 2, 3], Mode::TriangleFan), [1, 2, 0, 2, 3, 0]);
    assert_eq!(triangles(vec![0, 1, 2, 3], Mode::Triangles), [0, 1, 2]);
    assert!(triangles(vec![0, 1], Mode::TriangleStrip).is_empty());
}

#[test]
fn lines_are_counted_and_not_read() {
    let (mut json, binary) = square();
    let mut lines = json["meshes"][0]["primitives"][0].clone();
    lines["mode"] = 1.into();
    json["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.triangle_count(), 2);
    assert!(model.warnings.iter().next().unwrap().0.contains("point, line"));
}

#[test]
fn quantised_positions_and_colours_are_scaled() {
    let (mut json, mut binary) = square();
    binary.truncate(92);
    for value in [0_u16, 0, 0, 0, 65535, 0, 0, 0, 65535, 65535, 0, 0, 0, 65535, 0, 0] {
        binary.extend(value.to_le_bytes());
    }
    binary.extend([255, 0, 0, 128].repeat(4));
    json["buffers"][0]["byteLength"] = (92 + 32 + 16).into();
    let views = json["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": 92, "byteLength": 32, "byteStride": 8}));
    views.push(json!({"buffer": 0, "byteOffset": 124, "byteLength": 16}));
    let accessors = json["accessors"].as_array_mut().unwrap();
    accessors.push(json!({"bufferView": 3, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC3"}));
    accessors.push(json!({"bufferView": 4, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"}));
    json["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 3, "COLOR_0": 4});
    json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    json["nodes"][0]["scale"] = json!([10, 10, 10]);
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.parts[0].positions[2], [10.0, 10.0, 0.0]);
    assert_eq!(model.parts[0].colors[0], [65535, 0, 0, 32896]);
}

#[test]
fn sparse_accessors_replace_elements() {
    let (mut json, mut binary) = square();
    binary.truncate(92);
    binary.extend([2, 0, 0, 0]);
    for value in [5., 6., 7_f32] {
        binary.extend(value.to_le_bytes());
    }
    json["buffers"][0]["byteLength"] = 108.into();
    let views = json["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": 92, "byteLength": 4}));
    views.push(json!({"buffer": 0, "byteOffset": 96, "byteLength": 12}));
    json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 4}});
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.parts[0].positions[2], [5.0, 6.0, 7.0]);
    binary[92] = 4;
    let error = read_glb(&json, &binary).unwrap_err();
    assert!(error.contains("sparse index 4 of 4"), "{error}");
}

#[test]
fn files_beside_the_model_are_found_and_listed() {
    let folder = tempfile::tempdir().unwrap();
    let (mut json, binary) = textured();
    json["buffers"][0]["uri"] = "my%20data.bin".into();
    json["images"] = json!([{"uri": "brick%20a.png"}]);
    std::fs::write(folder.path().join("my data.bin"), &binary).unwrap();
    std::fs::write(folder.path().join("brick a.png"), "").unwrap();
    let file = folder.path().join("city.gltf");
    std::fs::write(&file, json.to_string()).unwrap();
    let model = super::super::load(&file).unwrap();
    let names: Vec<_> =
        model.dependencies.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["brick a.png", "city.gltf", "my data.bin"]);
    std::fs::remove_file(folder.path().join("brick a.png")).unwrap();
    let model = super::super::load(&file).unwrap();
    assert!(model.warnings.iter().next().unwrap().0.contains("brick%20a.png not found"));
    std::fs::remove_file(folder.path().join("my data.bin")).unwrap();
    let error = super::super::load(&file).unwrap_err();
    assert!(error.to_string().contains("my%20data.bin not found"), "{error}");
}

#[test]
fn bad_files_are_refused_with_the_element() {
    let (json, binary) = square();
    let refused = |edit: &dyn Fn(&mut Value)| {
        let mut json = json.clone();
        edit(&mut json);
        read_glb(&json, &binary).unwrap_err()
    };
    let cases: [(&str, &dyn Fn(&mut Value)); 10] = [
        ("version 1.0", &|json| json["asset"]["version"] = "1.0".into()),
        ("KHR_draco_mesh_compression", &|json| {
            json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        }),
        ("there is no mesh 1", &|json| json["nodes"][0]["mesh"] = 1.into()),
        ("there is no buffer view 9", &|json| json["accessors"][0]["bufferView"] = 9.into()),
        ("buffer 0 is truncated", &|json| json["buffers"][0]["byteLength"] = 1000.into()),
        ("buffer view 0: 1000 bytes", &|json| json["bufferViews"][0]["byteLength"] = 1000.into()),
        ("accessor 0: 5 elements", &|json| json["accessors"][0]["count"] = 5.into()),
        ("accessor 0", &|json| json["accessors"][0]["count"] = u64::MAX.into()),
        ("accessor 1 has 2 components", &|json| {
            json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 1.into();
        }),
        ("no triangle in any mesh", &|json| json["scenes"][0]["nodes"] = json!([])),
    ];
    for (expected, edit) in cases {
        let error = refused(edit);
        assert!(error.contains(expected), "{error} for {expected}");
    }
    let mut outside = binary.clone();
    outside[80] = 4;
    let error = read_glb(&json, &outside).unwrap_err();
    assert_eq!(error, "node 0: mesh 0, primitive 0: vertex index 4 of 4");
    assert!(read(Path::new("a.gltf"), b"not json").unwrap_err().contains("is not glTF"));
}

#[test]
fn every_truncation_and_bit_flip_gives_a_model_or_an_error() {
    let (json, binary) = textured();
    let bytes = glb(&json, &binary);
    for length in 0..bytes.len() {
        assert!(read(Path::new("a.glb"), &bytes[..length]).is_err(), "{length}");
    }
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(Ok(model)) = read(Path::new("a.glb"), &flipped).map(super::super::assemble) {
            super::super::tests::check(&model);
        }
    }
}
