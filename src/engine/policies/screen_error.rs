//! Screen-space error: a node is refined while its error is seen as more than so many pixels.
//!
//! `screen-error` is what CesiumJS does with 3D Tiles (`Cesium3DTileset`): a threshold of 16
//! pixels, which grows by 2 % a frame while what is wanted exceeds the memory, and falls back as
//! fast once it is less than half of that; what is near the middle of the image, and what a smaller
//! image would need too, is loaded first. The last is as its documentation has it: its source defers
//! nothing in tilesets that replace tiles and skip no level, as ours do, and loads there what a smaller
//! image would need, then what is near the line of sight, then what is near the camera.
//!
//! `screen-error-loop` has no fixed threshold: the load of the frame steers it by the rule with which
//! NVIDIA's vk_lod_clusters keeps its streaming memory (commit c19a250, read in a program that has taken
//! it over): there the load is that of memory, and the threshold never falls below the one set. Rates
//! are by frames of 1/60 s there, and by as much time here.

use super::descent::descend;
use super::parameter::{Parameter, info, parameter, with_settings};
use super::{PolicyKind, Settings};
use crate::Result;
use crate::camera::View;
use crate::engine::{FrameInput, FrameOutcome, Policy, Selection};
use crate::runtime::TreeNode;

const FIXED_NAME: &str = "screen-error";
const LOOP_NAME: &str = "screen-error-loop";

/// Seconds of a frame by which rates are published.
const FRAME_S: f64 = 1.0 / 60.0;

/// Nothing is nearer, metres.
const NEAREST: f64 = 1e-7;

/// The threshold never leaves this range, pixels.
const PIXELS: [f64; 2] = [0.1, 1e6];

/// How much more useful a node is that is loaded before all others of a kind.
const FIRST: f64 = 1e6;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Options {
    /// Pixels of error that are seen (`maximumScreenSpaceError`); where the loop begins.
    pixels: f64,
    /// By how much the threshold grows in a frame while what is wanted exceeds the memory.
    memory_gain: f64,
    /// The part of the memory below which it falls back (`cacheBytes`, of that and
    /// `maximumCacheOverflowBytes`).
    memory_kept: f64,
    /// The part of the field of view around the middle whose nodes are loaded first
    /// (`foveatedConeSize`).
    cone: f64,
    /// The part of the image's height for which nodes are loaded first
    /// (`progressiveResolutionHeightFraction`).
    progressive: f64,
    /// The part of a frame's load that the smoothed load takes over.
    smoothing: f64,
    /// Below this part of the target the threshold falls.
    least_load: f64,
    /// Above this part of the target the threshold grows.
    most_load: f64,
    /// By how much it grows in a frame.
    up: f64,
    /// By how much it falls in a frame.
    down: f64,
}

const OPTIONS: Options = Options {
    pixels: 16.0,
    memory_gain: 1.02,
    memory_kept: 0.5,
    cone: 0.1,
    progressive: 0.3,
    smoothing: 0.05,
    least_load: 0.70,
    most_load: 0.85,
    up: 1.02,
    down: 0.995,
};

const PARAMETERS: [Parameter<Options>; 5] = [
    parameter!(pixels, 0.1, 1e6, "error that is seen before a node is refined, pixels"),
    parameter!(memory_gain, 1.0, 10.0, "growth of the threshold in 1/60 s while memory is short"),
    parameter!(memory_kept, 0.0, 1.0, "part of the memory below which the threshold falls back"),
    parameter!(cone, 0.0, 1.0, "part of the field of view that is loaded first"),
    parameter!(progressive, 0.0, 1.0, "part of the image's height that is loaded for first"),
];

const LOOP_PARAMETERS: [Parameter<Options>; 6] = [
    parameter!(pixels, 0.1, 1e6, "threshold at the start, pixels"),
    parameter!(smoothing, 0.0, 1.0, "part of a frame's load that the smoothed load takes over"),
    parameter!(least_load, 0.0, 1.0, "part of the target below which the threshold falls"),
    parameter!(most_load, 0.0, 10.0, "part of the target above which the threshold grows"),
    parameter!(up, 1.0, 10.0, "growth of the threshold in 1/60 s"),
    parameter!(down, 0.1, 1.0, "fall of the threshold in 1/60 s"),
];

pub(super) const FIXED: PolicyKind = PolicyKind {
    name: FIXED_NAME,
    summary: "errors of at most so many pixels, more while memory is short",
    source: "CesiumJS, Cesium3DTileset",
    parameters: || info(&OPTIONS, &PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(FIXED_NAME, OPTIONS, &PARAMETERS, settings)?;
        Ok(Box::new(ScreenError::new(options, None)))
    },
};

pub(super) const LOOP: PolicyKind = PolicyKind {
    name: LOOP_NAME,
    summary: "errors of at most so many pixels, as many as the frame time allows",
    source: "NVIDIA, vk_lod_clusters",
    parameters: || info(&OPTIONS, &LOOP_PARAMETERS),
    make: |settings: &Settings| -> Result<Box<dyn Policy>> {
        let options = with_settings(LOOP_NAME, OPTIONS, &LOOP_PARAMETERS, settings)?;
        Ok(Box::new(ScreenError::new(options, Some(Load::default()))))
    },
};

/// The load of frames, smoothed, as a part of the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Load {
    /// `None` before the first frame.
    smoothed: Option<f64>,
    target_ms: f64,
    dt_s: f64,
}

#[derive(Clone, Debug)]
struct ScreenError {
    options: Options,
    /// Pixels.
    threshold: f64,
    /// What steers the threshold, unless memory does.
    load: Option<Load>,
    queue: Vec<u32>,
}

/// Pixels as which a node's error is seen.
fn screen_error(node: &TreeNode, view: &View) -> f64 {
    let nearest = view.pose.position.clamp(node.bbox[0], node.bbox[1]);
    let distance = view.pose.position.distance(nearest).max(NEAREST);
    node.viewer_error * view.pixels_per_metre() / distance
}

impl ScreenError {
    fn new(options: Options, load: Option<Load>) -> Self {
        Self { options, threshold: options.pixels, load, queue: Vec::new() }
    }

    /// A rate for a frame of 1/60 s, for as long as a frame took.
    fn rate(by_frame: f64, dt_s: f64) -> f64 {
        libm::pow(by_frame, dt_s / FRAME_S)
    }

    fn steer_by_memory(&mut self, frame: &FrameInput<'_>) {
        let gain = Self::rate(self.options.memory_gain, frame.dt_s);
        let (wanted, cap) = (frame.memory.requested_bytes as f64, frame.memory.cap_bytes as f64);
        if wanted > cap {
            self.threshold *= gain;
        } else if wanted < cap * self.options.memory_kept {
            self.threshold /= gain;
        }
        self.threshold = self.threshold.clamp(self.options.pixels, PIXELS[1]);
    }
}

/// How useful a node is: by the error that is seen without it, and first what is in the middle
/// and what a smaller image would need.
fn utility(options: &Options, frame: &FrameInput<'_>, threshold: f64, node: u32) -> f64 {
    let (tree, view) = (frame.tree, frame.view);
    let Some(parent) = tree.node(node).parent else { return FIRST * FIRST * FIRST };
    let error = screen_error(tree.node(parent), view);
    let mut utility = error;
    if error * options.progressive > threshold {
        utility *= FIRST;
    }
    if !is_deferred(options, view, tree.node(node), error, threshold) {
        utility *= FIRST;
    }
    if frame.is_visible(node) { utility } else { utility / FIRST }
}

/// Whether a node is so far from the middle of the image, and the error seen without it so small,
/// that it is loaded after others: towards the edge the threshold is raised to twice its value.
fn is_deferred(
    options: &Options,
    view: &View,
    node: &TreeNode,
    error: f64,
    threshold: f64,
) -> bool {
    let to_node = (node.bbox[0] + node.bbox[1]) / 2.0 - view.pose.position;
    let radius = node.bbox[0].distance(node.bbox[1]) / 2.0;
    let forward = view.frustum.forward;
    let along = to_node.dot(forward).max(0.0);
    let aside = to_node - forward * along;
    if aside.length() <= radius {
        return false; // the line of sight passes through it
    }
    let nearest = to_node - aside.normalize_or_zero() * radius;
    let factor = 1.0 - nearest.normalize_or_zero().dot(forward).abs();
    let most = 1.0 - libm::cos(view.pose.fov_y_deg.to_radians() / 2.0);
    let cone = options.cone * most;
    if factor <= cone {
        return false;
    }
    let relaxed = threshold * ((factor - cone) / (most - cone)).clamp(0.0, 1.0);
    error < threshold + relaxed
}

impl Policy for ScreenError {
    fn name(&self) -> &'static str {
        if self.load.is_some() { LOOP_NAME } else { FIXED_NAME }
    }

    fn diagnostics(&self) -> &'static [&'static str] {
        &["threshold_pixels"]
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        out.clear();
        match &mut self.load {
            Some(load) => (load.target_ms, load.dt_s) = (frame.target_ms, frame.dt_s),
            None => self.steer_by_memory(frame),
        }
        let &mut Self { options, threshold, ref mut queue, .. } = self;
        let refine = |node| screen_error(frame.tree.node(node), frame.view) > threshold;
        let utility = |node| utility(&options, frame, threshold, node);
        descend(frame, queue, out, refine, utility);
        out.diagnostics.push(threshold);
    }

    fn utility(&self, frame: &FrameInput<'_>, node: u32) -> f64 {
        utility(&self.options, frame, self.threshold, node)
    }

    fn drawn(&mut self, outcome: &FrameOutcome) {
        let Some(load) = &mut self.load else { return };
        let now = outcome.frame_ms / load.target_ms;
        if !now.is_finite() {
            return;
        }
        let Options { smoothing, least_load, most_load, up, down, .. } = self.options;
        let part = 1.0 - Self::rate(1.0 - smoothing, load.dt_s);
        let smoothed = load.smoothed.map_or(now, |before| before + part * (now - before));
        load.smoothed = Some(smoothed);
        if smoothed > most_load {
            self.threshold *= Self::rate(up, load.dt_s);
        } else if smoothed < least_load {
            self.threshold *= Self::rate(down, load.dt_s);
        }
        self.threshold = self.threshold.clamp(PIXELS[0], PIXELS[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::TestFrame;
    use crate::runtime::SceneTree;
    use crate::runtime::test_tree::{Sketch, sketch, tree};

    /// A root and two children at 10 m, seen 100 pixels high and 90° wide: 5 pixels for a metre.
    fn fork(error: f64) -> SceneTree {
        let leaf = |y: f64| sketch([11.0, y, 0.0], 1.0, vec![]);
        let children = vec![leaf(-0.5), leaf(0.5)];
        tree(vec![Sketch { error, ..sketch([11.0, 0.0, 0.0], 1.0, children) }])
    }

    #[test]
    fn nodes_are_refined_above_sixteen_pixels() {
        let fixed = || FIXED.make(&Settings::new()).unwrap();
        for (error, front) in [(3.19, &[0][..]), (3.21, &[1, 2])] {
            let frame = TestFrame::new(fork(error));
            assert_eq!(frame.front(&mut *fixed()), front, "{error} m");
        }
    }

    #[test]
    fn the_threshold_grows_while_memory_is_short_and_falls_back() {
        let mut policy = FIXED.make(&Settings::new()).unwrap();
        let mut frame = TestFrame { dt_s: FRAME_S, ..TestFrame::new(fork(1.0)) };
        let mut threshold = |frame: &TestFrame| frame.select(&mut *policy).diagnostics[0];
        assert_eq!(threshold(&frame), 16.0);
        frame.memory.requested_bytes = frame.memory.cap_bytes + 1;
        assert!((threshold(&frame) - 16.0 * 1.02).abs() < 1e-9);
        assert!((threshold(&frame) - 16.0 * 1.02 * 1.02).abs() < 1e-9);
        // What has room now may have none with a lower threshold.
        frame.memory.requested_bytes = frame.memory.cap_bytes * 6 / 10;
        assert!((threshold(&frame) - 16.0 * 1.02 * 1.02).abs() < 1e-9);
        frame.memory.requested_bytes = frame.memory.cap_bytes * 4 / 10;
        assert!((threshold(&frame) - 16.0 * 1.02).abs() < 1e-9);
        assert!((threshold(&frame) - 16.0).abs() < 1e-9);
        assert_eq!(threshold(&frame), 16.0, "not below");
    }

    #[test]
    fn what_is_in_the_middle_and_what_a_smaller_image_needs_is_loaded_first() {
        let options = OPTIONS;
        let pair = |at: [f64; 3], error: f64| Sketch {
            error,
            ..sketch(at, 1.0, vec![sketch(at, 1.0, vec![])])
        };
        // 1, in the middle; 3, at the side; 5, at the side with an error of many pixels.
        let trees = vec![
            pair([41.0, 0.0, 0.0], 20.0),
            pair([41.0, 35.0, 0.0], 20.0),
            pair([41.0, 35.0, 0.0], 2000.0),
        ];
        let frame = TestFrame::new(tree(trees));
        let of = |node| utility(&options, &frame.input(), 16.0, node);
        assert!(of(1) > 1e3 * of(3), "{} {}", of(1), of(3));
        assert!(of(5) > 1e3 * of(1), "{} {}", of(5), of(1));
    }

    /// Frames of a part of the target, after which the threshold is this.
    fn threshold_after(load: f64, frames: usize) -> f64 {
        let mut policy = LOOP.make(&Settings::new()).unwrap();
        let frame = TestFrame { dt_s: FRAME_S, ..TestFrame::new(fork(1.0)) };
        for _ in 0..frames {
            frame.select(&mut *policy);
            let ms = frame.target_ms * load;
            policy.drawn(&FrameOutcome { actual_ms: ms, frame_ms: ms });
        }
        frame.select(&mut *policy).diagnostics[0]
    }

    #[test]
    fn the_load_moves_the_threshold_outside_of_a_dead_band() {
        assert!((threshold_after(0.9, 10) - 16.0 * 1.02f64.powi(10)).abs() < 1e-9);
        assert!((threshold_after(0.6, 10) - 16.0 * 0.995f64.powi(10)).abs() < 1e-9);
        for load in [0.71, 0.84] {
            assert_eq!(threshold_after(load, 100), 16.0);
        }
    }

    #[test]
    fn one_late_frame_moves_nothing() {
        let mut policy = LOOP.make(&Settings::new()).unwrap();
        let frame = TestFrame { dt_s: FRAME_S, ..TestFrame::new(fork(1.0)) };
        for load in [0.75, 0.75, 2.0, 0.75] {
            frame.select(&mut *policy);
            let ms = frame.target_ms * load;
            policy.drawn(&FrameOutcome { actual_ms: ms, frame_ms: ms });
        }
        assert_eq!(frame.select(&mut *policy).diagnostics[0], 16.0);
    }
}
