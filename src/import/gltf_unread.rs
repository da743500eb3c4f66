//! What a glTF file asks for and import does not read, counted by the primitives that it concerns.
//! Features that concern no primitive or the whole file are counted once.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::Value;

use super::gltf_nodes::Placement;
use crate::mesh::Warnings;

/// Extensions that are read.
const READ: [&str; 10] = [
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "EXT_texture_webp",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "CESIUM_RTC",
];

/// Extensions that change nothing that is seen: metadata, and alternatives that a viewer offers.
const METADATA: [&str; 11] = [
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "KHR_materials_variants",
    "KHR_node_selectability",
    "KHR_node_hoverability",
    "KHR_interactivity",
    "EXT_mesh_features",
    "EXT_instance_features",
    "EXT_structural_metadata",
    "EXT_feature_metadata",
    "EXT_mesh_manifold",
];

/// Encodings that are not read. Where a file does not require them, it holds the plain form too, which is read.
const ENCODINGS: [&str; 4] =
    ["KHR_draco_mesh_compression", "KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"];

/// Refuses, by name, what a file requires and cannot be shown without.
pub(super) fn check_required(json: &Value) -> Result<(), String> {
    let refused: Vec<&str> = names(json, "extensionsRequired")
        .filter(|name| !READ.contains(name) && !is_only_appearance(name))
        .collect();
    if refused.is_empty() {
        return Ok(());
    }
    let how = match refused[..] {
        ["KHR_draco_mesh_compression"] => {
            "decode it first, for instance with: gltf-pipeline -i IN.glb -o OUT.glb"
        }
        ["KHR_texture_basisu"] => {
            "convert its textures first, for instance with: gltf-transform ktxdecompress IN.glb OUT.glb"
        }
        ["EXT_texture_avif"] => {
            "convert its textures first, for instance with: gltf-transform png IN.glb OUT.glb"
        }
        _ => "export it without",
    };
    Err(format!("requires {}, which is not read; {how}", refused.join(", ")))
}

/// True if geometry and base colour are right without the extension: it concerns reflections, light or motion.
fn is_only_appearance(name: &str) -> bool {
    METADATA.contains(&name)
        || name == "KHR_animation_pointer"
        || ["KHR_materials_", "KHR_lights_", "EXT_lights_"]
            .iter()
            .any(|start| name.starts_with(start))
}

/// True if nothing has to be said of an extension that a file uses.
fn is_covered(name: &str) -> bool {
    READ.contains(&name) || METADATA.contains(&name) || ENCODINGS.contains(&name)
}

/// Adds a warning for each thing that changes how placed primitives look and is not read, with their number.
pub(super) fn warn(path: &Path, json: &Value, placements: &[Placement], warnings: &mut Warnings) {
    warn_of_file(path, json, warnings);
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut found = BTreeSet::new();
    for placement in placements {
        let node = &json["nodes"][placement.node];
        let mesh = &json["meshes"][placement.mesh];
        let weights = if node["weights"].is_array() { &node["weights"] } else { &mesh["weights"] };
        for primitive in array(&mesh["primitives"]) {
            found.clear();
            extensions([node, mesh, primitive], &mut found);
            if let Some(material) = primitive["material"].as_u64() {
                of_material(json, &json["materials"][material as usize], &mut found);
            }
            if has_nonzero(weights) && !array(&primitive["targets"]).is_empty() {
                found.insert("morph targets, shown without them".into());
            }
            if placement.skin.is_some() {
                found.insert("a skin, shown in its bind pose".into());
            }
            if placement.is_animated {
                found.insert("an animation, shown at rest".into());
            }
            for what in &found {
                match counts.get_mut(what) {
                    Some(count) => *count += 1,
                    None => _ = counts.insert(what.clone(), 1),
                }
            }
        }
    }
    // Such as lights. A file may also list what nothing in it uses.
    let mut others = BTreeSet::new();
    all_extensions(json, &mut others);
    others.extend(names(json, "extensionsRequired"));
    for name in others {
        let is_named = is_covered(name) || counts.contains_key(&of_extension(name));
        if !is_named && !name.starts_with("KHR_materials_") {
            let what = format!("the extension {name} is not read; no shown primitive has it");
            warnings.add(format!("{}: {what}", path.display()), 1);
        }
    }
    for (what, count) in counts {
        warnings.add(format!("{}: primitive with {what}", path.display()), count);
    }
}

/// Warns of what is wrong with fields that concern the whole file.
fn warn_of_file(path: &Path, json: &Value, warnings: &mut Warnings) {
    let scene = &json["scene"];
    let is_there = scene.as_u64().is_some_and(|index| !json["scenes"][index as usize].is_null());
    if !scene.is_null() && !is_there {
        let what = match array(&json["scenes"]).is_empty() {
            true => "all nodes are shown",
            false => "the first is shown",
        };
        warnings.add(format!("{}: there is no scene {scene}; {what}", path.display()), 1);
    }
    let center = &json["extensions"]["CESIUM_RTC"];
    if center.is_object() && center["center"].is_null() {
        warnings.add(format!("{}: CESIUM_RTC without center, ignored", path.display()), 1);
    }
}

/// Adds the names of all extensions that some object of the file has.
fn all_extensions<'a>(value: &'a Value, found: &mut BTreeSet<&'a str>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| all_extensions(value, found)),
        Value::Object(fields) => {
            for (name, value) in fields {
                if let ("extensions", Some(names)) = (&name[..], value.as_object()) {
                    found.extend(names.keys().map(String::as_str));
                }
                // Application data may have any fields.
                if name != "extras" {
                    all_extensions(value, found);
                }
            }
        }
        _ => {}
    }
}

fn of_material(json: &Value, material: &Value, found: &mut BTreeSet<String>) {
    extensions([material], found);
    let pbr = &material["pbrMetallicRoughness"];
    let glossiness = &material["extensions"]["KHR_materials_pbrSpecularGlossiness"];
    let info = match glossiness {
        Value::Null => &pbr["baseColorTexture"],
        _ => &glossiness["diffuseTexture"],
    };
    extensions([info], found);
    if let Some(texture) = info["index"].as_u64() {
        let texture = &json["textures"][texture as usize];
        let is_read = |image: &Value| image.is_u64();
        if !is_read(&texture["source"])
            && !is_read(&texture["extensions"]["EXT_texture_webp"]["source"])
        {
            let formats = texture["extensions"].as_object().map(|names| names.keys());
            let formats: Vec<&str> = formats.into_iter().flatten().map(String::as_str).collect();
            found.insert(match formats.is_empty() {
                true => "a texture that has no image".into(),
                false => format!("a texture in {} alone, not shown", formats.join(", ")),
            });
        }
    }
    if !material["extensions"]["KHR_materials_unlit"].is_null() {
        return;
    }
    if has_nonzero(&material["emissiveFactor"]) {
        found.insert("an emissive colour, not shown".into());
    }
    for (field, what) in [
        ("normalTexture", "a normal texture, not shown"),
        ("occlusionTexture", "an occlusion texture, not shown"),
    ] {
        if material[field].is_object() {
            found.insert(what.into());
        }
    }
}

/// Adds the extensions of objects that are not read.
fn extensions<const N: usize>(objects: [&Value; N], found: &mut BTreeSet<String>) {
    for names in objects.iter().filter_map(|object| object["extensions"].as_object()) {
        let names = names.keys().map(String::as_str);
        found.extend(names.filter(|name| !is_covered(name)).map(of_extension));
    }
}

fn of_extension(name: &str) -> String {
    format!("the extension {name}, not shown")
}

/// The texts of an array of the file.
fn names<'a>(json: &'a Value, field: &str) -> impl Iterator<Item = &'a str> {
    array(&json[field]).iter().filter_map(Value::as_str)
}

fn array(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn has_nonzero(numbers: &Value) -> bool {
    array(numbers).iter().any(|number| number.as_f64().is_some_and(|number| number != 0.0))
}
