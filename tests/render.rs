//! Pictures of known scenes from known places. Where there is no graphics adapter these tests say
//! that they were skipped, or fail if `HLOD_REQUIRE_GPU` is 1.
#![cfg(feature = "render")]

#[path = "common/adapter.rs"]
mod adapter;

use std::io::Cursor;
use std::path::Path;

use glam::{DQuat, DVec3};
use hlod::camera::Pose;
use hlod::format::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use hlod::mesh::{AlphaMode, Wrap};
use hlod::picture_error::mean_squared_error;
use hlod::render::content::{Content, Picture, TextureFormat};
use hlod::render::{RenderOptions, Renderer, Shading, Side, level_tint};
use image::{Rgba, RgbaImage};

const SIZE: u32 = 64;

fn options() -> RenderOptions {
    RenderOptions {
        size: [SIZE, SIZE],
        shading: Shading::Unlit,
        background: [10, 20, 30],
        ..RenderOptions::default()
    }
}

const BACKGROUND: [u8; 3] = [10, 20, 30];

fn renderer(options: &RenderOptions) -> Option<Renderer> {
    adapter::or_skip(Renderer::new(options))
}

/// At the origin, looking along −z; the picture is two metres wide at one metre.
fn pose() -> Pose {
    Pose { position: DVec3::ZERO, rotation: DQuat::IDENTITY, fov_y_deg: 90.0 }
}

fn plain(color: [f32; 3]) -> Surface {
    Surface {
        base_color: [color[0], color[1], color[2], 1.0],
        image: None,
        wrap: [Wrap::Repeat; 2],
        alpha: AlphaMode::Opaque,
        double_sided: true,
        is_unlit: false,
    }
}

const RED: [f32; 3] = [1.0, 0.0, 0.0];
const GREEN: [f32; 3] = [0.0, 1.0, 0.0];

/// A rectangle that faces the camera: from left to right, from bottom to top, at a distance.
/// Its picture is upright.
fn rectangle(
    [left, right]: [f32; 2],
    [low, high]: [f32; 2],
    far: f32,
    surface: Surface,
) -> Primitive {
    Primitive {
        positions: vec![
            [left, low, -far],
            [right, low, -far],
            [right, high, -far],
            [left, high, -far],
        ],
        texcoords: match surface.image {
            Some(_) => vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
            None => Vec::new(),
        },
        colors: Vec::new(),
        indices: vec![0, 1, 2, 0, 2, 3],
        normals: Vec::new(),
        skirt_triangles: 0,
        surface,
    }
}

fn mesh(primitives: Vec<Primitive>) -> NodeMesh {
    NodeMesh { origin: [0.0; 3], images: Vec::new(), primitives }
}

fn png(image: &RgbaImage) -> NodeImage {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let data =
        NodeImageData::Embedded { mime: "image/png", bytes: bytes.into_inner(), file_name: None };
    NodeImage { width: image.width(), height: image.height(), data }
}

fn content(mesh: &NodeMesh) -> Content {
    Content::from_mesh(Path::new("test.glb"), mesh, |_| Some(0)).unwrap()
}

/// A picture of one node; `None` without an adapter.
fn shot(options: &RenderOptions, mesh: &NodeMesh) -> Option<RgbaImage> {
    shot_from(options, mesh, &pose())
}

fn shot_from(options: &RenderOptions, mesh: &NodeMesh, pose: &Pose) -> Option<RgbaImage> {
    let mut renderer = renderer(options)?;
    renderer.upload(0, 0, &content(mesh)).unwrap();
    renderer.draw(&[0], pose, 0.1).unwrap();
    Some(renderer.snapshot().unwrap())
}

/// The pixel at a place in −1–1 to the right and up.
fn at(image: &RgbaImage, right: f32, up: f32) -> [u8; 3] {
    let pixel = |place: f32, size: u32| (((place + 1.0) / 2.0 * size as f32) as u32).min(size - 1);
    let Rgba([r, g, b, a]) =
        *image.get_pixel(pixel(right, image.width()), pixel(-up, image.height()));
    assert_eq!(a, 255);
    [r, g, b]
}

#[track_caller]
fn assert_near(found: [u8; 3], expected: [u8; 3], tolerance: u8) {
    let far = (0..3).any(|i| found[i].abs_diff(expected[i]) > tolerance);
    assert!(!far, "found {found:?}, expected {expected:?}");
}

#[test]
fn each_thing_is_where_it_stands_in_its_colour() {
    // Half grey in linear light is 188. Green is to the upper right, and nothing at the left.
    let scene = mesh(vec![
        rectangle([0.0, 2.0], [-2.0, 0.0], 2.0, plain([0.5; 3])),
        rectangle([1.0, 2.0], [1.0, 2.0], 2.0, plain(GREEN)),
    ]);
    let Some(image) = shot(&options(), &scene) else { return };
    assert_near(at(&image, 0.5, -0.5), [188; 3], 0);
    assert_near(at(&image, 0.75, 0.75), [0, 255, 0], 0);
    assert_near(at(&image, 0.25, 0.25), BACKGROUND, 0);
    assert_near(at(&image, -0.5, -0.5), BACKGROUND, 0);
    // The edges are at the pixel.
    let x = SIZE / 2;
    assert_eq!(image.get_pixel(x, SIZE - 1).0, [188, 188, 188, 255]);
    assert_eq!(image.get_pixel(x - 1, SIZE - 1).0[..3], BACKGROUND);
}

#[test]
fn vertex_colours_mix_in_linear_light() {
    let mut square = rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, plain([1.0; 3]));
    let (black, white) = ([0, 0, 0, 65535], [65535; 4]);
    square.colors = vec![black, white, white, black];
    let Some(image) = shot(&options(), &mesh(vec![square])) else { return };
    assert_near(at(&image, 0.0, 0.0), [188; 3], 2);
    assert_near(at(&image, -0.5, 0.0), [137; 3], 3);
}

#[test]
fn the_nearest_is_seen_whatever_comes_first() {
    let near = || rectangle([-9.0, 9.0], [-9.0, 0.0], 3.0, plain(RED));
    let far = || rectangle([-9.0, 9.0], [-9.0, 9.0], 3.001, plain(GREEN));
    for primitives in [vec![near(), far()], vec![far(), near()]] {
        let Some(image) = shot(&options(), &mesh(primitives)) else { return };
        assert_near(at(&image, 0.0, -0.5), [255, 0, 0], 0);
        assert_near(at(&image, 0.0, 0.5), [0, 255, 0], 0);
    }
    // A metre at ten kilometres, with a near plane of a tenth of a metre: this needs reversed depth.
    let near = || rectangle([-9e4, 9e4], [-9e4, 0.0], 10_000.0, plain(RED));
    let far = || rectangle([-9e4, 9e4], [-9e4, 9e4], 10_001.0, plain(GREEN));
    for primitives in [vec![near(), far()], vec![far(), near()]] {
        let Some(image) = shot(&options(), &mesh(primitives)) else { return };
        assert_near(at(&image, 0.0, -0.5), [255, 0, 0], 0);
    }
}

#[test]
fn what_is_nearer_than_the_near_plane_or_behind_is_not_seen() {
    let scene = mesh(vec![
        rectangle([-9.0, 9.0], [-9.0, 9.0], 0.05, plain(RED)),
        rectangle([-9.0, 9.0], [-9.0, 9.0], -5.0, plain(RED)),
        rectangle([-9.0, 9.0], [-9.0, 9.0], 5.0, plain(GREEN)),
    ]);
    let Some(image) = shot(&options(), &scene) else { return };
    assert_near(at(&image, 0.0, 0.0), [0, 255, 0], 0);
}

/// Red, green / blue, white, from the upper left.
fn four_colors(side: u32) -> RgbaImage {
    RgbaImage::from_fn(side * 2, side * 2, |x, y| match (x < side, y < side) {
        (true, true) => Rgba([255, 0, 0, 255]),
        (false, true) => Rgba([0, 255, 0, 255]),
        (true, false) => Rgba([0, 0, 255, 255]),
        (false, false) => Rgba([255; 4]),
    })
}

#[test]
fn pictures_stand_upright() {
    let surface = Surface { image: Some(0), ..plain([1.0; 3]) };
    let mut scene = mesh(vec![rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, surface)]);
    scene.images = vec![png(&four_colors(32))];
    let Some(image) = shot(&options(), &scene) else { return };
    assert_near(at(&image, -0.5, 0.5), [255, 0, 0], 0);
    assert_near(at(&image, 0.5, 0.5), [0, 255, 0], 0);
    assert_near(at(&image, -0.5, -0.5), [0, 0, 255], 0);
    assert_near(at(&image, 0.5, -0.5), [255; 3], 0);
}

#[test]
fn pictures_go_on_as_their_surface_says() {
    for (wrap, expected) in
        [(Wrap::Repeat, [255, 0, 0]), (Wrap::Mirror, [0, 255, 0]), (Wrap::Clamp, [0, 255, 0])]
    {
        let surface = Surface { image: Some(0), wrap: [wrap; 2], ..plain([1.0; 3]) };
        let mut square = rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, surface);
        // The right half of the picture begins again at the left, or does not.
        square.texcoords.iter_mut().for_each(|[u, _]| *u *= 2.0);
        let mut scene = mesh(vec![square]);
        scene.images = vec![png(&four_colors(32))];
        let Some(image) = shot(&options(), &scene) else { return };
        assert_near(at(&image, 0.25, 0.5), expected, 0);
        let last = if wrap == Wrap::Mirror { [255, 0, 0] } else { [0, 255, 0] };
        assert_near(at(&image, 0.75, 0.5), last, 0);
    }
}

#[test]
fn what_is_cut_out_shows_what_is_behind() {
    let hole = RgbaImage::from_fn(64, 64, |x, _| Rgba([255, 0, 0, if x < 32 { 0 } else { 255 }]));
    let fence = |alpha, opacity| Surface {
        image: Some(0),
        alpha,
        base_color: [1.0, 1.0, 1.0, opacity],
        ..plain([1.0; 3])
    };
    let both = |surface| {
        let mut scene = mesh(vec![
            rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, surface),
            rectangle([-2.0, 2.0], [-2.0, 2.0], 2.0, plain(GREEN)),
        ]);
        scene.images = vec![png(&hole)];
        shot(&options(), &scene)
    };
    let mask = |cutoff| AlphaMode::Mask { cutoff };
    let (red, green) = ([255, 0, 0], [0, 255, 0]);
    for (alpha, opacity, left, right) in [
        (mask(0.5), 1.0, green, red),
        (mask(0.7), 0.6, green, green),
        (mask(0.5), 0.6, green, red),
        (mask(0.0), 1.0, red, red),
        (mask(1.0), 1.0, green, red),
        (AlphaMode::Opaque, 1.0, red, red),
        (AlphaMode::Blend, 1.0, green, red),
    ] {
        let Some(image) = both(fence(alpha, opacity)) else { return };
        assert_near(at(&image, -0.5, 0.0), left, 0);
        assert_near(at(&image, 0.5, 0.0), right, 0);
    }
    // Glass of a quarter's opacity takes a quarter of the pixels.
    let Some(image) = both(fence(AlphaMode::Blend, 0.25)) else { return };
    let red = image.pixels().filter(|pixel| pixel.0[0] == 255).count();
    assert_eq!(red, (SIZE * SIZE / 8) as usize);
}

#[test]
fn far_pictures_show_the_mean_of_their_texels() {
    let checker = RgbaImage::from_fn(512, 512, |x, y| {
        let white = 255 * ((x + y) % 2) as u8;
        Rgba([white, white, white, 255])
    });
    let surface = Surface { image: Some(0), ..plain([1.0; 3]) };
    let mut scene = mesh(vec![rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, surface)]);
    scene.images = vec![png(&checker)];
    // Eight texels to a pixel.
    let Some(image) = shot(&options(), &scene) else { return };
    for x in -9..=9 {
        assert_near(at(&image, x as f32 / 10.0, 0.3), [188; 3], 1);
    }
}

#[test]
fn levels_tint_what_they_hold() {
    let square = |x: f32| mesh(vec![rectangle([x, x + 1.0], [-1.0, 1.0], 1.0, plain([0.5; 3]))]);
    for show_levels in [false, true] {
        let Some(mut renderer) = renderer(&RenderOptions { show_levels, ..options() }) else {
            return;
        };
        renderer.upload(3, 0, &content(&square(-1.0))).unwrap();
        renderer.upload(8, 2, &content(&square(0.0))).unwrap();
        renderer.draw(&[3, 8], &pose(), 0.1).unwrap();
        let image = renderer.snapshot().unwrap();
        let (left, right) = (at(&image, -0.5, 0.0), at(&image, 0.5, 0.0));
        if show_levels {
            assert_ne!(left, right);
            let brightest = |tint: [f32; 3]| (0..3).max_by(|a, b| tint[*a].total_cmp(&tint[*b]));
            let most = |color: [u8; 3]| (0..3).max_by_key(|channel| color[*channel]);
            assert_eq!(most(left), brightest(level_tint(0)));
            assert_eq!(most(right), brightest(level_tint(2)));
        } else {
            assert_eq!(left, right);
        }
    }
}

#[test]
fn great_coordinates_give_the_same_picture() {
    let picture = RgbaImage::from_fn(64, 64, |x, y| Rgba([x as u8 * 4, y as u8 * 4, 77, 255]));
    let textured = Surface { image: Some(0), ..plain([1.0; 3]) };
    let mut scene = mesh(vec![
        rectangle([-3.25, 1.0], [-2.5, 3.0], 4.0, textured),
        rectangle([-1.0, 7.0], [-4.0, 0.0], 9.0, plain(RED)),
    ]);
    // A floor, whose lines run into the distance.
    let mut floor = rectangle([-50.0, 50.0], [-1.0, -1.0], 0.0, plain(GREEN));
    floor.positions[2][2] = -200.0;
    floor.positions[3][2] = -200.0;
    scene.primitives.push(floor);
    scene.images = vec![png(&picture)];
    let mut pose = pose();
    pose.position = DVec3::new(0.3, 0.2, 0.1);
    pose.rotation = DQuat::from_rotation_y(0.1) * DQuat::from_rotation_x(-0.2);
    let options = RenderOptions { shading: Shading::HeadLight, ..options() };
    let Some(here) = shot_from(&options, &scene, &pose) else { return };
    assert!(here.pixels().any(|pixel| pixel.0[2] > 40), "the picture is not seen");

    let far = DVec3::new(5e6, -5e6, 250_000.0);
    scene.origin = far.to_array();
    pose.position += far;
    let there = shot_from(&options, &scene, &pose).unwrap();
    let most = here.iter().zip(there.iter()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    // At 5e6 the eye itself is rounded to a nanometre, so that an edge may fall on the other
    // side of a pixel's middle; nothing else may differ.
    let differ = here.pixels().zip(there.pixels()).filter(|(a, b)| a != b).count();
    assert!(most <= 1 || differ <= 2, "{differ} pixels differ by up to {most}");
}

#[test]
fn what_has_no_picture_is_as_bright_from_wherever_it_is_seen_and_its_sides_differ() {
    let lit = RenderOptions { shading: Shading::Photo, ..options() };
    // A wall across the view, one beside it along the view, and ground.
    let wall = mesh(vec![rectangle([-3.0, 3.0], [-3.0, 3.0], 2.0, plain([1.0; 3]))]);
    let mut along = rectangle([-9.0, -9.0], [-9.0, 9.0], 0.0, plain([1.0; 3]));
    let mut ground = rectangle([-900.0, 900.0], [-1.0, -1.0], 0.0, plain([1.0; 3]));
    ground.positions[2][2] = -900.0;
    ground.positions[3][2] = -900.0;
    for (corner, z) in along.positions.iter_mut().zip([0.0, -900.0, -900.0, 0.0]) {
        corner[2] = z;
    }
    let Some(image) = shot(&lit, &wall) else { return };
    let ahead = at(&image, 0.0, 0.0);
    let turns =
        [DQuat::from_rotation_y(0.5), DQuat::from_rotation_x(0.4), DQuat::from_rotation_z(1.0)];
    for rotation in turns {
        let turned = shot_from(&lit, &wall, &Pose { rotation, ..pose() }).unwrap();
        assert_near(at(&turned, 0.0, 0.0), ahead, 1);
    }
    let beside = at(&shot(&lit, &mesh(vec![along])).unwrap(), -0.9, 0.0);
    let below = at(&shot(&lit, &mesh(vec![ground])).unwrap(), 0.0, -0.9);
    let bright = [ahead, beside, below].map(|pixel| pixel[0]);
    let differ = |a: usize, b: usize| bright[a].abs_diff(bright[b]) > 15;
    assert!(differ(0, 1) && differ(1, 2) && differ(2, 0), "{bright:?}");
}

#[test]
fn a_light_at_the_viewer_shows_how_planes_stand() {
    let lit = RenderOptions { shading: Shading::HeadLight, ..options() };
    let facing = mesh(vec![rectangle([-3.0, 3.0], [-3.0, 3.0], 2.0, plain([1.0; 3]))]);
    let mut floor = rectangle([-900.0, 900.0], [-1.0, -1.0], 0.0, plain([1.0; 3]));
    floor.positions[2][2] = -900.0;
    floor.positions[3][2] = -900.0;
    // 0.3 + 0.7 × |normal · light|, in linear light.
    let encoded = |cosine: f64| {
        let linear = 0.3 + 0.7 * cosine;
        ((1.055 * linear.powf(1.0 / 2.4) - 0.055) * 255.0).round() as u8
    };
    let Some(image) = shot(&lit, &facing) else { return };
    for (right, up) in [(0.0, 0.0), (-0.9, 0.9), (0.9, -0.3)] {
        assert_near(at(&image, right, up), [encoded(0.9438); 3], 1);
    }
    let image = shot(&lit, &mesh(vec![floor.clone()])).unwrap();
    for (right, up) in [(0.0, -0.5), (-0.9, -0.9), (0.9, -0.1)] {
        assert_near(at(&image, right, up), [encoded(0.3304); 3], 1);
    }
    // Which way a triangle is turned does not matter.
    floor.indices.reverse();
    assert_eq!(shot(&lit, &mesh(vec![floor])).unwrap(), image);
    // Pictures hold their own light, unless it is asked for. What has none is lit from
    // (0.35, 0.5, 0.79): 0.79 of its length is across this wall.
    let photo = RenderOptions { shading: Shading::Photo, ..options() };
    let surface = Surface { image: Some(0), ..plain([1.0; 3]) };
    let mut textured = mesh(vec![rectangle([-3.0, 3.0], [-3.0, 3.0], 2.0, surface)]);
    textured.images = vec![png(&RgbaImage::from_pixel(4, 4, Rgba([255; 4])))];
    assert_near(at(&shot(&photo, &textured).unwrap(), 0.0, 0.0), [255; 3], 0);
    assert_near(at(&shot(&photo, &facing).unwrap(), 0.0, 0.0), [encoded(0.7914); 3], 1);
    assert_near(at(&shot(&lit, &textured).unwrap(), 0.0, 0.0), [encoded(0.9438); 3], 1);
}

#[test]
fn backs_are_left_away_only_where_that_is_asked_for() {
    let mut square = rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, plain(RED));
    square.surface.double_sided = false;
    let front = mesh(vec![square.clone()]);
    square.indices.reverse();
    let back = mesh(vec![square.clone()]);
    square.surface.double_sided = true;
    let both = mesh(vec![square]);
    for (cull, scene, seen) in
        [(false, &back, true), (true, &back, false), (true, &front, true), (true, &both, true)]
    {
        let Some(image) = shot(&RenderOptions { cull, ..options() }, scene) else { return };
        let expected = if seen { [255, 0, 0] } else { BACKGROUND };
        assert_near(at(&image, 0.0, 0.0), expected, 0);
    }
}

#[test]
fn exactly_the_front_is_drawn_and_memory_comes_back() {
    let Some(mut renderer) = renderer(&options()) else { return };
    assert_eq!(renderer.gpu_bytes(), 0);
    let left = content(&mesh(vec![rectangle([-1.0, 0.0], [-1.0, 1.0], 1.0, plain(RED))]));
    let surface = Surface { image: Some(0), ..plain([1.0; 3]) };
    let mut right = mesh(vec![rectangle([0.0, 1.0], [-1.0, 1.0], 1.0, surface)]);
    right.images = vec![NodeImage {
        width: 9,
        height: 5,
        data: NodeImageData::Shared { file_name: "green.png".into() },
    }];
    let right = content(&right);
    let green = Picture::new(9, 5, [0, 255, 0, 255].repeat(45)).unwrap();

    renderer.upload(4, 1, &left).unwrap();
    renderer.upload(4_000_000_000, 1, &right).unwrap();
    // What is drawn must be there, shared pictures too.
    assert!(renderer.draw(&[5], &pose(), 0.1).is_err());
    assert!(renderer.draw(&[4_000_000_000], &pose(), 0.1).is_err());
    renderer.upload_shared(0, &green).unwrap();
    assert_eq!(renderer.gpu_bytes(), left.bytes() + right.bytes() + green.bytes());
    renderer.finish_uploads().unwrap();

    let mut colors = |front: &[u32]| {
        let times = renderer.draw(front, &pose(), 0.1).unwrap();
        assert!(times.encode_ms >= 0.0 && times.gpu_wait_ms > 0.0);
        assert_eq!(times.triangles, front.len() as u64 * 2);
        let (image, coverage) = (renderer.snapshot().unwrap(), renderer.coverage().unwrap());
        let covered = coverage.pixels().filter(|pixel| pixel.0[0] == 255).count();
        assert_eq!(covered, front.len() * (SIZE * SIZE / 2) as usize);
        [at(&image, -0.5, 0.0), at(&image, 0.5, 0.0)]
    };
    let (red, green_seen) = ([255, 0, 0], [0, 255, 0]);
    assert_eq!(colors(&[4_000_000_000, 4]), [red, green_seen]);
    assert_eq!(colors(&[4]), [red, BACKGROUND]);
    assert_eq!(colors(&[4_000_000_000]), [BACKGROUND, green_seen]);
    assert_eq!(colors(&[]), [BACKGROUND; 2]);

    // Uploading again takes no more; removing what is not there takes nothing.
    renderer.upload(4, 1, &left).unwrap();
    renderer.upload_shared(0, &green).unwrap();
    renderer.remove(99);
    assert_eq!(renderer.gpu_bytes(), left.bytes() + right.bytes() + green.bytes());
    renderer.remove(4);
    assert_eq!(renderer.gpu_bytes(), right.bytes() + green.bytes());
    assert!(renderer.draw(&[4], &pose(), 0.1).is_err());
    renderer.remove_shared(0);
    renderer.remove(4_000_000_000);
    renderer.remove(4_000_000_000);
    assert_eq!(renderer.gpu_bytes(), 0);
    renderer.draw(&[], &pose(), 0.1).unwrap();
}

/// A wall with its picture, which is seen texel by pixel and as small as a quarter of that.
fn facade() -> NodeMesh {
    let photograph = RgbaImage::from_fn(SIZE, SIZE, |x, y| {
        let window = (x % 16 > 4 && y % 12 > 3) as u32;
        let noise = (x * 7919 + y * 104_729) % 23;
        let [r, g, b] = [180 - window * 110, 150 - window * 60, 120 + window * 20];
        Rgba([(r + noise) as u8, (g + noise) as u8, (b + noise) as u8, 255])
    });
    let textured = || Surface { image: Some(0), ..plain([1.0; 3]) };
    NodeMesh {
        images: vec![png(&photograph)],
        ..mesh(vec![
            rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, textured()),
            rectangle([-0.2, 0.3], [-0.2, 0.3], 0.9, textured()),
        ])
    }
}

#[test]
fn compressed_pictures_take_a_quarter_and_look_the_same() {
    let Some(mut renderer) = renderer(&options()) else { return };
    let Ok(()) = renderer.check_textures(TextureFormat::Bc7) else {
        eprintln!("{} has no BC7", renderer.adapter());
        return;
    };
    let original = content(&facade());
    let mut draw = |content: &Content| {
        renderer.upload(0, 0, content).unwrap();
        assert_eq!(renderer.gpu_bytes(), content.bytes());
        renderer.draw(&[0], &pose(), 0.1).unwrap();
        let texture_bytes: u64 = content.pictures.iter().map(Picture::bytes).sum();
        (image::DynamicImage::from(renderer.snapshot().unwrap()).into_rgb8(), texture_bytes)
    };
    let (expected, bytes) = draw(&original);
    let (found, compressed_bytes) = draw(&original.clone().stored_as(TextureFormat::Bc7));
    let quarter = compressed_bytes as f64 / bytes as f64;
    assert!((0.25..0.255).contains(&quarter), "{compressed_bytes} of {bytes}");
    // 34 dB, as is stated of any picture; it is compressed at all.
    let error = mean_squared_error(&expected, &found).unwrap();
    assert!(error > 0.0 && error < 255.0f64.powi(2) / 10f64.powf(3.4), "{error}");
}

#[test]
fn small_levels_of_compressed_pictures_are_whole() {
    // From so far away that levels are seen that are smaller than a block, and of sizes that are no
    // multiples of it.
    let image = RgbaImage::from_pixel(12, 20, Rgba([200, 100, 50, 255]));
    let surface = Surface { image: Some(0), ..plain([1.0; 3]) };
    for far in [1.0, 4.0, 12.0, 24.0] {
        let wall = rectangle([-1.0, 1.0], [-1.0, 1.0], far, surface.clone());
        let scene = NodeMesh { images: vec![png(&image)], ..mesh(vec![wall]) };
        let Some(mut renderer) = renderer(&options()) else { return };
        if renderer.check_textures(TextureFormat::Bc7).is_err() {
            return;
        }
        renderer.upload(0, 0, &content(&scene).stored_as(TextureFormat::Bc7)).unwrap();
        renderer.draw(&[0], &pose(), 0.1).unwrap();
        assert_near(at(&renderer.snapshot().unwrap(), 0.01, 0.01), [200, 100, 50], 1);
    }
}

#[test]
fn many_draws_find_their_instances() {
    // More than there is room for at first, each in its own place.
    let Some(mut renderer) = renderer(&options()) else { return };
    let side = 32u32;
    let step = 2.0 / side as f32;
    for node in 0..side * side {
        let (x, y) = (node % side, node / side);
        let color = [f32::from((x % 2) as u8), f32::from((y % 2) as u8), 1.0];
        let square = rectangle([0.0, step], [0.0, step], 0.0, plain(color));
        let origin = [x as f32 * step - 1.0, y as f32 * step - 1.0, -1.0].map(f64::from);
        let mesh = NodeMesh { origin, ..mesh(vec![square]) };
        renderer.upload(node, 0, &content(&mesh)).unwrap();
    }
    let front: Vec<u32> = (0..side * side).collect();
    let times = renderer.draw(&front, &pose(), 0.1).unwrap();
    assert_eq!(times.draw_calls, side * side);
    let image = renderer.snapshot().unwrap();
    for (x, y, pixel) in image.enumerate_pixels() {
        let (column, row) = (x * side / SIZE, side - 1 - y * side / SIZE);
        let expected = [(column % 2) as u8 * 255, (row % 2) as u8 * 255, 255, 255];
        assert_eq!(pixel.0, expected, "{x} {y}");
    }
}

#[test]
fn odd_sizes_are_read_back_whole() {
    let options = RenderOptions { size: [70, 33], ..options() };
    let scene = mesh(vec![rectangle([0.0, 9.0], [-9.0, 9.0], 1.0, plain(RED))]);
    let Some(image) = shot(&options, &scene) else { return };
    assert_eq!(image.dimensions(), (70, 33));
    for (x, _, pixel) in image.enumerate_pixels() {
        let expected = if x < 35 { BACKGROUND } else { [255, 0, 0] };
        assert_eq!(pixel.0[..3], expected, "{x}");
    }
}

#[test]
fn what_cannot_be_had_is_refused() {
    let unknown = RenderOptions { adapter: Some("no such adapter".into()), ..options() };
    let error = Renderer::new(&unknown).err().expect("an adapter of that name");
    assert_eq!(error.exit_code(), 5, "{error}");
    if renderer(&options()).is_none() {
        return;
    }
    for size in [[0, 10], [10, 0], [10, u32::MAX]] {
        let error = Renderer::new(&RenderOptions { size, ..options() }).err().expect("a size");
        assert_eq!(error.exit_code(), 2, "{error}");
    }
}

#[test]
fn nodes_are_cut_at_a_box_and_both_sides_of_it_are_the_whole() {
    // A floor from 1 to 9 m ahead, and a wall behind the box.
    let mut floor = rectangle([-4.0, 4.0], [-1.0, -1.0], 1.0, plain(RED));
    floor.positions =
        [[-4.0, -1.0], [4.0, -1.0], [4.0, -9.0], [-4.0, -9.0]].map(|[x, z]| [x, -1.0, z]).to_vec();
    let picture = RgbaImage::from_pixel(4, 4, Rgba([0, 255, 0, 255]));
    let surface = Surface { image: Some(0), ..plain([1.0; 3]) };
    let mut scene = mesh(vec![floor, rectangle([-1.0, 1.0], [-1.0, 2.0], 8.0, surface)]);
    scene.images = vec![png(&picture)];
    let Some(whole) = shot(&options(), &scene) else { return };
    let cut_at = [DVec3::new(-2.0, -3.0, -4.0), DVec3::new(2.0, 3.0, 0.0)];
    let [inside, outside] = [Side::Inside, Side::Outside].map(|side| {
        let mut renderer = renderer(&RenderOptions { cut: Some(side), ..options() }).unwrap();
        renderer.upload(0, 0, &content(&scene)).unwrap();
        renderer.draw(&[0], &pose(), 0.1).unwrap();
        assert_eq!(renderer.snapshot().unwrap(), whole, "no box yet");
        renderer.cut_at(Some(cut_at));
        renderer.draw(&[0], &pose(), 0.1).unwrap();
        renderer.surface().unwrap()
    });
    let (mut of_inside, mut of_outside) = (0, 0);
    for (x, y, pixel) in whole.enumerate_pixels() {
        let sides = [inside.get_pixel(x, y), outside.get_pixel(x, y)];
        let drawn = sides.map(|side| side.0[3] > 0);
        assert!(!(drawn[0] && drawn[1]), "{x} {y}: twice");
        let (place_x, place_y) = ((x as f32 + 0.5) / 32.0 - 1.0, 1.0 - (y as f32 + 0.5) / 32.0);
        if place_y < 0.0 && place_y > -1.0 {
            // The floor, -1 / place_y metres ahead.
            let ahead = -1.0 / place_y;
            let is_in_box = ahead < 4.0 && (place_x * ahead).abs() < 2.0;
            let is_near_edge =
                (ahead - 4.0).abs() < 0.3 || ((place_x * ahead).abs() - 2.0).abs() < 0.2;
            if drawn[0] && !is_near_edge {
                assert!(is_in_box, "{x} {y}: {ahead} m");
            }
        }
        of_inside += u32::from(drawn[0]);
        of_outside += u32::from(drawn[1]);
        let seen = if drawn[0] { sides[0] } else { sides[1] };
        if drawn[0] || drawn[1] {
            assert_eq!(seen.0[..3], pixel.0[..3], "{x} {y}");
        } else {
            assert_near([pixel.0[0], pixel.0[1], pixel.0[2]], BACKGROUND, 0);
        }
    }
    assert!(of_inside > 100 && of_outside > 100, "{of_inside} {of_outside}");
}

#[test]
fn a_picture_is_projected_from_where_it_was_taken_whatever_the_triangles() {
    // A plane that goes away to the right under a picture of stripes that was taken from the origin.
    let stripes = RgbaImage::from_fn(SIZE, SIZE, |x, _| match x / 8 % 2 {
        0 => Rgba([255, 0, 0, 255]),
        _ => Rgba([0, 0, 255, 255]),
    });
    let surface = Surface { image: Some(0), wrap: [Wrap::Clamp; 2], ..plain([1.0; 3]) };
    let mut plane = rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0, surface);
    let corner = |right: f32, up: f32| {
        let far = 2.0 + 1.9 * right;
        ([right * far, up * far, -far], [(right + 1.0) / 2.0, (1.0 - up) / 2.0])
    };
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    plane.positions = corners.map(|at| at.0).to_vec();
    plane.texcoords = corners.map(|at| at.1).to_vec();
    let mut scene = mesh(vec![plane]);
    scene.images = vec![png(&stripes)];
    let Some(mut renderer) = renderer(&options()) else { return };
    let mut content = content(&scene);
    let mut error = |projection| {
        content.draws[0].projection = projection;
        renderer.upload(0, 0, &content).unwrap();
        renderer.draw(&[0], &pose(), 0.05).unwrap();
        let drawn = renderer.snapshot().unwrap();
        let rgb = |image: &RgbaImage| {
            image::RgbImage::from_fn(SIZE, SIZE, |x, y| {
                let [r, g, b, _] = image.get_pixel(x, y).0;
                image::Rgb([r, g, b])
            })
        };
        mean_squared_error(&rgb(&stripes), &rgb(&drawn)).unwrap()
    };
    let projected = error(Some([0.0, 0.0, -1.0, 0.0]));
    assert!(projected < 1.0, "{projected}");
    let bent = error(None);
    assert!(bent > 1000.0, "{bent}");
}

#[test]
fn unlit_surfaces_without_a_picture_keep_their_colour() {
    let options = RenderOptions { shading: Shading::Photo, ..options() };
    // They lean away from the camera, so that light changes the other one.
    let leaning = |[left, right]: [f32; 2], is_unlit| {
        let surface = Surface { is_unlit, ..plain([0.5; 3]) };
        let mut primitive = rectangle([left, right], [-1.0, 1.0], 1.0, surface);
        primitive.positions[2][2] -= 2.0;
        primitive.positions[3][2] -= 2.0;
        primitive
    };
    let scene = mesh(vec![leaning([-1.0, 0.0], true), leaning([0.0, 1.0], false)]);
    let Some(image) = shot(&options, &scene) else { return };
    assert_near(at(&image, -0.5, -0.5), [188; 3], 0);
    assert!(at(&image, 0.5, -0.5) != [188; 3], "{:?}", at(&image, 0.5, -0.5));
}
