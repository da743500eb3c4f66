//! What a verification can be asked for, and where its limits lie.

use crate::{Error, Result};

/// Points unless others are asked for: at least, and for each leaf, so that something can be said of most
/// leaves of however large a scene.
const LEAST_SAMPLES: u64 = 300_000;
const SAMPLES_PER_LEAF: u64 = 60;

/// How a scene is verified.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VerifyOptions {
    /// Points spread over the source by area, from 1,000 on; as many again over each level. Vertices
    /// are measured besides. More: rarer faults are found, and it takes longer. `None`: 300,000, or 60 for
    /// each leaf where that is more.
    pub samples: Option<u64>,
    /// Draws the points; equal seeds draw equal points.
    pub seed: u64,
    /// Nodes that are listed as the worst.
    pub worst: usize,
    /// Where given, a front of mixed levels is measured as well, cut where the stored errors say, of
    /// at most this share of the leaves' triangles; over 0, at most 1.
    pub front: Option<f64>,
    /// Cells of which faces are drawn, at most, spread evenly over all; 0 draws none, and needs no graphics
    /// adapter.
    pub cells: usize,
    /// See [`Limits`].
    pub limits: Limits,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self { samples: None, seed: 1, worst: 5, front: None, cells: 8, limits: Limits::default() }
    }
}

impl VerifyOptions {
    /// Refuses what is out of range.
    pub fn check(&self) -> Result<()> {
        if let Some(share) = self.front
            && !(share > 0.0 && share <= 1.0)
        {
            return Err(Error::Usage(format!("front is {share}, expected over 0 and at most 1")));
        }
        match self.samples {
            None | Some(1_000..=1_000_000_000) => Ok(()),
            Some(found) => {
                Err(Error::Usage(format!("samples is {found}, expected 1000 to 1000000000")))
            }
        }
    }

    /// How many points are spread over the source where it has so many leaves.
    pub(super) fn samples(&self, leaves: usize) -> u64 {
        self.samples.unwrap_or(LEAST_SAMPLES.max(SAMPLES_PER_LEAF * leaves as u64))
    }
}

/// What separates pass from fail. All tolerances stand here.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Limits {
    /// Relative difference between a stored attribute and its recomputation: room for the last
    /// bits of sums.
    pub attribute: f64,
    /// Stored error over measured error, at most this in the median of the nodes of each level.
    pub median_error_ratio: f64,
    /// The same at the 95th percentile.
    pub high_error_ratio: f64,
    /// Colour error of the leaves (RMS, 0–255) over that of JPEG itself on the source's images.
    pub texel_ratio: f64,
    /// Added to that: rounding of texels and texture coordinates, 0–255.
    pub texel_slack: f64,
    /// Likewise for a single leaf, whose images may be harder than the average.
    pub leaf_texel_ratio: f64,
    /// Likewise, 0–255.
    pub leaf_texel_slack: f64,
    /// Share of samples that may show a wrong tile, where tiles can be told.
    pub wrong_tiles: f64,
    /// Likewise for a single leaf: a few of its samples may lie where JPEG spoiled the number.
    pub leaf_wrong_tiles: f64,
    /// Share of a level's surface that may have another colour than the source.
    pub other_color: f64,
    /// A level with a larger share is named, and does not fail.
    pub other_color_warning: f64,
    /// Share of the pixels of what is far that may be missing where it is drawn from faces.
    pub missing_of_faces: f64,
    /// Share of them that may show something else, or at another distance.
    pub wrong_of_faces: f64,
    /// Gap that counts as none, in steps of the lattice that f32 has over the extent: corners of
    /// skirts are rounded to it.
    pub gap_steps: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            attribute: 1e-9,
            median_error_ratio: 1.5,
            high_error_ratio: 2.5,
            texel_ratio: 1.5,
            texel_slack: 1.0,
            leaf_texel_ratio: 3.0,
            leaf_texel_slack: 8.0,
            wrong_tiles: 0.01,
            leaf_wrong_tiles: 0.1,
            other_color: 0.1,
            other_color_warning: 0.02,
            missing_of_faces: 0.005,
            wrong_of_faces: 0.02,
            gap_steps: 4.0,
        }
    }
}
