//! Reads all node files of a result, as the loading thread does without drawing them, and says how
//! many bytes they have and how long it took: the fastest of several times, on one thread, from the
//! page cache. `scripts/encodings` compares encodings with it.
//!
//! usage: load_nodes RUNS OUT

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use hlod::format::{NODES_DIR, NodeImageData, Scene, read_glb};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [runs, out] = &arguments[..] else {
        return Err("usage: load_nodes RUNS OUT".into());
    };
    let nodes = Path::new(out).join(NODES_DIR);
    let scene = Scene::read(Path::new(out))?;
    let (mut fastest, mut bytes, mut pictures) = (f64::INFINITY, 0, 0);
    for _ in 0..runs.parse::<usize>()?.max(1) {
        (bytes, pictures) = (0, 0);
        let begin = Instant::now();
        for node in &scene.nodes {
            let file = std::fs::read(nodes.join(&node.file))?;
            let mesh = read_glb(&file, Path::new(&node.file))?;
            bytes += file.len();
            for image in &mesh.images {
                if let NodeImageData::Embedded { bytes, .. } = &image.data {
                    pictures += bytes.len();
                }
            }
        }
        fastest = fastest.min(begin.elapsed().as_secs_f64());
    }
    println!("{bytes} {pictures} {fastest}");
    Ok(())
}
