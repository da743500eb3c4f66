//! Normals of triangles without a texture.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;

use glam::DVec3;
use hlod::city;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::inputs::{small_city, write};
use crate::support::result::{Built, difference, lasting, report};
use crate::support::run_build;

/// A cube of 2 m.
const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
                    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn built(name: &str, text: &str, arguments: &[&str]) -> (TempDir, Built) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), name, text);
    run_build(folder.path(), &[arguments, &["--up", "z", name, "out"]].concat());
    let result = Built::read(&folder.path().join("out"));
    (folder, result)
}

fn json_of(file: &[u8]) -> Value {
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&file[20..20 + length]).unwrap()
}

/// The accessors of an attribute in a file.
fn accessors(file: &[u8], attribute: &str) -> Vec<Value> {
    let json = json_of(file);
    let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
    let number = |primitive: &Value| primitive["attributes"][attribute].as_u64();
    let numbers = primitives.iter().filter_map(number);
    numbers.map(|number| json["accessors"][number as usize].clone()).collect()
}

/// Corners of the triangles of a node that are no skirts: where they are, the normal of their triangle,
/// and their own.
fn corners(built: &Built, node: usize) -> Vec<(DVec3, DVec3, DVec3)> {
    let mesh = &built.meshes[node];
    let mut corners = Vec::new();
    for primitive in mesh.primitives.iter().filter(|primitive| primitive.surface.image.is_none()) {
        let surface = primitive.indices.len() - 3 * primitive.skirt_triangles;
        let triangles = primitive.indices[..surface].chunks_exact(3);
        for (triangle, normals) in triangles.zip(primitive.normals.chunks_exact(3)) {
            let at = [0, 1, 2].map(|corner| {
                let position = primitive.positions[triangle[corner] as usize];
                DVec3::from(mesh.origin) + DVec3::from(position.map(f64::from))
            });
            let face = (at[1] - at[0]).cross(at[2] - at[0]).normalize_or_zero();
            let own = |corner: usize| (at[corner], face, normals[corner].vector().unwrap());
            corners.extend([0, 1, 2].map(own));
        }
    }
    corners
}

#[test]
fn a_cube_has_three_normals_at_each_of_its_corners() {
    let (_folder, built) = built("cube.obj", CUBE, &[]);
    assert_eq!(built.meshes.len(), 1);
    let found = corners(&built, 0);
    assert_eq!(found.len(), 36);
    assert!(found.iter().all(|(_, face, own)| face == own), "{found:?}");
    // In memory the triangles of a corner share its vertex, in the file each side has one.
    assert_eq!(
        (built.meshes[0].primitives[0].positions.len(), built.scene.nodes[0].vertices),
        (8, 8)
    );
    for attribute in ["POSITION", "NORMAL"] {
        let [accessor] = &accessors(&built.files[0], attribute)[..] else { panic!() };
        assert_eq!(
            (accessor["count"].as_u64(), accessor["componentType"].as_u64()),
            (Some(24), Some(5126))
        );
    }
}

#[test]
fn normals_of_quantised_nodes_have_8_bits() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "cube.obj", CUBE);
    for compress in ["none", "meshopt"] {
        let quantized =
            ["--quantize", "0.001", "--up", "z", "cube.obj", "out", "--compress", compress];
        run_build(folder.path(), &quantized);
        let built = Built::read(&folder.path().join("out"));
        let [accessor] = &accessors(&built.files[0], "NORMAL")[..] else { panic!() };
        assert_eq!(
            (
                accessor["count"].as_u64(),
                accessor["componentType"].as_u64(),
                &accessor["normalized"]
            ),
            (Some(24), Some(5120), &Value::Bool(true))
        );
        let json = json_of(&built.files[0]);
        let view = accessor["bufferView"].as_u64().unwrap() as usize;
        assert_eq!(json["bufferViews"][view]["byteStride"], 4);
        assert!(json["extensionsRequired"].to_string().contains("KHR_mesh_quantization"));
        assert!(corners(&built, 0).iter().all(|(_, face, own)| face == own));
    }
}

/// Surfaces in memory, and so what is drawn, measured and made into coarser nodes, are those without
/// normals.
#[test]
fn normals_change_nothing_but_files() {
    let folder = tempfile::tempdir().unwrap();
    let options = city::CityOptions { blocks: 12, triangles: 24_000, split: true, ..small_city() };
    city::write(&options, &folder.path().join("parts")).unwrap();
    let small = ["--desired-tris", "40", "parts"];
    run_build(folder.path(), &[&small[..], &["on"]].concat());
    run_build(folder.path(), &[&small[..], &["off", "--normals", "off"]].concat());
    let [on, mut off] = ["on", "off"].map(|out| Built::read(&folder.path().join(out)));
    assert!(report(&folder.path().join("on"))["above"].as_array().is_some_and(|d| !d.is_empty()));
    assert!(off.files.iter().all(|file| accessors(file, "NORMAL").is_empty()));
    assert_eq!(on.meshes.len(), off.meshes.len());
    let mut lit = 0;
    for (mut with, without) in on.meshes.clone().into_iter().zip(&off.meshes) {
        for primitive in &mut with.primitives {
            let normals = std::mem::take(&mut primitive.normals);
            let corners =
                if primitive.surface.image.is_none() { primitive.indices.len() } else { 0 };
            assert_eq!(normals.len(), corners);
            lit += corners;
        }
        assert_eq!(&with, without);
    }
    assert!(lit > 3000, "{lit}");
    for (with, without) in on.scene.nodes.iter().zip(&mut off.scene.nodes) {
        (without.file_bytes, without.file_crc) = (with.file_bytes, with.file_crc);
        assert_eq!(with, without);
    }
    // Normals of triangles without any in the source are those of their planes, skirts apart.
    for node in 0..on.meshes.len() {
        for (at, face, own) in corners(&on, node) {
            let off = face.angle_between(own).to_degrees();
            assert!(face == DVec3::ZERO || off < 0.3, "{at}: {off}°");
        }
    }
}

/// A dome of radius 10 m on a floor: rings of quads, 6° wide, with the normals of a sphere.
fn dome() -> String {
    let (columns, rings) = (60, 14);
    let mut text = String::from("v 0 0 10\nvn 0 0 1\n");
    for ring in 1..=rings {
        for column in 0..columns {
            let (polar, around) =
                (f64::from(ring) * 6f64.to_radians(), f64::from(column) * 6f64.to_radians());
            let normal =
                DVec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos());
            let at = normal * 10.0;
            writeln!(
                text,
                "v {} {} {}\nvn {} {} {}",
                at.x, at.y, at.z, normal.x, normal.y, normal.z
            )
            .unwrap();
        }
    }
    let number = |ring: i32, column: i32| match ring {
        0 => 1,
        ring => 2 + (ring - 1) * columns + column % columns,
    };
    for ring in 0..rings {
        for column in 0..columns {
            text.push('f');
            let mut quad = vec![
                (ring, column),
                (ring + 1, column),
                (ring + 1, column + 1),
                (ring, column + 1),
            ];
            if ring == 0 {
                quad.pop();
            }
            for (ring, column) in quad {
                let number = number(ring, column);
                write!(text, " {number}//{number}").unwrap();
            }
            text.push('\n');
        }
    }
    // The floor's normals are those of its plane.
    let z = 10.0 * (f64::from(rings) * 6f64.to_radians()).cos();
    let first = 2 + rings * columns;
    for [x, y] in [[-40, -40], [40, -40], [40, 40], [-40, 40]] {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    writeln!(text, "vn 0 0 1\nf {first}//-1 {}//-1 {}//-1 {}//-1", first + 1, first + 2, first + 3)
        .unwrap();
    text
}

#[test]
fn normals_of_a_source_are_kept_on_all_levels() {
    for arguments in
        [&["--desired-tris", "100"][..], &["--desired-tris", "100", "--quantize", "0.001"]]
    {
        let (folder, built) = built("dome.obj", &dome(), arguments);
        run_build(folder.path(), &["verify", "out", "--source", "dome.obj", "--samples", "20000"]);
        assert!(built.meshes.len() > 8);
        let rounded = if arguments.len() > 2 { 0.6 } else { 0.0 };
        for node in 0..built.meshes.len() {
            let is_leaf = built.is_leaf(node);
            for (at, face, own) in corners(&built, node) {
                let is_floor = face.angle_between(DVec3::Z) < 1e-6 && at.length() > 10.01;
                let expected = if is_floor { DVec3::Z } else { at.normalize() };
                // Facets are 3° off at their corners. New vertices of leaves lie on planes that cut
                // triangles, where normals are between those of the triangle's corners. Lids in these
                // planes are no part of the dome.
                let most = if is_leaf { 0.5 + rounded } else { 12.0 };
                if !is_leaf && expected.angle_between(face).to_degrees() > 30.0 {
                    continue;
                }
                let off = expected.angle_between(own).to_degrees();
                assert!(off <= most, "{at}: {off}° of {:?}", built.scene.nodes[node].file);
            }
        }
        // Normals of the source, as they are, at its vertices.
        let exact = |(at, face, own): &(DVec3, DVec3, DVec3)| {
            let off = own.angle_between(at.normalize()).to_degrees();
            face.angle_between(DVec3::Z) > 1e-6
                && (at.length() - 10.0).abs() < 1e-3
                && off < 0.01 + rounded
        };
        let leaves = (0..built.meshes.len()).filter(|&node| built.is_leaf(node));
        let found = leaves.flat_map(|node| corners(&built, node)).filter(exact).count();
        assert!(found > 3 * 1400, "{found}");
        // The coarsest level is smooth: its corners meet in one normal.
        let root = built.scene.roots().next().unwrap() as usize;
        let mut at: BTreeMap<[u64; 3], Vec<DVec3>> = BTreeMap::new();
        for (place, _, own) in corners(&built, root) {
            at.entry(place.to_array().map(f64::to_bits)).or_default().push(own);
        }
        let smooth = at
            .values()
            .filter(|normals| normals.len() > 2 && normals.windows(2).all(|n| n[0] == n[1]));
        assert!(2 * smooth.count() > at.len(), "{} vertices", at.len());
    }
}

#[test]
fn a_result_with_source_normals_is_the_same_however_it_is_built() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "dome.obj", dome());
    let build = |out: &str, more: &[&str]| {
        let arguments = ["--desired-tris", "100", "--up", "z", "dome.obj", out];
        run_build(folder.path(), &[&arguments[..], more].concat());
        lasting(&folder.path().join(out))
    };
    let one = build("one", &["--threads", "1"]);
    assert_eq!(difference(&one, &build("four", &["--threads", "4"])), None);
    // The option is part of what a result is known by.
    assert_ne!(difference(&one, &build("one", &["--normals", "off"])), None);
    assert_eq!(difference(&one, &build("one", &["--normals", "on"])), None);
}

#[test]
fn normals_that_cannot_be_are_replaced_and_counted() {
    let text = format!(
        "{CUBE}vn 0 0 0\nvn nan 0 1\nvn 0 0 -1\nvn 0 0.6 0.8\n\
         v 9 0 0\nv 9 1 0\nv 8 0 0\nf -1//-4 -3//-3 -2//-2\nf 1//99 3//0 2\n"
    );
    let (folder, built) = built("odd.obj", &text, &[]);
    assert!(corners(&built, 0).iter().all(|(_, face, own)| face == own));
    let warnings = report(&folder.path().join("out"))["warnings"].to_string();
    assert!(warnings.contains("replaced by the face's"), "{warnings}");
}

/// No file of a textured surface has normals: it is not lit.
#[test]
fn textured_surfaces_have_none() {
    let folder = tempfile::tempdir().unwrap();
    city::write(&small_city(), &folder.path().join("city.obj")).unwrap();
    run_build(folder.path(), &["city.obj", "out"]);
    for file in fs::read_dir(folder.path().join("out/nodes")).unwrap() {
        let json = json_of(&fs::read(file.unwrap().path()).unwrap());
        for primitive in json["meshes"][0]["primitives"].as_array().unwrap() {
            let material = &json["materials"][primitive["material"].as_u64().unwrap() as usize];
            let is_unlit = material["extensions"]["KHR_materials_unlit"].is_object();
            assert_eq!(primitive["attributes"]["NORMAL"].is_null(), is_unlit);
        }
    }
}
