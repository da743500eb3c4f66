//! Where frames are drawn and how time passes.

use std::sync::{Arc, Mutex};

use image::RgbaImage;

use crate::Result;
use crate::camera::View;
use crate::engine::NodeOcclusion;
use crate::runtime::residency::{Changes, Residency};

/// Where frames are drawn and how time passes: a graphics adapter and the clock on the wall, or a
/// model of both.
pub trait Backend {
    /// Loads the roots, before the first frame.
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()>;

    /// Uploads what was loaded and frees what left; milliseconds that it took.
    fn apply(&mut self, changes: &Changes) -> Result<f64>;

    /// Milliseconds since some fixed moment; for parts of frames.
    fn now_ms(&mut self) -> f64;

    /// Draws nodes; milliseconds that it took.
    fn draw(&mut self, front: &[u32], view: &View) -> Result<Drawn>;

    /// What a node hides that has just been loaded, and how it may be hidden; asked for once. `None`
    /// where that is not known.
    fn occlusion(&mut self, node: u32) -> Option<Arc<NodeOcclusion>> {
        let _ = node;
        None
    }

    /// The priorities of a frame were set: loading may go on.
    fn priorities_set(&mut self) {}

    /// Ends a frame that took `frame_ms`; the next begins `interval_ms` after it began at the
    /// earliest.
    fn end_frame(
        &mut self,
        residency: &Mutex<Residency>,
        frame_ms: f64,
        interval_ms: f64,
    ) -> Result<()>;

    /// Frame `frame` of a path was logged: a time for what must not be timed.
    fn logged(&mut self, frame: u64) -> Result<()> {
        let _ = frame;
        Ok(())
    }

    /// Pauses loading while the frame that was drawn last is inspected, with its image where there
    /// is one; leaves no trace in the frames to come.
    fn pause_for(&mut self, front: &[u32], view: &View, inspect: &mut Inspect<'_>) -> Result<()> {
        let _ = (front, view);
        inspect(None)
    }

    /// Bytes of the whole process; 0 where that is not measured.
    fn process_bytes(&mut self) -> u64;
}

/// Inspects an image, where there is one.
pub type Inspect<'a> = dyn FnMut(Option<RgbaImage>) -> Result<()> + 'a;

/// What drawing a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Milliseconds until the image was complete.
    pub draw_ms: f64,
    /// Milliseconds of this that the graphics card took by its own clock, where it has one.
    pub gpu_ms: Option<f64>,
}
