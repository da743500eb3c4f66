//! The generator's command line: files, messages and exit codes.

#[path = "e2e/support/files.rs"]
mod files;

use std::fs;

use assert_cmd::Command;
use files::contents;
use hlod::city::{City, CityOptions};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

fn make_city() -> Command {
    Command::cargo_bin("make-city").unwrap()
}

const SMALL: [&str; 4] = ["--blocks", "5", "--triangles", "20000"];

fn small_city() -> City {
    City::new(&CityOptions { blocks: 5, triangles: 20_000, ..CityOptions::default() }).unwrap()
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    for out in ["city.obj", "city.glb", "parts"] {
        let run = |threads: &str| {
            let place = tempfile::tempdir().unwrap();
            let split: &[&str] = if out == "parts" { &["--split"] } else { &[] };
            make_city()
                .current_dir(&place)
                .args(SMALL)
                .args(split)
                .args(["--threads", threads, out])
                .assert()
                .success();
            contents(place.path())
        };
        let one = run("1");
        assert!(!one.is_empty());
        assert!(one == run("4"), "{out} differs");
        assert!(one == run("3"), "{out} differs");
    }
}

#[test]
fn an_obj_reads_back_as_the_city() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("new/folder/city.obj");
    make_city()
        .args(SMALL)
        .args(["--offset", "678016,5403456,-400.5"])
        .arg(&out)
        .assert()
        .success()
        .stdout(contains("triangles         200").and(contains("texels")).and(contains("seconds")));

    let city = City::new(&CityOptions {
        blocks: 5,
        triangles: 20_000,
        offset: [678_016.0, 5_403_456.0, -400.5],
        ..CityOptions::default()
    })
    .unwrap();
    let (models, materials) = tobj::load_obj(&out, &tobj::GPU_LOAD_OPTIONS).unwrap();
    let materials = materials.unwrap();
    assert_eq!(models.len(), 2 * city.len(), "façade and the rest of each block");
    assert_eq!(materials.len(), city.len() + 1);
    for (pair, index) in models.chunks(2).zip(0..) {
        let block = city.block(index).unwrap();
        assert!(pair.iter().all(|model| model.name == block.name));
        let (facade, rest) = (&pair[0].mesh, &pair[1].mesh);
        assert_eq!(facade.indices.len(), 3 * block.facade_triangles);
        assert_eq!(facade.indices.len() + rest.indices.len(), 3 * block.triangles.len());
        assert_eq!(facade.texcoords.len(), facade.positions.len() / 3 * 2);
        assert!(rest.texcoords.is_empty());
        let corners = block.triangles[..block.facade_triangles].as_flattened();
        for (&vertex, &read) in corners.iter().zip(&facade.indices) {
            let at = 3 * read as usize;
            assert_eq!(facade.positions[at..at + 3], block.positions[vertex as usize]);
        }
        let material = &materials[facade.material_id.unwrap()];
        let texture = out.parent().unwrap().join(material.diffuse_texture.as_ref().unwrap());
        let size = city.tiles(index).unwrap().size;
        assert_eq!(image::image_dimensions(texture).unwrap(), (size[0], size[1]));
    }
}

#[test]
fn a_glb_reads_back_as_the_city() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("city.glb");
    make_city().args(SMALL).arg("--watertight").arg(&out).assert().success();
    let bytes = fs::read(&out).unwrap();
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = gltf.blob.as_deref();
    let city = City::new(&CityOptions {
        blocks: 5,
        triangles: 20_000,
        watertight: true,
        ..CityOptions::default()
    })
    .unwrap();
    let root = gltf.default_scene().unwrap().nodes().next().unwrap();
    // Up is +z in the city and +y in glTF; north is +y and −z.
    let matrix = glam::Mat4::from_cols_array_2d(&root.transform().matrix());
    assert_eq!(matrix.transform_vector3(glam::Vec3::Z), glam::Vec3::Y);
    assert_eq!(matrix.transform_vector3(glam::Vec3::Y), glam::Vec3::NEG_Z);
    assert_eq!(root.children().count(), city.len());
    for (node, index) in root.children().zip(0..) {
        let block = city.block(index).unwrap();
        assert_eq!(node.name(), Some(block.name.as_str()));
        let (translation, ..) = node.transform().decomposed();
        assert_eq!(translation.map(f64::from), block.origin);
        let primitives: Vec<_> = node.mesh().unwrap().primitives().collect();
        let mut triangles = 0;
        for (primitive, is_facade) in primitives.iter().zip([true, false]) {
            let reader = primitive.reader(|_| blob);
            let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            assert!(indices.iter().all(|&vertex| (vertex as usize) < positions.len()));
            for &vertex in &indices {
                let source = block.triangles.as_flattened()[triangles];
                let found = glam::Vec3::from(positions[vertex as usize]).as_dvec3()
                    + glam::DVec3::from(block.origin);
                let expected = glam::DVec3::from(block.positions[source as usize]);
                assert!((found - expected).abs().max_element() < 2e-5, "{found} {expected}");
                triangles += 1;
            }
            assert_eq!(reader.read_tex_coords(0).is_some(), is_facade);
            let texture = primitive.material().pbr_metallic_roughness().base_color_texture();
            assert_eq!(texture.is_some(), is_facade);
        }
        assert_eq!(triangles, 3 * block.triangles.len());
    }
    for image in gltf.images() {
        let gltf::image::Source::View { view, mime_type } = image.source() else {
            panic!("the image is not embedded");
        };
        assert_eq!(mime_type, "image/jpeg");
        let bytes = &blob.unwrap()[view.offset()..view.offset() + view.length()];
        assert_eq!(image::guess_format(bytes).unwrap(), image::ImageFormat::Jpeg);
    }
}

#[test]
fn a_split_city_has_a_file_for_each_block() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("parts");
    // Twice: an earlier city there is replaced, also where it was larger.
    for (blocks, expected) in [("5", 15), ("3", 9)] {
        make_city()
            .args(["--triangles", "20000", "--split", "--blocks", blocks])
            .arg(&out)
            .assert()
            .success();
        assert_eq!(contents(&out).len(), expected);
    }
    let (models, materials) =
        tobj::load_obj(out.join("block_0002.obj"), &tobj::LoadOptions::default()).unwrap();
    assert_eq!(models.len(), 2);
    let texture = materials.unwrap()[0].diffuse_texture.clone().unwrap();
    assert!(out.join(texture).is_file());
}

#[test]
fn a_city_without_textures_has_no_texture_coordinates() {
    let place = tempfile::tempdir().unwrap();
    make_city()
        .current_dir(&place)
        .args(SMALL)
        .args(["--no-textures", "--quiet", "city.obj"])
        .assert()
        .success()
        .stdout("");
    let files = contents(place.path());
    assert_eq!(files.keys().collect::<Vec<_>>(), ["city.mtl", "city.obj"]);
    let text = String::from_utf8(files["city.obj"].clone()).unwrap();
    assert!(!text.contains("vt ") && !text.contains('/'));
    let faces = text.lines().filter(|line| line.starts_with("f ")).count();
    let expected: usize =
        (0..5).map(|index| small_city().block(index).unwrap().triangles.len()).sum();
    assert_eq!(faces, expected);
}

#[test]
fn bad_arguments_are_usage_errors() {
    let place = tempfile::tempdir().unwrap();
    let cases: &[(&[&str], &str)] = &[
        (&[], "OUT"),
        (&["city.ply"], ".obj or .glb"),
        (&["--split", "city.obj"], "--split writes a folder"),
        (&["--blocks", "0", "city.obj"], "expected 1 to 100000, found 0"),
        (&["--triangles", "17999", "city.obj"], "18000 to 180000000, found 17999"),
        (&["--offset", "1,2", "city.obj"], "three numbers, found 2"),
        (&["--offset", "1,2,NaN", "city.obj"], "--offset"),
        (&["--texture-size", "4096", "city.obj"], "WIDTHxHEIGHT"),
        (&["--texture-size", "4096x8", "city.obj"], "16 to 16384"),
        (&["--texels-per-triangle", "0", "city.obj"], "0.1 to 10000"),
        (&["--texels-per-triangle", "9", "--no-textures", "city.obj"], "cannot be used with"),
        (&["--jpeg-quality", "101", "city.obj"], "1 to 100"),
    ];
    for (arguments, message) in cases {
        make_city()
            .current_dir(&place)
            .args(*arguments)
            .assert()
            .code(2)
            .stderr(contains(*message));
    }
    assert!(contents(place.path()).is_empty());
}

#[test]
fn output_that_cannot_be_written_is_named_and_nothing_is_left() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("file"), "mine").unwrap();
    fs::create_dir(place.path().join("full")).unwrap();
    fs::write(place.path().join("full/letter.txt"), "mine").unwrap();
    fs::create_dir(place.path().join("city.obj")).unwrap();
    let before = contents(place.path());
    let cases: &[(&[&str], &str)] = &[
        (&["file/city.obj"], "file: cannot create the folder"),
        (&["--split", "full"], "letter.txt"),
        (&["city.obj"], "city.obj: there is a folder of that name"),
    ];
    for (arguments, message) in cases {
        make_city()
            .current_dir(&place)
            .args(SMALL)
            .args(*arguments)
            .assert()
            .code(4)
            .stderr(contains(*message));
    }
    assert!(contents(place.path()) == before);
    let entries = fs::read_dir(&place).unwrap().count();
    assert_eq!(entries, 3, "no scratch folder is left");
}

#[test]
fn help_names_units_and_ranges() {
    let output = make_city().arg("--help").output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let unwrapped = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for fact in ["0.1 to 10000", "metres within ±16000000", "Exit codes: 0 success"] {
        assert!(unwrapped.contains(fact), "{fact}: {text}");
    }
}
