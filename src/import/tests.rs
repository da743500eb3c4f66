//! Checks on whole models, and the real data where it is present.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::*;
use crate::decode::{decode_texture, texture_size};
use crate::mesh::{AlphaMode, Part};
use crate::scaling::assert_scales;

/// What every imported model promises.
pub(super) fn check(model: &Model) {
    assert!(!model.groups.is_empty());
    let mut names = BTreeSet::new();
    for material in &model.materials {
        assert!(names.insert(&material.name), "material {} is there twice", material.name);
        assert!(material.texture.is_none_or(|texture| (texture as usize) < model.textures.len()));
        assert!(material.base_color.iter().all(|part| (0.0..=1.0).contains(part)));
    }
    assert!(model.dependencies.is_sorted());
    let mut kinds = BTreeSet::new();
    for part in &model.parts {
        assert!((part.group as usize) < model.groups.len());
        assert!(kinds.insert((part.group, part.material)), "a part is there twice");
        let textured = model.materials[part.material as usize].texture.is_some();
        let vertices = part.positions.len();
        assert_eq!(part.texcoords.len(), if textured { vertices } else { 0 });
        assert!(part.colors.is_empty() || part.colors.len() == vertices);
        assert!(!part.indices.is_empty() && part.indices.len() % 3 == 0);
        assert!(part.positions.as_flattened().iter().all(|value| value.is_finite()));
        assert!(part.texcoords.as_flattened().iter().all(|value| value.is_finite()));
        let mut used = vec![false; vertices];
        for [a, b, c] in part.indices.as_chunks::<3>().0 {
            let [a, b, c] = [a, b, c].map(|vertex| {
                used[*vertex as usize] = true;
                part.positions[*vertex as usize]
            });
            assert!(a != b && b != c && c != a, "degenerate triangle");
        }
        assert!(used.iter().all(|used| *used), "vertex without a triangle");
    }
}

/// The folder of real data: `HLOD_DATA`, or `../shared/data` beside the crate.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("HLOD_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no real data at {}", folder.display());
    None
}

/// How often a warning whose text contains `what` was counted.
fn counted(model: &Model, what: &str) -> u64 {
    model.warnings.iter().filter(|(text, _)| text.contains(what)).map(|(_, times)| times).sum()
}

#[test]
fn real_data_has_the_triangles_that_its_description_says() {
    let Some(data) = data() else { return };
    for (file, triangles) in [
        ("sceaux/sceaux.obj", 174_899),
        ("oblique_a/oblique_a.obj", 111_674),
        ("ingolstadt/ingolstadt.obj", 149_769),
        ("torcs_street1/street1.obj", 25_508),
        ("hamada/hamada.obj", 859_380),
        ("wageningen/wageningen.obj", 304_126),
        ("lyon_roads/lyon_roads.obj", 414_368),
        ("3dfier/tinsimp_0.obj", 88_670),
        ("3dfier/testarea.obj", 28_619),
        ("glb/sceaux.glb", 174_899),
        ("glb/oblique_a.glb", 111_674),
        ("glb/ingolstadt.glb", 149_769),
        ("glb/street1.glb", 25_508),
        ("glb/wageningen.glb", 304_126),
    ] {
        let model = load(&data.join(file)).unwrap();
        check(&model);
        let dropped = counted(&model, "dropped");
        assert_eq!(model.triangle_count() as u64 + dropped, triangles as u64, "{file}");
    }
}

#[test]
fn broken_real_data_is_read_and_its_defects_are_counted() {
    let Some(data) = data() else { return };
    for file in find_inputs(&[data.join("lyon_nasty")]).unwrap() {
        let model = load(&file).unwrap();
        check(&model);
        let faces = std::fs::read_to_string(&file).unwrap();
        let faces = faces.lines().filter(|line| line.starts_with("f ")).count() as u64;
        assert_eq!(model.triangle_count() as u64 + counted(&model, "dropped"), faces);
    }
}

#[test]
fn real_cut_outs_and_textures_are_found() {
    let Some(data) = data() else { return };
    let model = load(&data.join("torcs_street1/street1.obj")).unwrap();
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    // 989 objects, of which 44 go on under the name of the one before.
    assert_eq!((model.groups.len(), model.materials.len()), (945, 44));
    let masked = model.materials.iter().filter(|material| material.alpha != AlphaMode::Opaque);
    assert_eq!(masked.count(), 13);
    for texture in &model.textures {
        let decoded = decode_texture(texture).unwrap();
        assert_eq!(texture_size(texture).unwrap(), (decoded.width, decoded.height));
    }
}

#[test]
fn a_glb_stands_where_its_obj_does() {
    let Some(data) = data() else { return };
    let bounds = |file: &str| {
        let model = load(&data.join(file)).unwrap();
        let positions = model.parts.iter().flat_map(|part| &part.positions);
        positions.fold([[f64::MAX; 3], [f64::MIN; 3]], |[low, high], position| {
            let each =
                |f: fn(f64, f64) -> f64, a: [f64; 3]| [0, 1, 2].map(|at| f(a[at], position[at]));
            [each(f64::min, low), each(f64::max, high)]
        })
    };
    let [low, high] = bounds("ingolstadt/ingolstadt.obj");
    let turned = bounds("glb/ingolstadt.glb");
    // Z up to Y up: (x, y, z) to (x, z, -y).
    let expected = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]];
    for (a, b) in turned.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((a - b).abs() < 1e-3, "{turned:?} for {expected:?}");
    }
}

/// The fixture that is in both formats: a shed with a concave floor, a texture whose path comes
/// from another machine, and a lawn.
#[test]
fn the_same_scene_as_obj_and_as_gltf() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/import");
    let obj = load(&fixtures.join("shed.obj")).unwrap();
    let gltf = load(&fixtures.join("shed.gltf")).unwrap();
    for model in [&obj, &gltf] {
        check(model);
        assert!(model.warnings.is_empty(), "{:?}", model.warnings);
        assert_eq!(model.triangle_count(), 9);
        let names: Vec<_> = model.groups.iter().map(|group| group.name.as_str()).collect();
        assert_eq!(names, ["shed", "lawn"]);
        let texture = decode_texture(&model.textures[0]).unwrap();
        assert_eq!((texture.width, texture.height, texture.channels), (2, 2, 3));
    }
    // The floor's corner on a straight edge is used, so area and corners are the same.
    let area = |model: &Model| -> f64 {
        let twice = |part: &Part| -> f64 {
            let at = |vertex: u32| glam::DVec3::from(part.positions[vertex as usize]);
            let triangles = part.indices.as_chunks::<3>().0.iter();
            triangles.map(|&[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a)).length()).sum()
        };
        model.parts.iter().map(twice).sum::<f64>() / 2.0
    };
    assert!((area(&obj) - 33.0).abs() < 1e-6, "{}", area(&obj));
    assert!((area(&obj) - area(&gltf)).abs() < 1e-3, "{}", area(&gltf));
    assert_eq!(obj.parts[0].texcoords[0], gltf.parts[0].texcoords[0]);
}

#[test]
fn materials_of_one_name_are_numbered() {
    let names = |given: &[&str]| -> Vec<String> {
        let mut materials: Vec<Material> =
            given.iter().map(|name| Material::plain(*name)).collect();
        number_equal_names(&mut materials);
        materials.into_iter().map(|material| material.name).collect()
    };
    assert_eq!(names(&["a", "b", "a", "a"]), ["a", "b", "a.2", "a.3"]);
    assert_eq!(
        names(&["a.2", "a", "a", "a.2", "a.3", "a"]),
        ["a.2", "a", "a.3", "a.2.2", "a.3.2", "a.4"]
    );
    assert_eq!(names(&["", "default", ""]), ["default", "default.2", "default.3"]);
}

#[test]
fn numbering_scales_with_the_number_of_materials() {
    let of_one_name = |count: usize| vec![Material::plain("facade"); count];
    assert_scales(1000, of_one_name, |mut materials| number_equal_names(&mut materials));
}
