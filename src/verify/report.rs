//! What a verification found, for people and programs.

use serde::Serialize;

use super::options::VerifyOptions;
use crate::cells::SeenFaces;
use crate::format::NodeId;
use crate::mesh::OutlineCoverage;
use crate::tileset::FirstView;
use crate::{Error, Result};

/// Failures of one check that are listed; the others are counted.
pub const MOST_LISTED: usize = 8;

/// Everything that a verification found. Equal scenes, sources and options give equal reports at
/// any number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyReport {
    /// Version of the program that verified it.
    pub version: String,
    /// The folder.
    pub out: String,
    /// The model files that it was compared with; empty where leaves stand for the source.
    pub source: Vec<String>,
    /// Those of them whose contents are not what `build.json` says that the scene was built from.
    pub other_sources: Vec<String>,
    /// How it was verified.
    pub options: VerifyOptions,
    /// True where every check passed.
    pub passed: bool,
    /// Facts of the scene; `None` where it could not be read.
    pub scene: Option<SceneFacts>,
    /// The requests, bytes and draw calls of the first picture of the whole; `None` if the scene could not be read.
    pub first_view: Option<FirstView>,
    /// All checks, in the order in which they were made.
    pub checks: Vec<Check>,
    /// Leaves against the source; `None` without a source.
    pub leaves: Option<LeafFigures>,
    /// Distance and appearance, one entry a level that has nodes other than leaves.
    pub levels: Vec<LevelFigures>,
    /// The front of mixed levels that was asked for; its `level` is that of its deepest node.
    pub front: Option<LevelFigures>,
    /// Stored against measured errors, by level; none where all nodes are leaves.
    pub errors: Vec<ErrorFigures>,
    /// The nodes that are farthest from the source, worst first.
    pub worst_nodes: Vec<NodeFigures>,
    /// Widest gaps, for every pair of levels that meet somewhere; `a` ≤ `b`.
    pub gaps: Vec<GapFigures>,
    /// Faces from corners that no picture was taken from, by cell; none where none was drawn.
    pub cells: Vec<SeenFaces>,
}

impl VerifyReport {
    /// One JSON object, with a line's end.
    pub fn to_json(&self) -> Result<String> {
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|error| Error::Internal(format!("report as JSON: {error}")))
    }
}

/// Facts of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneFacts {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of leaves.
    pub leaves: usize,
    /// Number of levels.
    pub levels: usize,
    /// Triangles of all leaves.
    pub leaf_triangles: u64,
    /// Diagonal of the bounding box, metres.
    pub diagonal: f64,
    /// Step of the lattice that coordinates lie on, metres, the largest where there are several:
    /// source coordinates are rounded by half of it at most.
    pub step: f64,
}

/// One check.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Check {
    /// Its name.
    pub name: &'static str,
    /// True where nothing failed.
    pub passed: bool,
    /// What was looked at, in a sentence.
    pub summary: String,
    /// The first failures.
    pub failures: Vec<Failure>,
    /// All failures.
    pub failure_count: u64,
    /// Findings that are doubtful and do not fail.
    pub warnings: Vec<Failure>,
}

impl Check {
    /// A check that has found nothing yet.
    pub fn new(name: &'static str) -> Self {
        Self { name, passed: true, ..Self::default() }
    }

    /// Notes a failure.
    pub fn fail(&mut self, place: impl Into<String>, what: impl Into<String>, hint: &'static str) {
        self.passed = false;
        self.failure_count += 1;
        if self.failures.len() < MOST_LISTED {
            self.failures.push(Failure { place: place.into(), what: what.into(), hint });
        }
    }

    /// Notes what does not fail, but should be looked at.
    pub fn warn(&mut self, place: impl Into<String>, what: impl Into<String>, hint: &'static str) {
        if self.warnings.len() < MOST_LISTED {
            self.warnings.push(Failure { place: place.into(), what: what.into(), hint });
        }
    }

    /// Takes over failures in order.
    pub fn extend(&mut self, failures: impl IntoIterator<Item = Failure>) {
        for Failure { place, what, hint } in failures {
            self.fail(place, what, hint);
        }
    }
}

/// Something that does not hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// Where: a node's file, a level, or the whole.
    pub place: String,
    /// What was expected and found.
    pub what: String,
    /// What to try.
    pub hint: &'static str,
}

/// Leaves against the source.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LeafFigures {
    /// Area of the source, square metres.
    pub source_area: f64,
    /// The same with all vertices rounded to the lattice of a quantised scene; `None` for others.
    pub rounded_area: Option<f64>,
    /// Area of all leaves, square metres.
    pub leaf_area: f64,
    /// `|leaf_area / source_area - 1|`, for a quantised scene against `rounded_area`.
    pub area_difference: f64,
    /// Source triangles, or groups of coincident ones, whose area the leaves do not have once, and
    /// triangles of leaves that lie on no source triangle.
    pub wrong_triangles: u64,
    /// Source triangles so small that rounding may take all of their area: the loss of one is not seen
    /// by its area.
    pub unseen_triangles: u64,
    /// The area of these, square metres.
    pub unseen_area: f64,
    /// Vertices of the source.
    pub source_vertices: u64,
    /// Of these, vertices of nothing but triangles about as thin as the lattice's step, which are
    /// not sought: the build leaves such triangles out, and says so.
    pub thin_vertices: u64,
    /// Of the others, those that no leaf has within `vertex_bound`.
    pub missing_vertices: u64,
    /// Farthest that a source vertex may be from a leaf's, metres: half a step along each axis.
    pub vertex_bound: f64,
    /// Farthest that a point of a leaf is from the source, metres.
    pub farthest: f64,
    /// Samples whose colours were compared.
    pub color_samples: u64,
    /// RMS difference of their colours, 0–255.
    pub color_rms: f64,
    /// The same for the source's images encoded and decoded again as the build does it; `None`
    /// without images.
    pub jpeg_rms: Option<f64>,
    /// Tiles of generated cities; `None` elsewhere.
    pub tiles: Option<TileFigures>,
}

/// Distance and appearance of a front: all nodes of a level and the leaves above it, or another.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LevelFigures {
    /// Steps from the root.
    pub level: u32,
    /// Nodes of the level; of a front of mixed levels all of its nodes.
    pub nodes: u64,
    /// Leaves above the level, which are in its front, too.
    pub leaves_above: u64,
    /// All leaves of the front.
    pub leaves: u64,
    /// Triangles of the front.
    pub triangles: u64,
    /// Of these, triangles in cutting planes (skirts), which the distances leave out.
    pub cut_plane_triangles: u64,
    /// From the source to the front.
    pub to_front: Distance,
    /// From the front to the source.
    pub to_source: Distance,
    /// The larger of both.
    pub two_sided: Distance,
    /// What it keeps of the outline of the leaves, by 4,096 cells.
    pub kept: OutlineCoverage,
    /// RMS colour difference, sRGB 0–255, between points of the source and what stands for them: the
    /// nearest surface within 60 degrees of facing the same way. `None` where nothing could be
    /// compared.
    pub color_rms: Option<f64>,
    /// The share of the source's points with a colour for which something stands, 0–1; floors of
    /// houses whose floors are gone have nothing.
    pub color_share: Option<f64>,
    /// The share of the compared surface whose mean colour differs from the source's by more than 64 of
    /// 255 in some channel, 0–1: the mean over regions as large as the node's error, or larger where
    /// samples are few. `None` where nothing could be compared.
    pub other_color_share: Option<f64>,
    /// The visible area of surfaces with cut-outs, as leaves of trees, over that of the leaves of the tree of nodes;
    /// `None` where these have none.
    pub cut_outs_kept: Option<f64>,
    /// Tiles of generated cities; `None` elsewhere.
    pub tiles: Option<TileFigures>,
}

/// How many samples show the right tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TileFigures {
    /// Samples on tiles.
    pub samples: u64,
    /// Of these, samples far enough from their tile's edge to tell it at this level.
    pub clear: u64,
    /// Of these, samples that show another tile.
    pub wrong: u64,
    /// Of the clear ones, samples whose colour is no tile's.
    pub unreadable: u64,
}

/// A distance in metres and in units of 1e-4 of the diagonal of the source's bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distance {
    /// Samples drawn by area.
    pub samples: u64,
    /// Mean, metres.
    pub mean: f64,
    /// Root mean square, metres.
    pub rms: f64,
    /// Maximum, metres; of samples and vertices.
    pub max: f64,
    /// Mean, 1e-4 of the diagonal.
    pub mean_relative: f64,
    /// Root mean square, 1e-4 of the diagonal.
    pub rms_relative: f64,
    /// Maximum, 1e-4 of the diagonal.
    pub max_relative: f64,
}

/// Stored against measured errors of the nodes of a level that are no leaves.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ErrorFigures {
    /// 0 is the roots'.
    pub level: u32,
    /// Nodes that were compared.
    pub nodes: u64,
    /// Nodes whose stored error is below the measured one.
    pub too_small: u64,
    /// Least of stored over measured.
    pub least_ratio: f64,
    /// Median of stored over measured.
    pub median_ratio: f64,
    /// 95 of 100 nodes have at most this.
    pub high_ratio: f64,
}

/// One node.
#[derive(Clone, Debug, Serialize)]
pub struct NodeFigures {
    /// Its id.
    pub id: NodeId,
    /// Its file.
    pub file: String,
    /// Its level.
    pub level: u32,
    /// Stored error, metres.
    pub geometric_error: f64,
    /// Measured error, metres: the larger maximum of both directions.
    pub measured: f64,
    /// From the source below it to the front of its level.
    pub to_front: Distance,
    /// From it to the source.
    pub to_source: Distance,
    /// Where the largest distance is, in source coordinates.
    pub farthest: [f64; 3],
}

/// Widest gaps between nodes of two levels that meet at a cut.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct GapFigures {
    /// Level on one side.
    pub a: u32,
    /// Level on the other.
    pub b: u32,
    /// Points of the cut that were compared.
    pub points: u64,
    /// Points beside these where the source ends within the node's error and the node leaves out
    /// what lies before; not counted in what follows.
    pub left_out: u64,
    /// Widest gap that the surfaces leave, cutting planes left out, metres.
    pub bare: f64,
    /// The same over the larger of both nodes' errors.
    pub bare_relative: f64,
    /// Widest gap that stays open, metres.
    pub open: f64,
    /// The same over the larger of both nodes' errors.
    pub open_relative: f64,
}
