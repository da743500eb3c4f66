//! What the leaves alone look like, drawn beside a run and outside of its time.

mod renderer;
mod silhouette_tolerance;

use image::{GrayImage, Luma, Rgb, RgbImage, RgbaImage};

use super::accuracy::{Accuracy, FrameInspector, FrameSample, ReferenceContext, WorstFrame};
use super::session::Session;
use crate::camera::View;
use crate::engine::FarShown;
use crate::picture_error::{FlipMap, Gaps, PIXELS_PER_DEGREE, flip, mean_squared_error, ssim};
use crate::render::RenderOptions;
use crate::render::content::TextureFormat;
use crate::runtime::{SceneTree, front_before};
use crate::{Error, Result};
pub use renderer::ReferenceRenderer;
use silhouette_tolerance::OutlineTolerance;
pub use silhouette_tolerance::SilhouetteTolerance;

/// Bytes that a reference holds, beside those of the run.
const CAP_BYTES: u64 = 512 << 20;
/// Frames that are kept as pictures.
const WORST: usize = 3;
/// Quality of these pictures, 1–100.
const QUALITY: u8 = 85;

/// Compares every so many frames of a run with the same view of the leaves.
pub struct Reference {
    renderer: ReferenceRenderer,
    /// Draws fronts of a run whose textures are stored in another way than the reference's.
    fronts: Option<ReferenceRenderer>,
    leaves: Vec<u32>,
    every: u64,
    every_toggle: bool,
    tolerance: SilhouetteTolerance,
    worst: Vec<WorstFrame>,
}

impl Reference {
    /// Every `every` frames, at least 1, beginning with the first. `options` are those of the
    /// run.
    pub fn new(
        session: &Session,
        options: &RenderOptions,
        every: u64,
        tolerance: SilhouetteTolerance,
    ) -> Result<Self> {
        let tree = session.tree();
        let leaves =
            (0..tree.len() as u32).filter(|&node| tree.children(node).is_empty()).collect();
        let renderer = ReferenceRenderer::new(session, options, CAP_BYTES)?;
        Ok(Self {
            renderer,
            fronts: None,
            leaves,
            every: every.max(1),
            every_toggle: false,
            tolerance,
            worst: Vec::new(),
        })
    }

    /// Draws fronts that the run itself does not draw with their textures in the run's format. Leaves
    /// stay RGBA8, so that what compression loses counts as error.
    pub fn with_textures(
        self,
        session: &Session,
        options: &RenderOptions,
        format: TextureFormat,
    ) -> Result<Self> {
        let make = || ReferenceRenderer::with_textures(session, options, CAP_BYTES, format);
        let fronts = (format != TextureFormat::Rgba8).then(make).transpose()?;
        Ok(Self { fronts, ..self })
    }

    /// A front beside faces, as they are seen in a frame.
    fn render_front(
        &mut self,
        front: &[u32],
        far: &FarShown,
        frame: &FrameSample<'_>,
    ) -> Result<RgbaImage> {
        let renderer = self.fronts.as_mut().unwrap_or(&mut self.renderer);
        renderer.cut_at(far.cull_box);
        let drawn: Vec<u32> = front.iter().chain(&far.faces).copied().collect();
        let picture = renderer.render(&drawn, &frame.view.pose);
        renderer.cut_at(None);
        picture
    }

    /// Inspects every frame in which levels toggled, or what is far changed, as well.
    pub fn with_every_toggle(mut self) -> Self {
        self.every_toggle = true;
        self
    }

    /// What a summary and a report say of it.
    pub fn context(self) -> Result<ReferenceContext> {
        let adapter = serde_json::to_value(self.renderer.adapter())
            .map_err(|error| Error::Internal(format!("an adapter without JSON form: {error}")))?;
        let mut broken: Vec<String> = self.renderer.broken().cloned().collect();
        broken.dedup();
        Ok(ReferenceContext { every: self.every, adapter, broken, worst: self.worst })
    }

    /// Keeps a frame as pictures where it is one of the worst. Frames of the loading phase, which
    /// would always be, come after all others.
    fn keep(
        &mut self,
        frame: u64,
        loading_phase: bool,
        accuracy: &Accuracy,
        [drawn, reference]: [&RgbImage; 2],
        difference: &FlipMap,
    ) -> Result<()> {
        let flip = accuracy.flip_mean;
        let place = self.worst.partition_point(|worst| {
            (!worst.loading_phase, worst.accuracy.flip_mean) >= (!loading_phase, flip)
        });
        if place >= WORST || flip == 0.0 {
            return Ok(());
        }
        self.worst.truncate(WORST - 1);
        let worst = WorstFrame {
            frame,
            loading_phase,
            accuracy: accuracy.clone(),
            drawn: jpeg(drawn)?,
            reference: jpeg(reference)?,
            difference: jpeg(&difference.picture())?,
        };
        self.worst.insert(place, worst);
        Ok(())
    }
}

impl FrameInspector for Reference {
    fn wants(&self, index: usize, toggled: bool) -> bool {
        (index as u64).is_multiple_of(self.every) || (self.every_toggle && toggled)
    }

    fn inspect(&mut self, sample: FrameSample<'_>) -> Result<Accuracy> {
        let &FrameSample { frame, view, front, before, .. } = &sample;
        let pose = &view.pose;
        let drawn = match &sample.drawn {
            Some(drawn) => drawn.clone(),
            None => self.render_front(front, sample.far, &sample)?,
        };
        let leaves = seen(self.renderer.tree(), &self.leaves, view);
        let tree = self.renderer.tree();
        let triangles = leaves.iter().map(|&leaf| u64::from(tree.node(leaf).triangles));
        let triangles: u64 = triangles.sum();
        let reference = self.renderer.render(&leaves, pose)?;
        let gaps = Gaps::between(&surface(&reference), &surface(&drawn)).ok_or_else(other_size)?;
        let inner = if gaps.gaps.is_empty() {
            Vec::new()
        } else {
            let depths = self.renderer.depths()?;
            let outline = OutlineTolerance::new(self.renderer.tree(), front, view, self.tolerance);
            let width = view.size[0] as usize;
            gaps.inner(|[x, y]| {
                outline.at([x, y], f64::from(depths[y as usize * width + x as usize]))
            })
        };
        let pictures = [&drawn, &reference].map(opaque);
        let [picture, expected] = &pictures;
        let map = flip(expected, picture, PIXELS_PER_DEGREE).ok_or_else(other_size)?;
        let mut accuracy = Accuracy {
            flip_mean: map.mean(),
            flip_p95: map.percentile(95.0),
            squared_error: mean_squared_error(expected, picture).ok_or_else(other_size)?,
            ssim: ssim(expected, picture),
            reference_triangles: triangles,
            reference_pixels: gaps.reference_pixels,
            gap_pixels: gaps.gaps.len() as u64,
            inner_gap_pixels: inner.len() as u64,
            extra_pixels: gaps.extra_pixels,
            pop_flip: None,
        };
        if let Some(before) = before {
            // Where another part of the hierarchy was drawn than now, all of it was there.
            let far = sample.far_before.unwrap_or(sample.far);
            let front = match sample.far_before {
                Some(_) => &[before, front].concat(),
                None => front,
            };
            let before = front_before(self.renderer.tree(), before, front);
            let before = opaque(&self.render_front(&before, far, &sample)?);
            let pop = flip(&before, picture, PIXELS_PER_DEGREE).ok_or_else(other_size)?;
            accuracy.pop_flip = Some(pop.mean());
        }
        self.keep(frame, sample.loading_phase, &accuracy, [picture, expected], &map)?;
        Ok(accuracy)
    }
}

/// Those of `nodes` that a camera sees.
fn seen(tree: &SceneTree, nodes: &[u32], view: &View) -> Vec<u32> {
    let inside = |&node: &u32| view.frustum.outside(tree.node(node).bbox) <= 0.0;
    nodes.iter().copied().filter(inside).collect()
}

/// Colours alone.
fn opaque(picture: &RgbaImage) -> RgbImage {
    RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
        let [r, g, b, _] = picture.get_pixel(x, y).0;
        Rgb([r, g, b])
    })
}

/// Where surface is.
fn surface(picture: &RgbaImage) -> GrayImage {
    GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
        Luma([picture.get_pixel(x, y).0[3]])
    })
}

fn other_size() -> Error {
    Error::Internal("two pictures of one view have different sizes".into())
}

fn jpeg(picture: &RgbImage) -> Result<Vec<u8>> {
    let failed = |what: String| Error::Internal(format!("a frame as JPEG: {what}"));
    let side = |side: u32| u16::try_from(side).map_err(|error| failed(error.to_string()));
    let (width, height) = (side(picture.width())?, side(picture.height())?);
    let mut bytes = Vec::new();
    jpeg_encoder::Encoder::new(&mut bytes, QUALITY)
        .encode(picture.as_raw(), width, height, jpeg_encoder::ColorType::Rgb)
        .map_err(|error| failed(error.to_string()))?;
    Ok(bytes)
}
