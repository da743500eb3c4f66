//! What one node file holds, ready to be written: the seam between build, texture and format.

use std::sync::Arc;

use crate::mesh::{AlphaMode, Normal, Wrap};

/// A picture of a node, already encoded.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeImage {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Where its bytes are.
    pub data: NodeImageData,
}

/// A node's picture is its own, or one that many nodes share.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeImageData {
    /// Bytes that go into the node's file. `mime` is `image/jpeg` or `image/png`.
    Embedded {
        /// The MIME type.
        mime: &'static str,
        /// The encoded picture.
        bytes: Vec<u8>,
        /// The file name that a repeating texture has where nodes share it. An atlas has `None`.
        file_name: Option<Arc<str>>,
    },
    /// A repeating texture stored once in [`TEXTURES_DIR`](super::TEXTURES_DIR).
    Shared {
        /// File name inside that folder, without folders; only `[a-z0-9._-]`.
        file_name: Arc<str>,
    },
}

impl NodeImage {
    /// The file name of a repeating texture, shared or embedded; `None` of an atlas.
    pub fn repeating(&self) -> Option<&Arc<str>> {
        match &self.data {
            NodeImageData::Embedded { file_name, .. } => file_name.as_ref(),
            NodeImageData::Shared { file_name } => Some(file_name),
        }
    }
}

/// How the triangles of a primitive look.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Multiplies texture and vertex colour; linear RGBA, 0–1.
    pub base_color: [f32; 4],
    /// Index into [`NodeMesh::images`].
    pub image: Option<usize>,
    /// Wrapping of the image.
    pub wrap: [Wrap; 2],
    /// What alpha does.
    pub alpha: AlphaMode,
    /// Both sides are drawn.
    pub double_sided: bool,
    /// A surface without an image is drawn without light; one with an image always is, and has false
    /// here.
    pub is_unlit: bool,
}

/// Triangles that look alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    /// Metres from [`NodeMesh::origin`].
    pub positions: Vec<[f32; 3]>,
    /// One per vertex where the surface has an image, else empty. v grows downwards.
    pub texcoords: Vec<[f32; 2]>,
    /// One per vertex, or empty. RGBA, linear, 65535 is 1.
    pub colors: Vec<[u16; 4]>,
    /// One per corner of [`Self::indices`], or empty. A file has one per vertex: vertices whose corners
    /// have several are divided when it is written, and joined again when it is read.
    pub normals: Vec<Normal>,
    /// Three per triangle.
    pub indices: Vec<u32>,
    /// The last so many triangles are skirts: no part of the surface, but in a cutting plane, where
    /// they close gaps between levels.
    pub skirt_triangles: usize,
    /// How they look.
    pub surface: Surface,
}

/// A node's geometry and pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeMesh {
    /// Source coordinates of the local origin; each component is exactly representable in f32,
    /// so that glTF's f32 translation loses nothing.
    pub origin: [f64; 3],
    /// Pictures; a primitive's surface refers to them by index.
    pub images: Vec<NodeImage>,
    /// One per kind of surface.
    pub primitives: Vec<Primitive>,
}
