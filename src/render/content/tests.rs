use std::sync::Arc;

use super::*;
use crate::format::{NodeId, NodeImage, NodeLabel, Primitive, Surface, write_glb};
use crate::mesh::{AlphaMode, UpAxis, Wrap};

const FILE: &str = "nodes/7.glb";

fn surface(image: Option<usize>) -> Surface {
    Surface {
        base_color: [1.0; 4],
        image,
        wrap: [Wrap::Repeat; 2],
        alpha: AlphaMode::Opaque,
        double_sided: true,
        is_unlit: false,
    }
}

/// A square of one unit; its lower left corner is at (x, 0, 0).
fn square(x: f32, surface: Surface) -> Primitive {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    Primitive {
        positions: corners.map(|[u, v]| [x + u, v, 0.0]).to_vec(),
        texcoords: if surface.image.is_some() { corners.to_vec() } else { Vec::new() },
        colors: Vec::new(),
        indices: vec![0, 1, 2, 0, 2, 3],
        normals: Vec::new(),
        skirt_triangles: 0,
        surface,
    }
}

fn encoded(image: &image::DynamicImage, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn photograph(width: u32, height: u32) -> image::DynamicImage {
    image::RgbImage::from_fn(width, height, |x, y| {
        image::Rgb([(x * 7) as u8, (y * 11) as u8, (x ^ y) as u8])
    })
    .into()
}

fn jpeg(width: u32, height: u32) -> NodeImage {
    let bytes = encoded(&photograph(width, height), image::ImageFormat::Jpeg);
    NodeImage {
        width,
        height,
        data: NodeImageData::Embedded { mime: "image/jpeg", bytes, file_name: None },
    }
}

fn mesh() -> NodeMesh {
    let plain = surface(None);
    let shared = NodeImageData::Shared { file_name: Arc::from("brick.jpg") };
    NodeMesh {
        origin: [1e6, 5e6, 0.5],
        images: vec![jpeg(37, 20), NodeImage { width: 64, height: 64, data: shared }, jpeg(8, 8)],
        primitives: vec![
            square(0.0, Surface { base_color: [0.5, 0.0, 1.0, 1.0], ..plain.clone() }),
            square(1.0, surface(Some(2))),
            square(2.0, Surface { base_color: [0.0, 1.0, 0.0, 1.0], ..plain }),
            square(3.0, surface(Some(1))),
            square(4.0, surface(Some(2))),
            square(5.0, Surface { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..surface(Some(0)) }),
        ],
    }
}

fn shared(name: &str) -> Option<u32> {
    (name == "brick.jpg").then_some(9)
}

fn content(mesh: &NodeMesh) -> Content {
    Content::from_mesh(Path::new(FILE), mesh, shared).unwrap()
}

#[test]
fn what_is_held_is_what_was_foretold() {
    let mut mesh = mesh();
    let vertices = |mesh: &NodeMesh| mesh.primitives.iter().map(|p| p.positions.len()).sum();
    let held = |mesh: &NodeMesh| {
        let corners: usize = mesh.primitives.iter().map(|p| p.indices.len()).sum();
        let vertices: usize = vertices(mesh);
        let own = mesh.images.iter();
        let own = own.filter(|image| matches!(image.data, NodeImageData::Embedded { .. }));
        let own: Vec<_> = own.map(|image| [image.width, image.height]).collect();
        let held = |format| held_bytes(vertices as u32, corners as u32 / 3, &own, format);
        // Of the pictures one has sides that are no multiples of four.
        let compressed = content(mesh).stored_as(TextureFormat::Bc7);
        assert_eq!(compressed.bytes(), held(TextureFormat::Bc7));
        held(TextureFormat::Rgba8)
    };
    assert_eq!(content(&mesh).bytes(), held(&mesh));
    mesh.primitives.pop();
    assert_eq!(content(&mesh).bytes(), held(&mesh));
    // Two vertices are too many for short indices.
    mesh.primitives[0].positions.resize(65_538 - 16, [0.0; 3]);
    mesh.primitives[3].indices.truncate(3);
    assert_eq!(vertices(&mesh), 65_538);
    assert!(matches!(content(&mesh).indices, Indices::Long(_)));
    assert_eq!(content(&mesh).bytes(), held(&mesh));
    mesh.primitives.clear();
    mesh.images.clear();
    assert_eq!(content(&mesh).bytes(), 0);
}

#[test]
fn what_looks_alike_is_one_draw_and_colours_are_in_the_vertices() {
    let content = content(&mesh());
    let looks: Vec<_> =
        content.draws.iter().map(|draw| (draw.picture, draw.indices.clone())).collect();
    assert_eq!(
        looks,
        [
            (DrawPicture::None, 0..12),
            (DrawPicture::Own(1), 12..24),
            (DrawPicture::Shared(9), 24..30),
            (DrawPicture::Own(0), 30..36),
        ]
    );
    assert_eq!(content.draws[3].alpha, Alpha::Mask { cutoff: 0.5 });
    assert_eq!(content.vertices[0].color, [188, 0, 255, 255]);
    assert_eq!(content.vertices[4].color, [255; 4]);
    // The corners of each draw are those of its primitives.
    let Indices::Short(indices) = &content.indices else { panic!("long indices") };
    let x = |corner: usize| content.vertices[usize::from(indices[corner])].position[0];
    for (triangle, left) in [(0, 0.0), (2, 2.0), (4, 1.0), (6, 4.0), (8, 3.0), (10, 5.0)] {
        assert_eq!(x(triangle * 3), left, "triangle {triangle}");
    }
    assert_eq!(content.triangles(), 12);
}

#[test]
fn files_are_decoded_as_their_meshes_are() {
    let mesh = mesh();
    let glb = write_glb(&mesh, UpAxis::Z, NodeLabel { id: NodeId(1), level: 0 }).unwrap();
    let decoded = Content::decode(Path::new(FILE), &glb, shared).unwrap();
    assert_eq!(decoded, content(&mesh));
    for length in (0..glb.len()).step_by(97) {
        assert!(Content::decode(Path::new(FILE), &glb[..length], shared).is_err());
    }
}

#[test]
fn colours_of_pictures_are_those_of_their_files() {
    let image = photograph(16, 16);
    for (format, tolerance) in [(image::ImageFormat::Png, 0), (image::ImageFormat::Jpeg, 40)] {
        let bytes = encoded(&image, format);
        let picture = Picture::decode(Path::new(FILE), &bytes, [16, 16]).unwrap();
        let (size, texels) = picture.levels().next().unwrap();
        assert_eq!(size, [16, 16]);
        let expected = image.to_rgba8();
        let far = texels.iter().zip(expected.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(far.unwrap() <= tolerance, "{format:?}: {far:?}");
    }
}

#[test]
fn grey_and_deep_pictures_are_drawn_too() {
    let grey: image::DynamicImage = image::GrayImage::from_pixel(3, 5, image::Luma([77])).into();
    let deep: image::DynamicImage =
        image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(3, 5, image::Luma([0x4d4d])).into();
    for bytes in [
        encoded(&grey, image::ImageFormat::Jpeg),
        encoded(&grey, image::ImageFormat::Png),
        encoded(&deep, image::ImageFormat::Png),
    ] {
        let picture = Picture::decode(Path::new(FILE), &bytes, [3, 5]).unwrap();
        for (_, level) in picture.levels() {
            assert!(level.as_chunks().0.iter().all(|texel| *texel == [77, 77, 77, 255]));
        }
    }
}

#[test]
fn pictures_that_are_cut_short_or_damaged_are_refused_by_name() {
    let refused = |bytes: &[u8], size| {
        let error = Picture::decode(Path::new(FILE), bytes, size).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let text = error.to_string();
        assert!(text.contains(FILE), "{text}");
        text
    };
    for format in [image::ImageFormat::Jpeg, image::ImageFormat::Png] {
        let bytes = encoded(&photograph(40, 30), format);
        for length in 0..bytes.len() - 16 {
            refused(&bytes[..length], [40, 30]);
        }
        let text = refused(&bytes, [40, 31]);
        assert!(text.contains("40 x 31") || text.contains("imit"), "{text}");
        refused(&bytes, [0, 30]);
        refused(&bytes, [40, 40_000]);
        // Any single byte may be wrong: an error or a picture, but no panic.
        for at in 0..bytes.len() {
            let mut bytes = bytes.clone();
            bytes[at] ^= 0x55;
            let _ = Picture::decode(Path::new(FILE), &bytes, [40, 30]);
        }
    }
    refused(b"neither", [1, 1]);
}

#[test]
fn compressed_pictures_have_the_levels_of_others_in_whole_blocks() {
    let rgba = photograph(12, 20).to_rgba8();
    let picture = Picture::new(12, 20, rgba.into_raw()).unwrap();
    let compressed = picture.clone().stored_as(TextureFormat::Bc7);
    assert_eq!(compressed.format(), TextureFormat::Bc7);
    let sizes = |picture: &Picture| picture.levels().map(|(size, _)| size).collect::<Vec<_>>();
    assert_eq!(sizes(&compressed), sizes(&picture));
    let blocks: Vec<usize> = compressed.levels().map(|(_, level)| level.len() / 16).collect();
    assert_eq!(blocks, [15, 6, 2, 1, 1]);
    // Again changes nothing, and neither does what cannot be compressed.
    assert_eq!(compressed.clone().stored_as(TextureFormat::Bc7), compressed);
    assert_eq!(compressed.clone().stored_as(TextureFormat::Rgba8), compressed);
    let odd = Picture::new(6, 4, vec![9; 96]).unwrap();
    assert_eq!(odd.clone().stored_as(TextureFormat::Bc7), odd);
}

#[test]
fn a_picture_that_the_scene_lacks_is_named() {
    let error = Content::from_mesh(Path::new(FILE), &mesh(), |_| None).unwrap_err().to_string();
    assert!(error.contains(FILE) && error.contains("brick.jpg"), "{error}");
}

#[test]
fn unlit_surfaces_are_draws_of_their_own() {
    let unlit = Surface { is_unlit: true, ..surface(None) };
    let mesh = NodeMesh {
        primitives: vec![
            square(0.0, surface(None)),
            square(1.0, unlit.clone()),
            square(2.0, surface(None)),
            square(3.0, unlit),
        ],
        images: Vec::new(),
        ..mesh()
    };
    let (_, _, draws) = draw::assemble(&mesh.primitives, &[]).unwrap();
    let found: Vec<_> = draws.iter().map(|draw| (draw.is_unlit, draw.indices.len())).collect();
    assert_eq!(found, [(false, 12), (true, 12)]);
}
