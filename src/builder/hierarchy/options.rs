//! How one block is built.

use crate::builder::constants::Constants;
use crate::builder::cut::split::CutTolerance;
use crate::builder::simplify::ladder::{AppearanceWeights, Simplifier};
use crate::builder::simplify::simplified::LadderStep;

/// What happens to vertices on cutting planes.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum BorderMode {
    /// None is removed: no gaps, at the price of a large part of every coarse node's budget.
    Locked,
    /// They are simplified identically on both sides; skirts close the gaps between levels.
    #[default]
    Skirts,
}

/// The shape of a block's tree.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum TreeShape {
    /// As deep as the geometry needs: even ratios between levels, cuts that balance triangles, and
    /// a leaf wherever a chunk fits ([`super::shape`]).
    #[default]
    Balanced,
    /// The thesis's law (section 3.2): `simplification_0 = N / desired_tris`, divided by
    /// `level_factor` at every level until it falls below 1; slabs of even width across the longest
    /// side; all branches equally deep.
    Thesis,
}

/// How one block is built.
#[derive(Clone, Debug)]
pub struct HierarchyOptions {
    /// See [`TreeShape`].
    pub tree: TreeShape,
    /// Desired triangles of a node (`c_desiredTris`), at least 1.
    pub desired_tris: u32,
    /// Ratio of triangles and texels between levels (`c_levelFactor`), at least 2.
    pub level_factor: u32,
    /// See [`Simplifier`].
    pub simplifier: Simplifier,
    /// See [`BorderMode`].
    pub borders: BorderMode,
    /// See [`AppearanceWeights`].
    pub weights: AppearanceWeights,
    /// See [`CutTolerance`].
    pub tolerance: CutTolerance,
    /// A step of the ladder that is not tried, to measure what it is worth; a result does not say
    /// so.
    pub without: Option<LadderStep>,
    /// See [`Constants`]; a result does not say what they were.
    pub constants: Constants,
}

impl Default for HierarchyOptions {
    fn default() -> Self {
        Self {
            tree: TreeShape::default(),
            desired_tris: 2000,
            level_factor: 4,
            simplifier: Simplifier::default(),
            borders: BorderMode::default(),
            weights: AppearanceWeights::default(),
            tolerance: CutTolerance::default(),
            without: None,
            constants: Constants::default(),
        }
    }
}
