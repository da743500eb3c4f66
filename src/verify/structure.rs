//! Check: the tree is sound, every file present and whole, and every stored attribute equal to a
//! recomputation from the node's file.

use std::path::Path;

use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::options::Limits;
use super::progress::Progress;
use super::report::{Check, Failure};
use crate::decode::texture_size;
use crate::format::TILESET_FILE;
use crate::format::attributes::{TEXTURED_WEIGHT, attributes};
use crate::format::{
    NODES_DIR, Node, NodeImageData, NodeMesh, Scene, TEXTURES_DIR, file_crc, read_glb,
};
use crate::mesh::{TextureData, TextureSource};
use crate::place::placement_of;
use crate::tileset;

const REBUILD: &str = "build the scene again with --force";
const REPORT: &str = "build again with --force; if it stays, this is a fault of the builder";

/// Reads every node's file, checks it, and keeps its triangles. What cannot be read has none.
pub(super) fn structure(
    out: &Path,
    scene: &Scene,
    limits: &Limits,
    progress: &dyn Progress,
) -> (Vec<NodeGeometry>, Check) {
    let mut check = Check::new("structure");
    progress.phase("reading nodes", scene.nodes.len() as u64);
    let weight = scene.parameters["textured_weight"].as_f64().unwrap_or(TEXTURED_WEIGHT);
    let read: Vec<(NodeGeometry, Vec<Failure>)> = scene
        .nodes
        .par_iter()
        .map(|node| {
            let read = read_node(out, scene, node, weight, limits);
            progress.done(1);
            read
        })
        .collect();
    let mut geometry = Vec::with_capacity(read.len());
    for (triangles, failures) in read {
        geometry.push(triangles);
        check.extend(failures);
    }
    check.extend(scene.shared_textures.iter().filter_map(|texture| {
        let path = out.join(TEXTURES_DIR).join(&texture.file_name);
        let place = format!("{TEXTURES_DIR}/{}", texture.file_name);
        let what = match crate::format::read_regular(&path) {
            Err(error) => format!("cannot be read: {error}"),
            Ok(bytes) if bytes.len() as u64 != texture.bytes => {
                format!("expected {} bytes, found {}", texture.bytes, bytes.len())
            }
            Ok(bytes) => size_failure(&bytes, [texture.width, texture.height])?,
        };
        Some(Failure { place, what, hint: REBUILD })
    }));
    check.extend(tree_failures(scene));
    let tiles = tileset_failures(out, scene, &mut check);
    check.summary = format!(
        "{} nodes and {} shared images read, checksums and {ATTRIBUTES} attributes each; {tiles}",
        scene.nodes.len(),
        scene.shared_textures.len(),
    );
    (geometry, check)
}

/// Checks the tileset; says what was looked at.
fn tileset_failures(out: &Path, scene: &Scene, check: &mut Check) -> String {
    if !out.join(TILESET_FILE).exists() {
        let what = "is missing: an older version built this folder, or it was removed";
        check.fail(TILESET_FILE, what, "build the scene again; its nodes are kept");
        return "no tileset".into();
    }
    match placement_of(&scene.parameters)
        .and_then(|placement| tileset::check(out, scene, &placement))
    {
        Err(error) => {
            check.fail(TILESET_FILE, error.to_string(), REBUILD);
            "no tileset".into()
        }
        Ok(checked) => {
            let faults = checked.faults.into_iter();
            check.extend(faults.map(|tileset::Fault { place, what }| Failure {
                place,
                what,
                hint: REBUILD,
            }));
            let placed = checked.placed_within.map_or(String::new(), |off| {
                format!(", leaves within {:.1} mm of their place on the Earth", off * 1e3)
            });
            format!("{} tiles in {} tilesets{placed}", checked.tiles, checked.files)
        }
    }
}

/// Attributes that [`attribute_failures`] checks.
const ATTRIBUTES: usize = 13;

fn read_node(
    out: &Path,
    scene: &Scene,
    node: &Node,
    weight: f64,
    limits: &Limits,
) -> (NodeGeometry, Vec<Failure>) {
    let failure = |what, hint| Failure { place: node.file.clone(), what, hint };
    let path = out.join(NODES_DIR).join(&node.file);
    let bytes = match crate::format::read_regular(&path) {
        Ok(bytes) => bytes,
        Err(error) => {
            let what = format!("cannot be read: {error}");
            return (NodeGeometry::default(), vec![failure(what, REBUILD)]);
        }
    };
    let mut failures = Vec::new();
    if bytes.len() as u64 != node.file_bytes {
        let what = format!("expected {} bytes, found {}", node.file_bytes, bytes.len());
        failures.push(failure(what, REBUILD));
    } else if file_crc(&bytes) != node.file_crc {
        let found = file_crc(&bytes);
        let what = format!("damaged: expected CRC-32 {:08x}, found {found:08x}", node.file_crc);
        failures.push(failure(what, REBUILD));
    }
    match read_glb(&bytes, Path::new(&node.file)) {
        Err(error) => {
            failures.push(failure(error.to_string(), REBUILD));
            (NodeGeometry::default(), failures)
        }
        Ok(mesh) => {
            let wrong = attribute_failures(scene, node, &mesh, weight, limits);
            failures.extend(wrong.into_iter().map(|what| failure(what, REPORT)));
            (NodeGeometry::new(&mesh), failures)
        }
    }
}

/// Everything that the scene says of a node and its file says otherwise.
fn attribute_failures(
    scene: &Scene,
    node: &Node,
    mesh: &NodeMesh,
    weight: f64,
    limits: &Limits,
) -> Vec<String> {
    let found = attributes(mesh, weight);
    let mut failures = Vec::new();
    let mut compare = |name: &str, stored: String, recomputed: String, same: bool| {
        if !same {
            failures.push(format!("{name}: the scene says {stored}, its file gives {recomputed}"));
        }
    };
    let close = |a: f64, b: f64| (a - b).abs() <= limits.attribute * a.abs().max(b.abs());
    let mut whole = |name: &str, stored: u64, recomputed: u64| {
        compare(name, stored.to_string(), recomputed.to_string(), stored == recomputed);
    };
    whole("triangles", node.triangles.into(), found.triangles.into());
    whole("textured triangles", node.textured_triangles.into(), found.textured_triangles.into());
    whole("vertices", node.vertices.into(), found.vertices.into());
    let mut images = Vec::new();
    let mut shared = Vec::new();
    let mut shared_texels = 0;
    for image in &mesh.images {
        let texels = u64::from(image.width) * u64::from(image.height);
        match &image.data {
            NodeImageData::Embedded { bytes, .. } => {
                images.push([image.width, image.height]);
                if let Some(what) = size_failure(bytes, [image.width, image.height]) {
                    compare("image", "its size".into(), what, false);
                }
            }
            NodeImageData::Shared { file_name } => {
                shared_texels += texels;
                shared.push(file_name.to_string());
            }
        }
    }
    let texels = images.iter().map(|&[w, h]| u64::from(w) * u64::from(h)).sum::<u64>();
    let mut whole = |name: &str, stored: u64, recomputed: u64| {
        compare(name, stored.to_string(), recomputed.to_string(), stored == recomputed);
    };
    whole("texels", node.texels, texels);
    whole("shared texels", node.shared_texels, shared_texels);
    let stored_images = &node.pictures;
    compare(
        "pictures",
        format!("{stored_images:?}"),
        format!("{images:?}"),
        *stored_images == images,
    );
    shared.sort_unstable();
    let mut stored_shared: Vec<String> = node
        .shared_textures
        .iter()
        .filter_map(|&number| scene.shared_textures.get(number as usize))
        .map(|texture| texture.file_name.clone())
        .collect();
    stored_shared.sort_unstable();
    shared.dedup();
    let same = stored_shared == shared;
    compare("shared images", stored_shared.join(", "), shared.join(", "), same);
    let mut triple = |name: &str, stored: [f64; 3], recomputed: [f64; 3], tolerance: f64| {
        let same = stored.iter().zip(recomputed).all(|(a, b)| (a - b).abs() <= tolerance);
        compare(name, format!("{stored:?}"), format!("{recomputed:?}"), same);
    };
    triple("origin", node.origin, mesh.origin, 0.0);
    triple("least corner of the box", node.bbox_min, found.bbox_min, 0.0);
    triple("greatest corner of the box", node.bbox_max, found.bbox_max, 0.0);
    triple("average normal", node.average_normal.map(f64::from), found.average_normal, 1e-6);
    let mut number = |name: &str, stored: f64, recomputed: f64| {
        compare(name, stored.to_string(), recomputed.to_string(), close(stored, recomputed));
    };
    number("cost", node.cost, found.cost);
    number("static benefit", node.static_benefit, found.static_benefit);
    failures
}

/// Why encoded bytes are no image of a size.
fn size_failure(bytes: &[u8], size: [u32; 2]) -> Option<String> {
    let source = TextureSource {
        name: "image".into(),
        data: TextureData::Embedded(bytes.into()),
        opacity: None,
    };
    match texture_size(&source) {
        Ok((width, height)) if [width, height] == size => None,
        Ok(found) => Some(format!("expected an image of {size:?} texels, found {found:?}")),
        Err(error) => Some(error.to_string()),
    }
}

/// A skirt over several spans of a border may be so many times as high as the border is far from its
/// polyline, which is the builder's own bound (`builder::border::skirt`): more triangles would keep
/// closer.
const SKIRT_REACH: f64 = 2.5;

/// Nodes that stick out of their parent's box, and errors that grow towards the leaves.
fn tree_failures(scene: &Scene) -> Vec<Failure> {
    let mut failures = Vec::new();
    let steps = super::step::steps(scene);
    for (node, step) in scene.nodes.iter().zip(steps) {
        let Some(parent) = node.parent.map(|parent| &scene.nodes[parent as usize]) else {
            continue;
        };
        let mut fail = |what| {
            failures.push(Failure { place: node.file.clone(), what, hint: REPORT });
        };
        if node.geometric_error > parent.geometric_error {
            let (own, above) = (node.geometric_error, parent.geometric_error);
            fail(format!("error {own} m is above the {above} m of its parent"));
        }
        let beyond = (0..3)
            .map(|axis| {
                (parent.bbox_min[axis] - node.bbox_min[axis])
                    .max(node.bbox_max[axis] - parent.bbox_max[axis])
            })
            .fold(0.0, f64::max);
        // Each is as near to the source as its own error says, its skirts as SKIRT_REACH times that.
        // Corners of leaves lie on the lattice, those of coarse nodes between its points.
        if beyond > parent.geometric_error + SKIRT_REACH * node.geometric_error + step {
            fail(format!(
                "reaches {beyond:.4} m out of its parent's box, whose error is {:.4} m",
                parent.geometric_error
            ));
        }
    }
    failures
}
