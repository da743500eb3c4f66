//! How many triangles textured depth meshes take: `depth_meshes OUT PATH.csv FRAME REACH CULL PIXELS`.
//!
//! Draws the leaves beyond a box of CULL metres to each side of a camera of a path, towards six sides, and
//! prints what surfaces of them have left within half a pixel of PIXELS x PIXELS for an eye that moves
//! REACH metres.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use hlod::bench::{ReferenceRenderer, Session};
use hlod::camera::{Pose, from_angles, read_path};
use hlod::cells::parallax_simplify::simplified;
use hlod::cells::{Depths, ParallaxMesh};
use hlod::render::RenderOptions;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, path, frame, reach, cull, pixels] = &arguments[..] else {
        return Err("OUT PATH.csv FRAME REACH CULL PIXELS".into());
    };
    let (reach, cull, pixels): (f64, f64, u32) = (reach.parse()?, cull.parse()?, pixels.parse()?);
    let session = Session::open(Path::new(out))?;
    let camera = read_path(Path::new(path), session.scene().up)?;
    let at = camera.frames[frame.parse::<usize>()?].pose.position;
    let options = RenderOptions { size: [pixels; 2], ..RenderOptions::default() };
    let mut renderer = ReferenceRenderer::new(&session, &options, 4 << 30)?;
    let tree = session.tree();
    let is_outside = |node: u32| {
        let [min, max] = tree.node(node).bbox;
        (min - at).cmpgt(DVec3::splat(cull)).any() || (at - max).cmpgt(DVec3::splat(cull)).any()
    };
    let leaves: Vec<u32> = (0..tree.len() as u32)
        .filter(|&node| tree.children(node).is_empty() && is_outside(node))
        .collect();
    println!("{} leaves beyond {cull} m of {at}", leaves.len());
    for (yaw, pitch) in
        [(0.0, 0.0), (90.0, 0.0), (180.0, 0.0), (270.0, 0.0), (0.0, 90.0), (0.0, -90.0)]
    {
        let rotation = from_angles(session.scene().up, yaw, pitch, 0.0);
        let pose = Pose { position: at, rotation, fov_y_deg: 90.0 };
        let begin = Instant::now();
        let picture = renderer.render(&leaves, &pose)?;
        let metres = renderer.depths()?;
        let drawn_ms = begin.elapsed().as_secs_f64() * 1e3;
        picture.save(format!("/tmp/face-{yaw}-{pitch}.png"))?;
        let depths = Depths {
            metres: &metres,
            width: pixels as usize,
            pixel_metres: (f64::from(pixels) / 2.0 * reach) as f32,
        };
        let begin = Instant::now();
        let mesh = ParallaxMesh::new(&depths, 0.5);
        let mesh_ms = begin.elapsed().as_secs_f64() * 1e3;
        let begin = Instant::now();
        let fewer = simplified(&mesh, &depths, 1.0)?;
        let fewer_ms = begin.elapsed().as_secs_f64() * 1e3;
        println!(
            "{yaw} {pitch}: {} triangles, {} left, error {:.2}, {} missed; {drawn_ms:.0} + {mesh_ms:.0} + {fewer_ms:.0} ms",
            mesh.triangles.len(),
            fewer.mesh.triangles.len(),
            fewer.most_error,
            fewer.missed
        );
    }
    Ok(())
}
