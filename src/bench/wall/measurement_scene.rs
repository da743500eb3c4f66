//! Nodes on the graphics card for measurements, outside of any run.

use std::collections::BTreeSet;
use std::time::Instant;

use crate::Result;
use crate::loading::{Arrival, NodeFiles};
use crate::render::Renderer;
use crate::render::content::{DrawPicture, held_bytes, picture_bytes};
use crate::runtime::SceneTree;
use crate::runtime::residency::Sizes;

/// Puts on the graphics card what is to be drawn next, and takes down all of it at the end.
pub struct MeasurementScene<'a> {
    tree: &'a SceneTree,
    files: NodeFiles,
    sizes: Sizes,
    renderer: &'a mut Renderer,
    nodes: BTreeSet<u32>,
    /// Nodes that are there without their pictures.
    stripped: BTreeSet<u32>,
    textures: Vec<bool>,
    /// Bytes of the files that were read.
    read_bytes: u64,
    /// Milliseconds that it took to read and decode them.
    read_ms: f64,
    /// Bytes that were copied to the card.
    uploaded_bytes: u64,
    /// Milliseconds that it took.
    upload_ms: f64,
}

impl<'a> MeasurementScene<'a> {
    /// An empty one.
    pub fn new(tree: &'a SceneTree, files: NodeFiles, renderer: &'a mut Renderer) -> Self {
        let textures = vec![false; files.scene().shared_textures.len()];
        Self {
            tree,
            sizes: Sizes::new(files.scene(), held_bytes, |[width, height]| {
                picture_bytes(width, height)
            }),
            files,
            renderer,
            nodes: BTreeSet::new(),
            stripped: BTreeSet::new(),
            textures,
            read_bytes: 0,
            read_ms: 0.0,
            uploaded_bytes: 0,
            upload_ms: 0.0,
        }
    }

    /// What draws.
    pub fn renderer(&mut self) -> &mut Renderer {
        self.renderer
    }

    /// The hierarchy and the files of its nodes.
    pub fn scene(&self) -> (&'a SceneTree, &NodeFiles) {
        (self.tree, &self.files)
    }

    /// Bytes of files that were read and decoded in a millisecond, once any were.
    pub fn bytes_per_ms(&self) -> Option<f64> {
        (self.read_bytes > 0 && self.read_ms > 0.0).then(|| self.read_bytes as f64 / self.read_ms)
    }

    /// Bytes that were copied to the card so far, and milliseconds that it took.
    pub fn uploads(&self) -> (u64, f64) {
        (self.uploaded_bytes, self.upload_ms)
    }

    /// Has exactly these nodes on the card.
    pub fn show(&mut self, front: &[u32]) -> Result<()> {
        let wanted: BTreeSet<u32> = front.iter().copied().collect();
        for &node in self.nodes.difference(&wanted).chain(&self.stripped) {
            self.renderer.remove(node);
        }
        self.stripped.clear();
        let missing: Vec<u32> = wanted.difference(&self.nodes).copied().collect();
        self.nodes.retain(|node| wanted.contains(node));
        for node in missing {
            self.add(node)?;
        }
        let begin = Instant::now();
        self.renderer.finish_uploads()?;
        self.upload_ms += begin.elapsed().as_secs_f64() * 1e3;
        Ok(())
    }

    /// Has exactly these nodes on the card, none with a picture.
    pub fn strip(&mut self, front: &[u32]) -> Result<()> {
        self.show(front)?;
        for &node in front {
            let mut content = self.read(node)?.content;
            content.draws.iter_mut().for_each(|draw| draw.picture = DrawPicture::None);
            self.renderer.upload(node, self.tree.node(node).level, &content)?;
            self.nodes.remove(&node); // read it again when its pictures are wanted
            self.stripped.insert(node);
        }
        self.renderer.finish_uploads()
    }

    /// Reads a node and copies it to the card.
    pub fn add(&mut self, node: u32) -> Result<()> {
        let arrival = self.read(node)?;
        let begin = Instant::now();
        self.renderer.upload(node, self.tree.node(node).level, &arrival.content)?;
        self.upload_ms += begin.elapsed().as_secs_f64() * 1e3;
        self.uploaded_bytes += self.sizes.nodes[node as usize].held_bytes;
        self.nodes.insert(node);
        Ok(())
    }

    /// Reads a node, and copies to the card the shared pictures that come with it.
    fn read(&mut self, node: u32) -> Result<Arrival> {
        let begin = Instant::now();
        let arrival = self.files.read(node, |texture| self.textures[texture as usize])?;
        self.read_ms += begin.elapsed().as_secs_f64() * 1e3;
        let scene = self.files.scene();
        self.read_bytes += scene.nodes[node as usize].file_bytes;
        for (texture, picture) in &arrival.pictures {
            self.textures[*texture as usize] = true;
            self.read_bytes += scene.shared_textures[*texture as usize].bytes;
            self.renderer.upload_shared(*texture, picture)?;
        }
        Ok(arrival)
    }
}

impl Drop for MeasurementScene<'_> {
    fn drop(&mut self) {
        self.nodes.iter().chain(&self.stripped).for_each(|&node| self.renderer.remove(node));
        (0..self.textures.len() as u32).for_each(|texture| self.renderer.remove_shared(texture));
    }
}
