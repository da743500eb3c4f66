//! Times frames of rolling ground in nodes of some ten thousand triangles: what the renderer
//! costs by itself on this machine, before there is a scene.
//!
//! usage: render_times [--plain] [--across N] [--frames N] [--adapter NAME] [--shading photo|head-light|unlit]

use std::error::Error;
use std::path::Path;

use glam::DVec3;
use hlod::camera::{Pose, looking_at};
use hlod::format::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use hlod::mesh::{AlphaMode, UpAxis, Wrap};
use hlod::render::content::Content;
use hlod::render::{RenderOptions, Renderer, Shading};

/// Quads along a node's side.
const QUADS: u32 = 70;
/// Metres along a node's side.
const SIDE: f32 = 50.0;
/// Frames of which the median is taken, where nothing else is asked for.
const FRAMES: usize = 41;

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = RenderOptions::default();
    let mut textured = true;
    let mut frames = FRAMES;
    let mut across = vec![0, 1, 2, 3, 5, 10];
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--plain" => textured = false,
            "--across" => across = vec![words.next().ok_or("--across N")?.parse()?],
            "--frames" => frames = words.next().ok_or("--frames N")?.parse::<usize>()?.max(1),
            "--adapter" => options.adapter = words.next(),
            "--shading" => {
                options.shading = match words.next().as_deref() {
                    Some("head-light") => Shading::HeadLight,
                    Some("unlit") => Shading::Unlit,
                    _ => Shading::Photo,
                }
            }
            other => return Err(format!("no such option: {other}").into()),
        }
    }
    let mut renderer = Renderer::new(&options)?;
    println!("{}, {:?}", renderer.adapter(), options.size);
    println!("nodes  triangles  encode ms  draw ms (median of {frames})");
    for across in across {
        let mut front = Vec::new();
        for node in 0..across * across {
            let content =
                Content::from_mesh(Path::new("ground"), &ground(node, across, textured), |_| None)?;
            renderer.upload(node, 0, &content)?;
            front.push(node);
        }
        renderer.finish_uploads()?;
        // The whole picture is covered, whatever the number of nodes.
        let half = f64::from(across.max(1)) * f64::from(SIDE) / 2.0;
        let position = DVec3::new(half, half - half * 0.35, half * 0.55);
        let at = DVec3::new(half, half, 0.0);
        let rotation = looking_at(UpAxis::Z, position, at).ok_or("looks at itself")?;
        let pose = Pose { position, rotation, fov_y_deg: 50.0 };
        for _ in 0..3 {
            renderer.draw(&front, &pose, 0.1)?;
        }
        let mut times = Vec::new();
        for _ in 0..frames {
            times.push(renderer.draw(&front, &pose, 0.1)?);
        }
        times.sort_by(|a, b| a.gpu_wait_ms.total_cmp(&b.gpu_wait_ms));
        let median = times[frames / 2];
        println!(
            "{:5}  {:9}  {:9.3}  {:7.2}",
            front.len(),
            median.triangles,
            median.encode_ms,
            median.gpu_wait_ms
        );
        front.iter().for_each(|&node| renderer.remove(node));
    }
    Ok(())
}

/// One square of the ground.
fn ground(node: u32, across: u32, textured: bool) -> NodeMesh {
    let origin = [(node % across) as f32 * SIDE, (node / across) as f32 * SIDE, 0.0];
    let along = QUADS + 1;
    let vertices = (0..along * along).map(|vertex| [vertex % along, vertex / along]);
    let share = |quads: u32| quads as f32 / QUADS as f32;
    let positions = vertices.clone().map(|[x, y]| {
        let [x, y] = [x, y].map(|quads| share(quads) * SIDE);
        [x, y, 1.5 * ((x + origin[0]) * 0.3).sin() * ((y + origin[1]) * 0.2).cos()]
    });
    let corners = (0..QUADS * QUADS).flat_map(|quad| {
        let low = quad / QUADS * along + quad % QUADS;
        [low, low + 1, low + along + 1, low, low + along + 1, low + along]
    });
    let picture = image::RgbImage::from_fn(1024, 1024, |x, y| {
        image::Rgb([(x ^ y) as u8, (x * 3) as u8, (y * 5) as u8])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    let images = if textured && picture.write_to(&mut bytes, image::ImageFormat::Png).is_ok() {
        let data = NodeImageData::Embedded {
            mime: "image/png",
            bytes: bytes.into_inner(),
            file_name: None,
        };
        vec![NodeImage { width: 1024, height: 1024, data }]
    } else {
        Vec::new()
    };
    let surface = Surface {
        base_color: [0.8, 0.8, 0.7, 1.0],
        image: textured.then_some(0),
        wrap: [Wrap::Clamp; 2],
        alpha: AlphaMode::Opaque,
        double_sided: true,
        is_unlit: false,
    };
    let texcoords = vertices.map(|corner| corner.map(share)).collect();
    let primitive = Primitive {
        positions: positions.collect(),
        texcoords: if textured { texcoords } else { Vec::new() },
        colors: Vec::new(),
        normals: Vec::new(),
        indices: corners.collect(),
        skirt_triangles: 0,
        surface,
    };
    NodeMesh { origin: origin.map(f64::from), images, primitives: vec![primitive] }
}
