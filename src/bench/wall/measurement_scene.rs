//! Nodes on the graphics card for measurements, outside of any run.

use std::time::Instant;

use crate::bench::node_cache::NodeCache;
use crate::loading::{Arrival, NodeFiles};
use crate::render::Renderer;
use crate::render::content::DrawPicture;
use crate::runtime::SceneTree;
use crate::{Error, Result};

/// Bytes that stay on the card from one measurement to the next.
const CAP_BYTES: u64 = 512 << 20;

/// Puts on the graphics card what is to be drawn next, measures what that takes, and takes down all
/// of it at the end.
pub struct MeasurementScene<'a> {
    cache: NodeCache<&'a mut Renderer>,
    /// Nodes that are there without their pictures.
    stripped: Vec<u32>,
    /// Bytes of the files that were read.
    read_bytes: u64,
    /// Milliseconds that it took to read and decode them.
    read_ms: f64,
    /// Bytes that were copied to the card.
    uploaded_bytes: u64,
    /// Milliseconds that it took.
    upload_ms: f64,
}

impl<'a> MeasurementScene<'a> {
    /// An empty one.
    pub fn new(tree: &SceneTree, files: NodeFiles, renderer: &'a mut Renderer) -> Self {
        Self {
            cache: NodeCache::new(tree.clone(), files, renderer, CAP_BYTES),
            stripped: Vec::new(),
            read_bytes: 0,
            read_ms: 0.0,
            uploaded_bytes: 0,
            upload_ms: 0.0,
        }
    }

    /// What draws.
    pub fn renderer(&mut self) -> &mut Renderer {
        self.cache.renderer()
    }

    /// Bytes of files that were read and decoded in a millisecond, once any were.
    pub fn bytes_per_ms(&self) -> Option<f64> {
        (self.read_bytes > 0 && self.read_ms > 0.0).then(|| self.read_bytes as f64 / self.read_ms)
    }

    /// Bytes that were copied to the card so far, and milliseconds that it took.
    pub fn uploads(&self) -> (u64, f64) {
        (self.uploaded_bytes, self.upload_ms)
    }

    /// Has these nodes on the card, with their pictures.
    pub fn show(&mut self, front: &[u32]) -> Result<()> {
        for node in std::mem::take(&mut self.stripped) {
            self.cache.let_go(node);
        }
        for node in self.cache.want(front) {
            self.add(node)?;
        }
        let begin = Instant::now();
        self.cache.renderer().finish_uploads()?;
        self.upload_ms += begin.elapsed().as_secs_f64() * 1e3;
        Ok(())
    }

    /// Has these nodes on the card without their pictures.
    pub fn strip(&mut self, front: &[u32]) -> Result<()> {
        self.show(front)?;
        for &node in front {
            let mut arrival = self.read(node)?;
            arrival.content.draws.iter_mut().for_each(|draw| draw.picture = DrawPicture::None);
            self.hold(&arrival)?;
            self.stripped.push(node);
        }
        self.cache.renderer().finish_uploads()
    }

    /// Reads a node and copies it to the card.
    pub fn add(&mut self, node: u32) -> Result<()> {
        let arrival = self.read(node)?;
        let begin = Instant::now();
        self.hold(&arrival)?;
        self.upload_ms += begin.elapsed().as_secs_f64() * 1e3;
        self.uploaded_bytes += self.cache.held_bytes(node);
        Ok(())
    }

    fn read(&mut self, node: u32) -> Result<Arrival> {
        let begin = Instant::now();
        let arrival = self.cache.read_one(node)?;
        self.read_ms += begin.elapsed().as_secs_f64() * 1e3;
        self.read_bytes += self.cache.file_bytes(&arrival);
        Ok(arrival)
    }

    fn hold(&mut self, arrival: &Arrival) -> Result<()> {
        match self.cache.hold(arrival)? {
            true => Ok(()),
            false => Err(Error::Internal(format!("node {} lacks a picture", arrival.node))),
        }
    }
}

impl Drop for MeasurementScene<'_> {
    fn drop(&mut self) {
        self.cache.clear();
    }
}
