//! The scene file: round trip, and every kind of damage.

use std::path::Path;

use super::node_id::NodeId;
use super::scene::Scene;
use super::scene_check::{Element, SceneDefect};
use super::sink::NONE;
use super::test_scene::scene;
use super::{SCENE_FILE, SCENE_VERSION};

fn read(bytes: &[u8]) -> crate::Result<Scene> {
    Scene::from_bytes(bytes, Path::new("out/scene.hlod"))
}

/// Makes length and checksum agree with what stands before them.
fn seal(bytes: &mut Vec<u8>) {
    let length = bytes.len() as u64;
    bytes[16..24].copy_from_slice(&length.to_le_bytes());
    bytes.truncate(bytes.len() - 4);
    let crc = crc32fast::hash(bytes);
    bytes.extend(crc.to_le_bytes());
}

fn message(bytes: &[u8]) -> String {
    read(bytes).unwrap_err().to_string()
}

#[test]
fn reads_back_what_it_wrote() {
    let scene = scene();
    assert_eq!(scene.check(), []);
    let bytes = scene.to_bytes().unwrap();
    assert_eq!(read(&bytes).unwrap(), scene);
    assert_eq!(scene.to_bytes().unwrap(), bytes);
}

#[test]
fn reads_from_an_output_folder() {
    let dir = tempfile::tempdir().unwrap();
    let missing = Scene::read(dir.path()).unwrap_err();
    assert!(missing.to_string().contains("scene.hlod"), "{missing}");
    assert_eq!(missing.exit_code(), 3);
    std::fs::write(dir.path().join(SCENE_FILE), scene().to_bytes().unwrap()).unwrap();
    assert_eq!(Scene::read(dir.path()).unwrap(), scene());
}

#[test]
fn walks_the_forest_in_order() {
    let scene = scene();
    assert_eq!(scene.roots().collect::<Vec<_>>(), [0, 4]);
    assert_eq!(scene.children(1).collect::<Vec<_>>(), [3, 2]);
    assert_eq!(scene.children(4).count() + scene.children(NONE).count(), 0);
    assert_eq!(scene.level_count(), 3);
    let [min, max] = scene.bounds().unwrap();
    assert_eq!((min[0], max[0]), (678_016.25, 678_120.25));
}

#[test]
fn a_ring_of_siblings_ends() {
    let mut scene = scene();
    scene.nodes[2].next_sibling = Some(3);
    assert_eq!(scene.children(1).count(), scene.nodes.len());
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = scene().to_bytes().unwrap();
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "{length}");
        if length >= 28 {
            let mut sealed = bytes[..length].to_vec();
            seal(&mut sealed);
            assert!(read(&sealed).is_err(), "{length}, sealed");
        }
    }
    assert!(message(&bytes[..40]).contains(&format!("expected {} bytes, found 40", bytes.len())));
    assert!(message(&bytes[..5]).contains("truncated"));
}

#[test]
fn every_flipped_bit_is_an_error() {
    let bytes = scene().to_bytes().unwrap();
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&flipped).is_err(), "bit {bit}");
        // Past the checksum, the parser must hold by itself: what it accepts is sound.
        seal(&mut flipped);
        if let Ok(scene) = read(&flipped) {
            assert_eq!(scene.check(), [], "bit {bit}");
        }
    }
}

#[test]
fn foreign_and_future_files_are_named_as_such() {
    assert!(message(b"").contains("not a scene file"));
    assert!(message(b"# an OBJ file").contains("not a scene file"));
    let mut future = scene().to_bytes().unwrap();
    future[8..12].copy_from_slice(&7u32.to_le_bytes());
    let message = message(&future);
    assert!(message.contains(&format!("expected {SCENE_VERSION}, found 7")), "{message}");
    assert!(message.starts_with("out/scene.hlod: "));
}

#[test]
fn damage_is_named() {
    let mut bytes = scene().to_bytes().unwrap();
    let last = bytes.len() - 10;
    bytes[last] ^= 0x40;
    assert!(message(&bytes).contains("damaged: expected CRC-32"));
    bytes.push(0);
    assert!(message(&bytes).contains("appended to"));
}

#[test]
fn text_that_is_not_utf8_is_refused() {
    let mut bytes = scene().to_bytes().unwrap();
    let at = bytes.windows(4).position(|w| w == b"roof").unwrap();
    bytes[at + 1] = 0xFF;
    seal(&mut bytes);
    let expected = format!("name of a block at byte {}: expected UTF-8, found byte 0xff", at + 1);
    assert!(message(&bytes).contains(&expected));
}

#[test]
fn a_header_that_contradicts_the_nodes_is_refused() {
    for (at, what) in [(12, "textured"), (60, "bounding box"), (104, "number of roots")] {
        let mut bytes = scene().to_bytes().unwrap();
        bytes[at] ^= 1;
        seal(&mut bytes);
        assert!(message(&bytes).contains(what), "{what}: {}", message(&bytes));
    }
    let mut bytes = scene().to_bytes().unwrap();
    bytes[12] |= 0x80;
    seal(&mut bytes);
    assert!(message(&bytes).contains("flags"));
}

#[test]
fn a_huge_count_is_refused_before_anything_is_allocated() {
    let mut bytes = scene().to_bytes().unwrap();
    let parameters = u32::from_le_bytes(bytes[108..112].try_into().unwrap()) as usize;
    let count = 112 + parameters; // of shared textures
    assert_eq!(bytes[count..count + 4], [1, 0, 0, 0]);
    bytes[count..count + 4].copy_from_slice(&0xFFFF_FFFEu32.to_le_bytes());
    seal(&mut bytes);
    assert!(message(&bytes).contains("number of shared textures"), "{}", message(&bytes));
}

/// One defect each, and what is found.
#[test]
fn every_defect_is_found() {
    use SceneDefect as D;
    type Case = (&'static str, fn(&mut Scene), fn(&SceneDefect) -> bool);
    let cases: &[Case] = &[
        ("no nodes", |s| s.nodes.clear(), |d| matches!(d, D::NoNodes)),
        (
            "link out of range",
            |s| s.nodes[0].first_child = Some(5),
            |d| matches!(d, D::IndexOutOfRange { field: "first child", limit: 5, found: 5, .. }),
        ),
        (
            "parent out of range",
            |s| s.nodes[1].parent = Some(99),
            |d| matches!(d, D::IndexOutOfRange { field: "parent", found: 99, .. }),
        ),
        (
            "child does not point back",
            |s| s.nodes[2].parent = Some(0),
            |d| matches!(d, D::ParentDisagrees { child: 2, parent: 1, found: Some(0) }),
        ),
        (
            "two parents",
            |s| s.nodes[4].first_child = Some(1),
            |d| matches!(d, D::SeveralParents { child: 1, parent: 4 }),
        ),
        (
            "siblings in a ring",
            |s| s.nodes[2].next_sibling = Some(3),
            |d| matches!(d, D::SeveralParents { child: 3, parent: 1 }),
        ),
        (
            "parent does not list it",
            |s| s.nodes[3].next_sibling = None,
            |d| matches!(d, D::NotListed { child: 2, parent: 1 }),
        ),
        (
            "sibling of a root",
            |s| s.nodes[0].next_sibling = Some(4),
            |d| matches!(d, D::RootWithSibling { node: 0, found: 4 }),
        ),
        (
            "cycle",
            |s| {
                s.nodes[0].first_child = None;
                s.nodes[1].parent = Some(2);
                s.nodes[2].first_child = Some(1);
            },
            |d| matches!(d, D::Cycle { node: 1 }),
        ),
        (
            "own parent",
            |s| {
                s.nodes[4].parent = Some(4);
                s.nodes[4].first_child = Some(4);
            },
            |d| matches!(d, D::Cycle { node: 4 }),
        ),
        (
            "wrong level",
            |s| s.nodes[2].level = 1,
            |d| matches!(d, D::Level { node: 2, expected: 2, found: 1 }),
        ),
        (
            "error grows",
            |s| s.nodes[3].geometric_error = 2.5,
            |d| matches!(d, D::ErrorNotMonotone { child: 3, parent: 1, .. }),
        ),
        (
            "block changes",
            |s| s.nodes[2].block = Some(1),
            |d| matches!(d, D::BlockChanges { child: 2, parent_block: 0, found: Some(1) }),
        ),
        (
            "block out of range",
            |s| s.nodes[4].block = Some(2),
            |d| matches!(d, D::IndexOutOfRange { field: "block", limit: 2, found: 2, .. }),
        ),
        (
            "shared texture out of range",
            |s| s.nodes[4].shared_textures = vec![0, 1],
            |d| matches!(d, D::IndexOutOfRange { field: "shared texture", limit: 1, found: 1, .. }),
        ),
        (
            "NaN error",
            |s| s.nodes[0].geometric_error = f64::NAN,
            |d| matches!(d, D::Number { field: "geometric error", .. }),
        ),
        (
            "NaN mean error",
            |s| s.nodes[0].mean_error = f64::NAN,
            |d| matches!(d, D::Number { field: "mean error", .. }),
        ),
        (
            "negative percentile of the error",
            |s| s.nodes[0].p95_error = -1.0,
            |d| matches!(d, D::Number { field: "95th percentile of the error", .. }),
        ),
        (
            "negative cost",
            |s| s.nodes[0].cost = -1.0,
            |d| matches!(d, D::Number { field: "cost", found: -1.0, .. }),
        ),
        (
            "infinite benefit",
            |s| s.nodes[0].static_benefit = f64::INFINITY,
            |d| matches!(d, D::Number { field: "static benefit", .. }),
        ),
        (
            "NaN in a box",
            |s| s.nodes[0].bbox_min[1] = f64::NAN,
            |d| matches!(d, D::Number { field: "bounding box", .. }),
        ),
        (
            "box inside out",
            |s| s.nodes[4].bbox_min[2] = 31.0,
            |d| matches!(d, D::Box { node: 4, axis: 'z', min: 31.0, max: 30.0 }),
        ),
        (
            "origin too precise",
            |s| s.nodes[0].origin[0] = 678_016.01,
            |d| matches!(d, D::Number { field: "origin", .. }),
        ),
        (
            "long normal",
            |s| s.nodes[0].average_normal = [1.0, 1.0, 0.0],
            |d| matches!(d, D::Number { field: "average normal", .. }),
        ),
        (
            "block origin",
            |s| s.blocks[1].origin[2] = f64::NEG_INFINITY,
            |d| matches!(d, D::Number { element: Element::Block(1), .. }),
        ),
        (
            "empty picture",
            |s| s.shared_textures[0].width = 0,
            |d| matches!(d, D::Number { field: "width", found: 0.0, .. }),
        ),
        (
            "textured triangles",
            |s| s.nodes[0].textured_triangles = 901,
            |d| matches!(d, D::TexturedTriangles { node: 0, triangles: 900, found: 901 }),
        ),
        (
            "vertices",
            |s| s.nodes[2].vertices = 2701,
            |d| matches!(d, D::Vertices { node: 2, expected: 2700, found: 2701 }),
        ),
        (
            "pictures",
            |s| s.nodes[1].pictures[0] = [256, 255],
            |d| matches!(d, D::Pictures { node: 1, texels: 66_048, found: 65_792 }),
        ),
        (
            "folder in a file name",
            |s| s.nodes[0].file = "../n.glb".into(),
            |d| matches!(d, D::FileName { element: Element::Node(0), .. }),
        ),
        (
            "absolute name of a picture",
            |s| s.shared_textures[0].file_name = "/etc/passwd".into(),
            |d| matches!(d, D::FileName { element: Element::SharedTexture(0), .. }),
        ),
        (
            "same file",
            |s| s.nodes[4].file = "n0.glb".into(),
            |d| matches!(d, D::SameFile { element: Element::Node(4), other: Element::Node(0), .. }),
        ),
        (
            "same id",
            |s| s.nodes[4].id = NodeId(100),
            |d| matches!(d, D::SameId { node: 4, other: 0, found: NodeId(100) }),
        ),
    ];
    for (name, spoil, expected) in cases {
        let mut scene = scene();
        spoil(&mut scene);
        let defects = scene.check();
        assert!(defects.iter().any(expected), "{name}: {defects:?}");
        assert!(scene.to_bytes().is_err(), "{name} must not be written");
    }
}

#[test]
fn defects_in_a_file_are_reported_together() {
    let mut bytes = scene().to_bytes().unwrap();
    for name in [&b"n1.glb"[..], b"n3.glb"] {
        let at = bytes.windows(6).position(|w| w == name).unwrap();
        bytes[at] = b'/';
    }
    seal(&mut bytes);
    let message = message(&bytes);
    assert!(message.contains("2 defects"), "{message}");
    assert!(message.contains("node 1: expected a plain file name, found \"/1.glb\""));
    assert!(message.contains("node 3: "));
}

#[test]
fn only_the_first_sixteen_defects_are_kept() {
    let mut scene = scene();
    scene.nodes.iter_mut().for_each(|node| node.bbox_min = [f64::NAN; 3]);
    scene.nodes.iter_mut().for_each(|node| node.bbox_max = [f64::NAN; 3]);
    assert_eq!(scene.check().len(), 16);
}
