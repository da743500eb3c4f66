//! Measures how long things take on this machine.

use std::time::Instant;

use glam::DVec3;

use super::backend::near_plane;
use super::fit::fit;
use super::measurement_scene::MeasurementScene;
use crate::Result;
use crate::bench::statistics::percentile;
use crate::bench::{CLOCK_FILE_VERSION, ClockConstants};
use crate::camera::{CameraPath, Pose, View};
use crate::engine::policies::lakhia::{Lakhia, LakhiaOptions, TimeModel};
use crate::engine::{FrameInput, Policy, Residents, Selection};
use crate::loading::NodeFiles;
use crate::render::Renderer;
use crate::runtime::{SceneTree, covered};

/// How often a frame is drawn for one figure; the median counts.
const REPEATS: usize = 7;
/// Poses of a path that are looked at.
const POSES: usize = 6;
/// Diagonals of the scene between its middle and the place from which it fills little.
const FAR: f64 = 2.0;
/// What frames may take for which nodes are chosen to be measured.
const TARGETS_MS: [f64; 4] = [10.0, 15.0, 25.0, 40.0];

/// Milliseconds to draw nodes: the median of several frames after one that does not count.
fn draw_ms(renderer: &mut Renderer, front: &[u32], pose: &Pose, near: f32) -> Result<f64> {
    renderer.draw(front, pose, near)?;
    let mut times = [0.0; REPEATS];
    for time in &mut times {
        let begin = Instant::now();
        renderer.draw(front, pose, near)?;
        *time = begin.elapsed().as_secs_f64() * 1e3;
    }
    Ok(percentile(&times, 50.0))
}

/// Poses spread over a path.
fn poses(path: &CameraPath) -> impl Iterator<Item = &Pose> {
    let last = path.frames.len() - 1;
    let count = POSES.min(path.frames.len());
    (0..count).map(move |index| &path.frames[index * last / (count - 1).max(1)].pose)
}

/// What a frame draws, and how long that takes.
struct Sample {
    /// Milliseconds above those of an empty frame.
    ms: f64,
    cost: f64,
    nodes: f64,
    textured: f64,
    untextured: f64,
    /// The part of the picture that is covered.
    covered: f64,
    /// The part that selection takes it for, from boxes.
    expected: f64,
}

impl Sample {
    /// Draws nodes of the measured scene; `None` where there are none to draw.
    fn measure(
        measured: &mut MeasurementScene<'_>,
        front: &[u32],
        pose: &Pose,
        empty_ms: f64,
    ) -> Result<Option<Self>> {
        if front.is_empty() {
            return Ok(None);
        }
        let (tree, files) = measured.scene();
        let entries = front.iter().map(|&node| &files.scene().nodes[node as usize]);
        let triangles: f64 = entries.clone().map(|node| f64::from(node.triangles)).sum();
        let textured = entries.map(|node| f64::from(node.textured_triangles)).sum();
        let cost = front.iter().map(|&node| tree.node(node).cost).sum();
        let view = View::new(*pose, DVec3::ZERO, measured.renderer().options().size);
        let ms = draw_ms(measured.renderer(), front, pose, near_plane(tree))? - empty_ms;
        let picture = measured.renderer().coverage()?;
        let drawn = picture.pixels().filter(|pixel| pixel.0[0] > 0).count();
        Ok(Some(Self {
            ms,
            cost,
            nodes: front.len() as f64,
            textured,
            untextured: triangles - textured,
            covered: drawn as f64 / picture.pixels().len().max(1) as f64,
            expected: covered(tree, front, &view),
        }))
    }

    /// For a fit by relative deviations, which is how estimates are judged.
    fn relative(&self, terms: [f64; 3]) -> ([f64; 3], f64) {
        let weight = 1.0 / self.ms.max(0.05); // what is shorter is not measured any better
        (terms.map(|term| term * weight), self.ms * weight)
    }
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
/// thrown away before they are drawn, as they never are at the levels that selection chooses.
fn far_away(tree: &SceneTree, pose: &Pose) -> Pose {
    let back = tree.diagonal() * FAR;
    Pose { position: tree.middle() - pose.forward() * back, fov_y_deg: 60.0, ..*pose }
}

/// What drawing takes at the beginning of a run: the fixed overhead, measured by drawing nothing
/// (thesis, section 4.2, note 3), and the times for a unit of cost and for filling the picture,
/// from those of the roots that can be read.
pub fn measure_start(
    renderer: &mut Renderer,
    tree: &SceneTree,
    files: NodeFiles,
    path: &CameraPath,
) -> Result<TimeModel> {
    let mut measured = MeasurementScene::new(tree, files, renderer);
    // What cannot be read is told of by the run itself.
    let roots: Vec<u32> =
        tree.roots().iter().copied().filter(|&root| measured.add(root).is_ok()).collect();
    let (mut samples, mut fixed) = (Vec::new(), Vec::new());
    for pose in poses(path) {
        let empty_ms = draw_ms(measured.renderer(), &[], pose, near_plane(tree))?;
        fixed.push(empty_ms);
        let seen = seen(tree, &roots, pose, measured.renderer().options().size);
        for part in [seen.len(), seen.len() / 2, seen.len() / 4] {
            samples.extend(Sample::measure(&mut measured, &seen[..part], pose, empty_ms)?);
        }
        let far = far_away(tree, pose);
        samples.extend(Sample::measure(&mut measured, &roots, &far, empty_ms)?);
    }
    let terms = samples.iter().map(|sample| sample.relative([sample.cost, sample.covered, 0.0]));
    let [ms_per_cost, fill_ms, _] = fit(&terms.collect::<Vec<_>>());
    Ok(time_model(percentile(&fixed, 50.0), ms_per_cost, fill_ms, &samples))
}

/// From milliseconds for the whole picture to units of cost for what boxes take for it.
fn time_model(fixed_ms: f64, ms_per_cost: f64, fill_ms: f64, samples: &[Sample]) -> TimeModel {
    let sum = |part: fn(&Sample) -> f64| samples.iter().map(part).sum::<f64>();
    let (covered, expected) = (sum(|s| s.covered), sum(|s| s.expected));
    let fills = if expected > 0.0 { covered / expected } else { 1.0 };
    if ms_per_cost > 0.0 {
        TimeModel { fixed_ms, ms_per_cost, fill_cost: fills * fill_ms / ms_per_cost }
    } else {
        TimeModel { fixed_ms, ..TimeModel::default() } // triangles took no time that one could see
    }
}

/// What selection would draw from a place where all is in memory and a frame may take
/// `target_ms`.
fn choose(tree: &SceneTree, pose: &Pose, size: [u32; 2], target_ms: f64) -> Vec<u32> {
    let mut policy = Lakhia::new(LakhiaOptions::default());
    let mut selection = Selection::default();
    let view = View::new(*pose, DVec3::ZERO, size);
    let residents = Residents::all(tree.len());
    let frame = FrameInput { tree, view: &view, residents: &residents, target_ms, dt_s: 0.0 };
    policy.select(&frame, &mut selection);
    selection.front
}

/// `c_textured` from the times of the same frames with and without pictures: what pictures cost
/// is in the first alone. `None` where nothing has any.
fn textured_weight(pairs: &[[f64; 2]]) -> Option<f64> {
    let [with, without] = [0, 1].map(|i| pairs.iter().map(|pair| pair[i].max(0.0)).sum::<f64>());
    (with > 0.0 && without > 0.0).then(|| with / (with + without))
}

/// Measures the constants of the model clock over what selection chooses of a scene from places
/// on a path, for frames short and long. What `tree` says of costs only decides what is drawn.
pub fn calibrate(
    renderer: &mut Renderer,
    tree: &SceneTree,
    files: NodeFiles,
    path: &CameraPath,
) -> Result<ClockConstants> {
    let mut measured = MeasurementScene::new(tree, files, renderer);
    let size = measured.renderer().options().size;
    let (mut samples, mut fixed, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    for pose in poses(path) {
        let empty_ms = draw_ms(measured.renderer(), &[], pose, near_plane(tree))?;
        fixed.push(empty_ms);
        for target_ms in TARGETS_MS {
            let front = choose(tree, pose, size, target_ms);
            measured.show(&front)?;
            samples.extend(Sample::measure(&mut measured, &front, pose, empty_ms)?);
            // The same triangles without their pictures.
            if let Some(with) = samples.last().filter(|sample| sample.textured > 0.0) {
                let with_ms = with.ms;
                measured.strip(&front)?;
                let ms = draw_ms(measured.renderer(), &front, pose, near_plane(tree))?;
                pairs.push([with_ms, ms - empty_ms]);
            }
        }
    }
    let fitted = |terms: &dyn Fn(&Sample) -> [f64; 3]| {
        fit(&samples.iter().map(|sample| sample.relative(terms(sample))).collect::<Vec<_>>())
    };
    // Costs follow from the weight of textures, so that it is found first.
    let defaults = ClockConstants::default();
    let weight = textured_weight(&pairs).unwrap_or(defaults.textured_weight);
    let cost = |s: &Sample| weight * s.textured + (1.0 - weight) * s.untextured;
    let [ms_per_cost, fill_ms, _] = fitted(&|s| [cost(s), s.covered, 0.0]);
    // Nodes have much the same number of triangles each: what is theirs is what is left over.
    let left = samples.iter().map(|s| {
        let (terms, ms) = s.relative([s.nodes, cost(s), s.covered]);
        ([terms[0], 0.0, 0.0], ms - ms_per_cost * terms[1] - fill_ms * terms[2])
    });
    let [ms_per_node, _, _] = fit(&left.collect::<Vec<_>>());
    let time = time_model(percentile(&fixed, 50.0), ms_per_cost, fill_ms, &samples);
    Ok(ClockConstants {
        version: CLOCK_FILE_VERSION,
        fixed_ms: time.fixed_ms,
        ms_per_cost: time.ms_per_cost,
        fill_cost: time.fill_cost,
        ms_per_node,
        load_bytes_per_ms: measured.bytes_per_ms().unwrap_or(defaults.load_bytes_per_ms),
        textured_weight: weight,
    })
}
