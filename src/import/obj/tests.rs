use std::fs;

use glam::DVec3;

use super::super::lines::text;
use super::super::tests::check;
use super::*;
use crate::color::{linear_to_byte, srgb_to_linear, unorm16};
use crate::mesh::Wrap;
use crate::random::Random;
use crate::scaling::assert_scales;

/// Reads `obj` as `city.obj` from a folder that also holds `files`.
fn read(obj: impl AsRef<[u8]>, files: &[(&str, &str)]) -> Result<Model> {
    read_from(&folder_with(files), obj)
}

fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(folder.path().join(name), content).unwrap();
    }
    folder
}

fn read_from(folder: &tempfile::TempDir, obj: impl AsRef<[u8]>) -> Result<Model> {
    let model = read_in_chunks(folder, obj.as_ref(), CHUNK_BYTES)?;
    check(&model);
    Ok(model)
}

fn read_in_chunks(folder: &tempfile::TempDir, obj: &[u8], chunk_bytes: usize) -> Result<Model> {
    let path = folder.path().join("city.obj");
    let text = super::super::plain_text(&path, obj)?;
    super::read(&path, text, FileTraits::default(), chunk_bytes)
}

/// The model or the error must be the same wherever the text is divided.
fn check_chunks(folder: &tempfile::TempDir, obj: &[u8]) {
    let whole = format!("{:?}", read_in_chunks(folder, obj, CHUNK_BYTES));
    for chunk_bytes in [1, 2, 7, 23, 60, 150] {
        let divided = format!("{:?}", read_in_chunks(folder, obj, chunk_bytes));
        assert_eq!(divided, whole, "in chunks of {chunk_bytes}:\n{}", text(obj));
    }
}

/// What is wrong with `obj`, without the file's name.
fn refusal(obj: impl AsRef<[u8]>) -> String {
    match read(obj, &[]) {
        Err(Error::Input { what, .. }) => what,
        other => panic!("{other:?}"),
    }
}

fn warnings(model: &Model) -> Vec<(String, u64)> {
    let short = |text: &str| text.split_once("city.obj: ").unwrap().1.to_owned();
    model.warnings.iter().map(|(text, times)| (short(text), times)).collect()
}

fn group_names(model: &Model) -> Vec<&str> {
    model.groups.iter().map(|group| group.name.as_str()).collect()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn a_square_without_groups_is_one_group_of_the_files_name() {
    let model = read(format!("{SQUARE}f 1 2 3 4\n"), &[]).unwrap();
    assert_eq!(group_names(&model), ["city"]);
    assert_eq!(model.parts[0].positions.len(), 4);
    assert_eq!(model.parts[0].indices, [0, 1, 2, 0, 2, 3]);
    assert_eq!(model.materials, [crate::mesh::Material::plain("default")]);
    assert_eq!((model.up, model.warnings.is_empty()), (None, true));
}

#[test]
fn doubles_are_kept() {
    let obj = "v 678016.123456789 5403456.987654321 0.1\nv 1 0 0\nv 0 1 0\nf 1 2 3";
    let model = read(obj, &[]).unwrap();
    assert_eq!(model.parts[0].positions[0], [678_016.123_456_789, 5_403_456.987_654_321, 0.1]);
}

#[test]
fn parts_are_by_group_and_material_in_order_of_appearance() {
    let obj = format!(
        "mtllib a.mtl\n{SQUARE}o one\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\nusemtl red\n\
         f 2 3 4\no one\nf 1 2 4\no two\no three\nf 1 2 3\no one\nf 1 2 3\n"
    );
    let model = read(obj, &[("a.mtl", "newmtl blue\nKd 0 0 1\nnewmtl red\nKd 1 0 0\n")]).unwrap();
    assert_eq!(group_names(&model), ["one", "three", "one"]);
    let parts: Vec<_> = model
        .parts
        .iter()
        .map(|part| {
            let material = &model.materials[part.material as usize].name;
            (part.group, material.as_str(), part.indices.len() / 3)
        })
        .collect();
    assert_eq!(parts, [(0, "red", 3), (0, "blue", 1), (1, "red", 1), (2, "red", 1)]);
    assert_eq!(model.parts[0].positions.len(), 4, "vertices are shared inside a part");
    assert_eq!(model.dependencies.len(), 2);
    assert!(warnings(&model).is_empty());
}

#[test]
fn negative_indices_count_back() {
    let model = read("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n", &[]).unwrap();
    assert_eq!(model.parts[0].positions, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(warnings(&model), [("vertex that no face uses, ignored".to_owned(), 2)]);
}

#[test]
fn texture_coordinates_are_transformed_then_flipped() {
    let obj = format!(
        "mtllib my lib.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 nan\nusemtl m\n\
         f 1/1 2/2 3/3\nf 1/1 3/3 4\nf 1/4 2/2 4/3"
    );
    let mtl = "newmtl m\nmap_Kd -clamp on -s 2 4 1 -o 0.5 0.25 my brick.png\n";
    let model = read(obj, &[("my lib.mtl", mtl), ("my brick.png", "")]).unwrap();
    let part = &model.parts[0];
    let texcoords: Vec<_> = part.indices.iter().map(|at| part.texcoords[*at as usize]).collect();
    assert_eq!(texcoords[..3], [[0.5, 0.75], [2.5, 0.75], [2.5, -3.25]]);
    assert_eq!(texcoords[5], [0.0, 0.0], "a corner without a texture coordinate");
    assert_eq!(texcoords[6], [0.5, -3.25], "u and v are 0 and 1 where one is not finite");
    assert_eq!(model.materials[0].wrap, [Wrap::Clamp; 2]);
    assert_eq!(model.textures.len(), 1);
    assert_eq!(model.dependencies.len(), 3);
    let expected = [
        ("textured face without texture coordinates, set to 0".to_owned(), 1),
        ("texture coordinate that is not finite, set to 0".to_owned(), 1),
    ];
    assert_eq!(warnings(&model), expected);
}

#[test]
fn what_has_no_area_at_all_is_refused() {
    let row = |scale: [f64; 3], at: f64| {
        let corner = |n: usize| scale.map(|c| at + c * n as f64);
        let vertex = |n| corner(n).map(|c| c.to_string()).join(" ");
        format!("v {}\nv {}\nv {}\nf 1 2 3\n", vertex(0), vertex(1), vertex(3))
    };
    for at in [0.0, 678_016.123] {
        for along in [[1.0, 0.0, 0.0], [0.3, 0.7, 0.2]] {
            let error = read(row(along, at), &[]).unwrap_err().to_string();
            assert!(error.contains("no triangle is left"), "{error}");
        }
    }
    // A needle of 1 m and 1 nm is none.
    assert!(read("v 0 0 0\nv 1 0 0\nv 0 1e-9 0\nf 1 2 3\n", &[]).is_ok());
}

#[test]
fn texture_coordinates_far_out_keep_their_digits_where_the_texture_repeats() {
    let read = |clamp: &str, at: f64| {
        let vt = |u: f64, v: f64| format!("vt {} {}\n", at + u, v - at);
        let obj = format!(
            "mtllib a.mtl\n{SQUARE}{}{}{}usemtl t\nf 1/1 2/2 3/3\n",
            vt(0.125, 0.5),
            vt(1.0625, 0.5),
            vt(1.0625, 0.75),
        );
        let mtl = format!("newmtl t\nmap_Kd {clamp} t.png\n");
        let model = read(obj, &[("a.mtl", mtl.as_str()), ("t.png", "")]).unwrap();
        model.parts[0].texcoords.clone()
    };
    let near = [[0.125, 0.5], [1.0625, 0.5], [1.0625, 0.25]];
    assert_eq!(read("", 0.0), near);
    for far in [1e6, -1e6, 3e9] {
        let found = read("", far);
        let [u, v] = [0, 1].map(|axis| (found[0][axis] - near[0][axis]) % 2.0);
        assert_eq!([u, v], [0.0; 2], "the same place of an even repeat");
        let moved: Vec<[f32; 2]> =
            near.iter().map(|uv| [0, 1].map(|i| uv[i] + found[0][i] - near[0][i])).collect();
        assert_eq!(found, moved);
    }
    assert_eq!(read("", 100.0)[0], [100.125, 100.5], "what is near stays as it is");
    assert_eq!(read("-clamp on", 1e6)[0], [1_000_000.1, 1_000_000.5]);
}

#[test]
fn a_position_with_two_texture_coordinates_is_two_vertices_only_where_textured() {
    let obj = |material: &str| {
        format!(
            "mtllib a.mtl\n{SQUARE}vt 0 0\nvt 1 1\nusemtl {material}\nf 1/1 2/1 3/1\nf 1/2 3/1 4/1"
        )
    };
    let files = [("a.mtl", "newmtl t\nmap_Kd t.png\nnewmtl c\nKd 1 1 1"), ("t.png", "")];
    assert_eq!(read(obj("t"), &files).unwrap().parts[0].positions.len(), 5);
    let plain = read(obj("c"), &files).unwrap();
    assert_eq!(plain.parts[0].positions.len(), 4);
    assert!(plain.textures.is_empty(), "a material that no face uses names no texture");
}

#[test]
fn a_library_may_come_after_its_use() {
    let obj = format!(
        "{SQUARE}vt 0 0\nvt 1 0.25\nusemtl t\nf 1/1 2/2 3/2\nusemtl c\nf 1/1 3/2 4/1\nmtllib a.mtl"
    );
    let files = [("a.mtl", "newmtl t\nmap_Kd -o 0.5 0.5 t.png\nnewmtl c\nKd 1 1 1"), ("t.png", "")];
    let model = read(obj, &files).unwrap();
    assert_eq!(model.parts[0].texcoords, [[0.5, 0.5], [1.5, 0.25], [1.5, 0.25]]);
    assert!(model.parts[1].texcoords.is_empty());
    assert!(warnings(&model).is_empty());
}

#[test]
fn what_is_missing_is_named() {
    let obj = format!("mtllib gone.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n");
    let model = read(&obj, &[]).unwrap();
    let expected = [
        ("material library gone.mtl not found".to_owned(), 1),
        ("usemtl without a material library, taken as plain grey".to_owned(), 2),
    ];
    assert_eq!(warnings(&model), expected);
    let mtl = "newmtl a\nKd 0 1 0\nmap_Kd lost.jpg\n";
    let model = read(obj.replace("gone", "here"), &[("here.mtl", mtl)]).unwrap();
    let expected = [
        ("material a: texture lost.jpg not found".to_owned(), 1),
        ("material b is in no library, taken as plain grey".to_owned(), 1),
    ];
    assert_eq!(warnings(&model), expected);
    assert_eq!(model.materials[0].base_color, [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(model.materials[1], crate::mesh::Material::plain("b"));
}

#[test]
fn vertex_colours_are_linear_and_white_ones_are_dropped() {
    let model = read("v 0 0 0\nv 1 0 0 0.5 0 2\nv 0 1 0 1 1 1\nf 1 2 3\n", &[]).unwrap();
    let colors = &model.parts[0].colors;
    assert_eq!(colors[0], [65535; 4]);
    assert_eq!(colors[1], [unorm16(srgb_to_linear(0.5)), 0, 65535, 65535]);
    assert_eq!(warnings(&model), [("vertex colour out of range, clamped".to_owned(), 1)]);
    let white = "v 0 0 0 1 1 1\nv 1 0 0 1.0 1.0 1.0\nv 0 1 0 1 1 1\nf 1 2 3\n";
    assert!(read(white, &[]).unwrap().parts[0].colors.is_empty());
    // Colours that begin after a part has vertices.
    let late = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 1 1 0 0 0 0\nf 2 4 3\n";
    let model = read(late, &[]).unwrap();
    assert_eq!(model.parts[0].colors[..3], [[65535; 4]; 3]);
    assert_eq!(model.parts[0].colors[3], [0, 0, 0, 65535]);
}

/// The colour that vertices have: theirs times that of their material, in sRGB bytes.
fn shown(model: &Model) -> Vec<[u8; 3]> {
    let of_part = |part: &crate::mesh::Part| {
        let base = model.materials[part.material as usize].base_color;
        let colors = part.colors.clone();
        (0..part.positions.len()).map(move |vertex| {
            let color = colors.get(vertex).copied().unwrap_or(WHITE);
            [0, 1, 2].map(|at| {
                let linear = f64::from(base[at]) * f64::from(color[at]) / 65535.0;
                linear_to_byte().of(unorm16(linear))
            })
        })
    };
    model.parts.iter().flat_map(of_part).collect()
}

#[test]
fn vertex_colours_without_a_material_are_shown_as_they_are() {
    let grey = "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 0.5 0.5 0.5\n";
    let white = "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0 1 1 1\n";
    let some = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0\n";
    let named = "mtllib a.mtl\nusemtl gone\n";
    let files =
        [("a.mtl", "newmtl a\nKd 1 1 1\nnewmtl bare\nillum 2\nnewmtl half\nKd 0.5 0.5 0.5\n")];
    for (start, vertices, expected) in [
        ("", grey, [[128; 3]; 3]),
        ("", white, [[255; 3]; 3]),
        ("", some, [[255, 0, 0], [255, 0, 0], [255; 3]]),
        (named, grey, [[128; 3]; 3]),
        ("usemtl gone\n", grey, [[128; 3]; 3]),
        ("mtllib a.mtl\nusemtl bare\n", grey, [[128; 3]; 3]),
        ("mtllib a.mtl\nusemtl half\n", white, [[128; 3]; 3]),
        ("", SQUARE, [[204; 3]; 3]),
    ] {
        let model = read(format!("{start}{vertices}f 1 2 3\n"), &files).unwrap();
        assert_eq!(shown(&model), expected, "{start}{vertices}");
        let warned = warnings(&model).iter().any(|(what, _)| what.contains("taken as plain white"));
        assert_eq!(warned, start.contains("gone"));
    }
}

#[test]
fn vertex_colours_of_0_to_255_are_read_as_bytes() {
    let vertices = |colors: [&str; 3]| {
        let [a, b, c] = colors;
        format!("v 0 0 0 {a}\nv 1 0 0 {b}\nv 1 1 0 {c}\nf 1 2 3\n")
    };
    let bytes = "vertex colours are integers of 0 to 255, divided by 255";
    let clamped = "vertex colour out of range, clamped";
    for (colors, expected, expected_warnings) in [
        (["255 128 0", "1 1 1", "0 0 2"], [[255, 128, 0], [1; 3], [0, 0, 2]], vec![(bytes, 1)]),
        (["255.0 128.000 0", "1 1 1", ""], [[255, 128, 0], [1; 3], [255; 3]], vec![(bytes, 1)]),
        (
            ["300 -1 7", "0 0 9", ""],
            [[255, 0, 7], [0, 0, 9], [255; 3]],
            vec![(bytes, 1), (clamped, 2)],
        ),
        (["1 0 1", "0 0 0", "1 1 1"], [[255, 0, 255], [0; 3], [255; 3]], vec![]),
        (["2 0 0", "0.5 0 1", ""], [[255, 0, 0], [128, 0, 255], [255; 3]], vec![(clamped, 1)]),
        (["0.5 0 1", "2 0 0", ""], [[128, 0, 255], [255, 0, 0], [255; 3]], vec![(clamped, 1)]),
        (
            ["nan 0 9", "inf 0 0", ""],
            [[0, 0, 9], [255, 0, 0], [255; 3]],
            vec![(bytes, 1), (clamped, 2)],
        ),
    ] {
        let obj = vertices(colors);
        let model = read(&obj, &[]).unwrap();
        assert_eq!(shown(&model), expected, "{obj}");
        let expected_warnings: Vec<_> =
            expected_warnings.iter().map(|(what, times)| ((*what).to_owned(), *times)).collect();
        assert_eq!(warnings(&model), expected_warnings, "{obj}");
        check_chunks(&folder_with(&[]), obj.as_bytes());
    }
}

/// A textured square, whose library and texture have these names.
fn textured(library: &str, material: &str) -> String {
    format!(
        "mtllib {library}\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl {material}\n\
         f 1/1 2/2 3/3 4/4\n"
    )
}

#[test]
fn texts_of_any_encoding_and_line_ends_are_the_same() {
    let obj =
        format!("# façade\n{}g wall façade\nf 1/1 2/2 3/3 \\\n4/4\n", textured("a.mtl", "façade"));
    let mtl = "newmtl façade\nKd 1 0 0\nmap_Kd t.png\n";
    let utf_16 = |text: &str, bytes_of: fn(u16) -> [u8; 2]| -> Vec<u8> {
        format!("\u{feff}{text}").encode_utf16().flat_map(bytes_of).collect()
    };
    let variants = |text: &str| {
        [
            text.as_bytes().to_vec(),
            format!("\u{feff}{text}").into_bytes(),
            text.replace('\n', "\r\n").into_bytes(),
            text.replace('\n', "\r").into_bytes(),
            utf_16(text, u16::to_le_bytes),
            utf_16(&text.replace('\n', "\r\n"), u16::to_be_bytes),
            utf_16(&text.replace('\n', "\r"), u16::to_le_bytes),
        ]
    };
    let folder = folder_with(&[("t.png", "")]);
    fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    let expected = format!("{:?}", read_from(&folder, &obj).unwrap());
    for obj in variants(&obj) {
        for mtl in variants(mtl) {
            fs::write(folder.path().join("a.mtl"), mtl).unwrap();
            assert_eq!(format!("{:?}", read_from(&folder, &obj).unwrap()), expected);
        }
        check_chunks(&folder, &obj);
    }
}

#[test]
fn keywords_are_read_in_any_case() {
    let obj = textured("a.mtl", "a");
    let folder = folder_with(&[("a.mtl", "NEWMTL a\nMAP_KD t.png\n"), ("t.png", "")]);
    let expected = format!("{:?}", read_from(&folder, &obj).unwrap());
    for keyword in ["mtllib", "usemtl", "vt", "v", "f"] {
        let upper = obj.replace(&format!("{keyword} "), &format!("{} ", keyword.to_uppercase()));
        assert_eq!(format!("{:?}", read_from(&folder, &upper).unwrap()), expected, "{upper}");
    }
}

#[test]
fn names_in_a_code_page_are_found_and_shown() {
    let gbk = |text: &str| encoding_rs::GBK.encode(text).0.into_owned();
    let folder = folder_with(&[("大地形.png", "")]);
    let obj = format!("{}g 屋顶\nf 1/1 2/2 3/3\n", textured("大地形.mtl", "墙"));
    let mtl = "newmtl 墙\nmap_Kd 大地形.png\n";
    fs::write(folder.path().join("大地形.mtl"), mtl).unwrap();
    let expected = format!("{:?}", read_from(&folder, &obj).unwrap());
    assert!(expected.contains("屋顶") && expected.contains("墙"), "{expected}");
    for mtl in [mtl.as_bytes().to_vec(), gbk(mtl)] {
        fs::write(folder.path().join("大地形.mtl"), mtl).unwrap();
        assert_eq!(format!("{:?}", read_from(&folder, gbk(&obj)).unwrap()), expected);
        assert_eq!(format!("{:?}", read_from(&folder, &obj).unwrap()), expected);
        check_chunks(&folder, &gbk(&obj));
    }
}

#[test]
fn several_libraries_may_have_spaces_escapes_and_comments() {
    let files = [
        ("a.mtl", "newmtl a\nKd 1 0 0\n"),
        ("my b.mtl", "newmtl b\nKd 0 1 0\n"),
        ("my lib 2.MTL", "newmtl c\nKd 0 0 1\n"),
        ("d # 1.mtl", "newmtl d\nKd 1 1 0\n"),
    ];
    let colors = [
        ("a", [1., 0., 0., 1.]),
        ("b", [0., 1., 0., 1.]),
        ("c", [0., 0., 1., 1.]),
        ("d", [1., 1., 0., 1.]),
    ];
    for (libraries, found, missing) in [
        ("a.mtl my b.mtl my lib 2.mtl", "abc", vec![]),
        ("my b.mtl a.mtl # and more.mtl", "ab", vec![]),
        ("\"my b.mtl\" a.mtl", "ab", vec![]),
        ("my\\ b.mtl lib/a.mtl", "ab", vec![]),
        ("C:\\lib\\a.mtl C:\\my files\\my b.mtl", "ab", vec![]),
        ("d # 1.mtl", "d", vec![]),
        ("gone.mtl a.mtl not here.mtl", "a", vec!["gone.mtl", "not here.mtl"]),
        ("nothing", "", vec!["nothing"]),
    ] {
        let uses: String =
            colors.iter().map(|(name, _)| format!("usemtl {name}\nf 1 2 3\n")).collect();
        let model = read(format!("mtllib {libraries}\n{SQUARE}{uses}"), &files).unwrap();
        for (material, (name, color)) in model.materials.iter().zip(&colors) {
            let is_found = material.base_color == *color;
            assert_eq!(is_found, found.contains(name), "{libraries}: {name}");
        }
        let expected: Vec<String> =
            missing.iter().map(|name| format!("material library {name} not found")).collect();
        let warned = warnings(&model).into_iter().map(|(what, _)| what);
        let of_libraries: Vec<String> = warned.filter(|what| what.contains("not found")).collect();
        assert_eq!(of_libraries, expected, "{libraries}");
    }
}

#[test]
fn udim_tiles_are_materials_of_their_own() {
    let obj = format!(
        "mtllib a.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 1 0\nvt 2 0\nvt 2 1\nvt 0.5 1.25\n\
         vt 0.75 1.25\nvt 0.75 1.5\nvt -3 0\nusemtl m\nf 1/1 2/2 3/3\nf 1/4 2/5 4/6\nf 2/7 3/8 4/9\n\
         f 1/1 3/2 4/3\nf 3/10 2/10 1/10\n"
    );
    let mtl = "newmtl m\nKd 1 1 1\nmap_Kd t_<UDIM>.png\n";
    let files = [("a.mtl", mtl), ("t_1001.png", ""), ("t_1002.png", "")];
    let model = read(&obj, &files).unwrap();
    check_chunks(&folder_with(&files), obj.as_bytes());
    let of_part: Vec<_> = model
        .parts
        .iter()
        .map(|part| {
            let texture = model.materials[part.material as usize].texture;
            let name = texture.map(|texture| model.textures[texture as usize].name.as_str());
            (name, part.indices.len() / 3)
        })
        .collect();
    let expected = [(None, 1), (Some("t_1001.png"), 2), (Some("t_1002.png"), 1), (None, 1)];
    assert_eq!(of_part, expected);
    for part in &model.parts[1..3] {
        assert!(part.texcoords.as_flattened().iter().all(|at| (0.0..=1.0).contains(at)));
    }
    let across = "face in no single UDIM tile, textured by the tile of its middle if there is one";
    let expected = [("material m: texture t_1011.png not found", 1), (across, 1)];
    let found = warnings(&model);
    for (what, times) in expected {
        assert!(found.contains(&(what.to_owned(), times)), "{found:?}");
    }
}

#[test]
fn what_is_no_triangle_is_counted() {
    let obj = format!(
        "{SQUARE}v nan 0 0\nv 1e999 0 0\nf 1 2 3\nf 1 2 5\nf 1 2 3 6\nf 1 1 2\nf 2 3 1\nl 1 2 3\n\
         p 1\nf 1 2\nf 1 2 1 2\n"
    );
    let model = read(obj, &[]).unwrap();
    assert_eq!(model.triangle_count(), 1);
    let expected = [
        ("triangle with a coordinate that is not finite, dropped", 3),
        ("degenerate triangle, dropped", 1),
        ("duplicate triangle, dropped", 1),
        ("polygon without area, dropped", 1),
        ("point, line or free-form element, ignored", 3),
        ("vertex that no face uses, ignored", 2),
    ];
    assert_eq!(warnings(&model), expected.map(|(text, times)| (text.to_owned(), times)));
}

#[test]
fn where_nothing_is_left_the_file_is_refused() {
    assert!(refusal("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n").contains("not finite, dropped (1)"));
    assert_eq!(refusal(""), "is empty; expected a Wavefront OBJ with faces");
    assert!(refusal(SQUARE).contains("no face; expected at least one (there are 4 vertices"));
    assert!(
        refusal("Dear reader,\nthis is a letter.\n").contains("no vertex and no face in 2 lines")
    );
    assert!(refusal(b"glTF\x02\0\0\0").contains("is not a text file"));
}

#[test]
fn errors_name_the_line() {
    let line_7 = |line: &str| refusal(format!("# square\n\n{SQUARE}{line}\nf 1 2 3\n"));
    for (line, expected) in [
        ("f 1 2 x", "line 7: face corner \"x\"; expected v, v/vt, v//vn or v/vt/vn"),
        ("f 1 2 9\nf 1 2 3 x", "line 8: face corner \"x\"; expected v, v/vt, v//vn or v/vt/vn"),
        ("v 1 2", "line 7: vertex of 2 coordinates; expected 3"),
        ("v 1 2 z", "line 7: vertex coordinate \"z\"; expected a number"),
        ("vt u", "line 7: texture coordinate \"u\"; expected a number"),
        ("vt", "line 7: texture coordinate without a value; expected u and v"),
    ] {
        assert_eq!(line_7(line), expected);
    }
}

#[test]
fn faces_with_a_position_out_of_range_are_dropped() {
    for (face, index) in [
        ("f 1 2 9", "9"),
        ("f 1 2 -5", "-5"),
        ("f 0 1 2", "0"),
        ("f 1 2 -0", "0"),
        ("f 1/1 2/1 3/1 7/1", "7"),
        ("f 1 \\\n 2 99999999999999999999", "1152921504606846976"),
        ("f 1 2 4611686018427387904", "1152921504606846976"),
        ("f 1 2 -1099511627776", "-1099511627776"),
    ] {
        let obj = format!("# square\n\n{SQUARE}{face}\nf 1 2 3\n{face}\n");
        let model = read(&obj, &[]).unwrap();
        assert_eq!(model.parts[0].indices, [0, 1, 2], "{face}");
        let expected = format!(
            "vertex index that is 0 or out of range, face dropped (first in line 7: {index} of 4 \
             vertices)"
        );
        assert_eq!(warnings(&model)[0], (expected, 2));
        check_chunks(&folder_with(&[]), obj.as_bytes());
    }
    let nothing = refusal(format!("{SQUARE}f 1 2 9\nf 0 0 0\n"));
    assert!(nothing.contains("no face"), "{nothing}");
    assert!(nothing.contains("(first in line 5: 9 of 4 vertices) (2)"), "{nothing}");
}

#[test]
fn faces_with_a_texture_coordinate_out_of_range_lose_it_alone() {
    let files = [("a.mtl", "newmtl t\nmap_Kd t.png\n"), ("t.png", "")];
    let model = |faces: &str| {
        let obj = format!("mtllib a.mtl\n{SQUARE}vt 0.5 0.25\nvt 1 1\nusemtl t\n{faces}");
        check_chunks(&folder_with(&files), obj.as_bytes());
        read(&obj, &files).unwrap()
    };
    for (face, first) in [
        ("f 1/0 2/1 3/1 4/1", Some(0)),
        ("f 1/0/0 2/0/0 3/0/0 4/0/0", Some(0)),
        ("f 1/1 2/3 3/1 4/1", Some(3)),
        ("f 1/-3 2/1 3/1 4/1", Some(-3)),
        ("f 1/1/0 2/1/0 3/1/0 4/1/0", None),
        ("f 1/1/9 2/1/-7 3/1/0 4/1", None),
        ("f 1/1 2/1 3/1 4/1", None),
    ] {
        let model = model(&format!("{face}\n"));
        assert_eq!(model.triangle_count(), 2, "{face}");
        let texcoord = if first.is_some() { [0.0, 0.0] } else { [0.5, 0.75] };
        assert!(model.parts[0].texcoords.iter().all(|at| *at == texcoord), "{face}");
        let warned = first.map(|index| {
            let what = "texture coordinate index that is 0 or out of range, the face's texture \
                        coordinates dropped";
            (format!("{what} (first in line 9: {index} of 2 texture coordinates)"), 1)
        });
        let found = warnings(&model).into_iter().find(|(what, _)| !what.starts_with("normal"));
        assert_eq!(found, warned, "{face}");
    }
    let both = model("f 1/1 2/1 3/1\nf 1/1 3/9 4/1\n");
    let textured = |vertex: &&u32| both.parts[0].texcoords[**vertex as usize] == [0.5, 0.75];
    assert_eq!(both.parts[0].indices.iter().filter(textured).count(), 3);
}

#[test]
fn normals_of_untextured_faces_are_kept() {
    // The first face is smooth, the second has the normal of its plane, the third none.
    let normals = "vn 0.6 0 0.8\nvn 0 0 3\nvn 0 -6e-1 .8 # tilted\n";
    let faces = "f 1//1 2//3 3//-2\nf 1//2 3//2 4//2\nf 4 3 2\n";
    let obj = format!("{SQUARE}{normals}{faces}");
    check_chunks(&folder_with(&[]), obj.as_bytes());
    let model = read(&obj, &[]).unwrap();
    let part = &model.parts[0];
    let of_corner = |corner: usize| part.normals[part.indices[corner] as usize];
    let along = |x: f64, y: f64, z: f64| Normal::along(DVec3::new(x, y, z));
    let smooth = [along(3.0, 0.0, 4.0), along(0.0, -3.0, 4.0), along(0.0, 0.0, 1.0)];
    assert_eq!([0, 1, 2].map(of_corner), smooth);
    assert!((3..9).all(|corner| of_corner(corner) == Normal::NONE));
    // Each of the first face's corners is on a vertex of its own.
    assert_eq!((part.positions.len(), part.normals.len()), (7, 7));
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
}

#[test]
fn normals_without_a_use_are_dropped() {
    let flat = read(format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3//1 4//1\n"), &[]).unwrap();
    assert!(flat.parts[0].normals.is_empty());
    let files = [("a.mtl", "newmtl t\nmap_Kd t.png\nnewmtl u\n"), ("t.png", "")];
    let textured = format!("{SQUARE}vn 1 0 1\nusemtl t\nf 1//1 2//1 3//1\n");
    // A library may say later that a material has a texture.
    for obj in [format!("mtllib a.mtl\n{textured}"), format!("{textured}mtllib a.mtl\n")] {
        assert!(read(&obj, &files).unwrap().parts[0].normals.is_empty());
    }
    let late = format!("{SQUARE}vn 1 0 1\nusemtl u\nf 1//1 2//1 3//1\nmtllib a.mtl\n");
    assert_eq!(read(&late, &files).unwrap().parts[0].normals.len(), 3);
}

#[test]
fn normals_that_cannot_be_are_dropped_and_counted() {
    let normals = "vn 0 0 0\nvn nan 0 1\nvn 0 0 -1\nvn 1 x\nvn\nvn 0.6 0 0.8\n";
    let faces = "f 1//1 2//2 3//6\nf 1//3 3//4 4//5\nf 1//7 4//6 2//0\n";
    let obj = format!("{SQUARE}{normals}{faces}");
    check_chunks(&folder_with(&[]), obj.as_bytes());
    let model = read(&obj, &[]).unwrap();
    let part = &model.parts[0];
    let is_there = |corner: &usize| part.normals[part.indices[*corner] as usize] != Normal::NONE;
    assert_eq!((0..9).filter(is_there).collect::<Vec<_>>(), [2]);
    let found = warnings(&model);
    let dropped = "normal without a direction or to the back of its face, replaced by the face's";
    assert!(found.contains(&(dropped.into(), 5)), "{found:?}");
    assert!(found.iter().any(|(what, count)| what.contains("7 of 6 normals") && *count == 1));
}

#[test]
fn texture_coordinates_that_the_file_does_not_have_are_dropped_from_all_faces() {
    let obj = format!("{SQUARE}f 1/1/1 2/2/2 3/3/3 4/4/4\nf -1/-1 -2/-2 -3/-3\n");
    let model = read(&obj, &[]).unwrap();
    assert_eq!(model.triangle_count(), 3);
    let normals = "normal index that is 0 or out of range, the face's normals dropped (first in line \
                   5: 1 of 0 normals)";
    assert_eq!(warnings(&model)[0].1, 2, "{:?}", model.warnings);
    assert_eq!(warnings(&model)[1..], [(normals.into(), 1)], "one warning for a file and kind");
    check_chunks(&folder_with(&[]), obj.as_bytes());
}

#[test]
fn habits_of_exporters_are_understood() {
    let obj = b"\xef\xbb\xbf# fa\xe7ade\r\nv 0 0 0 # corner\r\nv\t1 0 0\r\nv 1 1 0 1.0\r\n\
        g fa\xe7ade east\r\ns off\r\nvn 0 0 1\r\nf 1//1 2//1 \\\r\n3//1 # face\r\n";
    let model = read(obj, &[]).unwrap();
    assert_eq!(group_names(&model), ["façade east"]);
    assert_eq!(model.triangle_count(), 1);
}

#[test]
fn several_libraries_in_one_statement() {
    let obj = format!("mtllib a.mtl gone.mtl b.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4");
    let files = [("a.mtl", "newmtl a\nKd 1 0 0"), ("b.mtl", "newmtl b\nKd 0 1 0")];
    let model = read(obj, &files).unwrap();
    assert_eq!(warnings(&model), [("material library gone.mtl not found".to_owned(), 1)]);
    assert_eq!(model.materials[1].base_color, [0.0, 1.0, 0.0, 1.0]);
}

/// Numbers from a seed.
/// The corners of all triangles by group and material name, as places and texture coordinates.
type Soup = BTreeMap<(String, String), Vec<([f64; 3], [f32; 2])>>;

#[test]
fn random_files_are_read_as_tobj_reads_them() {
    for seed in 0..200 {
        let mut random = Random::new(seed, 0);
        let mut obj = String::from("mtllib a.mtl\n");
        let (vertices, texcoords) = (3 + random.below(30), 1 + random.below(20));
        for vertex in 0..vertices {
            // Distinct places, so that nothing is degenerate.
            obj += &format!("v {}.25 {} {vertex}\n", random.below(100), random.below(1000));
        }
        for _ in 0..texcoords {
            obj += &format!("vt 0.{} -{}.5\n", random.below(1000), random.below(9));
        }
        let mut seen = std::collections::BTreeSet::new();
        for group in 0..1 + random.below(4) {
            obj += &format!("o group {group}\nusemtl {}\n", ["a", "b"][random.below(2)]);
            for _ in 0..1 + random.below(20) {
                let corners = [(); 3].map(|()| random.below(vertices));
                let mut sorted = corners;
                sorted.sort();
                if sorted[0] == sorted[1] || sorted[1] == sorted[2] || !seen.insert(sorted) {
                    continue;
                }
                obj += "f";
                for corner in corners {
                    let position = if random.below(2) == 0 {
                        corner as i64 + 1
                    } else {
                        corner as i64 - vertices as i64
                    };
                    obj += &format!(" {position}/{}", 1 + random.below(texcoords));
                }
                obj += "\n";
                if random.below(5) == 0 {
                    obj += &format!("usemtl {}\n", ["a", "b"][random.below(2)]);
                }
            }
        }
        if seen.is_empty() {
            continue;
        }
        let mtl = "newmtl a\nmap_Kd t.png\nnewmtl b\nmap_Kd t.png\n";
        let folder = folder_with(&[("a.mtl", mtl), ("t.png", "")]);
        check_chunks(&folder, obj.as_bytes());
        let model = read_from(&folder, &obj).unwrap();
        let mut ours = Soup::new();
        for part in &model.parts {
            let key = (
                model.groups[part.group as usize].name.clone(),
                model.materials[part.material as usize].name.clone(),
            );
            let corner = |at: &u32| (part.positions[*at as usize], part.texcoords[*at as usize]);
            ours.entry(key).or_default().extend(part.indices.iter().map(corner));
        }
        let options = tobj::LoadOptions::default();
        let (models, materials) = tobj::load_obj_buf(&mut obj.as_bytes(), &options, |_| {
            tobj::load_mtl_buf(&mut mtl.as_bytes())
        })
        .unwrap();
        let materials = materials.unwrap();
        let mut theirs = Soup::new();
        for tobj::Model { name, mesh } in
            models.iter().filter(|model| !model.mesh.indices.is_empty())
        {
            let material = materials[mesh.material_id.unwrap()].name.clone();
            let corners = mesh.indices.iter().zip(&mesh.texcoord_indices).map(|(at, uv)| {
                let [at, uv] = [*at as usize * 3, *uv as usize * 2];
                let position = [mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]];
                (position, [mesh.texcoords[uv] as f32, (1.0 - mesh.texcoords[uv + 1]) as f32])
            });
            theirs.entry((name.clone(), material)).or_default().extend(corners);
        }
        assert_eq!(ours, theirs, "seed {seed}:\n{obj}");
    }
}

/// A small file that has every kind of statement.
const SAMPLE: &str = "mtllib a.mtl\no one\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0\nv 0 1 0\n\
    v 0.5 0.5 1e1\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/1/1 4/2/1\n\
    g two three\nusemtl b\nf -1//1 -2//1 -3//1\nf 1 2 3 \\\n5 4\nl 1 2 3\n";

#[test]
fn every_truncation_gives_a_model_or_an_error() {
    let folder = folder_with(&[("a.mtl", "newmtl a\nmap_Kd a.mtl\n")]);
    for length in 0..SAMPLE.len() {
        let _ = read_from(&folder, &SAMPLE[..length]);
        check_chunks(&folder, &SAMPLE.as_bytes()[..length]);
    }
}

#[test]
fn mutated_files_give_a_model_or_an_error() {
    let bytes = SAMPLE.as_bytes();
    let folder = folder_with(&[("a.mtl", "newmtl a\nmap_Kd a.mtl\nnewmtl b\n")]);
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.to_vec();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let _ = read_from(&folder, &flipped);
    }
    let pieces: [&[u8]; 14] = [
        b"-",
        b"/",
        b" ",
        b"\n",
        b"9999999999999999999",
        b"nan",
        b"1e400",
        b"f ",
        b"usemtl ",
        b"\\\n",
        b"0",
        b".",
        b"\xff",
        b"o\n",
    ];
    let mut random = Random::new(1, 0);
    for _ in 0..3000 {
        let mut mutated = bytes.to_vec();
        for _ in 0..1 + random.below(4) {
            let at = random.below(mutated.len());
            let end = (at + random.below(4)).min(mutated.len());
            mutated.splice(at..end, pieces[random.below(pieces.len())].iter().copied());
        }
        let _ = read_from(&folder, &mutated);
        check_chunks(&folder, &mutated);
    }
}

/// Statements that lean on what came before: indices that count back, faces beside and behind the
/// vertices that they lack, groups and materials that end and come again, colours that begin late.
#[test]
fn where_chunks_end_makes_no_difference() {
    let lines: [&[u8]; 36] = [
        b"v 0 0 0\n",
        b"v 1 0 0\r\n",
        b"v 1.5 1 0 0.5 0.5 0.5\n",
        b"v 0 1 -2.25e-1\n",
        b"v 1 2 3 4\n",
        b"v  7\t-8 +9.0 \n",
        b"v nan 0 0\n",
        b"v 12345678901234567890 0 .5\n",
        b"vt 0 0\n",
        b"vt 0.5 1.5 0\n",
        b"vt 1e39 0\n",
        b"vt 1\n",
        b"vn 0 0 1\n",
        b"vn 0 0 \\\n1\n",
        b"f -1 -2 -3\n",
        b"f -1/-1 -2/-1 -3/-1\n",
        b"f 1 2 3\n",
        b"f 1/1 2/1 3/1\n",
        b"f 1 2 4 3\n",
        b"f -4 -3 -2 -1\n",
        b"f 1//1 2//1 \\\r\n-1//1\n",
        b"f 2 3 5 # five\n",
        b"f 9 2 1\n",
        b"f 1 2\n",
        b"f 1 2 x\n",
        b"f 1 1/9 2/0\n",
        b"g a\n",
        b"g b\n",
        b"o\n",
        b"usemtl a\n",
        b"usemtl b\n",
        b"usemtl c\n",
        b"mtllib a.mtl\n",
        b"mtllib gone.mtl\n",
        b"l 1 2\n",
        b"\n",
    ];
    let folder = folder_with(&[("a.mtl", "newmtl a\nmap_Kd a.mtl\nnewmtl b\nKd 1 0 0\n")]);
    let mut random = Random::new(3, 0);
    let mut good = 0;
    for round in 0..1500 {
        let mut obj = format!("{SQUARE}vt 0 1\n").repeat(round % 3).into_bytes();
        for _ in 0..random.below(40) {
            // Mostly what is right, so that files are read to their end.
            let limit = if random.below(8) == 0 { lines.len() } else { 21 };
            obj.extend_from_slice(lines[random.below(limit)]);
            if random.below(4) == 0 {
                obj.extend_from_slice(lines[26 + random.below(10)]);
            }
        }
        good += usize::from(read_in_chunks(&folder, &obj, CHUNK_BYTES).is_ok());
        check_chunks(&folder, &obj);
    }
    assert!(good > 300, "{good} files without an error");
}

#[test]
fn the_number_of_threads_makes_no_difference() {
    let folder = folder_with(&[("a.mtl", "newmtl a\nmap_Kd a.mtl\n")]);
    let read = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let obj = SAMPLE.repeat(30);
        format!("{:?}", pool.install(|| read_in_chunks(&folder, obj.as_bytes(), 100)))
    };
    let one = read(1);
    assert!(one.starts_with("Ok"), "{one}");
    assert_eq!(read(2), one);
    assert_eq!(read(7), one);
}

#[test]
fn mutated_libraries_give_a_model() {
    let mtl = "newmtl a\nKd 0.5 0.5 0.5\nd 0.5\nTr 0.2\nmap_Kd -s 2 2 1 -o 0 1 -clamp on a.mtl\n\
        map_d a.mtl\nnewmtl b\nKd 1 1\nillum 2\n";
    let folder = folder_with(&[]);
    let mut random = Random::new(2, 0);
    for _ in 0..1500 {
        let mut mutated = mtl.as_bytes().to_vec();
        for _ in 0..1 + random.below(3) {
            let at = random.below(mutated.len());
            match random.below(3) {
                0 => mutated[at] ^= 1 << random.below(8),
                1 => mutated.truncate(at.max(1)),
                _ => mutated.insert(at, b"\n -1e9"[random.below(6)]),
            }
        }
        fs::write(folder.path().join("a.mtl"), mutated).unwrap();
        assert!(read_from(&folder, SAMPLE).is_ok());
    }
}

#[cfg(unix)]
#[test]
fn libraries_and_textures_that_are_no_files_are_warned_of_like_missing_ones() {
    let folder = folder_with(&[("a.mtl", ""), ("large.mtl", "")]);
    let large = fs::File::options().write(true).open(folder.path().join("large.mtl")).unwrap();
    large.set_len(crate::side_file::MOST_LIBRARY_BYTES + 1).unwrap();
    let faulty = crate::side_file::make_faulty_files(folder.path());
    for (name, what) in faulty {
        let mtl = format!("newmtl m\nKd 0 1 0\nmap_Kd {name}\nmap_d {name}\n");
        fs::write(folder.path().join("a.mtl"), mtl).unwrap();
        let obj = format!("mtllib {name}\nmtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3 4\n");
        let model = read_from(&folder, obj).unwrap();
        let found = warnings(&model);
        assert_eq!(found.iter().map(|(_, times)| *times).collect::<Vec<_>>(), [1, 2], "{found:?}");
        let library = format!("material library {name} cannot be read: ");
        let texture = format!("material m: texture {name} cannot be read: ");
        for ((found, _), expected) in found.iter().zip([library, texture]) {
            assert!(found.starts_with(&expected) && found.contains(what), "{found}");
        }
        assert_eq!(model.materials[0].base_color, [0.0, 1.0, 0.0, 1.0]);
        // None of them ends or delays the report on files.
        for path in &model.dependencies {
            let report = crate::report::build_report::FileReport::read(path).unwrap();
            let is_read = ["a.mtl", "city.obj"].iter().any(|name| path.ends_with(name));
            assert_eq!(!report.blake3.is_empty(), is_read && path.exists(), "{report:?}");
        }
    }
    let model = read_from(&folder, format!("mtllib large.mtl\n{SQUARE}f 1 2 3 4\n")).unwrap();
    assert!(warnings(&model)[0].0.contains("expected at most 256 MiB"), "{:?}", warnings(&model));
}

#[cfg(unix)]
#[test]
fn a_model_that_is_no_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let faulty = crate::side_file::make_faulty_files(folder.path());
    for (name, what) in faulty.into_iter().filter(|(name, _)| *name != "sparse") {
        for extension in ["obj", "gltf"] {
            let path = folder.path().join(format!("{name}.{extension}"));
            std::os::unix::fs::symlink(name, &path).unwrap();
            let refusals =
                [crate::import::load(&path).map(drop), crate::import::bounds(&path).map(drop)];
            for refusal in refusals {
                let error = refusal.unwrap_err();
                assert_eq!(error.exit_code(), 3);
                assert!(error.to_string().contains(what), "{error}");
            }
        }
    }
}

#[test]
fn the_first_definition_of_a_material_counts_in_one_library_and_in_several() {
    let (red, blue) = ("newmtl m\nKd 1 0 0\n", "newmtl m\nKd 0 0 1\n");
    let both = format!("{red}newmtl unused\nKd 1 1 1\nnewmtl unused\n{blue}");
    let red = format!("{red}newmtl other\nKd nan 0 0\n");
    let files =
        [("red.mtl", &red[..]), ("blue.mtl", blue), ("both.mtl", &both), ("again.mtl", &red)];
    let faces = "usemtl m\nf 1 2 3\n";
    for (obj, times) in [
        (format!("mtllib red.mtl blue.mtl\n{SQUARE}{faces}"), Some(1)),
        (format!("mtllib red.mtl\nmtllib blue.mtl\n{SQUARE}{faces}"), Some(1)),
        (format!("mtllib red.mtl\n{SQUARE}{faces}mtllib blue.mtl\n{faces}"), Some(1)),
        (format!("{SQUARE}{faces}mtllib red.mtl\nmtllib blue.mtl\n"), Some(1)),
        (format!("mtllib both.mtl\n{SQUARE}{faces}"), Some(1)),
        (format!("mtllib red.mtl again.mtl\n{SQUARE}{faces}"), None),
    ] {
        let folder = folder_with(&files);
        let model = read_from(&folder, &obj).unwrap();
        assert_eq!(model.materials[0].base_color, [1.0, 0.0, 0.0, 1.0], "{obj}");
        let found = warnings(&model).into_iter().find(|(text, _)| text.contains("defined again"));
        assert_eq!(found.as_ref().map(|(_, times)| *times), times, "{obj}");
        assert!(found.is_none_or(|(text, _)| text.ends_with("(first: m)")));
        check_chunks(&folder, obj.as_bytes());
    }
}

#[test]
fn time_scales_with_the_number_of_undefined_materials() {
    use std::fmt::Write;
    let folder = folder_with(&[]);
    let unused = |count: usize| {
        let mut obj = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
        (0..count).for_each(|number| writeln!(obj, "usemtl m{number}").unwrap());
        obj + "f 1 2 3\n"
    };
    let used = |count: usize| {
        let mut obj = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
        (0..count).for_each(|number| writeln!(obj, "usemtl m{number}\nf 1 2 3").unwrap());
        obj
    };
    for obj in [unused, used] {
        assert_scales(1000, obj, |obj| {
            read_in_chunks(&folder, obj.as_bytes(), CHUNK_BYTES).unwrap().materials.len()
        });
    }
}
