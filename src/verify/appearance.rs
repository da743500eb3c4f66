//! How levels look beside the source: colours at the same points.

use rayon::prelude::*;

use super::color_regions::{ColorRegions, ComparedPoint};
use super::distance::{FrontDistances, ShownAt};
use super::geometry::NodeGeometry;
use super::node_textures::{NodePoint, NodeTextures};
use super::options::Limits;
use super::points::Points;
use super::report::{Check, LeafFigures, TileFigures};
use super::source_colors::Shown;
use super::surface_appearance::{Color, squared_difference};
use super::tiles::{Tile, count};
use super::tree::is_leaf;
use crate::format::Scene;

/// Fewer samples of a leaf than this say nothing of it: JPEG spoils a few texels together, which several
/// samples may meet, and at an edge of the picture a sample may be all off.
const FEWEST: u64 = 40;

/// What the source shows at each point.
pub(super) struct Reference {
    /// Its colour; `None` where there is none to compare.
    pub color: Vec<Option<Color>>,
    /// Its tile; empty where the source has none.
    pub tile: Vec<Option<Tile>>,
}

/// Colours of the leaves at all points.
pub(super) fn leaf_colors(
    leaves: &[u32],
    points: &Points,
    images: &NodeTextures,
    done: impl Fn() + Sync,
) -> Vec<Option<Color>> {
    let colors: Vec<Vec<Option<Color>>> = leaves
        .par_iter()
        .enumerate()
        .map(|(index, &leaf)| {
            let at: Vec<NodePoint> = points.all[points.of_leaf(index)]
                .iter()
                .map(|point| (point.triangle, point.weights))
                .collect();
            let colors = if at.is_empty() { Vec::new() } else { images.colors(leaf, &at) };
            done();
            colors
        })
        .collect();
    colors.into_iter().flatten().collect()
}

/// Check: the texels of the leaves are the source's, within JPEG's error.
pub(super) fn texels(
    scene: &Scene,
    leaves: &[u32],
    points: &Points,
    shown: &[Option<Color>],
    reference: &[Option<Shown>],
    figures: &mut LeafFigures,
    limits: &Limits,
) -> Check {
    let mut check = Check::new("texels of the leaves");
    let jpeg = figures.jpeg_rms.unwrap_or(0.0);
    let (mut sum, mut compared) = (0.0, 0);
    for (index, &leaf) in leaves.iter().enumerate() {
        let (mut squares, mut count) = (0.0, 0);
        for number in points.of_leaf(index) {
            if let (Some(color), Some(source)) = (shown[number], reference[number]) {
                squares += squared_difference(color, source.color);
                count += 1;
            }
        }
        let rms = if count > 0 { (squares / count as f64).sqrt() } else { 0.0 };
        let limit = limits.leaf_texel_ratio * jpeg + limits.leaf_texel_slack;
        if count >= FEWEST && rms > limit {
            check.fail(
                &scene.nodes[leaf as usize].file,
                format!(
                    "colours are off by {rms:.1} of 255 (RMS of {count} samples), limit {limit:.1}"
                ),
                HINT,
            );
        }
        sum += squares;
        compared += count;
    }
    figures.color_samples = compared;
    figures.color_rms = if compared > 0 { (sum / compared as f64).sqrt() } else { 0.0 };
    let limit = limits.texel_ratio * jpeg + limits.texel_slack;
    if figures.color_rms > limit {
        let what =
            format!("colours are off by {:.2} of 255 (RMS), limit {limit:.2}", figures.color_rms);
        check.fail("all leaves", what, HINT);
    }
    check.summary = format!(
        "colours off by {:.2} of 255 (RMS of {compared} samples); JPEG alone: {}",
        figures.color_rms,
        figures.jpeg_rms.map_or("no images".into(), |rms| format!("{rms:.2}")),
    );
    check
}

const HINT: &str = "build again with --force; a higher --jpeg-quality lowers JPEG's own part";

/// The colour difference of a level and its tiles. Points in leaves above the level count with the
/// leaves' own difference.
pub(super) fn level(
    scene: &Scene,
    distances: &FrontDistances,
    points: &Points,
    geometry: &[NodeGeometry],
    images: &NodeTextures,
    leaf_shown: &[Option<Color>],
    reference: &Reference,
    done: impl Fn() + Sync,
) -> LevelAppearance {
    // By node, so that each file is read once; points stay in order within.
    let mut below = vec![false; points.all.len()];
    distances.shown.iter().for_each(|&(number, _)| below[number as usize] = true);
    let shown = distances.shown.iter().filter_map(|&(number, shown)| Some((number, shown?)));
    let mut shown: Vec<(u32, ShownAt)> = shown.collect();
    shown.sort_by_key(|&(number, shown)| (shown.node, number));
    let groups: Vec<_> = shown.chunk_by(|a, b| a.1.node == b.1.node).collect();
    let colors: Vec<(Vec<Option<Color>>, f64)> = groups
        .par_iter()
        .map(|group| {
            let node = group[0].1.node;
            let at: Vec<NodePoint> = group.iter().map(|(_, shown)| shown.at).collect();
            let colors = images.colors(node, &at);
            done();
            (colors, texel_scale(scene, geometry, node))
        })
        .collect();
    let mut all = (0.0, 0, TileFigures::default());
    let mut compared = Vec::with_capacity(points.all.len());
    let mut compare = |number: u32, node: u32, color: Option<Color>, scale: f64| {
        add(&mut all, number as usize, color, scale, reference);
        if let (Some(shown), Some(source)) = (color, reference.color[number as usize]) {
            compared.push(ComparedPoint { number, node, shown, source });
        }
    };
    for (group, (colors, scale)) in groups.iter().zip(colors) {
        for (&(number, ShownAt { node, .. }), color) in group.iter().zip(colors) {
            compare(number, node, color, scale);
        }
    }
    for (number, _) in (0..).zip(&below).filter(|(_, below)| !**below) {
        compare(number, points.leaf[number as usize], leaf_shown[number as usize], 1.0);
    }
    let colored = reference.color.iter().filter(|color| color.is_some()).count();
    LevelAppearance {
        color_rms: (all.1 > 0).then(|| (all.0 / all.1 as f64).sqrt()),
        color_share: (colored > 0).then(|| all.1 as f64 / colored as f64),
        regions: ColorRegions::new(scene, points, &compared),
        tiles: (!reference.tile.is_empty()).then_some(all.2),
    }
}

/// How a level looks beside the source.
pub(super) struct LevelAppearance {
    /// RMS colour difference.
    pub color_rms: Option<f64>,
    /// The share of the source's coloured points that it is of: those for which something stands.
    pub color_share: Option<f64>,
    /// Regions where its mean colour is another.
    pub regions: ColorRegions,
    /// Tiles of generated cities.
    pub tiles: Option<TileFigures>,
}

/// Check: the leaves show the tiles that the source shows there.
pub(super) fn leaf_tiles(
    scene: &Scene,
    leaves: &[u32],
    points: &Points,
    shown: &[Option<Color>],
    reference: &Reference,
    limits: &Limits,
) -> (TileFigures, Check) {
    let mut check = Check::new("tiles of the leaves");
    let mut all = TileFigures::default();
    let mut demand = |place: &str, tiles: &TileFigures, limit: f64| {
        let share = tiles.wrong_share().unwrap_or(0.0);
        if share > limit {
            let what = format!(
                "{} of {} samples show another tile ({:.2} %), limit {:.2} %",
                tiles.wrong,
                tiles.clear,
                share * 100.0,
                limit * 100.0
            );
            check.fail(place, what, "texels are misplaced: report this");
        }
    };
    for (index, &leaf) in leaves.iter().enumerate() {
        let mut found = (0.0, 0, TileFigures::default());
        for number in points.of_leaf(index) {
            add(&mut found, number, shown[number], 1.0, reference);
        }
        let (_, _, tiles) = found;
        all.extend(&tiles);
        if tiles.clear >= FEWEST {
            demand(&scene.nodes[leaf as usize].file, &tiles, limits.leaf_wrong_tiles);
        }
    }
    demand("all leaves", &all, limits.wrong_tiles);
    check.summary = format!(
        "{} of {} samples that are clear of edges show another tile, {} none",
        all.wrong, all.clear, all.unreadable
    );
    (all, check)
}

fn add(
    (squares, compared, tiles): &mut (f64, u64, TileFigures),
    number: usize,
    color: Option<Color>,
    scale: f64,
    reference: &Reference,
) {
    let (Some(color), Some(source)) = (color, reference.color[number]) else { return };
    *squares += squared_difference(color, source);
    *compared += 1;
    if let Some(tile) = reference.tile.get(number).copied().flatten() {
        count(tiles, &tile, color, scale);
    }
}

/// The width of a node's texels in texels of the leaves below it, from what both have.
fn texel_scale(scene: &Scene, geometry: &[NodeGeometry], node: u32) -> f64 {
    if is_leaf(scene, node) {
        return 1.0;
    }
    let own = scene.nodes[node as usize].texels;
    let (mut below, mut open) = (0, vec![node]);
    while let Some(next) = open.pop() {
        if is_leaf(scene, next) && !geometry[next as usize].triangles.is_empty() {
            below += scene.nodes[next as usize].texels;
        }
        open.extend(scene.children(next));
    }
    if own > 0 { (below as f64 / own as f64).sqrt().max(1.0) } else { 1.0 }
}

/// Check: the levels have the source's colours, but for regions that are a small share of the surface.
pub(super) fn level_colors(
    scene: &Scene,
    levels: &[(u32, ColorRegions)],
    limits: &Limits,
) -> Check {
    let mut check = Check::new("colours of the levels");
    let hint = "look at this level: it shows another material than the source";
    for (level, regions) in levels {
        let (Some(share), Some((node, count, at))) = (regions.wrong_share(), regions.worst) else {
            continue;
        };
        let what = format!(
            "{:.1} % of the surface has another colour than the source, by more than 64 of 255 over \
             the node's error squared, limit {:.0} %; {:.0} % of that in {}, as at {:.2} {:.2} {:.2}",
            share * 100.0,
            limits.other_color * 100.0,
            100.0 * count as f64 / regions.wrong as f64,
            scene.nodes[node as usize].file,
            at.x,
            at.y,
            at.z
        );
        if share > limits.other_color {
            check.fail(format!("level {level}"), what, hint);
        } else if share > limits.other_color_warning {
            check.warn(format!("level {level}"), what, hint);
        }
    }
    let shares = levels.iter().map(|(_, regions)| match regions.wrong_share() {
        Some(share) => format!("{:.1} %", share * 100.0),
        None => "-".into(),
    });
    let shares: Vec<String> = shares.collect();
    check.summary = match &shares[..] {
        [] => "all nodes are leaves".into(),
        shares => format!("of another colour than the source, by level: {}", shares.join(", ")),
    };
    check
}
