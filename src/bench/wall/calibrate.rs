//! Measures how long things take on this machine.

use std::time::Instant;

use glam::DVec3;

use super::clock_fit::{Measured, fit_clock};
use super::measurement_scene::MeasurementScene;
use crate::Result;
use crate::bench::ClockConstants;
use crate::bench::model_load::TileLoad;
use crate::bench::statistics::{deviation, percentile};
use crate::camera::{CameraPath, Pose, View};
use crate::engine::policies::{PolicyKind, Settings};
use crate::engine::{
    CostModel, CoveredParts, FrameInput, FrontLoad, Load, Prices, Residents, Selection, Visibility,
};
use crate::loading::NodeFiles;
use crate::render::Renderer;
use crate::runtime::SceneTree;
use crate::runtime::residency::MemoryUse;

/// How often a frame is drawn for one figure; the median counts.
const REPEATS: usize = 7;
/// Poses of a path from which frames are measured.
const POSES: usize = 6;
/// Diagonals of the scene between its middle and the place from which it fills little.
const FAR: f64 = 2.0;
/// Pixels of error for which nodes are chosen to be measured: frames long and short.
const ERRORS_PIXELS: [f64; 4] = [64.0, 16.0, 4.0, 1.0];
/// No more triangles than this are measured in a frame, unless the adapter draws more in little time.
const MOST_TRIANGLES: u64 = 400_000;
/// Milliseconds that is.
const LITTLE_MS: f64 = 50.0;
/// And no more than this.
const MOST_IN_LITTLE_TIME: u64 = 8_000_000;

/// Milliseconds to draw nodes: at first, and in several frames after that.
fn times(
    renderer: &mut Renderer,
    front: &[u32],
    pose: &Pose,
    near: f32,
) -> Result<(f64, [f64; REPEATS])> {
    let mut draw = || {
        let begin = Instant::now();
        renderer.draw(front, pose, near)?;
        Ok(begin.elapsed().as_secs_f64() * 1e3)
    };
    let first = draw()?;
    let mut times = [0.0; REPEATS];
    for time in &mut times {
        *time = draw()?;
    }
    Ok((first, times))
}

/// Poses spread over a path.
fn poses(path: &CameraPath) -> impl Iterator<Item = &Pose> {
    let last = path.frames.len() - 1;
    let count = POSES.min(path.frames.len());
    (0..count).map(move |index| &path.frames[index * last / (count - 1).max(1)].pose)
}

/// Frames that were drawn, and how long each took.
#[derive(Default)]
struct Samples {
    /// What was drawn, and the median of its times.
    frames: Vec<(Load, f64)>,
    /// The same as the model clock sees it.
    measured: Vec<Measured>,
    /// Relative deviations of the times of the same frame.
    noise: Vec<f64>,
    /// Milliseconds by which frames took longer when they were drawn for the first time.
    cold_ms: f64,
}

impl Samples {
    /// Draws nodes; milliseconds that it took.
    fn measure(
        &mut self,
        tree: &SceneTree,
        measured: &mut MeasurementScene<'_>,
        front: &[u32],
        pose: &Pose,
    ) -> Result<f64> {
        let view = View::new(*pose, DVec3::ZERO, measured.renderer().options().size);
        let (first_ms, times) = times(measured.renderer(), front, pose, tree.near_plane())?;
        let ms = percentile(&times, 50.0);
        self.frames
            .push((FrontLoad::default().of(tree, front, &view, &CoveredParts::default(), 0), ms));
        self.measured.push((TileLoad::default().of(tree, &[], front, &view), ms));
        self.noise.push(deviation(&times) / ms);
        self.cold_ms += first_ms - ms;
        Ok(ms)
    }

    /// The prices that explain the times best; what frames do not tell is as usual.
    fn prices(&self) -> Prices {
        let mut costs = CostModel::new(&ClockConstants::default().prices);
        self.frames.iter().for_each(|(load, ms)| costs.observe(load, *ms, None, 0.0));
        costs.prices()
    }
}

/// What things take at the beginning of a run, from drawing nothing (thesis, section 4.2, note 3)
/// and those of some nodes that can be read.
pub fn measure_start(
    renderer: &mut Renderer,
    tree: &SceneTree,
    files: NodeFiles,
    nodes: &[u32],
    path: &CameraPath,
) -> Result<Prices> {
    let mut measured = MeasurementScene::new(tree, files, renderer);
    // What cannot be read is told of by the run itself.
    let nodes: Vec<u32> =
        nodes.iter().copied().filter(|&node| measured.add(node).is_ok()).collect();
    let mut samples = Samples::default();
    for pose in poses(path) {
        samples.measure(tree, &mut measured, &[], pose)?;
        let seen = seen(tree, &nodes, pose, measured.renderer().options().size);
        for part in [seen.len(), seen.len() / 2, seen.len() / 4] {
            samples.measure(tree, &mut measured, &seen[..part], pose)?;
        }
        samples.measure(tree, &mut measured, &nodes, &far_away(tree, pose))?;
    }
    Ok(samples.prices())
}

/// Those of `nodes` that a camera sees, from near to far.
fn seen(tree: &SceneTree, nodes: &[u32], pose: &Pose, size: [u32; 2]) -> Vec<u32> {
    let view = View::new(*pose, DVec3::ZERO, size);
    let mut seen: Vec<(f64, u32)> = nodes
        .iter()
        .map(|&node| (node, tree.node(node).bbox))
        .filter(|&(_, bbox)| view.frustum.outside(bbox) <= 0.0)
        .map(|(node, [min, max])| (((min + max) / 2.0).distance(pose.position), node))
        .collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    seen.into_iter().map(|(_, node)| node).collect()
}

/// A pose from which all nodes are seen and fill little. From further away still, triangles are
/// thrown away before they are drawn, as they never are at the levels that are chosen.
fn far_away(tree: &SceneTree, pose: &Pose) -> Pose {
    let back = tree.diagonal() * FAR;
    Pose { position: tree.middle() - pose.forward() * back, fov_y_deg: 60.0, ..*pose }
}

/// The nodes of which no error is seen as more than so many pixels, with all in memory.
fn choose(tree: &SceneTree, pose: &Pose, size: [u32; 2], pixels: f64) -> Result<Vec<u32>> {
    let settings = Settings::from([("pixels".to_owned(), pixels)]);
    let mut policy = PolicyKind::find(crate::engine::policies::BY_ERROR)?.make(&settings)?;
    let mut selection = Selection::default();
    let frame = FrameInput {
        tree,
        view: &View::new(*pose, DVec3::ZERO, size),
        visibility: &Visibility::default(),
        covered: &CoveredParts::default(),
        seen: None,
        hidden: None,
        predicted: &[],
        residents: &Residents::all(tree.len()),
        memory: MemoryUse { cap_bytes: u64::MAX, ..MemoryUse::default() },
        costs: &CostModel::new(&ClockConstants::default().prices),
        target_ms: 1e3,
        budget_ms: 1e3,
        dt_s: 0.0,
    };
    policy.select(&frame, &mut selection);
    Ok(selection.front)
}

/// `c_textured` from the times of the same frames with and without textures: what these cost is
/// in the first alone. `None` where nothing has any.
fn textured_weight(pairs: &[[f64; 2]]) -> Option<f64> {
    let [with, without] = [0, 1].map(|i| pairs.iter().map(|pair| pair[i].max(0.0)).sum::<f64>());
    (with > 0.0 && without > 0.0).then(|| with / (with + without))
}

/// What a calibration found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// The constants.
    pub constants: ClockConstants,
    /// Frames that were measured.
    pub frames: usize,
    /// Root of the mean square of relative errors by which these frames are off.
    pub unexplained: f64,
}

/// Measures the constants of the model clock over fronts of a scene from places on a path.
pub fn calibrate(
    renderer: &mut Renderer,
    tree: &SceneTree,
    files: NodeFiles,
    path: &CameraPath,
) -> Result<Calibration> {
    let mut measured = MeasurementScene::new(tree, files, renderer);
    let size = measured.renderer().options().size;
    let (mut samples, mut stripped, mut pairs) =
        (Samples::default(), Samples::default(), Vec::new());
    for pose in poses(path) {
        let empty_ms = samples.measure(tree, &mut measured, &[], pose)?;
        let mut most = MOST_TRIANGLES;
        for pixels in ERRORS_PIXELS {
            let front = choose(tree, pose, size, pixels)?;
            let nodes = || front.iter().map(|&node| tree.node(node));
            let triangles: u64 = nodes().map(|node| u64::from(node.triangles)).sum();
            if triangles > most {
                break; // finer ones have more
            }
            measured.show(&front)?;
            let ms = samples.measure(tree, &mut measured, &front, pose)?;
            let in_little_time = (triangles as f64 * LITTLE_MS / ms.max(0.01)) as u64;
            most = most.max(in_little_time.min(MOST_IN_LITTLE_TIME));
            // The same triangles without their textures.
            if nodes().any(|node| node.textured_triangles > 0) {
                measured.strip(&front)?;
                let without_ms = stripped.measure(tree, &mut measured, &front, pose)?;
                pairs.push([ms - empty_ms, without_ms - empty_ms]);
            }
        }
    }
    // The same triangles without textures tell what these add.
    let without = stripped.measured.iter().map(|(load, ms)| (load.stripped(), *ms));
    samples.measured.extend(without);
    let (uploaded_bytes, upload_ms) = measured.uploads();
    let by_byte = |ms: f64| ms.max(0.0) / uploaded_bytes.max(1) as f64;
    let defaults = ClockConstants::default();
    let (clock, unexplained) = fit_clock(&samples.measured, &defaults);
    let constants = ClockConstants {
        noise: percentile(&samples.noise, 50.0),
        load_bytes_per_ms: measured.bytes_per_ms().unwrap_or(defaults.load_bytes_per_ms),
        textured_weight: textured_weight(&pairs).unwrap_or(defaults.textured_weight),
        cold_byte: by_byte(samples.cold_ms),
        prices: Prices { uploaded_byte: by_byte(upload_ms), ..clock.prices },
        ..clock
    };
    Ok(Calibration { constants, frames: samples.measured.len(), unexplained })
}
