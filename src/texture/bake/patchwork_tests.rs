//! Tests that baked textures show materials that repeat, plain ones and lit ones.

use std::path::PathBuf;

use glam::DVec3;

use super::tests::{greatest, sheet};
use crate::color::srgb_to_linear;
use crate::format::NodeMesh;
use crate::mesh::{Group, Material, Mesh, Model, Part, TextureData, TextureSource, Wrap};
use crate::texture::{
    AppendedSkirts, BakeReason, BlockTextures, DecodedImages, SharedTextures, TextureCache,
    TextureOptions, TexturePlan,
};

/// A flat sheet of `side` by `side` squares over the unit square, whose material is `of` the middle of each square;
/// texture coordinates are the position times `periods`.
fn patchwork(side: u32, periods: f32, of: impl Fn(DVec3) -> u32) -> Mesh {
    let whole = sheet(side, |u, v| DVec3::new(u, v, 0.0));
    let mut mesh = Mesh::default();
    for triangles in whole.triangles.chunks(2) {
        let [a, _, c] = whole.corners(triangles[0]);
        let material = of((a + c) * 0.5);
        for &triangle in triangles {
            let corners = triangle.map(|vertex| {
                let own = mesh.push_vertex_from(&whole, vertex as usize);
                let [x, y, _] = mesh.positions[own as usize];
                mesh.texcoords[own as usize] = [x * periods, y * periods];
                mesh.materials[own as usize] = material;
                own
            });
            mesh.triangles.push(corners);
        }
    }
    mesh
}

/// A model of these materials, with textures of 16 texels a side that have these colours at (u, v).
fn model_of(
    mesh: &Mesh,
    materials: Vec<Material>,
    textures: &[&dyn Fn(f64, f64) -> [u8; 3]],
) -> Model {
    let texture = |(number, color): (usize, &&dyn Fn(f64, f64) -> [u8; 3])| {
        let at = |step: u32| (f64::from(step) + 0.5) / 16.0;
        let image = image::RgbImage::from_fn(16, 16, |x, y| image::Rgb(color(at(x), at(y))));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).expect("encodes");
        TextureSource {
            name: format!("{number}.png"),
            data: TextureData::Embedded(bytes.into_inner().into()),
            opacity: None,
        }
    };
    let part = |material: u32| Part {
        group: 0,
        material,
        positions: mesh.positions.iter().map(|p| p.map(f64::from)).collect(),
        texcoords: mesh.texcoords.clone(),
        indices: mesh
            .triangles
            .iter()
            .filter(|triangle| mesh.triangle_material(**triangle) == material)
            .flatten()
            .copied()
            .collect(),
        ..Part::default()
    };
    Model {
        source: PathBuf::from("patchwork.obj"),
        dependencies: Vec::new(),
        groups: vec![Group { name: "all".into() }],
        parts: (0..materials.len() as u32).map(part).collect(),
        materials,
        textures: textures.iter().enumerate().map(texture).collect(),
        up: None,
        warnings: Default::default(),
    }
}

fn textured(texture: u32) -> Material {
    Material {
        texture: Some(texture),
        base_color: [1.0; 4],
        ..Material::plain(format!("image {texture}"))
    }
}

/// Calls `with` for the block of a model.
fn with_block<R>(model: &Model, mesh: &Mesh, with: impl FnOnce(&BlockTextures) -> R) -> R {
    let plan = TexturePlan::new(model);
    let shared = SharedTextures::new();
    let images = DecodedImages::default();
    let announced = images.announce(model, &plan, 0..model.materials.len() as u32);
    let cache = TextureCache::new(model, &plan, &announced);
    let options = TextureOptions { jpeg_quality: 100, ..Default::default() };
    with(&BlockTextures::prepare(&cache, &shared, mesh, &[16.0, 4.0, 1.0], options))
}

fn baked(model: &Model, mesh: &Mesh, coarse: &Mesh, level: usize) -> NodeMesh {
    with_block(model, mesh, |block| {
        let baked = block.bake(coarse, level).expect("bakes");
        block
            .baked_node_mesh(&baked, &AppendedSkirts::default(), level, [0.0; 3])
            .expect("builds")
            .mesh
    })
}

#[test]
fn a_texture_that_repeats_is_shown_as_often() {
    // Level at the sides where it is mirrored, since a bend there is finer than a texel.
    for (wrap, phase) in [(Wrap::Repeat, 0.0), (Wrap::Mirror, 0.25)] {
        let wave = |u: f64, v: f64| {
            let [u, v] = [u, v].map(|turn| libm::sin((turn + phase) * std::f64::consts::TAU));
            [u, v, u * v].map(|wave| (128.0 + 90.0 * wave) as u8)
        };
        let mesh = patchwork(12, 3.0, |_| 0);
        let model = model_of(&mesh, vec![Material { wrap: [wrap; 2], ..textured(0) }], &[&wave]);
        let node = baked(&model, &mesh, &sheet(1, |u, v| DVec3::new(u, v, 0.0)), 2);
        assert!(node.images[0].repeating().is_none(), "it has a texture of its own");
        let [whole, _] = greatest(&node, |point| {
            let at = [point.x, point.y].map(|at| match wrap {
                Wrap::Mirror if (at * 3.0) as u32 % 2 == 1 => 1.0 - (at * 3.0).fract(),
                _ => (at * 3.0).fract(),
            });
            Some(wave(at[0], at[1]))
        });
        assert!(whole < 16.0, "{wrap:?}: {whole}");
    }
}

#[test]
fn what_is_plain_is_shown_beside_what_is_textured_and_colours_are_multiplied() {
    let mesh = patchwork(8, 4.0, |point| u32::from(point.x > 0.5));
    let half = srgb_to_linear(128.0 / 255.0) as f32;
    let [base_color, tint] = [[half, 0.0, 0.0, 1.0], [1.0, half, 1.0, 1.0]];
    let red = Material { base_color, is_unlit: true, ..Material::plain("red") };
    let tinted = Material { base_color: tint, ..textured(0) };
    let model = model_of(&mesh, vec![tinted, red], &[&|_, _| [200, 255, 40]]);
    // One square over both.
    let node = baked(&model, &mesh, &sheet(1, |u, v| DVec3::new(u, v, 0.0)), 1);
    let [whole, _] = greatest(&node, |point| match point.x {
        x if x < 0.4 => Some([200, 128, 40]),
        x if x > 0.6 => Some([128, 0, 0]),
        _ => None,
    });
    assert!(whole < 6.0, "{whole}");
}

#[test]
fn triangles_that_stand_for_what_is_lit_have_its_colour_and_no_texture() {
    let mut mesh = patchwork(8, 1.0, |point| u32::from(point.x > 0.5));
    let (red, blue) = ([u16::MAX, 0, 0, u16::MAX], [0, 0, u16::MAX, u16::MAX]);
    mesh.colors = mesh
        .positions
        .iter()
        .zip(&mesh.materials)
        .map(|(at, material)| match material {
            0 => [u16::MAX; 4],
            _ if at[1] > 0.75 => blue,
            _ => red,
        })
        .collect();
    let white = Material { base_color: [1.0; 4], ..Material::plain("lit") };
    let model = model_of(&mesh, vec![textured(0), white], &[&|_, _| [10, 200, 30]]);
    let mut coarse = sheet(2, |u, v| DVec3::new(u, v, 0.0));
    coarse.colors = vec![[u16::MAX; 4]; coarse.positions.len()];
    let node = baked(&model, &mesh, &coarse, 1);
    let of = |is_textured: bool| {
        let own = node.primitives.iter().filter(|own| own.surface.image.is_some() == is_textured);
        own.collect::<Vec<_>>()
    };
    let (images, plain) = (of(true), of(false));
    assert_eq!((images.len(), plain.len()), (1, 1), "one draw for each");
    assert!(images[0].positions.iter().all(|at| at[0] <= 0.5), "{:?}", images[0].positions);
    assert!(plain[0].positions.iter().all(|at| at[0] >= 0.5), "{:?}", plain[0].positions);
    assert!(images[0].colors.is_empty() && images[0].surface.base_color == [1.0; 4]);
    assert_eq!(plain[0].indices.len(), 12);
    for corners in plain[0].indices.chunks(3) {
        let colors: Vec<_> =
            corners.iter().map(|&corner| plain[0].colors[corner as usize]).collect();
        assert!(
            colors.iter().all(|&color| color == red),
            "most of each triangle is red: {colors:?}"
        );
    }
}

#[test]
fn a_node_is_wrong_where_it_has_another_material_than_the_source() {
    let mesh = patchwork(16, 4.0, |point| u32::from(point.x > 0.75));
    let model =
        model_of(&mesh, vec![textured(0), textured(1)], &[&|_, _| [20, 120, 20], &|_, _| [90; 3]]);
    let right = patchwork(4, 4.0, |point| u32::from(point.x > 0.75));
    let green = patchwork(4, 4.0, |_| 0);
    let [right, wrong] = with_block(&model, &mesh, |block| {
        [&right, &green].map(|coarse| block.wrong_colors(coarse))
    });
    assert_eq!(right, 0.0);
    assert!((wrong - 0.25).abs() < 0.02, "{wrong}");
    with_block(&model, &mesh, |block| {
        let plan = block.bake_plan().expect("may be baked");
        assert_eq!(plan.reason(&green, true), Some(BakeReason::Colors));
        assert_eq!(plan.reason(&mesh, true), None);
    });
}
