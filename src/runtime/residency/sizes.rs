//! How many bytes things take, on disk and in memory.

use crate::format::Scene;
use crate::format::cells::Face;

/// Bytes of one node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeSize {
    /// Of its file.
    pub file_bytes: u64,
    /// Of its geometry and its own pictures as held for drawing.
    pub held_bytes: u64,
    /// Of what is held beside it, and not for drawing.
    pub beside_bytes: u64,
    /// Indices of the shared pictures that it needs.
    pub textures: Vec<u32>,
}

impl NodeSize {
    /// Of all that is held of it, shared pictures apart.
    pub fn bytes(&self) -> u64 {
        self.held_bytes + self.beside_bytes
    }
}

/// Bytes of one picture that nodes share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureSize {
    /// Of its file.
    pub file_bytes: u64,
    /// As held for drawing.
    pub held_bytes: u64,
}

/// Bytes of everything in a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    /// By node.
    pub nodes: Vec<NodeSize>,
    /// By shared picture.
    pub textures: Vec<TextureSize>,
}

impl Sizes {
    /// The sizes of a scene; `node` and `picture` say how many bytes are held for drawing: of
    /// vertices, triangles and own pictures, and of one picture.
    pub fn new(
        scene: &Scene,
        node: impl Fn(u32, u32, &[[u32; 2]]) -> u64,
        picture: impl Fn([u32; 2]) -> u64,
    ) -> Self {
        let nodes = scene
            .nodes
            .iter()
            .map(|entry| {
                let mut textures = entry.shared_textures.clone();
                textures.sort_unstable();
                textures.dedup();
                NodeSize {
                    file_bytes: entry.file_bytes,
                    held_bytes: node(entry.vertices, entry.triangles, &entry.pictures),
                    beside_bytes: 0,
                    textures,
                }
            })
            .collect();
        let textures = scene
            .shared_textures
            .iter()
            .map(|texture| TextureSize {
                file_bytes: texture.bytes,
                held_bytes: picture([texture.width, texture.height]),
            })
            .collect();
        Self { nodes, textures }
    }

    /// Of the first so many of nodes, and of all pictures that nodes share, held for drawing and beside it.
    pub fn bytes_of(&self, nodes: usize) -> u64 {
        let pictures: u64 = self.textures.iter().map(|texture| texture.held_bytes).sum();
        self.nodes.iter().take(nodes).map(NodeSize::bytes).sum::<u64>() + pictures
    }

    /// The same with the faces of cells after the nodes; `face` says how many bytes one holds for drawing:
    /// of vertices, triangles and pictures.
    pub fn with_faces(
        mut self,
        faces: &[Face],
        face: impl Fn(u32, u32, &[[u32; 2]]) -> u64,
    ) -> Self {
        self.nodes.extend(faces.iter().map(|at| {
            let pictures: Vec<[u32; 2]> = at.views.iter().map(|view| view.size).collect();
            NodeSize {
                file_bytes: at.file_bytes,
                held_bytes: face(at.vertices, at.triangles, &pictures),
                beside_bytes: 0,
                textures: Vec::new(),
            }
        }));
        self
    }

    /// The same with what is held beside nodes, by their index.
    pub fn with_beside(mut self, bytes: impl Fn(u32) -> u64) -> Self {
        for (size, node) in self.nodes.iter_mut().zip(0..) {
            size.beside_bytes = bytes(node);
        }
        self
    }
}
