//! Properties of the files in an output folder, over seeded random scenes and meshes.

use std::path::Path;
use std::sync::Arc;

use hlod::format::{
    BlockInfo, Node, NodeId, NodeImage, NodeImageData, NodeLabel, NodeMesh, Primitive, Scene,
    SharedTexture, Surface, read_glb, write_glb,
};
use hlod::mesh::{AlphaMode, Normal, UpAxis, Wrap};
use hlod::report::inspect;
use proptest::collection::vec;
use proptest::prelude::*;

fn up() -> impl Strategy<Value = UpAxis> {
    prop_oneof![Just(UpAxis::Y), Just(UpAxis::Z)]
}

/// Coordinates that fit in f32, at any offset.
fn origin() -> impl Strategy<Value = [f64; 3]> {
    any::<[i32; 3]>().prop_map(|o| o.map(|c| f64::from((c >> 8) as f32 * 0.25)))
}

/// The parents of a forest: each node's parent stands before it, or it is a root.
fn parents() -> impl Strategy<Value = Vec<Option<u32>>> {
    vec(any::<Option<u32>>(), 1..40).prop_map(|raw| {
        let place = |(index, parent): (usize, Option<u32>)| match index {
            0 => None,
            _ => parent.map(|parent| parent % index as u32),
        };
        raw.into_iter().enumerate().map(place).collect()
    })
}

fn numbers() -> impl Strategy<Value = (u32, u32, f64, f64, [f64; 3], [f64; 3], u64, u32)> {
    (
        any::<u32>(),
        any::<u32>(),
        0.0..1e12f64,
        0.0..1e6f64,
        [-1e7..1e7f64, -1e7..1e7f64, -1e7..1e7f64],
        [0.0..1e4f64, 0.0..1e4f64, 0.0..1e4f64],
        any::<u64>(),
        any::<u32>(),
    )
}

prop_compose! {
    fn scene()(parents in parents())(
        numbers in vec((numbers(), origin()), parents.len()),
        parents in Just(parents),
        up in up(),
        fingerprint in any::<[u8; 32]>(),
        names in vec(".{0,12}", 1..4),
        parameter in any::<f64>().prop_filter("JSON has no others", |v| v.is_finite()),
    ) -> Scene {
        let mut nodes: Vec<Node> = Vec::new();
        for (index, ((numbers, origin), parent)) in numbers.into_iter().zip(parents).enumerate() {
            let (triangles, textured, cost, error, min, size, big, crc) = numbers;
            let above = parent.map(|parent| &nodes[parent as usize]);
            let block = above.map_or(Some(crc % names.len() as u32), |above| above.block);
            nodes.push(Node {
                id: NodeId((index as u64) << 32 | u64::from(crc)),
                parent,
                first_child: None,
                next_sibling: None,
                level: above.map_or(0, |above| above.level + 1),
                block,
                triangles: triangles.max(textured),
                textured_triangles: textured,
                vertices: triangles.max(textured),
                bbox_min: min,
                bbox_max: std::array::from_fn(|axis| min[axis] + size[axis]),
                cost,
                static_benefit: error * 3.0,
                average_normal: [[0.0; 3], [0.0, 0.6, -0.8], [1.0, 0.0, 0.0]][index % 3],
                geometric_error: above.map_or(error, |above| above.geometric_error.min(error)),
                mean_error: 0.0,
                p95_error: 0.0,
                texels: 6 * (big & 0xFFFF),
                pictures: vec![[2, (big & 0xFFFF) as u32], [(big & 0xFFFF) as u32, 4]],
                shared_texels: big >> 1,
                origin,
                file: format!("n{index}.glb"),
                file_bytes: big >> 2,
                file_crc: crc,
                shared_textures: vec![0; index % 3],
            });
            // New children come first, so that lists run against the order of the nodes.
            if let Some(parent) = parent {
                nodes[index].next_sibling = nodes[parent as usize].first_child;
                nodes[parent as usize].first_child = Some(index as u32);
            }
        }
        Scene {
            parameters: serde_json::json!({ "value": parameter, "names": names }),
            fingerprint,
            up,
            blocks: names
                .into_iter()
                .map(|name| BlockInfo { input: name.clone(), name, origin: [0.1, -0.0, parameter] })
                .collect(),
            shared_textures: vec![SharedTexture {
                file_name: "tile.jpg".into(),
                width: 1,
                height: u32::MAX,
                bytes: u64::MAX,
            }],
            nodes,
        }
    }
}

fn surface(images: usize) -> impl Strategy<Value = Surface> {
    let wrap = prop_oneof![Just(Wrap::Repeat), Just(Wrap::Mirror), Just(Wrap::Clamp)];
    let alpha = prop_oneof![
        Just(AlphaMode::Opaque),
        Just(AlphaMode::Blend),
        (0.0..=1.0f32).prop_map(|cutoff| AlphaMode::Mask { cutoff }),
    ];
    let image =
        if images == 0 { Just(None).boxed() } else { proptest::option::of(0..images).boxed() };
    let color = [0.0..=1.0f32, 0.0..=1.0f32, 0.0..=1.0f32, 0.0..=1.0f32];
    (color, image, [wrap.clone(), wrap], alpha, any::<[bool; 2]>()).prop_map(
        |(base_color, image, wrap, alpha, [double_sided, is_unlit])| Surface {
            base_color,
            image,
            // Without a picture there is nothing to wrap, and nothing is kept.
            wrap: if image.is_some() { wrap } else { [Wrap::Repeat; 2] },
            alpha,
            double_sided,
            // Those with a picture always are.
            is_unlit: is_unlit && image.is_none(),
        },
    )
}

fn finite() -> impl Strategy<Value = f32> {
    any::<f32>().prop_filter("coordinates are finite", |v| v.is_finite())
}

prop_compose! {
    fn primitive(images: usize)(surface in surface(images), vertices in 1usize..20)(
        positions in vec([finite(), finite(), finite()], vertices),
        texcoords in vec([finite(), finite()], if surface.image.is_some() { vertices } else { 0 }),
        colors in prop_oneof![vec(any::<[u16; 4]>(), vertices), Just(vec![])],
        indices in vec(any::<[prop::sample::Index; 3]>(), 1..30),
        directions in vec([-1.0..1.0f64, -1.0..1.0, 0.5..1.0], 90),
        surface in Just(surface),
    ) -> Primitive {
        // Files of textured primitives have no normals, and those of others no equal vertices in a row.
        let is_lit = surface.image.is_none() && positions.windows(2).all(|pair| pair[0] != pair[1]);
        let corners = if is_lit { 3 * indices.len() } else { 0 };
        let normals = directions.iter().map(|&direction| Normal::along(direction.into()));
        let indices = indices.as_flattened().iter().map(|i| i.index(positions.len()) as u32);
        Primitive {
            indices: indices.collect(),
            normals: normals.take(corners).collect(),
            skirt_triangles: 0,
            positions,
            texcoords,
            colors,
            surface,
        }
    }
}

fn image() -> impl Strategy<Value = NodeImage> {
    let file_name = || "[a-z0-9_-][a-z0-9._-]{0,20}".prop_map(Arc::<str>::from);
    let mime = prop_oneof![Just("image/jpeg"), Just("image/png")];
    let embedded = (mime, vec(any::<u8>(), 1..50), prop::option::of(file_name()))
        .prop_map(|(mime, bytes, file_name)| NodeImageData::Embedded { mime, bytes, file_name });
    let shared = file_name().prop_map(|file_name| NodeImageData::Shared { file_name });
    (any::<u32>(), any::<u32>(), prop_oneof![embedded, shared])
        .prop_map(|(width, height, data)| NodeImage { width, height, data })
}

fn mesh() -> impl Strategy<Value = NodeMesh> {
    (origin(), vec(image(), 0..3)).prop_flat_map(|(origin, images)| {
        vec(primitive(images.len()), 0..5).prop_map(move |primitives| NodeMesh {
            origin,
            images: images.clone(),
            primitives,
        })
    })
}

fn label() -> impl Strategy<Value = NodeLabel> {
    (any::<u64>(), any::<u32>()).prop_map(|(id, level)| NodeLabel { id: NodeId(id), level })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

    #[test]
    fn scenes_read_back_as_they_were(scene in scene()) {
        prop_assert_eq!(scene.check(), []);
        let bytes = scene.to_bytes().unwrap();
        let back = Scene::from_bytes(&bytes, Path::new("s")).unwrap();
        prop_assert_eq!(back.to_bytes().unwrap(), bytes);
        prop_assert_eq!(&back, &scene);
        // Every node is a root or one node's child.
        let children: usize = (0..).zip(&scene.nodes).map(|(n, _)| scene.children(n).count()).sum();
        prop_assert_eq!(children + scene.roots().count(), scene.nodes.len());
    }

    #[test]
    fn every_scene_can_be_shown(scene in scene()) {
        let value = inspect::json(&scene);
        prop_assert_eq!(value["nodes"].as_array().unwrap().len(), scene.nodes.len());
        prop_assert!(inspect::text(&scene, 3).lines().count() < 60 + 3 * 70);
    }

    #[test]
    fn damaged_scenes_give_errors(
        scene in scene(),
        damage in vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = scene.to_bytes().unwrap();
        let whole = bytes.clone();
        for (at, value) in damage {
            bytes[at.index(whole.len())] = value;
        }
        match Scene::from_bytes(&bytes, Path::new("s")) {
            Ok(back) => prop_assert_eq!((bytes, back), (whole, scene)),
            Err(error) => prop_assert_eq!(error.exit_code(), 3),
        }
    }

    #[test]
    fn meshes_read_back_as_they_were(mesh in mesh(), up in up(), label in label()) {
        let bytes = write_glb(&mesh, up, label).unwrap();
        let back = read_glb(&bytes, Path::new("n")).unwrap();
        prop_assert_eq!(&back, &mesh);
        prop_assert_eq!(write_glb(&back, up, label).unwrap(), bytes);
    }

    #[test]
    fn other_readers_accept_every_mesh(mesh in mesh(), up in up(), label in label()) {
        let bytes = write_glb(&mesh, up, label).unwrap();
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let triangles: usize = document
            .meshes()
            .flat_map(|mesh| mesh.primitives().map(|p| p.indices().unwrap().count() / 3).collect::<Vec<_>>())
            .sum();
        let ours: usize = mesh.primitives.iter().map(|p| p.indices.len() / 3).sum();
        prop_assert_eq!(triangles, ours);
    }

    #[test]
    fn arbitrary_bytes_are_refused(mut bytes in vec(any::<u8>(), 0..200)) {
        prop_assert!(read_glb(&bytes, Path::new("n")).is_err());
        prop_assert!(Scene::from_bytes(&bytes, Path::new("s")).is_err());
        bytes.splice(0..0, *b"glTF\x02\0\0\0");
        prop_assert!(read_glb(&bytes, Path::new("n")).is_err());
        bytes.splice(0..8, *b"HLODSCN\x1a\x01\0\0\0");
        prop_assert!(Scene::from_bytes(&bytes, Path::new("s")).is_err());
    }
}
