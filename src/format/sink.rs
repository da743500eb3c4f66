//! Writing little-endian fields.

use crate::{Error, Result};

/// Stands for an absent index.
pub(super) const NONE: u32 = u32::MAX;

/// Bytes to which fields are appended.
pub(super) struct Sink(pub Vec<u8>);

impl Sink {
    pub fn u32(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    pub fn u64(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    pub fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
    }

    pub fn count(&mut self, count: usize) -> Result<()> {
        match u32::try_from(count) {
            Ok(count) if count != NONE => self.u32(count),
            _ => return Err(Error::Internal(format!("{count} entries in one table"))),
        }
        Ok(())
    }

    pub fn text(&mut self, text: &str) -> Result<()> {
        self.count(text.len())?;
        self.0.extend(text.as_bytes());
        Ok(())
    }
}
