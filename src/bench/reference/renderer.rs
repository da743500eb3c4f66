//! Draws any nodes of a scene, whatever a run holds in memory.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use image::RgbaImage;

use crate::bench::node_cache::NodeCache;
use crate::bench::session::Session;
use crate::camera::Pose;
use crate::render::content::TextureFormat;
use crate::render::{AdapterLabel, RenderOptions, Renderer};
use crate::runtime::SceneTree;
use crate::{Error, Result};

/// Nodes that are read and decoded at once, before they are copied to the graphics card.
const READ_AT_ONCE: usize = 64;

/// Draws any nodes of a scene with a renderer of its own, which holds so many bytes and no more:
/// where that is too little for a picture, it is drawn part by part.
pub struct ReferenceRenderer {
    cache: NodeCache<Renderer>,
    near: f32,
    /// Files that cannot be used, each with what was wrong.
    broken: BTreeMap<u32, String>,
}

impl ReferenceRenderer {
    /// One that holds at most `cap_bytes`, or the bytes of one node where that is more.
    pub fn new(session: &Session, options: &RenderOptions, cap_bytes: u64) -> Result<Self> {
        Self::with_textures(session, options, cap_bytes, TextureFormat::Rgba8)
    }

    /// The same with textures in a format; fails where the adapter cannot sample it.
    pub fn with_textures(
        session: &Session,
        options: &RenderOptions,
        cap_bytes: u64,
        format: TextureFormat,
    ) -> Result<Self> {
        let renderer = Renderer::new(&RenderOptions { keep_depths: true, ..options.clone() })?;
        renderer.check_textures(format)?;
        let (tree, files) = (session.tree().clone(), session.files().with_textures(format));
        Ok(Self {
            near: tree.near_plane(),
            cache: NodeCache::new(tree, files, renderer, cap_bytes),
            broken: BTreeMap::new(),
        })
    }

    /// The hierarchy.
    pub fn tree(&self) -> &SceneTree {
        self.cache.tree()
    }

    /// The adapter that draws.
    pub fn adapter(&self) -> &AdapterLabel {
        self.cache.borrowed_renderer().adapter()
    }

    /// Files that could not be used, each with what was wrong.
    pub fn broken(&self) -> impl Iterator<Item = &String> {
        self.broken.values()
    }

    /// Bytes that are held now.
    pub fn used_bytes(&self) -> u64 {
        self.cache.used_bytes()
    }

    /// Draws nodes; those whose files cannot be used are left out. Alpha of the picture is 0 where
    /// nothing was drawn.
    pub fn render(&mut self, nodes: &[u32], pose: &Pose) -> Result<RgbaImage> {
        // What is there comes first, before any of it is evicted.
        let (there, missing): (Vec<u32>, Vec<u32>) =
            nodes.iter().partition(|&&node| self.cache.holds(node));
        self.cache.renderer().draw(&[], pose, self.near)?;
        let mut part = Vec::new();
        let (mut bytes, mut textures) = (0, BTreeSet::new());
        for node in there.into_iter().chain(missing) {
            let more = self.cache.bytes_beside(node, &textures);
            if !part.is_empty() && bytes + more > self.cache.cap_bytes() {
                self.draw_part(&part, pose)?;
                part.clear();
                textures.clear();
                bytes = 0;
            }
            bytes += self.cache.bytes_beside(node, &textures);
            textures.extend(self.cache.textures_of(node));
            part.push(node);
        }
        self.draw_part(&part, pose)?;
        self.cache.borrowed_renderer().surface()
    }

    /// From now on draws of nodes what [is on a side](Renderer::cut_at) of a box.
    pub fn cut_at(&mut self, cut_at: Option<[DVec3; 2]>) {
        self.cache.renderer().cut_at(cut_at);
    }

    /// Metres along the view to what the last picture shows, infinite where that is nothing.
    pub fn depths(&self) -> Result<Vec<f32>> {
        self.cache.borrowed_renderer().depths(self.near)
    }

    fn draw_part(&mut self, part: &[u32], pose: &Pose) -> Result<()> {
        let usable: Vec<u32> =
            part.iter().copied().filter(|node| !self.broken.contains_key(node)).collect();
        for nodes in self.cache.want(&usable).chunks(READ_AT_ONCE) {
            self.load(nodes)?;
        }
        let held: Vec<u32> = usable.into_iter().filter(|&node| self.cache.holds(node)).collect();
        let renderer = self.cache.renderer();
        renderer.finish_uploads()?;
        renderer.draw_over(&held, pose, self.near)?;
        Ok(())
    }

    /// Reads nodes and copies them to the graphics card.
    fn load(&mut self, nodes: &[u32]) -> Result<()> {
        for (&node, arrival) in nodes.iter().zip(self.cache.read(nodes)) {
            let broken = match arrival {
                Ok(arrival) if self.cache.hold(&arrival)? => continue,
                Ok(_) => format!("node {node}: a shared picture of it cannot be used"),
                Err(error @ Error::Input { .. }) => error.to_string(),
                Err(error) => return Err(error),
            };
            self.broken.insert(node, broken);
        }
        Ok(())
    }
}
