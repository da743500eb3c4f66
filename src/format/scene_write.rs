//! Writes `scene.hlod`.
//!
//! In an [`IndexFile`], flags 1: textured, 2: Z is up. All little-endian; a text is its length in bytes as u32 and then UTF-8; an absent index is
//! `u32::MAX`.
//!
//! ```text
//! fingerprint [u8; 32] · bounding box min and max [f64; 6] · roots u32
//! parameters text (JSON)
//! count u32 · shared textures: file name text · width u32 · height u32 · bytes u64
//! count u32 · blocks: name text · input text · origin [f64; 3]
//! count u32 · nodes: id u64 · parent, first child, next sibling u32 · level u32 · block u32
//!             triangles, textured triangles, vertices u32 · bounding box min and max [f64; 6]
//!             cost, static benefit f64 · geometric, mean, 95th percentile error f64
//!             average normal [f32; 3]
//!             texels, shared texels u64 · origin [f64; 3] · file name text · file bytes u64
//!             file CRC-32 u32 · count u32 · indices of shared textures u32
//!             count u32 · own pictures: width u32 · height u32
//! ```

use super::index_file::IndexFile;
use super::scene::{Node, Scene};
use super::sink::{NONE, Sink};
use super::{SCENE_MAGIC, SCENE_VERSION};
use crate::mesh::UpAxis;
use crate::{Error, Result};

/// Set where any triangle has a picture.
pub(super) const FLAG_TEXTURED: u32 = 1;
/// Set where Z is up, clear where Y is.
pub(super) const FLAG_Z_UP: u32 = 2;

pub(super) const SCENE: IndexFile = IndexFile {
    magic: SCENE_MAGIC,
    version: SCENE_VERSION,
    what: "a scene file",
    version_of: "scene format version",
    then: "build the scene again with this version, or use the version that built it",
};

impl Scene {
    /// The bytes of `scene.hlod`.
    ///
    /// Fails where [`Scene::check`] finds a defect: what is written can be read.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let defects = self.check();
        let (Some([min, max]), true) = (self.bounds(), defects.is_empty()) else {
            let first = defects.first().map(ToString::to_string).unwrap_or_default();
            return Err(Error::Internal(format!("unsound scene: {first}")));
        };
        let textured = if self.is_textured() { FLAG_TEXTURED } else { 0 };
        let z_up = if self.up == UpAxis::Z { FLAG_Z_UP } else { 0 };
        let mut out = SCENE.begin(textured | z_up, 256 + 256 * self.nodes.len());
        out.0.extend(self.fingerprint);
        out.f64s(&min);
        out.f64s(&max);
        out.count(self.roots().count())?;
        out.text(&self.parameters.to_string())?;
        out.count(self.shared_textures.len())?;
        for texture in &self.shared_textures {
            out.text(&texture.file_name)?;
            out.u32(texture.width);
            out.u32(texture.height);
            out.u64(texture.bytes);
        }
        out.count(self.blocks.len())?;
        for block in &self.blocks {
            out.text(&block.name)?;
            out.text(&block.input)?;
            out.f64s(&block.origin);
        }
        out.count(self.nodes.len())?;
        for node in &self.nodes {
            out.node(node)?;
        }
        Ok(IndexFile::end(out))
    }
}

impl Sink {
    fn node(&mut self, node: &Node) -> Result<()> {
        self.u64(node.id.0);
        for link in [node.parent, node.first_child, node.next_sibling] {
            self.u32(link.unwrap_or(NONE));
        }
        self.u32(node.level);
        self.u32(node.block.unwrap_or(NONE));
        self.u32(node.triangles);
        self.u32(node.textured_triangles);
        self.u32(node.vertices);
        self.f64s(&node.bbox_min);
        self.f64s(&node.bbox_max);
        self.f64s(&[node.cost, node.static_benefit]);
        self.f64s(&[node.geometric_error, node.mean_error, node.p95_error]);
        node.average_normal.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
        self.u64(node.texels);
        self.u64(node.shared_texels);
        self.f64s(&node.origin);
        self.text(&node.file)?;
        self.u64(node.file_bytes);
        self.u32(node.file_crc);
        self.count(node.shared_textures.len())?;
        node.shared_textures.iter().for_each(|&texture| self.u32(texture));
        self.count(node.pictures.len())?;
        node.pictures.as_flattened().iter().for_each(|&side| self.u32(side));
        Ok(())
    }
}
