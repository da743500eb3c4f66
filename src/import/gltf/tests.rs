use std::collections::BTreeSet;

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

/// [`square`] in a node with instances: translations, rotations in normalised 16 bits, scales.
fn instanced() -> (Value, Vec<u8>) {
    let (mut json, mut binary) = square();
    binary.truncate(92);
    for value in [0., 0., 0., 20., 0., 0., 0., 0., 1e6, 1., 1., 1., 2., 3., 1., 1., 1., 1_f32] {
        binary.extend(value.to_le_bytes());
    }
    for value in [0, 0, 0, 32767, 0, 0, 0, 32767, 0, 0, 23170, 23170_i16] {
        binary.extend(value.to_le_bytes());
    }
    json["buffers"][0]["byteLength"] = binary.len().into();
    let views = json["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": 92, "byteLength": 36}));
    views.push(json!({"buffer": 0, "byteOffset": 128, "byteLength": 36}));
    views.push(json!({"buffer": 0, "byteOffset": 164, "byteLength": 24}));
    let accessors = json["accessors"].as_array_mut().unwrap();
    for (view, component, shape) in [(3, 5126, "VEC3"), (4, 5126, "VEC3"), (5, 5122, "VEC4")] {
        accessors.push(json!({"bufferView": view, "componentType": component, "count": 3,
            "type": shape, "normalized": component == 5122}));
    }
    json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] =
        json!({"attributes": {"TRANSLATION": 3, "SCALE": 4, "ROTATION": 5, "_ID": 99}});
    json["nodes"][0]["translation"] = json!([678016.123, 0, 0]);
    json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    (json, binary)
}

#[test]
fn instances_are_placed_by_translation_rotation_and_scale() {
    let (json, binary) = instanced();
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!((model.groups.len(), model.parts.len()), (3, 3));
    assert!(model.warnings.is_empty());
    // The corner (1, 1, 0) of each: as it is, scaled by (2, 3, 1), turned by 90 degrees.
    let expected = [[1.0, 1.0, 0.0], [22.0, 3.0, 0.0], [-1.0, 1.0, 1e6]];
    for (part, [x, y, z]) in model.parts.iter().zip(expected) {
        let [found_x, found_y, found_z] = part.positions[2];
        assert!((found_x - x - 678_016.123).abs() < 1e-9, "{found_x} {x}");
        assert!((found_y - y).abs() < 1e-9 && found_z == z, "{found_y} {y}, {found_z} {z}");
        assert_eq!(part.indices, [0, 1, 2, 0, 2, 3]);
    }
    assert_eq!(model.parts.iter().map(|part| part.group).collect::<Vec<_>>(), [0, 1, 2]);
}

#[test]
fn instances_that_do_not_agree_or_are_too_many_are_refused() {
    let (json, binary) = instanced();
    let refused = |edit: &dyn Fn(&mut Value)| {
        let mut json = json.clone();
        edit(&mut json);
        read_glb(&json, &binary).unwrap_err()
    };
    let error = refused(&|json| json["accessors"][4]["count"] = 2.into());
    assert!(
        error.contains("EXT_mesh_gpu_instancing") && error.contains("found 3 and 2"),
        "{error}"
    );
    let error = refused(&|json| json["accessors"][3]["count"] = (1_u64 << 40).into());
    assert!(error.contains("triangles are added; expected at most"), "{error}");
    let error = refused(&|json| json["accessors"][3]["count"] = 4.into());
    assert!(error.contains("accessor 3: 4 elements"), "{error}");
    let error = refused(&|json| {
        json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
            77.into();
    });
    assert!(error.contains("no accessor 77"), "{error}");

    // Many nodes with the same mesh are no better.
    let (mut json, binary) = square();
    json["accessors"][2]["count"] = 60_000_000.into();
    json["scenes"][0]["nodes"] = (0..5).collect();
    json["nodes"] = (0..5).map(|_| json!({"mesh": 0})).collect();
    let error = read_glb(&json, &binary).unwrap_err();
    assert!(error.contains("triangles are added; expected at most"), "{error}");
}

#[test]
fn the_center_of_cesium_rtc_moves_everything() {
    let (mut json, binary) = square();
    json["nodes"][0]["rotation"] = json!([0, 0, 0.5, 0.5]);
    json["extensionsUsed"] = json!(["CESIUM_RTC"]);
    json["extensions"] = json!({"CESIUM_RTC": {"center": [6378137.123456, 100, 200]}});
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.parts[0].positions[0], [6_378_137.123_456, 100.0, 200.0]);
    assert!(model.warnings.is_empty());
    json["extensions"]["CESIUM_RTC"]["center"] = json!([1, 2]);
    assert!(read_glb(&json, &binary).unwrap_err().contains("CESIUM_RTC: center"));
}

#[test]
fn hidden_nodes_are_left_out_with_those_below() {
    let (mut json, binary) = square();
    json["scenes"][0]["nodes"] = json!([0, 1]);
    json["nodes"] = json!([
        {"mesh": 0, "name": "shown"},
        {"mesh": 0, "children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}},
        {"mesh": 0}
    ]);
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.groups, [Group { name: "shown".into() }]);
}

#[test]
fn a_skinned_mesh_is_where_its_first_joint_binds_it() {
    let (mut json, mut binary) = square();
    json["scenes"][0]["nodes"] = json!([0, 1]);
    json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [0, 50, 0]},
        {"translation": [100, 0, 0]}
    ]);
    json["skins"] = json!([{"joints": [1]}]);
    let position = |json: &Value, binary: &[u8]| {
        let model = read_glb(json, binary).unwrap();
        let warnings: Vec<_> = model.warnings.iter().collect();
        assert_eq!(warnings, [("dir/city.glb: primitive with a skin, shown in its bind pose", 1)]);
        model.parts[0].positions[0]
    };
    assert_eq!(position(&json, &binary), [100.0, 0.0, 0.0]);
    let inverse = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., -100., 7., 0., 1_f32];
    binary.extend(inverse.iter().flat_map(|value| value.to_le_bytes()));
    json["buffers"][0]["byteLength"] = binary.len().into();
    let view = json!({"buffer": 0, "byteOffset": 92, "byteLength": 64});
    json["bufferViews"].as_array_mut().unwrap().push(view);
    let accessor = json!({"bufferView": 3, "componentType": 5126, "count": 1, "type": "MAT4"});
    json["accessors"].as_array_mut().unwrap().push(accessor);
    json["skins"][0]["inverseBindMatrices"] = 3.into();
    assert_eq!(position(&json, &binary), [0.0, 7.0, 0.0]);
}

#[test]
fn what_changes_the_look_and_is_not_read_is_named_with_its_primitives() {
    let (json, binary) = square();
    let warnings = |edit: &dyn Fn(&mut Value)| -> Vec<(String, u64)> {
        let mut json = json.clone();
        // Two nodes with a mesh of two primitives, of which the edited material is the first's.
        let mut other = json["meshes"][0]["primitives"][0].clone();
        other["material"] = Value::Null;
        json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
        json["materials"].as_array_mut().unwrap().push(json!({"emissiveFactor": [9, 9, 9]}));
        json["scenes"][0]["nodes"] = json!([0, 1]);
        json["nodes"] = json!([{"mesh": 0}, {"mesh": 0}]);
        edit(&mut json);
        let model = read_glb(&json, &binary).unwrap();
        let starts = "dir/city.glb: primitive with ";
        let of = |(what, count): (&str, u64)| Some((what.strip_prefix(starts)?.to_owned(), count));
        model.warnings.iter().filter_map(of).collect()
    };
    let material = |extension: &'static str| {
        move |json: &mut Value| {
            json["materials"][0]["extensions"][extension] = json!({});
            json["extensionsUsed"] = json!([extension]);
        }
    };
    let cases: [(&str, u64, &dyn Fn(&mut Value)); 11] = [
        ("extension KHR_materials_transmission", 2, &material("KHR_materials_transmission")),
        (
            "extension KHR_materials_emissive_strength",
            2,
            &material("KHR_materials_emissive_strength"),
        ),
        ("extension ACME_paint", 2, &material("ACME_paint")),
        ("emissive colour", 2, &|json| json["materials"][0]["emissiveFactor"] = json!([0, 0.5, 0])),
        ("normal texture", 2, &|json| json["materials"][0]["normalTexture"] = json!({"index": 0})),
        ("occlusion texture", 2, &|json| {
            json["materials"][0]["occlusionTexture"] = json!({"index": 0});
        }),
        ("morph targets", 2, &|json| {
            json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
            json["meshes"][0]["weights"] = json!([0.5]);
        }),
        ("morph targets", 1, &|json| {
            json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
            json["nodes"][0]["weights"] = json!([0.5]);
        }),
        ("animation", 2, &|json| {
            json["animations"] = json!([{"channels": [{"sampler": 0,
                "target": {"node": 2, "path": "translation"}}], "samplers": []}]);
            json["nodes"] = json!([{"mesh": 0}, {"mesh": 0}, {"children": [0]}]);
            json["scenes"][0]["nodes"] = json!([2, 1]);
        }),
        ("texture in KHR_texture_basisu alone", 2, &|json| {
            json["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
            json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        }),
        ("texture that has no image", 2, &|json| {
            json["textures"] = json!([{}]);
            json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        }),
    ];
    for (expected, count, edit) in cases {
        let found = warnings(edit);
        assert_eq!(found.len(), 1, "{found:?} for {expected}");
        assert!(found[0].0.contains(expected) && found[0].1 == count, "{found:?} for {expected}");
    }

    let silent: [&dyn Fn(&mut Value); 6] = [
        &|_| {},
        &material("KHR_materials_unlit"),
        &|json| {
            json["extensionsUsed"] =
                json!(["EXT_structural_metadata", "KHR_draco_mesh_compression"])
        },
        &|json| json["materials"][0]["emissiveFactor"] = json!([0, 0, 0]),
        &|json| json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]),
        &|json| {
            json["materials"][0]["extensions"]["KHR_materials_unlit"] = json!({});
            json["materials"][0]["normalTexture"] = json!({"index": 0});
        },
    ];
    for edit in silent {
        assert_eq!(warnings(edit), []);
    }
}

#[test]
fn required_extensions_that_are_not_read_are_refused_with_a_way_out() {
    let (mut json, binary) = square();
    for (extension, expected) in [
        ("KHR_draco_mesh_compression", "gltf-pipeline"),
        ("KHR_texture_basisu", "gltf-transform"),
        ("ACME_geometry", "export it without"),
    ] {
        json["extensionsRequired"] = json!([extension]);
        let error = read_glb(&json, &binary).unwrap_err();
        assert!(error.contains(extension) && error.contains(expected), "{error}");
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

/// How a compressed view is described: its mode, filter, bytes of an element, elements and data.
type View<'a> = (&'a str, &'a str, usize, usize, Vec<u8>);

/// [`square`] with the data of its accessors in these compressed views.
fn compressed(extension: &str, views: [View; 3]) -> (Value, Vec<u8>) {
    let (mut json, _) = square();
    let mut binary = vec![0; 3];
    let mut fallback = 0;
    json["bufferViews"] = views
        .into_iter()
        .map(|(mode, filter, stride, count, bytes)| {
            let mut view =
                json!({"buffer": 1, "byteOffset": fallback, "byteLength": stride * count});
            view["extensions"][extension] = json!({
                "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len(),
                "byteStride": stride, "count": count, "mode": mode, "filter": filter});
            fallback += stride * count;
            binary.extend(bytes);
            view
        })
        .collect();
    json["buffers"] = json!([{"byteLength": binary.len()},
        {"byteLength": fallback, "extensions": {extension: {"fallback": true}}}]);
    json["extensionsRequired"] = json!([extension]);
    (json, binary)
}

fn square_positions() -> Vec<[f32; 3]> {
    vec![[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]
}

const CORNERS: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// The three views of a compressed square, by versions of the vertex codec.
fn compressed_views(version: i32) -> [View<'static>; 3] {
    let texcoords = [[0_f32; 2]; 4];
    let level = 2;
    let encoded = |bytes: meshopt::Result<Vec<u8>>| bytes.unwrap();
    [
        (
            "ATTRIBUTES",
            "NONE",
            12,
            4,
            encoded(meshopt::encoding::encode_vertex_buffer_level(
                &square_positions(),
                level,
                Some(version),
            )),
        ),
        (
            "ATTRIBUTES",
            "NONE",
            8,
            4,
            encoded(meshopt::encoding::encode_vertex_buffer_level(
                &texcoords,
                level,
                Some(version),
            )),
        ),
        ("TRIANGLES", "NONE", 2, 6, encoded(meshopt::encode_index_buffer(&CORNERS, 4))),
    ]
}

#[test]
fn compressed_views_are_read_under_both_names_of_the_extension() {
    for (extension, version) in [
        ("EXT_meshopt_compression", 0),
        ("KHR_meshopt_compression", 0),
        ("KHR_meshopt_compression", 1),
    ] {
        let (json, binary) = compressed(extension, compressed_views(version));
        let model = read_glb(&json, &binary).unwrap();
        let part = &model.parts[0];
        let corners = part.indices.iter().map(|&vertex| part.positions[vertex as usize]);
        let corners: BTreeSet<_> = corners.map(|position| position.map(f64::to_bits)).collect();
        let expected = square_positions().into_iter().map(|p| p.map(|c| f64::from(c).to_bits()));
        assert_eq!(corners, expected.collect());
        assert_eq!((part.indices.len(), model.warnings.is_empty()), (6, true));
    }
}

#[test]
fn index_sequences_and_filters_are_read() {
    let [positions, texcoords, _] = compressed_views(0);
    let filtered = meshopt::encoding::encode_filter_exp::<3>(
        &square_positions(),
        20,
        meshopt::encoding::EncodeExpMode::Separate,
    );
    let exponential = meshopt::encode_vertex_buffer(&filtered).unwrap();
    let sequence = meshopt::encoding::encode_index_sequence(&CORNERS, 4).unwrap();
    for stride in [2, 4] {
        let views = [
            ("ATTRIBUTES", "EXPONENTIAL", 12, 4, exponential.clone()),
            texcoords.clone(),
            ("INDICES", "NONE", stride, 6, sequence.clone()),
        ];
        let (mut json, binary) = compressed("KHR_meshopt_compression", views);
        json["accessors"][2]["componentType"] = if stride == 2 { 5123 } else { 5125 }.into();
        let model = read_glb(&json, &binary).unwrap();
        assert_eq!(model.parts[0].indices, CORNERS);
        assert_eq!(model.parts[0].positions[2], [1.0, 1.0, 0.0]);
    }
    // Unit vectors, which only normals need, are decoded for whoever reads them.
    let directions = [[0.6, 0.0, 0.8, 0.0], [0.0, -1.0, 0.0, 0.0_f32]];
    let octahedral = meshopt::encoding::encode_filter_oct::<i8>(&directions, 8);
    let bytes = meshopt::encode_vertex_buffer(&octahedral).unwrap();
    let views =
        [positions, ("ATTRIBUTES", "OCTAHEDRAL", 4, 2, bytes), compressed_views(0)[2].clone()];
    let (json, binary) = compressed("EXT_meshopt_compression", views);
    let compression = Compression::read(&json).unwrap();
    let view = compression.views[1].as_ref().unwrap();
    let decoded = view.decode(&binary[view.byte_offset..][..view.byte_length]).unwrap();
    for (element, expected) in decoded.chunks(4).zip(directions) {
        let close = |at: usize| (f32::from(element[at] as i8) / 127.0 - expected[at]).abs() < 0.02;
        assert!((0..3).all(close), "{element:?} {expected:?}");
    }
}

#[test]
fn damaged_and_hostile_compressed_views_are_refused() {
    let (json, binary) = compressed("EXT_meshopt_compression", compressed_views(0));
    let refused = |edit: &dyn Fn(&mut Value)| {
        let mut json = json.clone();
        edit(&mut json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]);
        read_glb(&json, &binary).unwrap_err()
    };
    let cases: [(&str, &dyn Fn(&mut Value)); 11] = [
        ("do not fit", &|view| view["count"] = 1_000_000.into()),
        ("do not fit", &|view| view["count"] = u64::MAX.into()),
        ("not in buffer 0", &|view| view["byteOffset"] = u64::MAX.into()),
        ("all buffers have", &|view| view["byteLength"] = u64::MAX.into()),
        ("not in buffer 7", &|view| view["buffer"] = 7.into()),
        ("Attributes of 4 elements of 7 bytes", &|view| view["byteStride"] = 7.into()),
        ("Attributes of 4 elements of 0 bytes", &|view| view["byteStride"] = 0.into()),
        ("Quaternion", &|view| view["filter"] = "QUATERNION".into()),
        ("unknown variant", &|view| view["mode"] = "MESHLETS".into()),
        ("missing field `count`", &|view| _ = view.as_object_mut().unwrap().remove("count")),
        ("Triangles of 4 elements", &|view| {
            view["mode"] = "TRIANGLES".into();
            view["byteStride"] = 4.into();
        }),
    ];
    for (expected, edit) in cases {
        let error = refused(edit);
        assert!(error.contains("buffer view") && error.contains(expected), "{error}: {expected}");
    }
    // The same bytes cannot be decoded again and again.
    let mut repeated = json.clone();
    let view = repeated["bufferViews"][0].clone();
    repeated["bufferViews"].as_array_mut().unwrap().extend(vec![view; 1000]);
    assert!(read_glb(&repeated, &binary).unwrap_err().contains("all buffers have"));

    // The container pads to four bytes.
    for length in 0..binary.len() - 4 {
        assert!(read_glb(&json, &binary[..length]).is_err());
    }
    for bit in 0..binary.len() * 8 {
        let mut flipped = binary.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        if let Ok(model) = read_glb(&json, &flipped).map(super::super::assemble) {
            model.iter().for_each(super::super::tests::check);
        }
    }
}

#[test]
fn quantised_positions_are_read_normalised_or_not_in_8_and_16_bits() {
    for (component, size, most) in
        [(5120, 1, 127), (5121, 1, 255), (5122, 2, 32767), (5123, 2, 65535_i32)]
    {
        for normalized in [false, true] {
            let (mut json, mut binary) = square();
            binary.truncate(92);
            for position in square_positions() {
                let value = |c: f32| ((c as i32) * most).to_le_bytes()[..size].to_vec();
                binary.extend(position.into_iter().flat_map(value));
                binary.resize(binary.len().next_multiple_of(4), 0);
            }
            let stride = (3 * size).next_multiple_of(4);
            json["buffers"][0]["byteLength"] = binary.len().into();
            let view = json!({"buffer": 0, "byteOffset": 92, "byteLength": 4 * stride,
                "byteStride": stride});
            json["bufferViews"].as_array_mut().unwrap().push(view);
            json["accessors"][0] = json!({"bufferView": 3, "componentType": component, "count": 4,
                "normalized": normalized, "type": "VEC3"});
            json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
            let model = read_glb(&json, &binary).unwrap();
            let side = if normalized { 1.0 } else { f64::from(most) };
            assert_eq!(model.parts[0].positions[2], [side, side, 0.0], "{component} {normalized}");
        }
    }
}

#[test]
fn skirts_of_nodes_are_left_out() {
    let (mut json, binary) = square();
    json["meshes"][0]["primitives"][0]["extras"] = json!({"skirtTriangles": 1});
    let model = read_glb(&json, &binary).unwrap();
    assert_eq!(model.parts[0].indices, [0, 1, 2]);
    json["meshes"][0]["primitives"][0]["extras"] = json!({"skirtTriangles": u64::MAX});
    assert!(read_glb(&json, &binary).unwrap_err().contains("no triangle in any mesh"));
}

/// Triangles of a strip, a primitive each, whose positions are all in one accessor.
fn shared_accessor(primitives: u32) -> (Value, Vec<u8>) {
    let mut binary = Vec::new();
    for vertex in 0..primitives + 2 {
        let position = [vertex as f32, (vertex % 2) as f32, 0.0];
        position.iter().for_each(|value| binary.extend(value.to_le_bytes()));
    }
    let positions = binary.len();
    let corners = (0..primitives).flat_map(|first| [first, first + 1, first + 2]);
    corners.for_each(|corner| binary.extend(corner.to_le_bytes()));
    let indices = |at: u32| json!({"bufferView": 1, "byteOffset": 12 * at, "componentType": 5125, "count": 3, "type": "SCALAR"});
    let vertices = primitives + 2;
    let mut accessors =
        vec![json!({"bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3"})];
    accessors.extend((0..primitives).map(indices));
    let primitive = |at: u32| json!({"attributes": {"POSITION": 0}, "indices": at + 1});
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": (0..primitives).map(primitive).collect::<Vec<_>>()}],
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteLength": positions},
            {"buffer": 0, "byteOffset": positions, "byteLength": binary.len() - positions}
        ],
        "buffers": [{"byteLength": binary.len()}]
    });
    (json, binary)
}

#[test]
fn time_scales_with_the_primitives_that_share_an_accessor() {
    crate::scaling::assert_scales(
        500,
        |count| shared_accessor(count as u32),
        |(json, binary)| {
            let model = read_glb(&json, &binary).unwrap();
            assert_eq!(
                model.triangle_count(),
                json["meshes"][0]["primitives"].as_array().unwrap().len()
            );
        },
    );
}

/// The square with a normal that is tilted, under these transforms; and the first corner's normals.
fn tilted(normals: [[f32; 3]; 4], nodes: &[Value]) -> Result<(Vec<Option<DVec3>>, Model), String> {
    let (mut json, mut binary) = square();
    binary.extend(normals.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    json["buffers"][0]["byteLength"] = binary.len().into();
    let views = json["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": 92, "byteLength": 48}));
    let accessors = json["accessors"].as_array_mut().unwrap();
    accessors.push(json!({"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC3"}));
    json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 3.into();
    json["nodes"] = nodes
        .iter()
        .map(|node| {
            let mut node = node.clone();
            node["mesh"] = 0.into();
            node
        })
        .collect();
    json["scenes"][0]["nodes"] = (0..nodes.len()).collect();
    let model = read_glb(&json, &binary)?;
    let first = |part: &Part| part.normals.get(part.indices[0] as usize)?.vector();
    Ok((model.parts.iter().map(first).collect(), model))
}

#[test]
fn unlit_materials_are_unlit_and_take_no_normals() {
    let (mut json, binary) = square();
    json["materials"][0]["extensions"]["KHR_materials_unlit"] = json!({});
    // One that is not there would be refused or warned of.
    json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 9.into();
    let model = read_glb(&json, &binary).unwrap();
    assert!(model.materials[0].is_unlit && model.warnings.is_empty());
    assert!(model.parts[0].normals.is_empty());
    assert!(!read_glb(&square().0, &binary).unwrap().materials[0].is_unlit);
}

#[test]
fn normals_turn_with_their_node() {
    let nodes = [
        json!({}),
        json!({"scale": [-1, 1, 1]}),
        json!({"scale": [2, 1, 1]}),
        json!({"rotation": [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()]}),
        json!({"scale": [3, 3, -3]}),
    ];
    let (found, model) = tilted([[0.6, 0.0, 0.8]; 4], &nodes).unwrap();
    let expected =
        [[0.6, 0., 0.8], [-0.6, 0., 0.8], [0.3, 0., 0.8], [0., 0.6, 0.8], [0.6, 0., -0.8]];
    for (found, expected) in found.iter().zip(expected) {
        let off = found.unwrap().distance(DVec3::from(expected).normalize());
        assert!(off < 1e-4, "{found:?} for {expected:?}");
    }
    // All look to the side that their triangles face.
    for part in &model.parts {
        for corners in part.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|vertex| DVec3::from(part.positions[vertex as usize]));
            let normal = part.normals[corners[0] as usize].vector().unwrap();
            assert!((b - a).cross(c - a).dot(normal) > 0.0);
        }
    }
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
}

#[test]
fn normals_that_cannot_be_are_dropped_and_counted() {
    let bad = [[0.0, 0.0, 0.0], [f32::NAN, 0.0, 1.0], [0.0, 0.6, -0.8], [0.6, 0.0, 0.8]];
    let (_, model) = tilted(bad, &[json!({})]).unwrap();
    let part = &model.parts[0];
    let kept = |vertex: &&u32| part.normals[**vertex as usize] != Normal::NONE;
    assert_eq!(part.indices.iter().filter(kept).count(), 1);
    let counts: Vec<u64> = model.warnings.iter().map(|(_, count)| count).collect();
    assert_eq!(counts, [4], "two vertices, and two corners of the third");
    // A square that is flat in its normals, too, keeps none.
    let (flat, model) = tilted([[0.0, 0.0, 2.0]; 4], &[json!({"scale": [2, 3, 4]})]).unwrap();
    assert_eq!((flat, model.warnings.is_empty()), (vec![None], true));
}

#[cfg(unix)]
#[test]
fn buffers_that_are_no_files_are_refused_and_images_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("city.glb");
    for (name, what) in crate::side_file::make_faulty_files(folder.path()) {
        let (mut json, binary) = textured();
        json["images"] = json!([{"uri": name}]);
        let model = read(&path, &glb(&json, &binary)).unwrap();
        assert_eq!(model.materials[0].texture, None);
        let (warning, times) = model.warnings.iter().next().unwrap();
        assert!(warning.contains(&format!("texture {name} cannot be read: ")), "{warning}");
        assert!(warning.contains(what) && times == 1, "{warning}");
        json["buffers"][0]["uri"] = name.into();
        let refusal = read(&path, &glb(&json, &binary)).unwrap_err();
        assert!(refusal.contains("buffer 0: ") && refusal.contains(what), "{refusal}");
    }
}

#[test]
fn extensions_that_no_primitive_has_are_named_only_if_something_has_them() {
    let (json, binary) = square();
    let warnings = |edit: &dyn Fn(&mut Value)| -> Vec<(String, u64)> {
        let mut json = json.clone();
        json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        edit(&mut json);
        let model = read_glb(&json, &binary).unwrap();
        model.warnings.iter().map(|(what, count)| (what.to_owned(), count)).collect()
    };
    assert_eq!(warnings(&|json| json["extras"] = json!({"extensions": {"A_b": 1}})), []);
    let expected =
        "dir/city.glb: the extension KHR_lights_punctual is not read; no shown primitive has it";
    let uses: [&dyn Fn(&mut Value); 3] = [
        &|json| json["extensionsRequired"] = json!(["KHR_lights_punctual"]),
        &|json| json["extensions"]["KHR_lights_punctual"] = json!({"lights": []}),
        &|json| {
            let light = json!({"extensions": {"KHR_lights_punctual": {"light": 0}}});
            json["nodes"].as_array_mut().unwrap().push(light);
        },
    ];
    for edit in uses {
        assert_eq!(warnings(edit), [(expected.to_owned(), 1)]);
    }
}

#[test]
fn a_missing_scene_center_or_corner_is_warned_of() {
    let (json, binary) = square();
    let cases: [(&str, usize, &dyn Fn(&mut Value)); 5] = [
        ("there is no scene 7; the first is shown", 2, &|json| json["scene"] = 7.into()),
        ("there is no scene 0; all nodes are shown", 2, &|json| {
            json.as_object_mut().unwrap().remove("scenes");
        }),
        ("CESIUM_RTC without center, ignored", 2, &|json| {
            json["extensions"] = json!({"CESIUM_RTC": {"centre": [1, 2, 3]}});
        }),
        ("list of triangles whose number of corners is no multiple of 3", 1, &|json| {
            json["accessors"][2]["count"] = 5.into();
        }),
        ("list of triangles whose number of corners is no multiple of 3", 1, &|json| {
            _ = json["meshes"][0]["primitives"][0]["indices"].take();
        }),
    ];
    for (expected, triangles, edit) in cases {
        let mut json = json.clone();
        edit(&mut json);
        let model = read_glb(&json, &binary).unwrap();
        let found: Vec<_> = model.warnings.iter().collect();
        assert_eq!(model.triangle_count(), triangles, "{expected}");
        assert!(found.len() == 1 && found[0].0.contains(expected) && found[0].1 == 1, "{found:?}");
    }
}

#[test]
fn normals_of_another_length_or_type_are_named_with_their_accessor() {
    let (mut json, binary) = square();
    json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 3.into();
    for (kind, count, expected) in [
        ("VEC3", 3, "accessor 3 has 3 elements; expected 4, one for each position"),
        ("VEC2", 4, "accessor 3 has 2 components; expected 3"),
    ] {
        json["accessors"].as_array_mut().unwrap().truncate(3);
        json["accessors"]
            .as_array_mut()
            .unwrap()
            .push(json!({"bufferView": 0, "componentType": 5126, "count": count, "type": kind}));
        let model = read_glb(&json, &binary).unwrap();
        let found: Vec<_> = model.warnings.iter().collect();
        let expected =
            format!("dir/city.glb: NORMAL of a primitive: {expected}; its faces' normals are used");
        assert_eq!(found, [(&expected[..], 1)]);
    }
}
