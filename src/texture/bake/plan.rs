//! The decision which coarse nodes of a block get a baked texture.

use serde::{Deserialize, Serialize};

use super::classes::BakeClasses;

/// Why a node was given a texture of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BakeReason {
    /// Its block's texture is in so many charts that the root has few triangles for each.
    Torn,
    /// Collapse within the seams leaves more triangles than the node may have.
    Seams,
    /// A node below it has one.
    Below,
}

impl BakeReason {
    /// For reports.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Torn => "texture baked, as its block's is in many small charts",
            Self::Seams => "texture baked, as seams kept the node from its triangle budget",
            Self::Below => "texture baked, as a node below has one that is",
        }
    }
}

/// Triangles of the root for each chart below which all coarse nodes are baked. With fewer, seams
/// determine their shape more than the surface does, and gutters take much of their atlases. Scans have 2 to
/// 10, generated façades and roofs more than 100.
const TORN: usize = 16;

/// Triangles of the root for each chart below which nodes that miss their budget are baked.
const DOUBTFUL: usize = 64;

/// The coarse nodes of a block that may be baked.
#[derive(Clone, Copy, Debug)]
pub struct BakePlan<'a> {
    /// The materials whose textures may be baked.
    pub classes: &'a BakeClasses,
    /// The reason to bake every coarse node; `None` if only those that need it are baked.
    pub always: Option<BakeReason>,
}

/// Decides about a block with this number of charts, whose root has this triangle budget. `None` means
/// that no node is baked, `Some(None)` that nodes are baked that miss their budget, and a reason that all
/// coarse nodes are baked.
pub(crate) fn bake_decision(charts: usize, triangles: usize) -> Option<Option<BakeReason>> {
    if charts * TORN > triangles {
        Some(Some(BakeReason::Torn))
    } else {
        (charts * DOUBTFUL > triangles).then_some(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_judged_by_the_triangles_that_their_root_has_for_a_chart() {
        assert_eq!(bake_decision(373, 900), Some(Some(BakeReason::Torn)));
        assert_eq!(bake_decision(30, 900), Some(None));
        assert_eq!(bake_decision(7, 900), None);
    }
}
