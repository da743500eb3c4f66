//! What is held in memory of a node: its geometry as one vertex and one index buffer, and its
//! pictures decoded, with all their smaller versions, and compressed where that is asked for. None of it
//! needs a graphics card.
//!
//! [`held_bytes`] and [`picture_bytes`] say beforehand, from the scene's figures alone, what
//! [`Content::bytes`] and [`Picture::bytes`] will be.

mod bc7;
mod draw;
mod held;
mod mips;
mod picture;
mod texture_format;
mod vertex;

use std::path::Path;

use glam::DVec3;

pub use draw::{Alpha, Draw, DrawPicture};
pub use held::{VERTEX_BYTES, held_bytes, picture_bytes};
pub use picture::Picture;
#[cfg(feature = "render")]
pub(crate) use texture_format::LONGEST_COMPRESSED;
pub use texture_format::TextureFormat;
pub use vertex::Vertex;

use crate::format::{NodeImageData, NodeMesh, read_glb_without_normals};
use crate::{Error, Result};

/// The corners of triangles as indices into the vertices: 16 bits where they suffice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Indices {
    /// At most 65,536 vertices.
    Short(Vec<u16>),
    /// More.
    Long(Vec<u32>),
}

/// A node, ready to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// Source coordinates of the point to which the vertices are relative.
    pub origin: DVec3,
    /// The vertices of all draws.
    pub vertices: Vec<Vertex>,
    /// Three a triangle.
    pub indices: Indices,
    /// What to draw: ranges of the indices, in order and without gaps.
    pub draws: Vec<Draw>,
    /// The node's own pictures, in the order of its file.
    pub pictures: Vec<Picture>,
}

impl Content {
    /// Decodes a node's file, whose bytes are `glb`; `file` is for messages only. `shared` finds
    /// the index of a shared picture by its file name in `textures/`.
    pub fn decode(file: &Path, glb: &[u8], shared: impl Fn(&str) -> Option<u32>) -> Result<Self> {
        Self::from_mesh(file, &read_glb_without_normals(glb, file)?, shared)
    }

    /// What is held of a node of which `mesh` was read; `file` is for messages only.
    pub fn from_mesh(
        file: &Path,
        mesh: &NodeMesh,
        shared: impl Fn(&str) -> Option<u32>,
    ) -> Result<Self> {
        let mut pictures = Vec::new();
        let mut places = Vec::with_capacity(mesh.images.len());
        for (image, number) in mesh.images.iter().zip(0..) {
            let refuse = |what: String| Error::input(file, format!("image {number}: {what}"));
            places.push(match &image.data {
                NodeImageData::Embedded { bytes, .. } => {
                    let size = [image.width, image.height];
                    let picture = Picture::decode_sized(bytes, size).map_err(refuse)?;
                    pictures.push(picture);
                    DrawPicture::Own(pictures.len() as u32 - 1)
                }
                NodeImageData::Shared { file_name } => {
                    DrawPicture::Shared(shared(file_name).ok_or_else(|| {
                        refuse(format!("the scene has no shared picture {file_name}"))
                    })?)
                }
            });
        }
        let (vertices, indices, draws) =
            draw::assemble(&mesh.primitives, &places).map_err(|what| Error::input(file, what))?;
        Ok(Self { origin: DVec3::from(mesh.origin), vertices, indices, draws, pictures })
    }

    /// The same with its pictures in this format, as far as they [can be](TextureFormat::of_picture).
    pub fn stored_as(self, format: TextureFormat) -> Self {
        let pictures = self.pictures.into_iter().map(|picture| picture.stored_as(format));
        Self { pictures: pictures.collect(), ..self }
    }

    /// Bytes that it takes in memory, here as on the graphics card: [`held_bytes`] of its
    /// figures.
    pub fn bytes(&self) -> u64 {
        let geometry = self.vertices.len() as u64 * VERTEX_BYTES + self.indices.bytes();
        geometry + self.pictures.iter().map(Picture::bytes).sum::<u64>()
    }

    /// The number of triangles.
    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }
}

impl Indices {
    /// The number of corners.
    pub fn len(&self) -> usize {
        match self {
            Self::Short(indices) => indices.len(),
            Self::Long(indices) => indices.len(),
        }
    }

    /// True without corners.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes in a buffer, whose size is a multiple of four.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Short(indices) => (indices.len() as u64 * 2).next_multiple_of(4),
            Self::Long(indices) => indices.len() as u64 * 4,
        }
    }
}

#[cfg(test)]
mod tests;
