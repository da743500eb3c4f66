//! Draws any nodes of a scene, whatever a run holds in memory.

use std::collections::{BTreeMap, BTreeSet};

use image::RgbaImage;
use rayon::prelude::*;

use crate::bench::session::Session;
use crate::bench::wall::near_plane;
use crate::camera::Pose;
use crate::loading::{Arrival, NodeFiles};
use crate::render::content::{held_bytes, picture_bytes};
use crate::render::{AdapterLabel, RenderOptions, Renderer};
use crate::runtime::SceneTree;
use crate::runtime::residency::Sizes;
use crate::{Error, Result};

/// Nodes that are read and decoded at once, before they are copied to the graphics card.
const READ_AT_ONCE: usize = 64;

/// Draws any nodes of a scene with a renderer of its own, which holds so many bytes and no more:
/// where that is too little for a picture, it is drawn part by part.
pub struct ReferenceRenderer {
    tree: SceneTree,
    files: NodeFiles,
    sizes: Sizes,
    renderer: Renderer,
    near: f32,
    cap_bytes: u64,
    used_bytes: u64,
    /// Nodes that are held, with when they were last drawn.
    held: BTreeMap<u32, u64>,
    /// Shared pictures that are held, with how many of the nodes need them.
    textures: BTreeMap<u32, u32>,
    parts: u64,
    /// Files that cannot be used, each with what was wrong.
    broken: BTreeMap<u32, String>,
}

impl ReferenceRenderer {
    /// One that holds at most `cap_bytes`, or the bytes of one node where that is more.
    pub fn new(session: &Session, options: &RenderOptions, cap_bytes: u64) -> Result<Self> {
        let options = RenderOptions { keep_depths: true, ..options.clone() };
        let picture = |[width, height]: [u32; 2]| picture_bytes(width, height);
        Ok(Self {
            tree: session.tree().clone(),
            files: session.files(),
            sizes: Sizes::new(session.scene(), held_bytes, picture),
            renderer: Renderer::new(&options)?,
            near: near_plane(session.tree()),
            cap_bytes,
            used_bytes: 0,
            held: BTreeMap::new(),
            textures: BTreeMap::new(),
            parts: 0,
            broken: BTreeMap::new(),
        })
    }

    /// The hierarchy.
    pub fn tree(&self) -> &SceneTree {
        &self.tree
    }

    /// The adapter that draws.
    pub fn adapter(&self) -> &AdapterLabel {
        self.renderer.adapter()
    }

    /// Files that could not be used, each with what was wrong.
    pub fn broken(&self) -> impl Iterator<Item = &String> {
        self.broken.values()
    }

    /// Bytes that are held now.
    pub fn used_bytes(&self) -> u64 {
        self.used_bytes
    }

    /// Draws nodes; those whose files cannot be used are left out. Alpha of the picture is 0 where
    /// nothing was drawn.
    pub fn render(&mut self, nodes: &[u32], pose: &Pose) -> Result<RgbaImage> {
        // What is there comes first, before any of it is evicted.
        let (there, missing): (Vec<u32>, Vec<u32>) =
            nodes.iter().partition(|node| self.held.contains_key(node));
        self.renderer.draw(&[], pose, self.near)?;
        let mut part = Vec::new();
        let (mut bytes, mut textures) = (0, BTreeSet::new());
        for node in there.into_iter().chain(missing) {
            let more = self.bytes_of(node, &textures);
            if !part.is_empty() && bytes + more > self.cap_bytes {
                self.paint_part(&part, pose)?;
                part.clear();
                textures.clear();
                bytes = 0;
            }
            bytes += self.bytes_of(node, &textures);
            textures.extend(&self.sizes.nodes[node as usize].textures);
            part.push(node);
        }
        self.paint_part(&part, pose)?;
        self.renderer.surface()
    }

    /// Metres along the view to what the last picture shows, infinite where that is nothing.
    pub fn depths(&self) -> Result<Vec<f32>> {
        self.renderer.depths(self.near)
    }

    /// Bytes of a node and of those of its shared pictures that are not among `textures`.
    fn bytes_of(&self, node: u32, textures: &BTreeSet<u32>) -> u64 {
        let size = &self.sizes.nodes[node as usize];
        let more = size.textures.iter().filter(|texture| !textures.contains(texture));
        size.held_bytes + more.map(|&texture| self.texture_bytes(texture)).sum::<u64>()
    }

    fn texture_bytes(&self, texture: u32) -> u64 {
        self.sizes.textures[texture as usize].held_bytes
    }

    fn paint_part(&mut self, part: &[u32], pose: &Pose) -> Result<()> {
        self.parts += 1;
        let wanted: BTreeSet<u32> = part.iter().copied().collect();
        for (node, drawn) in &mut self.held {
            if wanted.contains(node) {
                *drawn = self.parts;
            }
        }
        let missing: Vec<u32> = wanted
            .into_iter()
            .filter(|node| !self.held.contains_key(node) && !self.broken.contains_key(node))
            .collect();
        self.evict_for(&missing);
        for nodes in missing.chunks(READ_AT_ONCE) {
            self.load(nodes)?;
        }
        self.renderer.finish_uploads()?;
        let usable: Vec<u32> =
            part.iter().copied().filter(|node| self.held.contains_key(node)).collect();
        self.renderer.draw_over(&usable, pose, self.near)?;
        Ok(())
    }

    /// Evicts what was drawn longest ago until `missing` fit, but nothing that the present part draws.
    fn evict_for(&mut self, missing: &[u32]) {
        let mut textures: BTreeSet<u32> = self.textures.keys().copied().collect();
        let mut more = 0;
        for &node in missing {
            more += self.bytes_of(node, &textures);
            textures.extend(&self.sizes.nodes[node as usize].textures);
        }
        let mut oldest: Vec<(u64, u32)> =
            self.held.iter().map(|(&node, &drawn)| (drawn, node)).collect();
        oldest.retain(|&(drawn, _)| drawn < self.parts);
        oldest.sort_unstable();
        for (_, node) in oldest {
            if self.used_bytes + more <= self.cap_bytes {
                break;
            }
            self.let_go(node);
        }
    }

    fn let_go(&mut self, node: u32) {
        self.held.remove(&node);
        self.renderer.remove(node);
        let size = &self.sizes.nodes[node as usize];
        self.used_bytes -= size.held_bytes;
        for &texture in &size.textures {
            let users = self.textures.get_mut(&texture).map_or(0, |users| {
                *users -= 1;
                *users
            });
            if users == 0 {
                self.textures.remove(&texture);
                self.renderer.remove_shared(texture);
                self.used_bytes -= self.sizes.textures[texture as usize].held_bytes;
            }
        }
    }

    /// Reads nodes and copies them to the graphics card.
    fn load(&mut self, nodes: &[u32]) -> Result<()> {
        // Each shared picture is read with the first node that needs it.
        let mut known: BTreeSet<u32> = self.textures.keys().copied().collect();
        let own: Vec<(u32, Vec<u32>)> = nodes
            .iter()
            .map(|&node| {
                let textures = &self.sizes.nodes[node as usize].textures;
                (node, textures.iter().copied().filter(|&texture| known.insert(texture)).collect())
            })
            .collect();
        let files = &self.files;
        let read = |(node, own): &(u32, Vec<u32>)| files.read(*node, |t| !own.contains(&t));
        let arrivals: Vec<Result<Arrival>> = own.par_iter().map(read).collect();
        for (&node, arrival) in nodes.iter().zip(arrivals) {
            match arrival {
                Ok(arrival) => self.hold(arrival)?,
                Err(error @ Error::Input { .. }) => {
                    self.broken.insert(node, error.to_string());
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn hold(&mut self, arrival: Arrival) -> Result<()> {
        let Arrival { node, content, pictures } = arrival;
        for (texture, picture) in &pictures {
            self.renderer.upload_shared(*texture, picture)?;
            self.textures.entry(*texture).or_insert(0);
            self.used_bytes += self.texture_bytes(*texture);
        }
        let size = &self.sizes.nodes[node as usize];
        // A picture that could not be read with the node that it came with.
        if let Some(texture) = size.textures.iter().find(|t| !self.textures.contains_key(t)) {
            let what = format!("node {node}: its shared picture {texture} cannot be used");
            self.broken.insert(node, what);
            return Ok(());
        }
        self.renderer.upload(node, self.tree.node(node).level, &content)?;
        for texture in &size.textures {
            self.textures.entry(*texture).and_modify(|users| *users += 1);
        }
        self.used_bytes += size.held_bytes;
        self.held.insert(node, self.parts);
        Ok(())
    }
}
