//! Measures how long things take on this machine.

use std::time::Instant;

use super::world::near_plane;
use crate::Result;
use crate::bench::statistics::percentile;
use crate::bench::{CLOCK_FILE_VERSION, ClockConstants};
use crate::camera::{CameraPath, Pose};
use crate::loading::NodeFiles;
use crate::render::Renderer;
use crate::runtime::SceneTree;
use crate::runtime::lakhia::TimeModel;

/// How often a frame is drawn for one figure; the median counts.
const REPEATS: usize = 7;
/// Poses of a path that are looked at.
const POSES: usize = 5;
/// Nodes of a level that are read and drawn at most.
const MOST_NODES: usize = 400;

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

/// What drawing takes at the beginning of a run: the fixed overhead, measured by drawing nothing
/// (thesis, section 4.2, note 3), and the time for a unit of cost, from the roots in `front`
/// that were uploaded.
pub fn measure_start(
    renderer: &mut Renderer,
    tree: &SceneTree,
    path: &CameraPath,
    front: &[u32],
) -> Result<TimeModel> {
    let near = near_plane(tree);
    let (mut fixed, mut per_cost) = (Vec::new(), Vec::new());
    let cost: f64 = front.iter().map(|&node| tree.node(node).cost).sum();
    for pose in poses(path) {
        let empty = draw_ms(renderer, &[], pose, near)?;
        fixed.push(empty);
        per_cost.push((draw_ms(renderer, front, pose, near)? - empty).max(0.0) / cost);
    }
    let fallback = TimeModel::default().ms_per_cost;
    let per_cost = percentile(&per_cost, 50.0);
    let ms_per_cost = if per_cost.is_finite() && per_cost > 0.0 { per_cost } else { fallback };
    Ok(TimeModel { fixed_ms: percentile(&fixed, 50.0), ms_per_cost })
}

/// One measurement.
struct Sample {
    /// Milliseconds above those of an empty frame.
    ms: f64,
    cost: f64,
    nodes: f64,
    textured: f64,
    untextured: f64,
}

/// Measures the constants of the model clock over the levels of a scene, seen from places on a
/// path; `progress` is told of each level that is done.
pub fn calibrate(
    renderer: &mut Renderer,
    tree: &SceneTree,
    files: &NodeFiles,
    path: &CameraPath,
    mut progress: impl FnMut(u32),
) -> Result<ClockConstants> {
    let near = near_plane(tree);
    let levels = (0..tree.len() as u32).map(|node| tree.node(node).level + 1).max().unwrap_or(0);
    let (mut fixed, mut samples) = (Vec::new(), Vec::new());
    let (mut bytes, mut load_ms) = (0, 0.0);
    for level in 0..levels {
        let nodes: Vec<u32> = (0..tree.len() as u32)
            .filter(|&node| tree.node(node).level == level)
            .take(MOST_NODES)
            .collect();
        let mut held = vec![false; files.scene().shared_textures.len()];
        for &node in &nodes {
            let begin = Instant::now();
            let arrival = files.read(node, |texture| held[texture as usize])?;
            load_ms += begin.elapsed().as_secs_f64() * 1e3;
            bytes += files.scene().nodes[node as usize].file_bytes;
            for (texture, picture) in &arrival.pictures {
                held[*texture as usize] = true;
                bytes += files.scene().shared_textures[*texture as usize].bytes;
                renderer.upload_shared(*texture, picture)?;
            }
            renderer.upload(node, level, &arrival.content)?;
        }
        for pose in poses(path) {
            let empty = draw_ms(renderer, &[], pose, near)?;
            fixed.push(empty);
            for part in [nodes.len(), nodes.len() / 2, nodes.len() / 4] {
                let front = &nodes[..part];
                let ms = draw_ms(renderer, front, pose, near)? - empty;
                samples.push(sample(tree, files, front, ms));
            }
        }
        nodes.iter().for_each(|&node| renderer.remove(node));
        (0..held.len() as u32).for_each(|texture| renderer.remove_shared(texture));
        progress(level);
    }
    let defaults = ClockConstants::default();
    let [ms_per_cost, ms_per_node] = fit(samples.iter().map(|s| ([s.cost, s.nodes], s.ms)));
    let [textured, untextured] = fit(samples.iter().map(|s| ([s.textured, s.untextured], s.ms)));
    let both = textured > 0.0 && untextured > 0.0;
    Ok(ClockConstants {
        version: CLOCK_FILE_VERSION,
        fixed_ms: percentile(&fixed, 50.0),
        ms_per_cost: if ms_per_cost > 0.0 { ms_per_cost } else { defaults.ms_per_cost },
        ms_per_node,
        load_bytes_per_ms: if load_ms > 0.0 {
            bytes as f64 / load_ms
        } else {
            defaults.load_bytes_per_ms
        },
        textured_weight: if both {
            textured / (textured + untextured)
        } else {
            defaults.textured_weight
        },
    })
}

fn sample(tree: &SceneTree, files: &NodeFiles, front: &[u32], ms: f64) -> Sample {
    let mut sample =
        Sample { ms, cost: 0.0, nodes: front.len() as f64, textured: 0.0, untextured: 0.0 };
    for &node in front {
        let entry = &files.scene().nodes[node as usize];
        sample.cost += tree.node(node).cost;
        sample.textured += f64::from(entry.textured_triangles);
        sample.untextured += f64::from(entry.triangles - entry.textured_triangles);
    }
    sample
}

/// The two factors, neither below 0, by which the least squares of `Σ (a·x + b·y − z)²` are
/// reached.
fn fit(samples: impl Iterator<Item = ([f64; 2], f64)>) -> [f64; 2] {
    let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for ([x, y], z) in samples {
        xx += x * x;
        xy += x * y;
        yy += y * y;
        xz += x * z;
        yz += y * z;
    }
    let determinant = xx * yy - xy * xy;
    let alone = |square: f64, product: f64| {
        if square > 0.0 { (product / square).max(0.0) } else { 0.0 }
    };
    if determinant > 1e-12 * xx * yy {
        let a = (xz * yy - yz * xy) / determinant;
        let b = (yz * xx - xz * xy) / determinant;
        if a >= 0.0 && b >= 0.0 {
            return [a, b];
        }
        if a < 0.0 {
            return [0.0, alone(yy, yz)];
        }
    }
    [alone(xx, xz), 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_found_and_never_below_zero() {
        let points = [[1.0, 2.0], [3.0, 1.0], [5.0, 7.0], [2.0, 2.0]];
        let made = |a: f64, b: f64| fit(points.iter().map(|&[x, y]| ([x, y], a * x + b * y)));
        let [a, b] = made(0.5, 2.0);
        assert!((a - 0.5).abs() < 1e-12 && (b - 2.0).abs() < 1e-12);
        assert!(made(1.0, -0.2)[1] == 0.0 && made(1.0, -0.2)[0] > 0.0);
        assert!(made(-0.2, 1.0)[0] == 0.0 && made(-0.2, 1.0)[1] > 0.0);
        // One of the two never occurs.
        assert_eq!(fit([([2.0, 0.0], 3.0), ([4.0, 0.0], 6.0)].into_iter()), [1.5, 0.0]);
        assert_eq!(fit(std::iter::empty()), [0.0, 0.0]);
    }
}
