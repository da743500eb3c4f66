//! Any nodes of a scene on a graphics card, whatever a run has there.

use std::borrow::BorrowMut;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::Result;
use crate::loading::{Arrival, NodeFiles};
use crate::render::Renderer;
use crate::render::content::{held_bytes, picture_bytes};
use crate::runtime::SceneTree;
use crate::runtime::residency::Sizes;

/// Nodes on a graphics card with the shared pictures that they need: what was drawn longest ago
/// gives way, in any order and without regard to the hierarchy.
///
/// `R` is a renderer, or borrows one that others draw with later.
pub struct NodeCache<R> {
    tree: SceneTree,
    files: NodeFiles,
    sizes: Sizes,
    renderer: R,
    cap_bytes: u64,
    used_bytes: u64,
    /// Nodes that are held, with when they were last wanted.
    held: BTreeMap<u32, u64>,
    /// Shared pictures that are held, with how many of the nodes need them.
    textures: BTreeMap<u32, u32>,
    /// How often nodes were wanted.
    wants: u64,
}

impl<R: BorrowMut<Renderer>> NodeCache<R> {
    /// An empty one, to hold at most `cap_bytes`, or what is wanted at once where that is more.
    pub fn new(tree: SceneTree, files: NodeFiles, renderer: R, cap_bytes: u64) -> Self {
        let format = files.texture_format();
        let held = |vertices: u32, triangles: u32, own: &[[u32; 2]]| {
            held_bytes(vertices, triangles, own, format)
        };
        Self {
            sizes: Sizes::new(files.scene(), held, |size| picture_bytes(size, format))
                .with_faces(files.faces(), held),
            tree,
            files,
            renderer,
            cap_bytes,
            used_bytes: 0,
            held: BTreeMap::new(),
            textures: BTreeMap::new(),
            wants: 0,
        }
    }

    /// What draws.
    pub fn renderer(&mut self) -> &mut Renderer {
        self.renderer.borrow_mut()
    }

    /// The same, to be asked.
    pub fn borrowed_renderer(&self) -> &Renderer {
        self.renderer.borrow()
    }

    /// The hierarchy.
    pub fn tree(&self) -> &SceneTree {
        &self.tree
    }

    /// Bytes that are held now.
    pub fn used_bytes(&self) -> u64 {
        self.used_bytes
    }

    /// The most that is held, unless more is wanted at once.
    pub fn cap_bytes(&self) -> u64 {
        self.cap_bytes
    }

    /// Whether a node is held.
    pub fn holds(&self, node: u32) -> bool {
        self.held.contains_key(&node)
    }

    /// Bytes that a node takes, its shared pictures apart.
    pub fn held_bytes(&self, node: u32) -> u64 {
        self.sizes.nodes[node as usize].held_bytes
    }

    /// Bytes of a node and of those of its shared pictures that are not among `textures`.
    pub fn bytes_beside(&self, node: u32, textures: &BTreeSet<u32>) -> u64 {
        let more = self.textures_of(node).iter().filter(|texture| !textures.contains(texture));
        self.held_bytes(node) + more.map(|&texture| self.texture_bytes(texture)).sum::<u64>()
    }

    /// The shared pictures that a node needs.
    pub fn textures_of(&self, node: u32) -> &[u32] {
        &self.sizes.nodes[node as usize].textures
    }

    fn texture_bytes(&self, texture: u32) -> u64 {
        self.sizes.textures[texture as usize].held_bytes
    }

    /// Makes room for nodes that are to be drawn together, and names those that are not held.
    pub fn want(&mut self, nodes: &[u32]) -> Vec<u32> {
        self.wants += 1;
        let mut missing = BTreeSet::new();
        for &node in nodes {
            match self.held.get_mut(&node) {
                Some(wanted) => *wanted = self.wants,
                None => drop(missing.insert(node)),
            }
        }
        let missing: Vec<u32> = missing.into_iter().collect();
        self.evict_for(&missing);
        missing
    }

    /// Evicts what was wanted longest ago until `missing` fit, but nothing that is wanted now.
    fn evict_for(&mut self, missing: &[u32]) {
        let mut textures: BTreeSet<u32> = self.textures.keys().copied().collect();
        let mut more = 0;
        for &node in missing {
            more += self.bytes_beside(node, &textures);
            textures.extend(self.textures_of(node));
        }
        let mut oldest: Vec<(u64, u32)> =
            self.held.iter().map(|(&node, &wanted)| (wanted, node)).collect();
        oldest.retain(|&(wanted, _)| wanted < self.wants);
        oldest.sort_unstable();
        for (_, node) in oldest {
            if self.used_bytes + more <= self.cap_bytes {
                break;
            }
            self.let_go(node);
        }
    }

    /// Reads and decodes nodes side by side. Each shared picture that is not held comes with the
    /// first of them that needs it.
    pub fn read(&self, nodes: &[u32]) -> Vec<Result<Arrival>> {
        let mut known: BTreeSet<u32> = self.textures.keys().copied().collect();
        let with_own = |&node: &u32| {
            let textures = self.textures_of(node);
            (node, textures.iter().copied().filter(|&texture| known.insert(texture)).collect())
        };
        let pending: Vec<(u32, Vec<u32>)> = nodes.iter().map(with_own).collect();
        let files = &self.files;
        let read = |(node, own): &(u32, Vec<u32>)| files.read(*node, |t| !own.contains(&t));
        pending.par_iter().map(read).collect()
    }

    /// Reads and decodes a node, with those of its shared pictures that are not held.
    pub fn read_one(&self, node: u32) -> Result<Arrival> {
        self.files.read(node, |texture| self.textures.contains_key(&texture))
    }

    /// Bytes of the files that an arrival was read from.
    pub fn file_bytes(&self, arrival: &Arrival) -> u64 {
        let scene = self.files.scene();
        let texture = |(texture, _): &(u32, _)| scene.shared_textures[*texture as usize].bytes;
        scene.nodes[arrival.node as usize].file_bytes
            + arrival.pictures.iter().map(texture).sum::<u64>()
    }

    /// Copies a node to the graphics card, in the place of one that was there; false where a shared picture is missing that could not
    /// be read with the node that it should have come with.
    pub fn hold(&mut self, arrival: &Arrival) -> Result<bool> {
        let &Arrival { node, ref content, ref pictures, .. } = arrival;
        for (texture, picture) in pictures {
            self.renderer.borrow_mut().upload_shared(*texture, picture)?;
            if self.textures.insert(*texture, 0).is_none() {
                self.used_bytes += self.texture_bytes(*texture);
            }
        }
        let size = &self.sizes.nodes[node as usize];
        if size.textures.iter().any(|texture| !self.textures.contains_key(texture)) {
            return Ok(false);
        }
        let is_node = (node as usize) < self.tree.len();
        let level = if is_node { self.tree.node(node).level } else { 0 };
        self.renderer.borrow_mut().upload(node, level, content)?;
        if self.held.insert(node, self.wants).is_none() {
            for texture in &size.textures {
                self.textures.entry(*texture).and_modify(|users| *users += 1);
            }
            self.used_bytes += size.held_bytes;
        }
        Ok(true)
    }

    /// Frees a node, and the shared pictures that no other needs.
    pub fn let_go(&mut self, node: u32) {
        if self.held.remove(&node).is_none() {
            return;
        }
        let renderer = self.renderer.borrow_mut();
        renderer.remove(node);
        let size = &self.sizes.nodes[node as usize];
        self.used_bytes -= size.held_bytes;
        for texture in &size.textures {
            let Some(users) = self.textures.get_mut(texture) else { continue };
            *users -= 1;
            if *users == 0 {
                self.textures.remove(texture);
                renderer.remove_shared(*texture);
                self.used_bytes -= self.sizes.textures[*texture as usize].held_bytes;
            }
        }
    }

    /// Frees all of it.
    pub fn clear(&mut self) {
        for node in self.held.keys().copied().collect::<Vec<_>>() {
            self.let_go(node);
        }
        // Those that came with nodes that could not be held.
        for texture in std::mem::take(&mut self.textures).into_keys() {
            self.renderer.borrow_mut().remove_shared(texture);
            self.used_bytes -= self.texture_bytes(texture);
        }
    }
}
