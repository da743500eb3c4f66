//! Verifying a built scene: that it is whole, that its leaves are the source, how far each level is
//! from it, that nothing shows between levels, and what levels look like.
//!
//! | file | what it checks |
//! |---|---|
//! | `second_reader` | the importer against a second reader |
//! | `structure` | the tree, every file, every attribute |
//! | `faithful`, `coverage` | leaves against the source: triangles, vertices, surface |
//! | `joints` | leaves meet edge to edge |
//! | `appearance`, `color_regions` | leaves' texels; colours and tiles of every level |
//! | `distance` | each level against the source |
//! | `node_errors`, `errors` | each node against the leaves below it; stored against measured errors |
//! | `seams`, `cut_planes`, `border`, `gaps` | what shows where two levels meet |
//!
//! Without a source the leaves stand for it, and what needs it is not checked. Triangles of all
//! nodes are kept in memory (some 30 bytes each), and the source with its search tree (some 100
//! bytes a triangle); images are decoded node by node.

mod appearance;
mod assembly;
mod border;
mod cells;
mod color_regions;
mod coverage;
mod cut_outs;
mod cut_planes;
mod distance;
mod distance_stats;
mod errors;
mod faithful;
mod front;
mod gaps;
mod geometry;
mod joints;
mod jpeg;
mod lines;
mod node_errors;
mod node_textures;
mod options;
mod other_sources;
mod outlines;
mod points;
mod progress;
mod report;
mod sample;
mod seams;
mod second_reader;
mod source;
mod source_colors;
mod step;
mod structure;
mod surface_appearance;
mod text;
mod tiles;
mod tree;

use std::path::{Path, PathBuf};

use glam::DVec3;

pub use options::{Limits, VerifyOptions};
pub use progress::{Progress, Silent};
pub use report::{
    Check, Distance, ErrorFigures, Failure, GapFigures, LeafFigures, LevelFigures, NodeFigures,
    SceneFacts, TileFigures, VerifyReport,
};
pub use text::text;

use appearance::{LevelAppearance, Reference};
use assembly::Assembly;
use distance::{FrontDistances, NodeDistances};
use front::Front;
use geometry::NodeGeometry;
use node_textures::NodeTextures;
use outlines::Outlines;
use points::Points;
use source::Source;

use self::cut_outs::CutOuts;
use crate::format::{SCENE_FILE, Scene};
use crate::lattice::Quantization;
use crate::mesh::OutlineCoverage;
use crate::place::placement_of;
use crate::tileset::FirstView;
use crate::{Error, Result};

/// Verifies the scene in `out` against the models that it was built from; without any, against
/// its own leaves. An error where there is nothing to verify; what does not hold is in the report.
pub fn verify(
    out: &Path,
    sources: &[PathBuf],
    options: &VerifyOptions,
    progress: &dyn Progress,
) -> Result<VerifyReport> {
    options.check()?;
    let mut report = VerifyReport {
        version: env!("CARGO_PKG_VERSION").into(),
        out: out.to_string_lossy().into_owned(),
        source: Vec::new(),
        other_sources: Vec::new(),
        options: options.clone(),
        passed: false,
        scene: None,
        first_view: None,
        checks: Vec::new(),
        leaves: None,
        levels: Vec::new(),
        front: None,
        errors: Vec::new(),
        worst_nodes: Vec::new(),
        gaps: Vec::new(),
        cells: Vec::new(),
    };
    let path = out.join(SCENE_FILE);
    let bytes = crate::format::read_regular(&path)
        .map_err(|error| Error::input(&path, format!("cannot read the scene: {error}")))?;
    match Scene::from_bytes(&bytes, &path) {
        Ok(scene) => {
            Verification { out, scene: &scene, options, progress }.run(sources, &mut report)?
        }
        Err(error) => {
            let mut check = Check::new("structure");
            check.fail(SCENE_FILE, error.to_string(), "build the scene again with --force");
            report.checks.push(check);
        }
    }
    report.passed = report.checks.iter().all(|check| check.passed);
    Ok(report)
}

struct Verification<'a> {
    out: &'a Path,
    scene: &'a Scene,
    options: &'a VerifyOptions,
    progress: &'a dyn Progress,
}

impl Verification<'_> {
    fn run(&self, sources: &[PathBuf], report: &mut VerifyReport) -> Result<()> {
        let Self { out, scene, options, progress } = *self;
        let source = match sources {
            [] => None,
            sources => {
                let placement = placement_of(&scene.parameters)?;
                let mut source = Source::load(sources, &placement, scene.up, progress)?;
                if let Some(lattice) = Quantization::of(&scene.parameters) {
                    source.round(lattice);
                }
                Some(source)
            }
        };
        report.source = source.as_ref().map(Source::names).unwrap_or_default();
        report.other_sources = other_sources::other_sources(out, sources)?;
        let (mut geometry, check) = structure::structure(out, scene, &options.limits, progress);
        report.checks.push(check);
        if let Some(source) = &source {
            report.checks.push(second_reader::check(&source.second_readings));
        }
        if let Some((check, seen)) = cells::cells(out, scene, options, progress) {
            report.checks.push(check);
            report.cells = seen;
        }
        if geometry.iter().any(|node| node.triangles.is_empty()) {
            // What is missing would fail every other check too, and hide its own faults.
            return Ok(());
        }
        let leaves = tree::leaves(scene);
        let steps = step::steps(scene);
        report.scene = Some(facts(scene, &leaves, &geometry, &steps));
        report.first_view = Some(FirstView::of(out));
        let rims = seams::Rims::new(&leaves, &geometry);
        let seams = rims.seams();
        let between = rims.between_vertices();
        cut_planes::mark(scene, &mut geometry, [&seams, &between], &steps);
        let points = Points::new(&leaves, &geometry, options.samples(leaves.len()), options.seed);
        let images = NodeTextures::new(out, scene);

        progress.phase("images of the leaves", leaves.len() as u64);
        let shown = appearance::leaf_colors(&leaves, &points, &images, || progress.done(1));
        let reference = match &source {
            Some(source) => self
                .against_source(source, &leaves, &geometry, &rims, &points, &steps, &shown, report),
            None => Reference { color: shown.clone(), tile: Vec::new() },
        };
        self.levels(
            source.as_ref(),
            &leaves,
            &geometry,
            &points,
            &images,
            &steps,
            &shown,
            &reference,
            report,
        );
        drop(source);
        let open = rims.open();
        let (figures, check) = gaps::gaps(
            scene,
            &geometry,
            &seams,
            &open,
            &step::fine_steps(scene),
            &options.limits,
            progress,
        );
        report.gaps = figures;
        report.checks.push(check);
        Ok(())
    }

    /// Checks the leaves, and finds what the source shows at all points.
    fn against_source(
        &self,
        source: &Source,
        leaves: &[u32],
        geometry: &[NodeGeometry],
        rims: &seams::Rims,
        points: &Points,
        steps: &[f64],
        shown: &[Option<surface_appearance::Color>],
        report: &mut VerifyReport,
    ) -> Reference {
        let Self { scene, options, progress, .. } = *self;
        let limits = &options.limits;
        let (mut figures, check) =
            faithful::faithful(scene, source, leaves, geometry, points, steps, progress);
        report.checks.push(check);
        report.checks.push(joints::joints(scene, source, rims, steps));
        progress.phase("images of the source", 1);
        let quality = scene.parameters["jpeg_quality"].as_u64().unwrap_or(85).clamp(1, 100) as u8;
        figures.jpeg_rms = jpeg::jpeg_rms(source, quality);
        // Two roundings of half a step along three axes.
        let reach = leaves.iter().map(|&leaf| steps[leaf as usize]).fold(0.0, f64::max) * 2.0;
        let colors = source_colors::source_colors(source, points, geometry, shown, reach);
        let check = appearance::texels(scene, leaves, points, shown, &colors, &mut figures, limits);
        report.checks.push(check);
        let tiles = tiles::Tiles::find(source);
        let tile = tiles.map_or(Vec::new(), |tiles| {
            colors.iter().map(|shown| shown.and_then(|shown| tiles.at(&shown.appearance))).collect()
        });
        let color = colors.into_iter().map(|shown| Some(shown?.color)).collect();
        let reference = Reference { color, tile };
        if !reference.tile.is_empty() {
            let (tiles, check) =
                appearance::leaf_tiles(scene, leaves, points, shown, &reference, limits);
            report.checks.push(check);
            figures.tiles = Some(tiles);
        }
        report.leaves = Some(figures);
        progress.done(1);
        reference
    }

    /// Measures all levels.
    fn levels(
        &self,
        source: Option<&Source>,
        leaves: &[u32],
        geometry: &[NodeGeometry],
        points: &Points,
        images: &NodeTextures,
        steps: &[f64],
        shown: &[Option<surface_appearance::Color>],
        reference: &Reference,
        report: &mut VerifyReport,
    ) {
        let Self { scene, options, progress, .. } = *self;
        let joined;
        let surface = match source {
            Some(source) => &source.surface,
            None => {
                joined = Assembly::new(leaves.iter().copied(), geometry);
                &joined.surface
            }
        };
        let diagonal = report.scene.as_ref().map_or(0.0, |facts| facts.diagonal);
        let mut all: Vec<NodeDistances> = Vec::new();
        let outlines = Outlines::of(scene.up, leaves, geometry);
        let cut_outs = CutOuts::of(geometry, images, options.seed);
        let kept = |front: &Front| {
            let nodes: Vec<u32> = front.nodes().collect();
            outlines
                .as_ref()
                .map_or_else(OutlineCoverage::default, |outlines| outlines.kept_by(&nodes))
        };
        let measure = |front: &Front, level: Option<u32>| {
            let seed = options.seed;
            let distances =
                distance::measure(scene, front, leaves, geometry, points, surface, seed, progress);
            let LevelAppearance { color_rms, color_share, regions, tiles } = appearance::level(
                scene,
                &distances,
                points,
                geometry,
                images,
                shown,
                reference,
                || {},
            );
            let figures = self.level_figures(front, level, geometry, &distances, diagonal);
            let kept = kept(front);
            let other_color_share = regions.wrong_share();
            let cut_outs_kept = cut_outs.share(front.nodes(), leaves.iter().copied());
            let figures = LevelFigures {
                kept,
                color_rms,
                color_share,
                other_color_share,
                cut_outs_kept,
                tiles,
                ..figures
            };
            (figures, distances.nodes, regions)
        };
        let mut regions = Vec::new();
        for level in 0..tree::coarse_levels(scene) {
            progress.phase(&format!("level {level}"), leaves.len() as u64);
            let (figures, nodes, of_level) = measure(&Front::level(scene, level), Some(level));
            report.levels.push(figures);
            all.extend(nodes);
            regions.push((level, of_level));
        }
        report.checks.push(appearance::level_colors(scene, &regions, &options.limits));
        if let Some(share) = options.front {
            let triangles = report.scene.as_ref().map_or(0, |facts| facts.leaf_triangles);
            let front = Front::of_size(scene, (triangles as f64 * share) as u64);
            progress.phase("a front of mixed levels", leaves.len() as u64);
            report.front = Some(measure(&front, None).0);
        }
        progress.phase("errors of the nodes", all.len() as u64);
        let errors = node_errors::node_errors(scene, leaves, geometry, progress);
        let (figures, check) =
            errors::errors(scene, &errors, steps, &options.limits, report.other_sources.is_empty());
        report.errors = figures;
        report.checks.push(check);
        // Both hold every coarse node once.
        all.sort_by_key(|measured| measured.node);
        let mut worst: Vec<_> = all.iter().zip(&errors).collect();
        worst.sort_by(|a, b| b.1.max().total_cmp(&a.1.max()).then(a.1.node.cmp(&b.1.node)));
        let worst = worst.into_iter().take(options.worst);
        report.worst_nodes =
            worst.map(|(node, error)| node_figures(scene, node, error, diagonal)).collect();
    }

    fn level_figures(
        &self,
        front: &Front,
        level: Option<u32>,
        geometry: &[NodeGeometry],
        distances: &FrontDistances,
        diagonal: f64,
    ) -> LevelFigures {
        let to_front = distance::figures(&distances.to_front, diagonal);
        let to_source = distance::figures(&distances.to_source, diagonal);
        let deepest = || front.nodes().map(|node| self.scene.nodes[node as usize].level).max();
        let mut figures = LevelFigures {
            level: level.or_else(deepest).unwrap_or(0),
            two_sided: distance::larger(&to_front, &to_source),
            to_front,
            to_source,
            ..LevelFigures::default()
        };
        for node in front.nodes() {
            let geometry = &geometry[node as usize];
            let is_leaf = tree::is_leaf(self.scene, node);
            let above =
                is_leaf && level.is_some_and(|level| self.scene.nodes[node as usize].level < level);
            figures.leaves += u64::from(is_leaf);
            figures.leaves_above += u64::from(above);
            figures.nodes += u64::from(!above);
            figures.triangles += geometry.triangles.len() as u64;
            figures.cut_plane_triangles +=
                geometry.in_cut_plane.iter().filter(|&&inside| inside).count() as u64;
        }
        figures
    }
}

fn facts(scene: &Scene, leaves: &[u32], geometry: &[NodeGeometry], steps: &[f64]) -> SceneFacts {
    // Leaves' boxes: coarse nodes may reach beyond the source.
    let boxes = leaves.iter().map(|&leaf| &scene.nodes[leaf as usize]);
    let low = boxes.clone().fold(DVec3::INFINITY, |low, node| low.min(node.bbox_min.into()));
    let high = boxes.fold(DVec3::NEG_INFINITY, |high, node| high.max(node.bbox_max.into()));
    SceneFacts {
        nodes: scene.nodes.len(),
        leaves: leaves.len(),
        levels: scene.level_count(),
        leaf_triangles: leaves.iter().map(|&l| geometry[l as usize].triangles.len() as u64).sum(),
        diagonal: if low.x <= high.x { low.distance(high) } else { 0.0 },
        step: steps.iter().copied().fold(0.0, f64::max),
    }
}

fn node_figures(
    scene: &Scene,
    measured: &NodeDistances,
    error: &node_errors::NodeError,
    diagonal: f64,
) -> NodeFigures {
    let node = &scene.nodes[measured.node as usize];
    let (_, farthest) =
        if error.to_node.0 >= error.to_original.0 { error.to_node } else { error.to_original };
    NodeFigures {
        id: node.id,
        file: node.file.clone(),
        level: node.level,
        geometric_error: node.geometric_error,
        measured: error.max(),
        to_front: distance::figures(&measured.to_front, diagonal),
        to_source: distance::figures(&measured.to_source, diagonal),
        farthest: farthest.into(),
    }
}
