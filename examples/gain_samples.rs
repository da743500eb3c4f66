//! What a picture loses where one node stands for all that is below it: samples by which the gain of
//! the policy `gain-over-price` was fitted (`scripts/gain`).
//!
//! usage: gain_samples [--poses N] [--nodes N] OUT PATH.csv...
//!
//! At N poses of each path (default 10), for N of the nodes in view that are no leaves (default 24):
//! FLIP of the leaves with that node in the place of those below it against the leaves, summed over
//! pixels, beside what a policy knows of the node. Writes rows of CSV.

use std::error::Error;
use std::path::Path;

use hlod::bench::{ReferenceRenderer, Session};
use hlod::camera::{Pose, View, read_path};
use hlod::engine::Visibility;
use hlod::format::Scene;
use hlod::picture_error::{PIXELS_PER_DEGREE, flip};
use hlod::random::Random;
use hlod::render::RenderOptions;
use image::{DynamicImage, GenericImageView, RgbaImage};

type Result<T, E = Box<dyn Error>> = std::result::Result<T, E>;

const SIZE: [u32; 2] = [1280, 720];
const CAP_BYTES: u64 = 2 << 30;

/// FLIP looks no further than this, in pixels.
const REACH: u32 = 20;

const COLUMNS: &str = "scene,path,frame,node,parent,level,triangles,leaf_triangles,textured,area_m2,\
    texels,shared_texels,pixels_per_metre,inside,mean_m,p95_m,bound_m,children_mean_m,covered,seen,\
    children_triangles,flip_sum,children_flip_sum";

fn main() -> Result<()> {
    let (mut poses, mut nodes) = (10, 24);
    let mut files = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--poses" => poses = words.next().ok_or("--poses N")?.parse()?,
            "--nodes" => nodes = words.next().ok_or("--nodes N")?.parse()?,
            _ => files.push(word),
        }
    }
    let [out, paths @ ..] = &files[..] else { return Err("OUT PATH.csv...".into()) };
    println!("{COLUMNS}");
    for path in paths {
        sample(Path::new(out), Path::new(path), poses, nodes)?;
    }
    Ok(())
}

fn sample(out: &Path, path: &Path, poses: usize, nodes: usize) -> Result<()> {
    let session = Session::open(out)?;
    let options = RenderOptions { size: SIZE, ..RenderOptions::default() };
    let mut renderer = ReferenceRenderer::new(&session, &options, CAP_BYTES)?;
    let name = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let frames = read_path(path, session.scene().up)?.frames;
    for at in 0..poses.min(frames.len()) {
        let frame = (frames.len() - 1) * at / (poses - 1).max(1);
        let begin = format!("{},{},{frame}", name(out), name(path));
        sample_pose(session.scene(), &mut renderer, &frames[frame].pose, nodes, &begin)?;
    }
    Ok(())
}

fn sample_pose(
    scene: &Scene,
    renderer: &mut ReferenceRenderer,
    pose: &Pose,
    nodes: usize,
    begin: &str,
) -> Result<()> {
    let view = View::new(*pose, glam::DVec3::ZERO, SIZE);
    let visibility = Visibility::default();
    let bbox = |index: u32| {
        let node = &scene.nodes[index as usize];
        [node.bbox_min.into(), node.bbox_max.into()]
    };
    let in_view =
        |index: u32| visibility.get_or(index, || view.frustum.outside(bbox(index)) <= 0.0);
    let all = 0..scene.nodes.len() as u32;
    let is_leaf = |index: u32| scene.nodes[index as usize].first_child.is_none();
    let leaves: Vec<u32> = all.clone().filter(|&i| is_leaf(i) && in_view(i)).collect();
    let whole = renderer.render(&leaves, pose)?;

    let mut inner: Vec<u32> = all.filter(|&i| !is_leaf(i) && in_view(i)).collect();
    let mut random = Random::new(7, 0);
    for _ in 0..nodes {
        if inner.is_empty() {
            break;
        }
        let picked = inner.swap_remove((random.unit() * inner.len() as f64) as usize);
        let mut others = leaves.clone();
        others.retain(|&leaf| !is_below(scene, leaf, picked));
        let below = leaves.iter().filter(|&&leaf| is_below(scene, leaf, picked));
        let leaf_triangles: u64 =
            below.map(|&leaf| u64::from(scene.nodes[leaf as usize].triangles)).sum();
        let without = renderer.render(&others, pose)?;
        let seen = changed(&whole, &without).0;
        let mut with = others.clone();
        with.push(picked);
        let sum = flip_sum(&whole, &renderer.render(&with, pose)?)?;
        let children: Vec<u32> = scene.children(picked).filter(|&i| in_view(i)).collect();
        let children_triangles: u32 =
            children.iter().map(|&child| scene.nodes[child as usize].triangles).sum();
        let children_mean = children.iter().map(|&child| scene.nodes[child as usize].mean_error);
        let children_mean = children_mean.sum::<f64>() / children.len().max(1) as f64;
        others.extend(&children);
        let children_sum = flip_sum(&whole, &renderer.render(&others, pose)?)?;
        let node = &scene.nodes[picked as usize];
        let [min, max] = bbox(picked);
        let distance = pose.position.distance(pose.position.clamp(min, max));
        let area = node.static_benefit * node.static_benefit / f64::from(node.triangles.max(1));
        println!(
            "{begin},{picked},{},{},{},{leaf_triangles},{},{area},{},{},{},{},{},{},{},{children_mean},{},\
            {seen},{children_triangles},{sum},{children_sum}",
            node.parent.map_or(-1, i64::from),
            node.level,
            node.triangles,
            node.textured_triangles,
            node.texels,
            node.shared_texels,
            view.pixels_per_metre() / distance.max(1e-3),
            u8::from(distance == 0.0),
            node.mean_error,
            node.p95_error,
            node.geometric_error,
            view.frustum.covered([min, max]),
        );
    }
    Ok(())
}

fn is_below(scene: &Scene, mut node: u32, above: u32) -> bool {
    while let Some(parent) = scene.nodes[node as usize].parent {
        if parent == above {
            return true;
        }
        node = parent;
    }
    false
}

/// How many pixels differ, and the rectangle around them: left, top, width, height.
fn changed(a: &RgbaImage, b: &RgbaImage) -> (u64, [u32; 4]) {
    let (mut count, mut ends) = (0, [u32::MAX, u32::MAX, 0, 0]);
    for (x, y, pixel) in a.enumerate_pixels() {
        if pixel != b.get_pixel(x, y) {
            count += 1;
            ends = [ends[0].min(x), ends[1].min(y), ends[2].max(x + 1), ends[3].max(y + 1)];
        }
    }
    if count == 0 {
        return (0, [0; 4]);
    }
    let from = [ends[0].saturating_sub(REACH), ends[1].saturating_sub(REACH)];
    let to = [(ends[2] + REACH).min(a.width()), (ends[3] + REACH).min(a.height())];
    (count, [from[0], from[1], to[0] - from[0], to[1] - from[1]])
}

/// FLIP summed over pixels.
fn flip_sum(a: &RgbaImage, b: &RgbaImage) -> Result<f64> {
    let (count, [x, y, width, height]) = changed(a, b);
    if count == 0 {
        return Ok(0.0);
    }
    let part = |picture: &RgbaImage| {
        DynamicImage::from(picture.view(x, y, width, height).to_image()).to_rgb8()
    };
    let map = flip(&part(a), &part(b), PIXELS_PER_DEGREE).ok_or("sizes differ")?;
    Ok(map.values.iter().map(|&value| f64::from(value)).sum())
}
