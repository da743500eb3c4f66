//! Charts hide nothing, and what is baked is what the source shows there.

use std::path::PathBuf;

use glam::{DVec2, DVec3};

use super::flat::{FlatChart, flat_charts, for_centres};
use super::planar::planar_charts;
use crate::format::{NodeImageData, NodeMesh};
use crate::mesh::{Group, Material, Mesh, Model, Part, TextureData, TextureSource};
use crate::random::Random;
use crate::texture::{
    AppendedSkirts, BlockTextures, DecodedImages, SharedTextures, TextureCache, TextureOptions,
    TexturePlan,
};

/// A surface over a grid of `side` by `side` squares, without texture.
pub(super) fn sheet(side: u32, at: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    for position in 0..(side + 1) * (side + 1) {
        let [u, v] =
            [position / (side + 1), position % (side + 1)].map(|i| f64::from(i) / f64::from(side));
        mesh.positions.push(at(u, v).as_vec3().into());
        mesh.texcoords.push([0.0; 2]);
        mesh.materials.push(0);
    }
    for position in (0..side * (side + 1)).filter(|position| position % (side + 1) != side) {
        let [a, b, c, d] = [0, side + 1, side + 2, 1].map(|step| position + step);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// A stair that winds three times round its axis.
fn winding() -> Mesh {
    sheet(60, |u, v| {
        let (sine, cosine) = libm::sincos(u * 3.0 * std::f64::consts::TAU);
        DVec3::new(cosine * (1.0 + v), sine * (1.0 + v), u * 0.5)
    })
}

fn ball() -> Mesh {
    let mut random = Random::new(1, 0);
    let bumps: Vec<f64> = (0..64).map(|_| random.between(0.9, 1.1)).collect();
    sheet(40, |u, v| {
        let (sine, cosine) = libm::sincos(u * std::f64::consts::TAU);
        let (high, flat) = libm::sincos((v - 0.5) * std::f64::consts::PI);
        let bump = bumps[((u * 8.0) as usize % 8) * 8 + (v * 7.99) as usize];
        DVec3::new(cosine * flat, sine * flat, high) * bump
    })
}

#[test]
fn every_triangle_lies_in_one_chart_and_is_seen_from_its_front() {
    for mesh in [ball(), winding()] {
        let members: Vec<u32> = (0..mesh.triangles.len() as u32).step_by(3).collect();
        for members in [members, (0..mesh.triangles.len() as u32).collect()] {
            let charts = planar_charts(&mesh, &members);
            let mut found: Vec<u32> =
                charts.iter().flat_map(|chart| chart.triangles.iter().copied()).collect();
            found.sort_unstable();
            assert_eq!(found, members);
            for chart in &charts {
                for &triangle in &chart.triangles {
                    let [a, b, c] = mesh.corners(mesh.triangles[triangle as usize]);
                    let normal = (b - a).cross(c - a);
                    let cosine = normal.dot(chart.normal) / normal.length() / chart.normal.length();
                    assert!(normal.length() < 1e-9 || cosine > 0.3, "{cosine}");
                }
            }
        }
    }
    let smooth = sheet(30, |u, v| DVec3::new(u, v, u * v * 0.1));
    assert_eq!(planar_charts(&smooth, &(0..1800).collect::<Vec<_>>()).len(), 1);
}

/// Asserts that no two triangles have the centre of one texel.
fn assert_apart(chart: &FlatChart, scale: f64) {
    let [width, height] = (chart.size * scale).to_array().map(|side| side as usize + 1);
    let mut taken = vec![false; width * height];
    for triangle in &chart.corners {
        let triangle = triangle.map(|corner| corner * scale);
        for_centres(triangle, [width, height], -1e-6, |[x, y]| {
            assert!(!std::mem::replace(&mut taken[y * width + x], true));
        });
    }
}

#[test]
fn flat_charts_do_not_lie_on_themselves() {
    let mesh = winding();
    let members: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    assert_eq!(planar_charts(&mesh, &members).len(), 1, "it faces one way all along");
    let charts = flat_charts(&mesh, &members, |_| 40.0);
    assert!(charts.len() >= 3, "{}", charts.len());
    let mut found: Vec<u32> =
        charts.iter().flat_map(|chart| chart.triangles.iter().copied()).collect();
    found.sort_unstable();
    assert_eq!(found, members);
    for chart in &charts {
        assert_apart(chart, 40.0);
        let low = chart.corners.iter().flatten().fold(DVec2::INFINITY, |low, &at| low.min(at));
        assert!(low.abs().max_element() < 1e-9);
    }
}

/// Texels along the sides of a square's position in the image.
const TEXELS: usize = 16;

/// A mesh of squares, each a chart of its own somewhere in the image, and that image, in which
/// each point of the surface has its `color`, given itself and the middle of its square.
fn torn(mesh: &Mesh, color: impl Fn(DVec3, DVec3) -> [u8; 3]) -> (Model, Mesh) {
    let squares = mesh.triangles.len() / 2;
    let columns = (squares as f64).sqrt().ceil() as usize;
    let side = columns * TEXELS;
    let mut pixels = vec![255; side * side * 3];
    let mut torn = Mesh::default();
    for (square, triangles) in mesh.triangles.chunks(2).enumerate() {
        // A large prime visits each position once.
        let position = (square * 7919) % (columns * columns);
        let [column, row] = [position % columns * TEXELS, position / columns * TEXELS];
        let [a, b, c] = mesh.corners(triangles[0]);
        let d = mesh.corners(triangles[1])[2];
        // Corners are half a texel inside, as atlases without gutters have them.
        for (y, x) in (0..TEXELS).flat_map(|y| (0..TEXELS).map(move |x| (y, x))) {
            let [u, v] = [x, y].map(|step| step as f64 / (TEXELS - 1) as f64);
            let point = a.lerp(b, u).lerp(d.lerp(c, u), v);
            let texel = color(point, (a + c) * 0.5);
            pixels[((row + y) * side + column + x) * 3..][..3].copy_from_slice(&texel);
        }
        let ends = [[0, 0], [1, 0], [1, 1], [0, 1]];
        for (triangle, corners) in triangles.iter().zip([[0, 1, 2], [0, 2, 3]]) {
            let first = torn.positions.len() as u32;
            for (&vertex, corner) in triangle.iter().zip(corners) {
                let own = torn.push_vertex_from(mesh, vertex as usize);
                let [x, y] = ends[corner].map(|end| 0.5 + (end * (TEXELS - 1)) as f32);
                let texel = [column as f32 + x, row as f32 + y];
                torn.texcoords[own as usize] = texel.map(|at| at / side as f32);
            }
            torn.triangles.push([first, first + 1, first + 2]);
        }
    }
    let mut bytes = std::io::Cursor::new(Vec::new());
    let (width, format) = (side as u32, image::ImageFormat::Png);
    let kind = image::ExtendedColorType::Rgb8;
    image::write_buffer_with_format(&mut bytes, &pixels, width, width, kind, format)
        .expect("encodes");
    let texture = TextureSource {
        name: "torn.png".into(),
        data: TextureData::Embedded(bytes.into_inner().into()),
        opacity: None,
    };
    let part = Part {
        group: 0,
        material: 0,
        positions: torn.positions.iter().map(|p| p.map(f64::from)).collect(),
        texcoords: torn.texcoords.clone(),
        indices: torn.triangles.concat(),
        ..Part::default()
    };
    let model = Model {
        source: PathBuf::from("torn.obj"),
        dependencies: Vec::new(),
        groups: vec![Group { name: "all".into() }],
        parts: vec![part],
        materials: vec![Material {
            texture: Some(0),
            base_color: [1.0; 4],
            ..Material::plain("torn")
        }],
        textures: vec![texture],
        up: None,
        warnings: Default::default(),
    };
    (model, torn)
}

/// `coarse` with a texture baked from `mesh`, as level 1 of 3: half the resolution.
fn bake(model: &Model, mesh: &Mesh, coarse: &Mesh) -> NodeMesh {
    let plan = TexturePlan::new(model);
    let shared = SharedTextures::new();
    let images = DecodedImages::default();
    let announced = images.announce(model, &plan, [0]);
    let cache = TextureCache::new(model, &plan, &announced);
    let options = TextureOptions { jpeg_quality: 100, root_triangles: 0, ..Default::default() };
    let block = BlockTextures::prepare(&cache, &shared, mesh, &[16.0, 4.0, 1.0], options);
    let baked = block.bake(coarse, 1).expect("bakes");
    block.baked_node_mesh(&baked, &AppendedSkirts::default(), 1, [0.0; 3]).expect("builds").mesh
}

/// A page, and its half: the mip level that its gutters promise.
fn pages(mesh: &NodeMesh) -> [image::RgbImage; 2] {
    let NodeImageData::Embedded { bytes, .. } = &mesh.images[0].data else { panic!("shared") };
    let page = image::load_from_memory(bytes).expect("decodes").into_rgb8();
    let half = image::RgbImage::from_fn(page.width() / 2, page.height() / 2, |x, y| {
        let of = |channel: usize| {
            let all = [[0, 0], [1, 0], [0, 1], [1, 1]]
                .map(|[i, j]| u32::from(page[(2 * x + i, 2 * y + j)][channel]));
            ((all.iter().sum::<u32>() + 2) / 4) as u8
        };
        image::Rgb([of(0), of(1), of(2)])
    });
    [page, half]
}

/// Bilinear sampling of an image whose sides meet, as renderers do it.
fn sample(page: &image::RgbImage, uv: [f64; 2]) -> [f64; 3] {
    let size = [page.width(), page.height()].map(f64::from);
    let at = [0, 1].map(|axis| uv[axis] * size[axis] - 0.5);
    let mut color = [0.0; 3];
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share = |axis: usize, step: i32| {
            let part = at[axis] - at[axis].floor();
            if step == 0 { 1.0 - part } else { part }
        };
        let texel = |axis: usize, step: i32| {
            (at[axis].floor() + f64::from(step)).rem_euclid(size[axis]) as u32
        };
        let found = page[(texel(0, i), texel(1, j))];
        for channel in 0..3 {
            color[channel] += f64::from(found[channel]) * share(0, i) * share(1, j);
        }
    }
    color
}

/// The greatest difference between a baked node, at mip levels 0 and 1, and what `color` says of
/// each point, if anything.
pub(super) fn greatest(node: &NodeMesh, color: impl Fn(DVec3) -> Option<[u8; 3]>) -> [f64; 2] {
    let pages = pages(node);
    let mut random = Random::new(7, 0);
    let mut greatest = [0.0f64; 2];
    for primitive in &node.primitives {
        for triangle in primitive.indices.chunks(3) {
            for _ in 0..60 {
                let (a, b) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
                let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
                let weights = [1.0 - a - b, a, b];
                let corner = |i: usize| triangle[i] as usize;
                let point = (0..3).fold(DVec3::ZERO, |sum, i| {
                    sum + crate::mesh::wide(primitive.positions[corner(i)]) * weights[i]
                });
                let uv = [0, 1].map(|axis| {
                    (0..3)
                        .map(|i| f64::from(primitive.texcoords[corner(i)][axis]) * weights[i])
                        .sum::<f64>()
                });
                let Some(color) = color(point) else { continue };
                for (page, greatest) in pages.iter().zip(&mut greatest) {
                    for (found, expected) in sample(page, uv).into_iter().zip(color) {
                        *greatest = greatest.max((found - f64::from(expected)).abs());
                    }
                }
            }
        }
    }
    greatest
}

#[test]
fn a_flat_square_in_many_charts_shows_its_image_again() {
    let wave = |point: DVec3| {
        [point.x * 3.0, point.y * 2.0, point.x + point.y]
            .map(|turn| (128.0 + 90.0 * libm::sin(turn * std::f64::consts::TAU)) as u8)
    };
    let (model, torn) = torn(&sheet(16, |u, v| DVec3::new(u, v, 0.0)), |point, _| wave(point));
    let node = bake(&model, &torn, &sheet(1, |u, v| DVec3::new(u, v, 0.0)));
    let texels = node.images[0].width * node.images[0].height;
    assert!(texels < 256 * 256 / 4, "{texels} of 65536");
    let [whole, _] = greatest(&node, |point| Some(wave(point)));
    assert!(whole < 12.0, "{whole}");
}

/// The sides of a cube, each a sheet of its own.
fn cube(side: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for normal in SIDES {
        let right = if normal.z == 0.0 { DVec3::Z.cross(normal) } else { DVec3::X };
        let up = normal.cross(right);
        let part = sheet(side, |u, v| normal + right * (2.0 * u - 1.0) + up * (2.0 * v - 1.0));
        let first = mesh.positions.len() as u32;
        for vertex in 0..part.positions.len() {
            mesh.push_vertex_from(&part, vertex);
        }
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|vertex| first + vertex)));
    }
    mesh
}

const SIDES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
const COLORS: [[u8; 3]; 6] =
    [[200, 30, 30], [30, 200, 30], [30, 30, 200], [200, 200, 30], [30, 200, 200], [120; 3]];

#[test]
fn a_house_keeps_the_colour_of_each_side_at_the_mip_levels_that_gutters_promise() {
    let color = |point: DVec3| {
        let side = (0..6).max_by(|&a, &b| point.dot(SIDES[a]).total_cmp(&point.dot(SIDES[b])));
        COLORS[side.unwrap_or(0)]
    };
    // What lies on an edge has the colour of its square's side.
    let (model, torn) = torn(&cube(8), |_, middle| color(middle));
    let node = bake(&model, &torn, &cube(2));
    let [whole, half] = greatest(&node, |point| Some(color(point)));
    assert!(whole < 12.0 && half < 12.0, "{whole} {half}");
}
