//! Draws all nodes of one level of a built scene, or its leaves, so that people can look at them.
//!
//! usage: render_scene OUT IMAGE.png [--level N | --leaves] [--size WxH] [--from X,Y,Z]
//!        [--at X,Y,Z] [--fov DEGREES] [--adapter NAME] [--shading photo|head-light|unlit]
//!        [--show-levels] [--cull] [--repeat N]
//!
//! Where a branch ends above level N its leaf is drawn instead; without --level the roots are.
//! Without --from and --at the whole scene is seen from above its south. --repeat draws the frame
//! that many times and prints the median time.

use std::error::Error;
use std::path::PathBuf;

use glam::DVec3;
use hlod::camera::{Pose, looking_at, up_vector};
use hlod::format::Scene;
use hlod::mesh::UpAxis;
use hlod::render::{RenderOptions, Renderer, Shading};

#[path = "support/levels.rs"]
mod levels;
use levels::{front, upload};

type Result<T, E = Box<dyn Error>> = std::result::Result<T, E>;

struct Arguments {
    out: PathBuf,
    image: PathBuf,
    /// Deepest level to draw.
    level: u32,
    from: Option<DVec3>,
    at: Option<DVec3>,
    fov_y_deg: f64,
    repeat: usize,
    options: RenderOptions,
}

fn main() -> Result<()> {
    let arguments = parse()?;
    let scene = Scene::read(&arguments.out)?;
    let mut renderer = Renderer::new(&arguments.options)?;
    println!("adapter: {}", renderer.adapter());

    let front = front(&scene, arguments.level);
    let bytes = upload(&scene, &arguments.out, &front, &mut renderer)?;
    let triangles: u64 =
        front.iter().map(|&node| scene.nodes[node as usize].triangles).map(u64::from).sum();
    println!("{} nodes, {triangles} triangles, {bytes} bytes", front.len());

    let (pose, near) = pose(&scene, &arguments)?;
    let mut times = Vec::new();
    for _ in 0..arguments.repeat {
        times.push(renderer.draw(&front, &pose, near)?);
    }
    println!("first frame: {:.2} ms", times[0].encode_ms + times[0].gpu_wait_ms);
    times.sort_by(|a, b| a.gpu_wait_ms.total_cmp(&b.gpu_wait_ms));
    let median = times[times.len() / 2];
    println!(
        "median frame: {:.2} ms to encode, {:.2} ms to draw",
        median.encode_ms, median.gpu_wait_ms
    );
    renderer.snapshot()?.save(&arguments.image)?;
    Ok(())
}

/// The camera, and its near plane.
fn pose(scene: &Scene, arguments: &Arguments) -> Result<(Pose, f32)> {
    let bounds = scene.bounds().ok_or("the scene has no nodes")?.map(DVec3::from);
    let middle = (bounds[0] + bounds[1]) / 2.0;
    let size = (bounds[1] - bounds[0]).length();
    let at = arguments.at.unwrap_or(middle);
    let south = if scene.up == UpAxis::Z { DVec3::NEG_Y } else { DVec3::Z };
    let ahead = -(south * 0.75 + up_vector(scene.up) * 0.6).normalize();
    // As near as all corners of the scene are in the picture.
    let rotation = looking_at(scene.up, DVec3::ZERO, ahead).ok_or("no direction")?;
    let half_height = (arguments.fov_y_deg.to_radians() / 2.0).tan();
    let [width, height] = arguments.options.size.map(f64::from);
    let away = (0..8).map(|corner| {
        let side = |axis: usize| bounds[corner >> axis & 1][axis];
        let seen = rotation.inverse() * (DVec3::new(side(0), side(1), side(2)) - at);
        let high = seen.y.abs() / half_height;
        seen.z + high.max(seen.x.abs() / half_height * height / width)
    });
    let overview = at - ahead * away.fold(0.0, f64::max);
    let position = arguments.from.unwrap_or(overview);
    let rotation =
        looking_at(scene.up, position, at).ok_or("--from and --at are the same place")?;
    let near = (size * 1e-4) as f32;
    Ok((Pose { position, rotation, fov_y_deg: arguments.fov_y_deg }, near.max(1e-3)))
}

fn parse() -> Result<Arguments> {
    let mut options = RenderOptions::default();
    let (mut level, mut from, mut at, mut fov_y_deg, mut repeat) = (0, None, None, 60.0, 1);
    let mut places = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--level" => level = value()?.parse()?,
            "--leaves" => level = u32::MAX,
            "--size" => {
                let value = value()?;
                let (width, height) = value.split_once('x').ok_or("--size is WxH")?;
                options.size = [width.parse()?, height.parse()?];
            }
            "--from" => from = Some(place(&value()?)?),
            "--at" => at = Some(place(&value()?)?),
            "--fov" => fov_y_deg = value()?.parse()?,
            "--adapter" => options.adapter = Some(value()?),
            "--shading" => {
                options.shading = match value()?.as_str() {
                    "photo" => Shading::Photo,
                    "head-light" => Shading::HeadLight,
                    "unlit" => Shading::Unlit,
                    other => return Err(format!("no such shading: {other}").into()),
                }
            }
            "--show-levels" => options.show_levels = true,
            "--cull" => options.cull = true,
            "--repeat" => repeat = value()?.parse::<usize>()?.max(1),
            _ if word.starts_with("--") => return Err(format!("no such option: {word}").into()),
            _ => places.push(PathBuf::from(word)),
        }
    }
    let [out, image] = <[PathBuf; 2]>::try_from(places)
        .map_err(|_| "usage: render_scene OUT IMAGE.png [options]")?;
    Ok(Arguments { out, image, level, from, at, fov_y_deg, repeat, options })
}

fn place(text: &str) -> Result<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(str::parse).collect::<Result<_, _>>()?;
    let [x, y, z] = numbers[..] else { return Err(format!("{text} is not X,Y,Z").into()) };
    Ok(DVec3::new(x, y, z))
}
