//! Writes `cells.hlod`.
//!
//! All little-endian; a text is its length in bytes as u32 and then UTF-8.
//!
//! ```text
//! magic [u8; 8] · version u32 · 0 u32 · file length u64
//! fingerprint of the scene [u8; 32] · parameters text (JSON) · size f64
//! count u32 · cells: place [i64; 3] · cull box min and max [f64; 6]
//!             count u32 · faces: file name text · file bytes u64 · file CRC-32 u32
//!                         vertices, triangles u32 · bounding box min and max [f64; 6] · error f64
//!                         count u32 · views: width, height u32 · solid angle f32 · projection [f32; 4]
//! CRC-32 u32 of all that precedes
//! ```

use super::super::sink::Sink;
use super::{CELLS_MAGIC, CELLS_VERSION, Cells, Face};
use crate::Result;

/// Where the length of the file stands.
const LENGTH_AT: usize = 16;

impl Cells {
    /// The bytes of `cells.hlod`.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut out = Sink(Vec::with_capacity(256 + 1024 * self.cells.len()));
        out.0.extend(CELLS_MAGIC);
        out.u32(CELLS_VERSION);
        out.u32(0);
        out.u64(0); // the length, once it is known
        out.0.extend(self.scene);
        out.text(&self.parameters.to_string())?;
        out.f64s(&[self.size]);
        out.count(self.cells.len())?;
        for cell in &self.cells {
            cell.place.iter().for_each(|&at| out.u64(at as u64));
            out.f64s(cell.cull_box.as_flattened());
            out.count(cell.faces.len())?;
            self.faces_of(cell).iter().try_for_each(|face| out.face(face))?;
        }
        let mut bytes = out.0;
        let length = bytes.len() as u64 + 4;
        bytes[LENGTH_AT..LENGTH_AT + 8].copy_from_slice(&length.to_le_bytes());
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        Ok(bytes)
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
