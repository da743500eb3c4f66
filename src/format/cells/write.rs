//! Writes `cells.hlod`.
//!
//! In an [`IndexFile`] without flags. All little-endian; a text is its length in bytes as u32 and then UTF-8.
//!
//! ```text
//! fingerprint of the scene [u8; 32] · parameters text (JSON) · size, texel f64
//! count u32 · cells: place [i64; 3] · cull box min and max [f64; 6]
//!             count u32 · faces: file name text · file bytes u64 · file CRC-32 u32
//!                         vertices, triangles u32 · bounding box min and max [f64; 6] · error f64
//!                         count u32 · views: width, height u32 · solid angle f32 · projection [f32; 4]
//! ```

use super::super::index_file::IndexFile;
use super::super::sink::Sink;
use super::{Cells, Face};
use crate::Result;

pub(super) const CELLS: IndexFile = IndexFile {
    magic: *b"HLODCEL\x1a",
    version: 2,
    what: "an index of cells",
    version_of: "version of cells",
    then: "prepare them again with this version",
};

impl Cells {
    /// The bytes of `cells.hlod`.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut out = CELLS.begin(0, 256 + 1024 * self.cells.len());
        out.0.extend(self.scene);
        out.text(&self.parameters.to_string())?;
        out.f64s(&[self.size, self.texel]);
        out.count(self.cells.len())?;
        for cell in &self.cells {
            cell.place.iter().for_each(|&at| out.u64(at as u64));
            out.f64s(cell.cull_box.as_flattened());
            out.count(cell.faces.len())?;
            self.faces_of(cell).iter().try_for_each(|face| out.face(face))?;
        }
        Ok(IndexFile::end(out))
    }
}

impl Sink {
    fn face(&mut self, face: &Face) -> Result<()> {
        self.text(&face.file)?;
        self.u64(face.file_bytes);
        self.u32(face.file_crc);
        self.u32(face.vertices);
        self.u32(face.triangles);
        self.f64s(face.bounds.as_flattened());
        self.f64s(&[face.error]);
        self.count(face.views.len())?;
        for view in &face.views {
            view.size.iter().for_each(|&side| self.u32(side));
            let numbers = std::iter::once(&view.solid_angle).chain(&view.projection);
            numbers.for_each(|number| self.u32(number.to_bits()));
        }
        Ok(())
    }
}
