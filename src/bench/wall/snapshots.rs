//! Frames as pictures.

use std::path::PathBuf;

use crate::render::Renderer;
use crate::{Error, Result};

/// Which frames become pictures, and where these go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snapshots {
    /// Every so many frames, at least 1, beginning with the first.
    pub every: u64,
    /// Where `frame-000000.png` and so on are written; made where it is missing.
    pub dir: PathBuf,
}

impl Snapshots {
    /// Writes the frame just drawn where it is one of those.
    pub(super) fn take(&self, frame: u64, renderer: &Renderer) -> Result<()> {
        if !frame.is_multiple_of(self.every.max(1)) {
            return Ok(());
        }
        std::fs::create_dir_all(&self.dir).map_err(|error| {
            Error::output(&self.dir, format!("cannot make the folder: {error}"))
        })?;
        let path = self.dir.join(format!("frame-{frame:06}.png"));
        let mut bytes = std::io::Cursor::new(Vec::new());
        renderer
            .snapshot()?
            .write_to(&mut bytes, image::ImageFormat::Png)
            .map_err(|error| Error::Internal(format!("a frame as PNG: {error}")))?;
        super::super::write::write_beside(&path, bytes.get_ref())
    }
}
