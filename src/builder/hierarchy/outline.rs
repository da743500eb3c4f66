//! What a coarse node keeps of the outline of its source, and what becomes of one that keeps too
//! little.

use crate::builder::constants::OutlineConstants;
use crate::builder::error::SearchableSurface;
use crate::mesh::{Mesh, Outline, OutlineCoverage, OutlineFrame, UpAxis};

/// The next attempt has so many triangles that this share of the loss that is allowed is expected: the
/// guess is rough, and an attempt costs more than a few triangles.
const EXPECTED: f64 = 5.0 / 6.0;

/// No attempt has more than this many times the triangles of the one before: a guess is worth little so
/// far off.
const MOST_MORE: f64 = 2.0;

/// A coarse node that is not written, since it would keep too little of the outline of its source:
/// the nodes below it stand in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct SkippedNode {
    /// Child numbers from the root of its block down.
    pub child_path: Vec<u32>,
    /// The triangles that it would have had.
    pub triangles: u64,
    /// What it would have kept with these.
    pub kept: OutlineCoverage,
}

/// How many times the triangles a node needs that keeps too small a share of the outline, by a law
/// that holds roughly for houses.
pub(super) fn more_triangles(kept: f64, constants: &OutlineConstants) -> f64 {
    let expected = EXPECTED * (1.0 - constants.least_kept).max(f64::MIN_POSITIVE);
    // libm's, which is alike on all machines.
    libm::pow((1.0 - kept) / expected, constants.exponent).min(MOST_MORE)
}

/// The outline of what a node stands for.
pub(super) struct SourceOutline {
    frame: OutlineFrame,
    outline: Outline,
}

impl SourceOutline {
    /// `None` where there is none, or nobody asks for it.
    pub fn of(
        original: &SearchableSurface,
        up: UpAxis,
        constants: &OutlineConstants,
    ) -> Option<Self> {
        if constants.least_kept <= 0.0 {
            return None;
        }
        let corners = || original.triangles().map(|corners| corners.map(|p| p.as_dvec3()));
        let frame = OutlineFrame::around(up, corners().flatten(), constants.cells)?;
        let outline = frame.empty();
        corners().for_each(|corners| frame.add(&outline, corners));
        Some(Self { frame, outline })
    }

    /// What a simplified mesh keeps of it.
    pub fn kept_by(&self, mesh: &Mesh) -> OutlineCoverage {
        let outline = self.frame.empty();
        mesh.triangles.iter().for_each(|&t| self.frame.add(&outline, mesh.corners(t)));
        self.outline.kept_by(&outline)
    }
}
