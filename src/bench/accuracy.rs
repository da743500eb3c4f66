//! How far what is drawn is from what could be.

use image::RgbaImage;

use crate::Result;
use crate::camera::View;
use crate::engine::FarShown;

/// How far the picture of a frame is from that of the leaves alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// FLIP over all pixels, 0 (no difference) to 1.
    pub flip_mean: f64,
    /// FLIP that 95 of 100 pixels do not exceed.
    pub flip_p95: f64,
    /// Mean squared error of sRGB values, 0 to 65,025; PSNR follows from it.
    pub squared_error: f64,
    /// Structural similarity, 1 where there is no difference; `None` of pictures smaller than its
    /// window.
    pub ssim: Option<f64>,
    /// Triangles of the leaves in view.
    pub reference_triangles: u64,
    /// Pixels with surface in the picture of the leaves.
    pub reference_pixels: u64,
    /// Of these, pixels with background in that of the frame.
    pub gap_pixels: u64,
    /// Of these, pixels that no outline explains which is off by the tolerance: background seen
    /// through the model, or in place of something that is gone.
    pub inner_gap_pixels: u64,
    /// Pixels with surface where the leaves have background.
    pub extra_pixels: u64,
    /// FLIP between the picture and the same view with the levels of the frame before, and the cell of then:
    /// the pop that a user sees. `None` where neither changed.
    pub pop_flip: Option<f64>,
}

impl Accuracy {
    /// Peak signal-to-noise ratio in decibels; infinite where there is no difference.
    pub fn psnr_db(&self) -> f64 {
        crate::picture_error::psnr(self.squared_error)
    }

    /// Its columns of `frames.csv`.
    pub(super) const COLUMNS: [&str; 10] = [
        "flip_mean",
        "flip_p95",
        "psnr_db",
        "ssim",
        "reference_triangles",
        "reference_pixels",
        "gap_pixels",
        "inner_gap_pixels",
        "extra_pixels",
        "pop_flip",
    ];

    /// Its fields in the order of the columns.
    pub(super) fn fields(&self) -> [String; 10] {
        let optional = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
        [
            self.flip_mean.to_string(),
            self.flip_p95.to_string(),
            self.psnr_db().to_string(),
            optional(self.ssim),
            self.reference_triangles.to_string(),
            self.reference_pixels.to_string(),
            self.gap_pixels.to_string(),
            self.inner_gap_pixels.to_string(),
            self.extra_pixels.to_string(),
            optional(self.pop_flip),
        ]
    }
}

/// Looks at frames beside a run, which it does not change.
pub trait FrameInspector {
    /// Whether it inspects this frame of the path, in which levels toggled, or what is far changed, or not.
    fn wants(&self, index: usize, toggled: bool) -> bool;

    /// Looks at a frame that is over.
    fn inspect(&mut self, frame: FrameSample<'_>) -> Result<Accuracy>;
}

/// A frame that is over.
#[derive(Debug)]
pub struct FrameSample<'a> {
    /// Its number in the path.
    pub frame: u64,
    /// The camera.
    pub view: &'a View,
    /// It belongs to the [loading phase](crate::engine::FrameReport::loading_phase).
    pub loading_phase: bool,
    /// What was drawn.
    pub front: &'a [u32],
    /// What was drawn from the faces of cells.
    pub far: &'a FarShown,
    /// The rest of the front, which was not drawn since this hides it.
    pub hidden: &'a [u32],
    /// The front of the frame before, where levels toggled since, or what is far is drawn from another cell.
    pub before: Option<&'a [u32]>,
    /// What was drawn from the faces of another cell then, or was not.
    pub far_before: Option<&'a FarShown>,
    /// The picture, alpha 0 where nothing was drawn; `None` where the run drew none.
    pub drawn: Option<RgbaImage>,
}

/// One of the frames that are furthest from their reference, as pictures for a report.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstFrame {
    /// Its number in the path.
    pub frame: u64,
    /// It belongs to the loading phase, after which there are not enough frames that are off.
    pub loading_phase: bool,
    /// How far off it is.
    pub accuracy: Accuracy,
    /// What was drawn, as JPEG.
    pub drawn: Vec<u8>,
    /// The leaves alone, as JPEG.
    pub reference: Vec<u8>,
    /// FLIP at each pixel, as JPEG.
    pub difference: Vec<u8>,
}

/// How a run was compared with the leaves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReferenceContext {
    /// Every so many frames.
    pub every: u64,
    /// The graphics adapter that drew the leaves.
    pub adapter: serde_json::Value,
    /// Files that it could not use, each with what was wrong.
    pub broken: Vec<String>,
    /// The frames that are furthest off, worst first.
    pub worst: Vec<WorstFrame>,
}
