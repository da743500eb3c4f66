//! Levels of a built scene on a graphics card.

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use hlod::format::{NODES_DIR, Scene, TEXTURES_DIR};
use hlod::render::Renderer;
use hlod::render::content::{Content, Picture, TextureFormat, held_bytes, picture_bytes};

type Result<T, E = Box<dyn Error>> = std::result::Result<T, E>;

/// The nodes at a level, and leaves above it.
pub fn front(scene: &Scene, level: u32) -> Vec<u32> {
    let nodes = scene.nodes.iter().zip(0..);
    let drawn = nodes.filter(|(node, _)| {
        node.level == level || (node.level < level && node.first_child.is_none())
    });
    drawn.map(|(_, index)| index).collect()
}

/// Uploads the front and the shared pictures that it uses; the bytes that they take.
pub fn upload(scene: &Scene, out: &Path, front: &[u32], renderer: &mut Renderer) -> Result<u64> {
    let shared = |name: &str| {
        let mut textures = scene.shared_textures.iter().zip(0..);
        textures.find(|(texture, _)| texture.file_name == name).map(|(_, index)| index)
    };
    let mut foretold = 0;
    let nodes = || front.iter().map(|&index| (index, &scene.nodes[index as usize]));
    let mut textures: Vec<u32> =
        nodes().flat_map(|(_, node)| &node.shared_textures).copied().collect();
    textures.sort();
    textures.dedup();
    let (mut decoding, mut uploading) = (Duration::ZERO, Duration::ZERO);
    for index in textures {
        let texture = &scene.shared_textures[index as usize];
        let file = out.join(TEXTURES_DIR).join(&texture.file_name);
        let size = [texture.width, texture.height];
        let begin = Instant::now();
        let picture = Picture::decode(&file, &std::fs::read(&file)?, size)?;
        let decoded = Instant::now();
        renderer.upload_shared(index, &picture)?;
        decoding += decoded - begin;
        uploading += decoded.elapsed();
        foretold += picture_bytes(size, TextureFormat::Rgba8);
    }
    for (index, node) in nodes() {
        let file = out.join(NODES_DIR).join(&node.file);
        let begin = Instant::now();
        let content = Content::decode(&file, &std::fs::read(&file)?, shared)?;
        let decoded = Instant::now();
        renderer.upload(index, node.level, &content)?;
        decoding += decoded - begin;
        uploading += decoded.elapsed();
        foretold += held_bytes(node.vertices, node.triangles, &node.pictures, TextureFormat::Rgba8);
    }
    let begin = Instant::now();
    renderer.finish_uploads()?;
    uploading += begin.elapsed();
    eprintln!("{decoding:.1?} to read and decode, {uploading:.1?} to upload");
    if renderer.gpu_bytes() != foretold {
        return Err(format!("{foretold} bytes foretold, {} taken", renderer.gpu_bytes()).into());
    }
    Ok(foretold)
}
