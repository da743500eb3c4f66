//! The module as a whole: what is drawn from a node is what the source has there.

use std::io::Cursor;
use std::path::PathBuf;

use super::atlas::{Atlas, AtlasImage, AtlasInput, Page};
use super::level::{LevelImage, pyramid};
use super::region::Region;
use super::*;
use crate::decode::DecodedTexture;
use crate::format::{NodeImageData, NodeMesh, Surface};
use crate::mesh::{
    AlphaMode, Group, Material, Mesh, Model, Part, TextureData, TextureSource, Wrap,
};
use crate::random::Random;

/// An image in which every texel differs from all others.
fn numbered(width: u32, height: u32) -> DecodedTexture {
    let pixels =
        (0..width * height).flat_map(|i| [(i % 251) as u8, (i / 251) as u8, (i >> 16) as u8]);
    DecodedTexture { width, height, channels: 3, pixels: pixels.collect() }
}

fn png(image: &DecodedTexture) -> TextureData {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    let color = if image.channels == 4 {
        image::ExtendedColorType::Rgba8
    } else {
        image::ExtendedColorType::Rgb8
    };
    image::codecs::png::PngEncoder::new(Cursor::new(&mut bytes))
        .write_image(&image.pixels, image.width, image.height, color)
        .expect("encodes");
    TextureData::Embedded(bytes.into())
}

/// Bilinear sampling at a position in texels, the edge going on for ever.
fn sample(texel: impl Fn(usize, usize) -> [f64; 3], size: [usize; 2], at: [f64; 2]) -> [f64; 3] {
    let mut result = [0.0; 3];
    let start = at.map(|value| (value - 0.5).floor());
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let weight = |axis: usize, step: f64| 1.0 - (at[axis] - 0.5 - start[axis] - step).abs();
        let index =
            |axis: usize, step: f64| (start[axis] + step).clamp(0.0, size[axis] as f64 - 1.0);
        let color = texel(index(0, x) as usize, index(1, y) as usize);
        for channel in 0..3 {
            result[channel] += color[channel] * weight(0, x) * weight(1, y);
        }
    }
    result
}

/// Bilinear sampling of a page, over its sides where these meet.
fn sample_page(page: &Page, wraps: bool, at: [f64; 2]) -> [f64; 3] {
    if !wraps {
        return sample(of_page(page), page.size, at);
    }
    let texel = |x: usize, y: usize| of_page(page)(x % page.size[0], y % page.size[1]);
    let size = page.size.map(|side| side * 1000);
    // Far from the origin, so that repetition needs no negative numbers.
    sample(texel, size, [0, 1].map(|axis| at[axis] + 100.0 * page.size[axis] as f64))
}

fn of_page(page: &Page) -> impl Fn(usize, usize) -> [f64; 3] + '_ {
    |x, y| {
        let texel = &page.pixels[(y * page.size[0] + x) * 3..];
        [0, 1, 2].map(|channel| f64::from(texel[channel]))
    }
}

fn of_level(level: &LevelImage) -> impl Fn(usize, usize) -> [f64; 3] + '_ {
    |x, y| {
        let texel = level.texels(y, x, 1);
        [0, 1, 2].map(|channel| f64::from(texel[channel]))
    }
}

/// Charts of several triangles scattered over an image: corners, and the chart of each triangle.
fn scattered(random: &mut Random, side: f64) -> (Vec<[[f64; 2]; 3]>, Vec<u32>) {
    let mut corners = Vec::new();
    let mut charts = Vec::new();
    for chart in 0..4 + (random.unit() * 12.0) as u32 {
        let mut point = [random.unit() * side, random.unit() * side];
        let mut next = || {
            point =
                point.map(|value| (value + (random.unit() - 0.4) * side * 0.2).clamp(0.0, side));
            point
        };
        let mut strip = [next(), next(), next()];
        for _ in 0..6 {
            corners.push(strip);
            charts.push(chart);
            strip = [strip[1], strip[2], next()];
        }
    }
    (corners, charts)
}

fn whole(image: DecodedTexture) -> LevelImage {
    let region = Region {
        origin: [0; 2],
        size: [image.width as usize, image.height as usize],
        covered: None,
    };
    pyramid(std::sync::Arc::new(image), &region, 1.0).remove(0)
}

fn inside([a, b, c]: [[f64; 2]; 3], random: &mut Random) -> [f64; 2] {
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * u + (c[axis] - a[axis]) * v)
}

fn place(atlas: &Atlas, triangle: usize, at: [f64; 2]) -> (usize, [f64; 2]) {
    let placement = atlas.placements[atlas.patches[0][triangle] as usize];
    (placement.page, placement.texel(at))
}

#[test]
fn sampling_the_atlas_equals_sampling_the_source() {
    let mut random = Random::new(7, 0);
    let level = whole(numbered(256, 256));
    for (round, cell) in [2, 4, 8, 2, 4, 8, 2, 2].into_iter().enumerate() {
        let (corners, charts) = scattered(&mut random, 256.0);
        let image = AtlasImage { image: &level, corners: corners.clone(), charts };
        // Every other round is forced onto several pages.
        let max_side = if round % 2 == 0 { 4096 } else { 160 };
        let sheet = AtlasInput { images: vec![image], cell, max_side };
        let Some(atlas) = sheet.build(usize::MAX) else { continue };
        for (triangle, corners) in corners.iter().enumerate() {
            for _ in 0..40 {
                let at = inside(*corners, &mut random);
                let (page, moved) = place(&atlas, triangle, at);
                let page = &atlas.pages[page];
                assert!(page.size.iter().all(|side| side % 4 == 0 && *side <= max_side));
                let expected = sample(of_level(&level), level.size, at);
                let found = sample_page(page, atlas.wraps, moved);
                // Only the position's rounding differs.
                let error = (0..3).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-9, "{found:?}, not {expected:?} at {at:?}");
            }
        }
    }
}

#[test]
fn mips_that_the_cell_promises_show_no_neighbour() {
    // Left of the middle red is used, right of it blue; each chart's surroundings carry on.
    let mut random = Random::new(3, 0);
    let size = 256usize;
    let red = |x: usize| if x < size / 2 { [255, 0, 0] } else { [0, 0, 255] };
    let pixels = (0..size * size).flat_map(|i| red(i % size)).collect();
    let level = whole(DecodedTexture { width: 256, height: 256, channels: 3, pixels });
    for (cell, mips) in [(2, 1), (4, 2), (8, 3)] {
        let (mut corners, mut charts) = scattered(&mut random, 100.0);
        let (right, more) = scattered(&mut random, 100.0);
        corners.extend(right.iter().map(|t| t.map(|at| [at[0] + 156.0, at[1]])));
        charts.extend(more.iter().map(|chart| chart + 100));
        let image = AtlasImage { image: &level, corners: corners.clone(), charts };
        let atlas =
            AtlasInput { images: vec![image], cell, max_side: 4096 }.build(1).expect("fits");
        let mut page = atlas.pages[0].clone();
        for mip in 0..=mips {
            let scale = 1.0 / f64::from(1 << mip);
            for (triangle, corners) in corners.iter().enumerate() {
                for _ in 0..20 {
                    let at = inside(*corners, &mut random);
                    let expected =
                        if at[0] < 128.0 { [255.0, 0.0, 0.0] } else { [0.0, 0.0, 255.0] };
                    let (_, moved) = place(&atlas, triangle, at);
                    let moved = moved.map(|value| value * scale);
                    let found = sample_page(&page, atlas.wraps, moved);
                    let error = (0..3).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f64::max);
                    assert!(error < 1e-6, "cell {cell}, mip {mip}: {found:?} at {at:?}");
                }
            }
            page = halved(&page);
        }
    }
}

/// The next mip level, as graphics cards make it: sides rounded down.
fn halved(page: &Page) -> Page {
    let size = page.size.map(|side| (side / 2).max(1));
    let mut pixels = Vec::new();
    for y in 0..size[1] {
        for x in 0..size[0] {
            for channel in 0..3 {
                let at = |dx: usize, dy: usize| {
                    let (x, y) =
                        ((2 * x + dx).min(page.size[0] - 1), (2 * y + dy).min(page.size[1] - 1));
                    u32::from(page.pixels[(y * page.size[0] + x) * 3 + channel])
                };
                pixels.push(((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4) as u8);
            }
        }
    }
    Page { size, pixels }
}

/// A mesh of separate triangles and the model around it.
struct Scene {
    model: Model,
    mesh: Mesh,
}

fn scene(
    images: &[DecodedTexture],
    materials: &[(Option<u32>, Wrap)],
    triangles: &[(u32, [[f32; 2]; 3])],
) -> Scene {
    let mut mesh = Mesh::default();
    for (material, uvs) in triangles {
        let first = mesh.positions.len() as u32;
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.materials.extend([*material; 3]);
        mesh.texcoords.extend(uvs);
        mesh.positions.extend([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    }
    let materials: Vec<Material> = materials
        .iter()
        .enumerate()
        .map(|(index, (texture, wrap))| {
            let mut material = Material::plain(format!("m{index}"));
            material.base_color = [1.0; 4];
            material.texture = *texture;
            material.wrap = [*wrap; 2];
            material
        })
        .collect();
    let parts = (0..materials.len() as u32)
        .map(|material| {
            let own: Vec<[u32; 3]> = mesh
                .triangles
                .iter()
                .copied()
                .filter(|t| mesh.materials[t[0] as usize] == material)
                .collect();
            Part {
                group: 0,
                material,
                positions: vec![[0.0; 3]; mesh.positions.len()],
                texcoords: mesh.texcoords.clone(),
                indices: own.concat(),
                ..Part::default()
            }
        })
        .collect();
    let textures = images
        .iter()
        .enumerate()
        .map(|(index, image)| TextureSource {
            name: format!("Texture {index}.png"),
            data: png(image),
            opacity: None,
        })
        .collect();
    let model = Model {
        source: PathBuf::from("scene.obj"),
        dependencies: Vec::new(),
        groups: vec![Group { name: "all".into() }],
        parts,
        materials,
        textures,
        up: None,
        warnings: Default::default(),
    };
    Scene { model, mesh }
}

/// The nodes of a scene at all levels, and the files that they share.
fn nodes(
    scene: &Scene,
    factors: &[f64],
    options: TextureOptions,
) -> (Vec<TexturedNode>, Vec<SharedFile>) {
    let plan = TexturePlan::new(&scene.model);
    let shared = SharedTextures::new();
    let materials = 0..scene.model.materials.len() as u32;
    let images = DecodedImages::default();
    let announced = images.announce(&scene.model, &plan, materials);
    let cache = TextureCache::new(&scene.model, &plan, &announced);
    let block = BlockTextures::prepare(&cache, &shared, &scene.mesh, factors, options);
    let nodes = (0..factors.len())
        .map(|level| {
            let node = block
                .node_mesh(&scene.mesh, &AppendedSkirts::default(), level, [1.0, 2.0, 3.0])
                .expect("builds");
            shared.embed(&mut node.mesh.clone(), 0);
            node
        })
        .collect();
    drop(block);
    (nodes, shared.into_files())
}

fn decode(mesh: &NodeMesh, image: usize) -> Page {
    let NodeImageData::Embedded { bytes, .. } = &mesh.images[image].data else { panic!("shared") };
    let decoded = image::load_from_memory(bytes).expect("decodes").into_rgb8();
    let size = [decoded.width() as usize, decoded.height() as usize];
    assert_eq!(size, [mesh.images[image].width as usize, mesh.images[image].height as usize]);
    Page { size, pixels: decoded.into_raw() }
}

const FINEST: TextureOptions = TextureOptions {
    jpeg_quality: 100,
    max_atlas: 4096,
    normals: true,
    // Enough for each chart: nothing is baked.
    root_triangles: usize::MAX,
};

/// An image that JPEG keeps well.
fn smooth(width: u32, height: u32) -> DecodedTexture {
    let wave = |value: u32, of: u32| {
        let angle = f64::from(value) / f64::from(of) * std::f64::consts::TAU;
        (128.0 + 100.0 * angle.sin()) as u8
    };
    let pixels = (0..width * height)
        .flat_map(|i| [wave(i % width, width), wave(i / width, height), 128])
        .collect();
    DecodedTexture { width, height, channels: 3, pixels }
}

/// The greatest difference between drawing the node and drawing the source, which repeats, at a mip level.
fn difference(scene: &Scene, node: &TexturedNode, source: &DecodedTexture, mip: usize) -> f64 {
    let mut random = Random::new(11, 0);
    let mut greatest: f64 = 0.0;
    let at_mip = |page: Page| (0..mip).fold(page, |page, _| halved(&page));
    let size = [source.width as usize, source.height as usize];
    let source = at_mip(Page { size, pixels: source.pixels.clone() });
    for primitive in &node.mesh.primitives {
        let page = at_mip(decode(&node.mesh, primitive.surface.image.expect("textured")));
        // Triangles stay in order, so a single primitive's are the mesh's.
        for (index, triangle) in primitive.indices.chunks(3).enumerate() {
            let corners = |uvs: [[f32; 2]; 3], size: [usize; 2]| {
                uvs.map(|uv| [0, 1].map(|axis| f64::from(uv[axis]) * size[axis] as f64))
            };
            let old =
                [0, 1, 2].map(|c| scene.mesh.texcoords[scene.mesh.triangles[index][c] as usize]);
            let new = [0, 1, 2].map(|c| primitive.texcoords[triangle[c] as usize]);
            for _ in 0..20 {
                let seed = random.bits();
                let at_old = inside(corners(old, source.size), &mut Random::new(seed, 0));
                let at_new = inside(corners(new, page.size), &mut Random::new(seed, 0));
                let expected = sample_page(&source, true, at_old);
                let wraps = primitive.surface.wrap == [Wrap::Repeat; 2];
                let found = sample_page(&page, wraps, at_new);
                for channel in 0..3 {
                    greatest = greatest.max((found[channel] - expected[channel]).abs());
                }
            }
        }
    }
    greatest
}

/// A leaf is seen at low angles too, where cards draw mip level 2.
#[test]
fn leaves_show_no_neighbour_to_mip_level_2() {
    let mut random = Random::new(5, 0);
    // A triangle in the middle of each of eight by eight squares of a grey, of which JPEG mixes nothing.
    let colors: Vec<[u8; 3]> = (0..64).map(|_| [random.below(256) as u8; 3]).collect();
    let pixels = (0..256 * 256).flat_map(|i| colors[i / 256 / 32 * 8 + i % 256 / 32]).collect();
    let source = DecodedTexture { width: 256, height: 256, channels: 3, pixels };
    let triangles: Vec<(u32, [[f32; 2]; 3])> = (0..64)
        .map(|square| {
            let first = [square % 8, square / 8].map(|at| f64::from(at) + 0.25);
            let mut corner = || first.map(|at| ((at + 0.5 * random.unit()) / 8.0) as f32);
            (0, [corner(), corner(), corner()])
        })
        .collect();
    let scene = scene(std::slice::from_ref(&source), &[(Some(0), Wrap::Repeat)], &triangles);
    let (nodes, _) = nodes(&scene, &[20.0, 5.0, 1.0], FINEST);
    for mip in 0..=2 {
        let found = difference(&scene, &nodes[2], &source, mip);
        assert!(found < 12.0, "mip level {mip}: {found} of 255");
    }
}

#[test]
fn nodes_draw_like_the_source_also_over_the_border() {
    let source = smooth(128, 96);
    for uvs in [
        [[0.1, 0.1], [0.6, 0.2], [0.2, 0.7]],
        [[0.8, 0.1], [1.3, 0.2], [0.9, 0.6]],
        [[-0.4, -2.8], [0.2, -2.9], [0.1, -3.4]],
        [[5.1, 7.1], [5.6, 7.2], [5.2, 7.9]],
    ] {
        let scene = scene(std::slice::from_ref(&source), &[(Some(0), Wrap::Repeat)], &[(0, uvs)]);
        let (nodes, files) = nodes(&scene, &[20.0, 5.0, 1.0], FINEST);
        assert!(files.is_empty());
        assert!(difference(&scene, &nodes[2], &source, 0) < 6.0, "leaf {uvs:?}");
        assert!(difference(&scene, &nodes[1], &source, 0) < 12.0, "middle {uvs:?}");
        assert!(nodes.iter().all(|node| node.warnings.is_empty()));
        assert!(nodes[1].own_texels < nodes[2].own_texels / 3);
    }
}

#[test]
fn a_facade_is_cropped_to_its_texels() {
    let quad = [
        (0, [[0.25, 0.25], [0.75, 0.25], [0.75, 0.5]]),
        (0, [[0.25, 0.25], [0.75, 0.5], [0.25, 0.5]]),
    ];
    let scene = scene(&[smooth(512, 512)], &[(Some(0), Wrap::Repeat)], &quad);
    let (nodes, _) = nodes(&scene, &[16.0, 4.0, 1.0], FINEST);
    let size = |node: &TexturedNode| (node.mesh.images[0].width, node.mesh.images[0].height);
    assert_eq!(size(&nodes[2]), (260, 132));
    assert_eq!(size(&nodes[1]), (132, 68));
    let total: u64 = nodes.iter().map(|node| node.own_texels).sum();
    assert!((total as f64) < 1.6 * (258 * 130) as f64);
}

#[test]
fn repeating_textures_are_kept_whole_and_stored_once() {
    let tiled =
        [(0, [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]), (1, [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])];
    let materials = [(Some(0), Wrap::Repeat), (Some(1), Wrap::Mirror)];
    let scene = scene(&[smooth(64, 64), smooth(32, 32)], &materials, &tiled);
    let (nodes, files) = nodes(&scene, &[4.0, 1.0], FINEST);
    assert_eq!(files.len(), 4);
    assert!(nodes.iter().all(|node| node.own_texels == 0 && node.mesh.primitives.len() == 2));
    let primitive = &nodes[1].mesh.primitives[0];
    assert_eq!(primitive.texcoords, [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]);
    assert_eq!(primitive.surface.wrap, [Wrap::Repeat; 2]);
    assert_eq!(nodes[1].mesh.primitives[1].surface.wrap, [Wrap::Mirror; 2]);
    let names: Vec<&str> = files.iter().map(|file| &*file.name).collect();
    assert!(names[0].starts_with("texture_0-") && names[0].ends_with("-32x32.jpg"), "{names:?}");
}

#[test]
fn texels_used_many_times_are_shared_and_charts_over_them_drawn_once() {
    let often = vec![(0, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]); 9];
    let materials = [(Some(0), Wrap::Repeat)];
    let scene_often = scene(&[smooth(64, 64)], &materials, &often);
    assert_eq!(TexturePlan::new(&scene_often.model).texture_use(0), TextureUse::Repeating);

    let twice = vec![(0, [[0.1, 0.1], [0.4, 0.1], [0.1, 0.4]]); 2];
    let once = vec![(0, [[0.1, 0.1], [0.4, 0.1], [0.1, 0.4]]); 1];
    let texels = |triangles: &[(u32, [[f32; 2]; 3])]| {
        let scene = scene(&[smooth(64, 64)], &materials, triangles);
        nodes(&scene, &[1.0], FINEST).0[0].own_texels
    };
    assert_eq!(texels(&twice), texels(&once));
}

#[test]
fn alpha_keeps_png_and_opaque_materials_do_not() {
    let pixels = (0..32 * 32).flat_map(|i| [10, 200, 30, if i % 3 == 0 { 0 } else { 255 }]);
    let leaf = DecodedTexture { width: 32, height: 32, channels: 4, pixels: pixels.collect() };
    let triangle = [(0, [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]])];
    let mut scene = scene(&[leaf], &[(Some(0), Wrap::Repeat)], &triangle);
    let mime = |scene: &Scene| match &nodes(scene, &[4.0, 1.0], FINEST).0[0].mesh.images[0].data {
        NodeImageData::Embedded { mime, .. } => *mime,
        NodeImageData::Shared { .. } => "shared",
    };
    assert_eq!(mime(&scene), "image/jpeg");
    scene.model.materials[0].alpha = AlphaMode::Mask { cutoff: 0.5 };
    assert_eq!(mime(&scene), "image/png");
}

#[test]
fn a_small_limit_gives_pages_to_leaves_and_a_warning_to_others() {
    let mut random = Random::new(5, 0);
    let (corners, charts) = scattered(&mut random, 1.0);
    let triangles: Vec<(u32, [[f32; 2]; 3])> = corners
        .iter()
        .zip(&charts)
        .map(|(t, _)| (0, t.map(|at| at.map(|value| value as f32))))
        .collect();
    let scene = scene(&[smooth(256, 256)], &[(Some(0), Wrap::Repeat)], &triangles);
    let options = TextureOptions { max_atlas: 128, ..FINEST };
    let (nodes, _) = nodes(&scene, &[1.2, 1.0], options);
    assert!(nodes[1].mesh.images.len() > 1 && nodes[1].warnings.is_empty());
    assert!(nodes[0].mesh.images.len() == 1 && !nodes[0].warnings.is_empty());
    for node in &nodes {
        assert!(node.mesh.images.iter().all(|image| image.width <= 128 && image.height <= 128));
        let drawn: usize = node.mesh.primitives.iter().map(|p| p.indices.len()).sum();
        assert_eq!(drawn, triangles.len() * 3);
    }
}

#[test]
fn untextured_materials_become_one_primitive_with_colours() {
    let triangles = [(0, [[0.0; 2]; 3]), (1, [[0.0; 2]; 3]), (0, [[0.0; 2]; 3])];
    let mut scene = scene(&[], &[(None, Wrap::Repeat), (None, Wrap::Repeat)], &triangles);
    scene.model.materials[1].base_color = [1.0, 0.5, 0.0, 1.0];
    let node = &nodes(&scene, &[1.0], FINEST).0[0];
    assert_eq!((node.mesh.primitives.len(), node.mesh.images.len()), (1, 0));
    let primitive = &node.mesh.primitives[0];
    assert_eq!(primitive.colors[3], [65535, 32768, 0, 65535]);
    assert_eq!(primitive.surface.base_color, [1.0; 4]);
    assert!(primitive.texcoords.is_empty());
    assert_eq!(node.mesh.origin, [1.0, 2.0, 3.0]);

    scene.model.materials[1].base_color = [1.0; 4];
    assert!(nodes(&scene, &[1.0], FINEST).0[0].mesh.primitives[0].colors.is_empty());
}

#[test]
fn unlit_materials_stay_apart_and_have_no_normals() {
    let triangles = [(0, [[0.0; 2]; 3]), (1, [[0.0; 2]; 3]), (2, [[0.0; 2]; 3])];
    let materials = [(None, Wrap::Repeat), (None, Wrap::Repeat), (Some(0), Wrap::Repeat)];
    let mut scene = scene(&[numbered(8, 8)], &materials, &triangles);
    for material in &mut scene.model.materials[1..] {
        material.is_unlit = true;
    }
    let node = &nodes(&scene, &[1.0], FINEST).0[0];
    let mut found: Vec<_> = node.mesh.primitives.iter().collect();
    found.sort_by_key(|primitive| (primitive.surface.image, primitive.surface.is_unlit));
    let found: Vec<_> = found
        .iter()
        .map(|primitive| {
            let Surface { image, is_unlit, .. } = primitive.surface;
            (image.is_some(), is_unlit, primitive.normals.len())
        })
        .collect();
    assert_eq!(found, [(false, false, 3), (false, true, 0), (true, false, 0)]);
}

#[test]
fn absurd_coordinates_and_missing_images_do_no_harm() {
    let far = [
        (0, [[f32::NAN, 0.0], [f32::INFINITY, 1.0], [0.5, -1e30]]),
        (0, [[1e9, 1e9]; 3]),
        (0, [[0.5, 0.5]; 3]),
        (1, [[0.2, 0.2], [0.4, 0.2], [0.2, 0.4]]),
    ];
    let materials = [(Some(0), Wrap::Repeat), (Some(1), Wrap::Clamp)];
    let mut scene = scene(&[smooth(16, 16), smooth(16, 16)], &materials, &far);
    scene.model.textures[1].data = TextureData::Embedded(b"not an image".as_slice().into());
    let plan = TexturePlan::new(&scene.model);
    let shared = SharedTextures::new();
    let images = DecodedImages::default();
    let announced = images.announce(&scene.model, &plan, [0, 1]);
    let cache = TextureCache::new(&scene.model, &plan, &announced);
    let block = BlockTextures::prepare(&cache, &shared, &scene.mesh, &[9.0, 1.0], FINEST);
    for level in 0..2 {
        let node = block
            .node_mesh(&scene.mesh, &AppendedSkirts::default(), level, [0.0; 3])
            .expect("builds");
        let finite =
            |p: &crate::format::Primitive| p.texcoords.iter().flatten().all(|v| v.is_finite());
        assert!(node.mesh.primitives.iter().all(finite));
        assert_eq!(node.mesh.primitives.iter().map(|p| p.indices.len()).sum::<usize>(), 12);
    }
    assert_eq!(cache.warnings().iter().count(), 1);
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let mut random = Random::new(9, 0);
    let (corners, _) = scattered(&mut random, 1.0);
    let triangles: Vec<(u32, [[f32; 2]; 3])> =
        corners.iter().map(|t| (0, t.map(|at| at.map(|value| value as f32)))).collect();
    let scene = scene(&[numbered(200, 150)], &[(Some(0), Wrap::Repeat)], &triangles);
    let build = || nodes(&scene, &[7.0, 1.75, 1.0], TextureOptions::default());
    assert_eq!(build(), build());
}
