//! Both readers find the same in files of every kind, and what one loses is found.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use super::*;
use crate::import::load;

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 2 5 0\nv 9 9 9\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nf 1 2 3\nf 1 3 4\nf 1 2 3\n\
    usemtl tiles\nf 1/1 2/2 3/3 4/4\nf -6/1 -5/2 \\\n-3/4\nusemtl red\nf 1 2 3 5 4\nf 1 1 2\n";
const MTL: &str = "newmtl red\r\nKd 0.8 0.1 0.1\r\nnewmtl tiles\r\nKd 0 0 0\r\nmap_Kd t.png\r\n";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.mtl"), MTL).unwrap();
    let quadrant = |x: u32, y: u32| match (x < 8, y < 8) {
        (true, true) => image::Rgb([220, 30, 30]),
        (false, true) => image::Rgb([30, 200, 30]),
        (true, false) => image::Rgb([30, 30, 220]),
        (false, false) => image::Rgb([230, 220, 30]),
    };
    image::RgbImage::from_fn(16, 16, quadrant).save(folder.path().join("t.png")).unwrap();
    folder
}

fn compared(folder: &TempDir, text: &str) -> (PathBuf, Model, Check) {
    let file = folder.path().join("city.obj");
    fs::write(&file, text).unwrap();
    let model = load(&file).unwrap();
    let check = check(&[compare(&file, &model)]);
    (file, model, check)
}

#[test]
fn both_readers_agree_and_what_the_importer_loses_is_found() {
    let folder = folder();
    let (file, model, check) = compared(&folder, OBJ);
    assert!(check.passed, "{check:?}");
    assert!(check.summary.contains("colours of 2 of 2 materials"), "{}", check.summary);

    let faults: [(&str, fn(&mut Model)); 5] = [
        ("triangles", |model| model.parts[0].indices.truncate(3)),
        ("area", |model| model.parts[0].positions[1][0] = 50.0),
        ("box", |model| {
            model.parts.iter_mut().flat_map(|p| &mut p.positions).for_each(|p| p[2] += 1.0)
        }),
        ("colour", |model| model.materials[0].base_color = [0.6; 4]),
        ("colour", |model| {
            for material in &mut model.materials {
                material.texture = None;
            }
        }),
    ];
    for (what, fault) in faults {
        let mut model = model.clone();
        fault(&mut model);
        let found = super::check(&[compare(&file, &model)]);
        assert!(!found.passed, "{what}");
        assert!(found.failures.iter().any(|failure| failure.what.contains(what)), "{found:?}");
    }
}

#[test]
fn vertex_colours_and_what_is_not_understood() {
    let folder = folder();
    let colored = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n";
    let (_, _, check) = compared(&folder, colored);
    assert!(check.summary.contains("1 of 1 materials"), "{check:?}");
    // The importer shows triangles without colours in white; the second reader leaves them alone.
    let partly = format!("{}v 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\nf 4 5 6\n", &colored[..42]);
    let (_, model, check) = compared(&folder, &partly);
    assert_eq!(model.triangle_count(), 2);
    assert!(check.passed && check.summary.contains("0 of 1 materials"), "{check:?}");
    let doubtful = OBJ.replace("a.mtl", "b.mtl");
    fs::write(folder.path().join("b.mtl"), MTL.replace("t.png", "-s 2 2 1 t.png")).unwrap();
    let (_, _, check) = compared(&folder, &doubtful);
    assert!(check.passed && check.summary.contains("1 of 2 materials"), "{check:?}");
}

/// Both readers must agree on a file, and compare the colours of this many materials.
fn assert_agree(folder: &TempDir, bytes: &[u8], colors: &str) {
    let file = folder.path().join("city.obj");
    fs::write(&file, bytes).unwrap();
    let check = check(&[compare(&file, &load(&file).unwrap())]);
    let text = String::from_utf8_lossy(bytes);
    assert!(check.passed && check.summary.contains(colors), "{text}: {check:?}");
}

#[test]
fn utf_16_is_read_with_every_end_of_lines() {
    let folder = folder();
    for end in ["\n", "\r\n", "\r"] {
        let text = OBJ.replace('\n', end);
        for bytes_of in [u16::to_le_bytes, u16::to_be_bytes] {
            for text in [text.clone(), format!("\u{feff}{text}")] {
                let bytes: Vec<u8> = text.encode_utf16().flat_map(bytes_of).collect();
                assert_agree(&folder, &bytes, "2 of 2 materials");
            }
        }
        assert_agree(&folder, format!("\u{feff}{text}").as_bytes(), "2 of 2 materials");
    }
    let mtl: Vec<u8> = MTL.encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    assert_agree(&folder, OBJ.as_bytes(), "2 of 2 materials");
}

#[test]
fn ranges_of_vertex_colours_are_those_of_the_file() {
    let folder = folder();
    for colors in [
        ["1 0 1", "255 128 0", "1 1 1"],
        ["0.5 0.2 0.1", "255 128 0", "1 0 0"],
        ["1.02 0.5 0.2", "1.02 0.5 0.2", "1 1 0"],
        ["-1 0.5 nan", "0.5 0.5 0.5", "0 1 0"],
        ["-7 nan 300", "1 0 9", "0 255 2"],
        ["0 1 0", "1 0 0", "0 0 1"],
    ] {
        let [a, b, c] = colors;
        let vertices = format!("v 0 0 0 {a}\nv 1 0 0 {b}\nv 0 1 0 {c}\nv 1 1 0 {a}\n");
        // What makes the range known may come after the faces that it concerns.
        for text in [
            format!("{vertices}f 1 2 3\nf 2 3 4\n"),
            format!("v 5 0 0 1 0 0\nv 6 0 0 0 0 1\nv 5 1 0 1 1 1\nf 1 2 3\n{vertices}f -1 -2 -3\n"),
        ] {
            assert_agree(&folder, text.as_bytes(), "1 of 1 materials");
        }
    }
}

#[test]
fn values_of_kd_are_read_alike_or_left_alone() {
    let folder = folder();
    let obj = OBJ.replace("a.mtl", "b.mtl");
    for (values, colors) in [
        ("0.5", "2 of 2"),
        ("255 128 0", "2 of 2"),
        ("-1 2 0.5", "2 of 2"),
        ("-1 2 nan", "1 of 2"),
        ("inf", "1 of 2"),
        ("xyz 1 1 1", "1 of 2"),
        ("0.8 0.1 0.1\nnewmtl red\nKd 0 0 1", "2 of 2"),
    ] {
        fs::write(folder.path().join("b.mtl"), MTL.replace("0.8 0.1 0.1", values)).unwrap();
        assert_agree(&folder, obj.as_bytes(), &format!("{colors} materials"));
    }
}

/// A file in which each corner of a triangle is a vertex of its own, as a GLB of one material.
fn glb(folder: &TempDir, json: &str, positions: &[[f32; 3]]) -> PathBuf {
    let bytes: Vec<u8> = positions.as_flattened().iter().flat_map(|at| at.to_le_bytes()).collect();
    let mut json = json.replace("LENGTH", &bytes.len().to_string()).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(((28 + json.len() + bytes.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bytes)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    let path = folder.path().join("city.glb");
    fs::write(&path, file).unwrap();
    path
}

#[test]
fn glb_files_are_read_again() {
    let folder = folder();
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"mesh":0,"translation":[5,0,0],"scale":[2,2,2],"children":[1]},{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0,"mode":5}]}],
        "materials":[{"name":"red","pbrMetallicRoughness":{"baseColorFactor":[0.6,0.1,0.1,1]}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":LENGTH}],"buffers":[{"byteLength":LENGTH}]}"#;
    let strip = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let path = glb(&folder, json, &strip);
    let mut model = load(&path).unwrap();
    let check = super::check(&[compare(&path, &model)]);
    assert!(check.passed && check.summary.contains("1 of 1 files"), "{check:?}");
    assert!(check.summary.contains("1 of 1 materials"), "{check:?}");
    model.parts.truncate(1);
    model.parts[0].indices.truncate(3);
    assert!(!super::check(&[compare(&path, &model)]).passed);
    let instanced = json.replacen("{", r#"{"extensionsUsed":["EXT_mesh_gpu_instancing"],"#, 1);
    let path = glb(&folder, &instanced, &strip);
    let check = super::check(&[compare(&path, &load(&path).unwrap())]);
    assert!(check.summary.contains("uses EXT_mesh_gpu_instancing"), "{check:?}");
    let skinned = json.replace(r#"{"mesh":0}]"#, r#"{"mesh":0,"skin":0}]"#).replacen(
        "{",
        r#"{"skins":[{"joints":[0]}],"#,
        1,
    );
    let path = glb(&folder, &skinned, &strip);
    let check = super::check(&[compare(&path, &load(&path).unwrap())]);
    assert!(check.summary.contains("has skins"), "{check:?}");
    // In a mesh that no node has, which the importer does not look at.
    let unused = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0,"mode":5}]},
        {"primitives":[{"attributes":{"POSITION":7}}]}],"materials""#;
    let [before, after] = [0, 1].map(|at| {
        let start = json.find(r#""meshes""#).unwrap();
        let end = json.find(r#""materials""#).unwrap() + r#""materials""#.len();
        if at == 0 { &json[..start] } else { &json[end..] }
    });
    let path = glb(&folder, &format!("{before}{unused}{after}"), &strip);
    let check = super::check(&[compare(&path, &load(&path).unwrap())]);
    assert!(check.summary.contains("an accessor that is not there"), "{check:?}");
}

/// Real files are in a folder beside the project, where there is one.
#[test]
fn real_files_are_read_alike() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if !data.is_dir() {
        eprintln!("skipped: {} is not there", data.display());
        return;
    }
    for name in ["torcs_street1", "glb/street1.glb"] {
        for file in crate::import::find_inputs(&[data.join(name)]).unwrap() {
            let model = load(&file).unwrap();
            let check = super::check(&[compare(&file, &model)]);
            assert!(check.passed, "{check:?}");
            assert!(check.summary.starts_with("1 of 1 files"), "{check:?}");
        }
    }
}
