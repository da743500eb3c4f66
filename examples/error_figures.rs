//! Which figure of a node's error a viewer should choose levels by: FLIP against the leaves of
//! fronts with equally many triangles, refined where each figure is seen as most pixels.
//!
//! usage: error_figures OUT...
//!
//! Poses are from every 45 degrees around the scene at 30 degrees over the horizon, from far enough
//! to see all of it and from a quarter of that distance. Fronts have 10, 20, 40 and 60 % of the
//! triangles of the leaves in view. Prints a row a scene: the geometric mean of FLIP by each figure
//! over that by the bound.

use std::error::Error;
use std::path::Path;

use glam::DVec3;
use hlod::bench::{ReferenceRenderer, Session};
use hlod::camera::{Pose, View, from_angles};
use hlod::format::{Node, Scene};
use hlod::picture_error::{PIXELS_PER_DEGREE, flip};
use hlod::render::RenderOptions;
use image::{DynamicImage, RgbaImage};

type Result<T, E = Box<dyn Error>> = std::result::Result<T, E>;

const SIZE: [u32; 2] = [640, 360];
const FOV_Y_DEG: f64 = 60.0;
const SHARES: [f64; 4] = [0.1, 0.2, 0.4, 0.6];
const CAP_BYTES: u64 = 2 << 30;

/// Metres of a node's error, by the name of the figure.
const FIGURES: [(&str, fn(&Node) -> f64); 7] = [
    ("bound", |node| node.geometric_error),
    ("p95", p95),
    ("mean", |node| node.mean_error),
    ("4 p95 or bound", |node| (4.0 * p95(node)).min(node.geometric_error)),
    ("8 p95 or bound", |node| (8.0 * p95(node)).min(node.geometric_error)),
    ("√(p95 × bound)", |node| (p95(node) * node.geometric_error).sqrt()),
    ("√(mean × bound)", |node| (node.mean_error * node.geometric_error).sqrt()),
];

/// The 95th percentile, or the mean where that is larger.
fn p95(node: &Node) -> f64 {
    node.p95_error.max(node.mean_error)
}

fn main() -> Result<()> {
    println!("| scene | {} |", FIGURES.map(|(name, _)| name).join(" | "));
    println!("|---|{}", "---:|".repeat(FIGURES.len()));
    let mut sums = [0.0; FIGURES.len()];
    let outs: Vec<String> = std::env::args().skip(1).collect();
    for out in &outs {
        let logs = logs_of_flip(Path::new(out))?;
        let name = Path::new(out).file_name().unwrap_or_default().to_string_lossy();
        println!("| {name} | {} |", cells(logs, 1.0));
        sums = std::array::from_fn(|figure| sums[figure] + logs[figure]);
    }
    println!("| all | {} |", cells(sums, outs.len().max(1) as f64));
    Ok(())
}

fn cells(logs: [f64; FIGURES.len()], count: f64) -> String {
    logs.map(|log| format!("{:.3}", ((log - logs[0]) / count).exp())).join(" | ")
}

/// The mean logarithm of FLIP, by figure.
fn logs_of_flip(out: &Path) -> Result<[f64; FIGURES.len()]> {
    let session = Session::open(out)?;
    let scene = session.scene();
    let options = RenderOptions { size: SIZE, ..RenderOptions::default() };
    let mut renderer = ReferenceRenderer::new(&session, &options, CAP_BYTES)?;
    let errors = FIGURES.map(|(_, of_node)| handed_up(scene, of_node));
    let (mut sums, mut count) = ([0.0; FIGURES.len()], 0);
    for pose in poses(scene)? {
        let view = View::new(pose, DVec3::ZERO, SIZE);
        let leaves = front(scene, &view, &errors[0], u64::MAX);
        let whole = renderer.render(&leaves, &pose)?;
        for share in SHARES {
            let most = (triangles(scene, &leaves) as f64 * share) as u64;
            let mut flips = [0.0; FIGURES.len()];
            for (flip, errors) in flips.iter_mut().zip(&errors) {
                let picture = renderer.render(&front(scene, &view, errors, most), &pose)?;
                *flip = difference(&whole, picture)?;
            }
            if flips.iter().all(|&flip| flip > 0.0) {
                sums = std::array::from_fn(|figure| sums[figure] + flips[figure].ln());
                count += 1;
            }
        }
    }
    Ok(sums.map(|sum| sum / f64::from(count.max(1))))
}

/// Errors that are never less than those below.
fn handed_up(scene: &Scene, of_node: fn(&Node) -> f64) -> Vec<f64> {
    let mut errors: Vec<f64> = scene.nodes.iter().map(of_node).collect();
    let mut deepest: Vec<usize> = (0..errors.len()).collect();
    deepest.sort_by_key(|&index| std::cmp::Reverse(scene.nodes[index].level));
    for index in deepest {
        if let Some(parent) = scene.nodes[index].parent {
            errors[parent as usize] = errors[parent as usize].max(errors[index]);
        }
    }
    errors
}

/// Nodes in view, refined where the error is seen as most pixels until there are so many triangles.
fn front(scene: &Scene, view: &View, errors: &[f64], most: u64) -> Vec<u32> {
    let in_view = |&index: &u32| {
        let node = &scene.nodes[index as usize];
        view.frustum.outside([node.bbox_min.into(), node.bbox_max.into()]) <= 0.0
    };
    let pixels = |index: u32| {
        let node = &scene.nodes[index as usize];
        let at = view.pose.position;
        let nearest = at.clamp(node.bbox_min.into(), node.bbox_max.into());
        (errors[index as usize] / at.distance(nearest).max(1e-7)).to_bits()
    };
    let mut waiting: std::collections::BinaryHeap<(u64, u32)> =
        scene.roots().filter(in_view).map(|root| (pixels(root), root)).collect();
    let roots: Vec<u32> = waiting.iter().map(|&(_, root)| root).collect();
    let mut now = triangles(scene, &roots);
    let mut front = Vec::new();
    while let Some((_, index)) = waiting.pop() {
        let children: Vec<u32> = scene.children(index).filter(in_view).collect();
        let after = now - triangles(scene, &[index]) + triangles(scene, &children);
        if scene.nodes[index as usize].first_child.is_none() || after > most {
            front.push(index);
        } else {
            now = after;
            waiting.extend(children.into_iter().map(|child| (pixels(child), child)));
        }
    }
    front
}

fn triangles(scene: &Scene, nodes: &[u32]) -> u64 {
    nodes.iter().map(|&node| u64::from(scene.nodes[node as usize].triangles)).sum()
}

fn poses(scene: &Scene) -> Result<Vec<Pose>> {
    let [low, high] = scene.bounds().ok_or("the scene has no nodes")?.map(DVec3::from);
    let away = low.distance(high) / 2.0 / (FOV_Y_DEG / 2.0).to_radians().sin();
    let around = (0..8).flat_map(|step| [(step, away), (step, away / 4.0)]);
    Ok(around
        .map(|(step, away)| {
            let rotation = from_angles(scene.up, f64::from(step) * 45.0, -30.0, 0.0);
            let position = (low + high) / 2.0 - rotation * DVec3::NEG_Z * away;
            Pose { position, rotation, fov_y_deg: FOV_Y_DEG }
        })
        .collect())
}

fn difference(a: &RgbaImage, b: RgbaImage) -> Result<f64> {
    let rgb = |picture: RgbaImage| DynamicImage::from(picture).to_rgb8();
    let map = flip(&rgb(a.clone()), &rgb(b), PIXELS_PER_DEGREE).ok_or("sizes differ")?;
    Ok(map.mean())
}
