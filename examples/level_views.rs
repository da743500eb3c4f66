//! FLIP of the coarse levels of a built scene against its leaves, from twelve fixed views around it.
//!
//! usage: level_views OUT [--levels N] [--near PIXELS] [--far PIXELS] [--samples N]
//!        [--pictures FOLDER] [--adapter NAME]
//!
//! Views are from every 45 degrees around at 30 degrees over the horizon and every 90 at 60. The
//! scene's box is at most 800 pixels wide and high in the near views, 300 in the far ones. A pixel is
//! the mean of N by N samples (default 4): with one, leaves whose triangles are smaller than a pixel
//! are noise, which differs from any level. Prints a JSON object: by level its triangles and the mean
//! FLIP of the near and of the far views, over the pixels that either picture has something in. Level
//! N is the last (default 1). Into FOLDER go, by level and of the leaves, the first of the far views
//! and one from a quarter of its distance.

use std::error::Error;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use hlod::camera::{Pose, from_angles};
use hlod::color::{linear_to_srgb, srgb_to_linear};
use hlod::format::Scene;
use hlod::picture_error::{PIXELS_PER_DEGREE, flip};
use hlod::render::{RenderOptions, Renderer};
use image::{Rgb, RgbImage, Rgba, RgbaImage};

#[path = "support/levels.rs"]
mod levels;
use levels::{front, upload};

type Result<T, E = Box<dyn Error>> = std::result::Result<T, E>;

const FOV_Y_DEG: f64 = 30.0;

struct Arguments {
    out: PathBuf,
    levels: u32,
    sizes: [u32; 2],
    samples: u32,
    pictures: Option<PathBuf>,
    adapter: Option<String>,
}

fn main() -> Result<()> {
    let arguments = parse()?;
    let scene = Scene::read(&arguments.out)?;
    let mut found = Vec::new();
    let [near, far] = arguments.sizes;
    let of_leaves = |size| views(&scene, &arguments, size, u32::MAX);
    let leaves = [of_leaves(near)?, of_leaves(far)?];
    for level in 0..=arguments.levels.min(scene.level_count() as u32 - 1) {
        let triangles: u64 = front(&scene, level)
            .iter()
            .map(|&node| u64::from(scene.nodes[node as usize].triangles))
            .sum();
        let mut means = [0.0; 2];
        for (kind, size) in arguments.sizes.into_iter().enumerate() {
            let pictures = views(&scene, &arguments, size, level)?;
            let errors = leaves[kind].iter().zip(&pictures).map(|(a, b)| difference(a, b));
            let errors: Vec<f64> = errors.collect::<Result<_>>()?;
            means[kind] = errors.iter().sum::<f64>() / errors.len() as f64;
        }
        if let Some(folder) = &arguments.pictures {
            save_pictures(&scene, &arguments, level, &folder.join(format!("level{level}")))?;
        }
        found.push(serde_json::json!({
            "level": level, "triangles": triangles, "near": means[0], "far": means[1],
        }));
    }
    if let Some(folder) = &arguments.pictures {
        save_pictures(&scene, &arguments, u32::MAX, &folder.join("leaves"))?;
    }
    println!("{}", serde_json::json!({ "levels": found }));
    Ok(())
}

/// The first far view of a level, and one from a quarter of its distance: of the middle of what
/// there is, which need not be the middle of the scene's box.
fn save_pictures(scene: &Scene, arguments: &Arguments, level: u32, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let camera = Camera::new(scene, 0.0, -30.0)?;
    let near = Camera { at: middle_of_leaves(scene)?, away: camera.away / 4.0, ..camera };
    let pictures = pictures(scene, arguments, arguments.sizes[1], level, &[camera, near])?;
    for (picture, name) in pictures.iter().zip(["far.png", "quarter.png"]) {
        picture.save(folder.join(name))?;
    }
    Ok(())
}

/// The middle of the leaf that is nearest to the median, along each axis, of all leaves' middles.
fn middle_of_leaves(scene: &Scene) -> Result<DVec3> {
    let leaves = scene.nodes.iter().filter(|node| node.first_child.is_none());
    let middles: Vec<DVec3> = leaves
        .map(|leaf| (DVec3::from(leaf.bbox_min) + DVec3::from(leaf.bbox_max)) / 2.0)
        .collect();
    let median = DVec3::from_array(std::array::from_fn(|axis| {
        let mut along: Vec<f64> = middles.iter().map(|middle| middle[axis]).collect();
        along.sort_by(f64::total_cmp);
        along.get(along.len() / 2).copied().unwrap_or_default()
    }));
    let off = |middle: &DVec3| middle.distance_squared(median);
    let nearest = middles.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    nearest.ok_or_else(|| "the scene has no nodes".into())
}

/// The pictures of a level from all views.
fn views(scene: &Scene, arguments: &Arguments, size: u32, level: u32) -> Result<Vec<RgbaImage>> {
    let around = (0..8).map(|step| (f64::from(step) * 45.0, -30.0));
    let above = (0..4).map(|step| (f64::from(step) * 90.0 + 20.0, -60.0));
    let cameras = around.chain(above).map(|(yaw, pitch)| Camera::new(scene, yaw, pitch));
    let cameras: Vec<_> = cameras.collect::<Result<_>>()?;
    pictures(scene, arguments, size, level, &cameras)
}

struct Camera {
    rotation: DQuat,
    /// What is in the middle of the picture, and how far away.
    at: DVec3,
    away: f64,
}

impl Camera {
    /// As near as four fifths of the picture's width and height hold all corners of the scene.
    fn new(scene: &Scene, yaw_deg: f64, pitch_deg: f64) -> Result<Self> {
        let bounds = scene.bounds().ok_or("the scene has no nodes")?.map(DVec3::from);
        let middle = (bounds[0] + bounds[1]) / 2.0;
        let rotation = from_angles(scene.up, yaw_deg, pitch_deg, 0.0);
        let half = (FOV_Y_DEG.to_radians() / 2.0).tan() / 1.25;
        let corners = (0..8).map(|corner| {
            let side = |axis: usize| bounds[corner >> axis & 1][axis];
            let seen = rotation.inverse() * (DVec3::new(side(0), side(1), side(2)) - middle);
            seen.z + seen.x.abs().max(seen.y.abs()) / half
        });
        Ok(Self { rotation, at: middle, away: corners.fold(0.0, f64::max) })
    }

    fn pose(&self) -> Pose {
        let position = self.at - self.rotation * DVec3::NEG_Z * self.away;
        Pose { position, rotation: self.rotation, fov_y_deg: FOV_Y_DEG }
    }
}

/// The pictures of a level, in which a scene that fills four fifths is `size` pixels wide or high.
fn pictures(
    scene: &Scene,
    arguments: &Arguments,
    size: u32,
    level: u32,
    cameras: &[Camera],
) -> Result<Vec<RgbaImage>> {
    let options = RenderOptions {
        size: [size * 5 / 4 * arguments.samples; 2],
        adapter: arguments.adapter.clone(),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&options)?;
    let nodes = front(scene, level);
    upload(scene, &arguments.out, &nodes, &mut renderer)?;
    let mut pictures = Vec::new();
    for camera in cameras {
        renderer.draw(&nodes, &camera.pose(), (camera.away * 1e-3) as f32)?;
        let (mut picture, coverage) = (renderer.snapshot()?, renderer.coverage()?);
        for (pixel, covered) in picture.pixels_mut().zip(coverage.pixels()) {
            pixel.0[3] = covered.0[0];
        }
        pictures.push(mean(&picture, arguments.samples));
    }
    Ok(pictures)
}

/// The picture with squares of so many pixels a side averaged, in linear light.
fn mean(picture: &RgbaImage, side: u32) -> RgbaImage {
    let to_linear: [f64; 256] = std::array::from_fn(|byte| srgb_to_linear(byte as f64 / 255.0));
    let count = f64::from(side * side);
    RgbaImage::from_fn(picture.width() / side, picture.height() / side, |x, y| {
        let (mut light, mut covered) = ([0.0; 3], 0u32);
        for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
            let pixel = picture.get_pixel(x * side + column, y * side + row).0;
            light = std::array::from_fn(|i| light[i] + to_linear[usize::from(pixel[i])]);
            covered += u32::from(pixel[3] > 0);
        }
        let [r, g, b] = light.map(|sum| (linear_to_srgb(sum / count) * 255.0).round() as u8);
        Rgba([r, g, b, if covered > 0 { 255 } else { 0 }])
    })
}

/// FLIP over the pixels in which either picture has a surface.
fn difference(leaves: &RgbaImage, level: &RgbaImage) -> Result<f64> {
    let opaque = |picture: &RgbaImage| {
        RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
            let [r, g, b, _] = picture.get_pixel(x, y).0;
            Rgb([r, g, b])
        })
    };
    let map = flip(&opaque(leaves), &opaque(level), PIXELS_PER_DEGREE).ok_or("sizes differ")?;
    let shown = leaves.pixels().zip(level.pixels()).filter(|(a, b)| a.0[3] > 0 || b.0[3] > 0);
    let all = f64::from(leaves.width()) * f64::from(leaves.height());
    Ok(map.mean() * all / shown.count().max(1) as f64)
}

fn parse() -> Result<Arguments> {
    let (mut levels, mut sizes, mut samples, mut pictures, mut adapter) =
        (1, [800, 300], 4, None, None);
    let mut places = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--levels" => levels = value()?.parse()?,
            "--near" => sizes[0] = value()?.parse()?,
            "--far" => sizes[1] = value()?.parse()?,
            "--samples" => samples = value()?.parse()?,
            "--pictures" => pictures = Some(value()?.into()),
            "--adapter" => adapter = Some(value()?),
            _ if word.starts_with("--") => return Err(format!("no such option: {word}").into()),
            _ => places.push(PathBuf::from(word)),
        }
    }
    let [out] = <[PathBuf; 1]>::try_from(places).map_err(|_| "usage: level_views OUT [options]")?;
    Ok(Arguments { out, levels, sizes, samples, pictures, adapter })
}
