//! What glTF inputs bring beside their geometry, and nodes of a result as inputs.

use std::fs;
use std::path::Path;

use base64::Engine;
use hlod::format::{NODES_DIR, TILESET_FILE};
use serde_json::{Value, json};

use crate::support::inputs::{SQUARE, write};
use crate::support::result::{Built, difference, lasting, report};
use crate::support::run_build;

/// A square of 1 m at `x`, in a file of its own.
fn square(folder: &Path, name: &str, x: f64, copyright: Option<&str>) {
    let mut binary: Vec<u8> = Vec::new();
    for value in [0., 0., 0., 1., 0., 0., 1., 0., -1., 0., 0., -1_f32] {
        binary.extend(value.to_le_bytes());
    }
    for index in [0_u16, 1, 2, 0, 2, 3] {
        binary.extend(index.to_le_bytes());
    }
    let data = base64::engine::general_purpose::STANDARD.encode(&binary);
    let mut json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [x, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12}
        ],
        "buffers": [{"byteLength": 60, "uri": format!("data:application/octet-stream;base64,{data}")}]
    });
    if let Some(copyright) = copyright {
        json["asset"]["copyright"] = copyright.into();
    }
    write(folder, name, json.to_string());
}

/// The copyright notice of every node and of the tileset, which are the same.
fn notice(out: &Path) -> Option<String> {
    let built = Built::read(out);
    let of_node = |file: &Vec<u8>| {
        let length = u32::from_le_bytes(*file[12..].first_chunk().unwrap()) as usize;
        let json: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
        json["asset"]["copyright"].as_str().map(str::to_owned)
    };
    let of_nodes: Vec<Option<String>> = built.files.iter().map(of_node).collect();
    let tileset: Value =
        serde_json::from_slice(&fs::read(out.join(TILESET_FILE)).unwrap()).unwrap();
    let extras = &tileset["asset"]["extras"];
    let notice = extras["copyright"].as_str().map(str::to_owned);
    assert!(of_nodes.iter().all(|node| *node == notice), "{of_nodes:?} {notice:?}");
    assert_eq!(report(out)["parameters"]["copyright"].as_str(), notice.as_deref());
    let credits = extras["cesium"]["credits"].as_array().map_or(0, Vec::len);
    assert_eq!(credits, notice.as_ref().map_or(0, |notice| notice.split("; ").count()));
    notice
}

#[test]
fn copyright_notices_are_joined_in_every_node_and_the_tileset() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let inputs = at.join("in");
    fs::create_dir(&inputs).unwrap();
    square(&inputs, "a.gltf", 0.0, Some("© A & <Sons>"));
    square(&inputs, "b.gltf", 5.0, None);
    square(&inputs, "c.gltf", 10.0, Some("CC BY © C; © A & <Sons>"));
    run_build(at, &["--blocks", "grid:4", "in", "out"]);
    assert_eq!(notice(&at.join("out")).unwrap(), "© A & <Sons>; CC BY © C");
    let tileset = fs::read_to_string(at.join("out").join(TILESET_FILE)).unwrap();
    assert!(tileset.contains(r#""html":"© A &amp; &lt;Sons&gt;""#), "{tileset}");
    assert!(run_build(at, &["--blocks", "grid:4", "in", "out"]).contains("up to date"));

    // Shares of a build know the notices of all inputs.
    for share in ["1/3", "2/3", "3/3"] {
        run_build(at, &["--blocks", "grid:4", "--subset", share, "in", "merged"]);
    }
    run_build(at, &["merge", "merged"]);
    assert_eq!(difference(&lasting(&at.join("out")), &lasting(&at.join("merged"))), None);

    // A notice that changes is one in every node.
    square(&inputs, "b.gltf", 5.0, Some("© B"));
    run_build(at, &["--blocks", "grid:4", "--copyright", "© City", "in", "out"]);
    assert_eq!(notice(&at.join("out")).unwrap(), "© A & <Sons>; © B; CC BY © C; © City");

    write(at, "plain.obj", SQUARE);
    run_build(at, &["--max-memory", "128MiB", "--copyright", "© O", "plain.obj", "plain"]);
    assert_eq!(notice(&at.join("plain")).unwrap(), "© O");
    run_build(at, &["plain.obj", "none"]);
    assert_eq!(notice(&at.join("none")), None);
}

/// Triangles as bits of their corners, each turned so that its least corner is first, in order; without degenerate
/// ones and repetitions, which import drops.
fn sorted(triangles: impl Iterator<Item = [[f64; 3]; 3]>) -> Vec<[[u64; 3]; 3]> {
    // Adding 0 turns -0 into 0.
    let bits = |corner: [f64; 3]| corner.map(|coordinate| (coordinate + 0.0).to_bits());
    let mut triangles: Vec<[[u64; 3]; 3]> = triangles
        .map(|triangle| {
            let mut corners = triangle.map(bits);
            let least = (0..3).min_by_key(|&corner| corners[corner]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        })
        .collect();
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    triangles.sort_unstable();
    triangles.dedup();
    triangles
}

/// Reads each node of a result as an input and compares it with the node.
pub fn check_nodes_as_inputs(out: &Path) {
    let built = Built::read(out);
    for (node, mesh) in built.scene.nodes.iter().zip(&built.meshes) {
        let corners = |primitive: &hlod::format::Primitive| -> Vec<[[f64; 3]; 3]> {
            let surface = primitive.indices.len() - 3 * primitive.skirt_triangles;
            let position = |&vertex: &u32| {
                let [x, y, z] = primitive.positions[vertex as usize].map(f64::from);
                let [x, y, z] = [mesh.origin[0] + x, mesh.origin[1] + y, mesh.origin[2] + z];
                match built.scene.up {
                    hlod::mesh::UpAxis::Y => [x, y, z],
                    hlod::mesh::UpAxis::Z => [x, z, -y],
                }
            };
            let corners = primitive.indices[..surface].as_chunks::<3>().0;
            corners.iter().map(|c| [&c[0], &c[1], &c[2]].map(position)).collect()
        };
        let expected = sorted(mesh.primitives.iter().flat_map(corners));
        let model = hlod::import::load(&out.join(NODES_DIR).join(&node.file)).unwrap();
        let found = sorted(model.parts.iter().flat_map(|part| {
            let corners = part.indices.as_chunks::<3>().0.iter();
            corners.map(|c| c.map(|vertex| part.positions[vertex as usize]))
        }));
        assert_eq!(found.len(), expected.len(), "{}", node.file);
        assert!(found == expected, "{}", node.file);
    }
}
