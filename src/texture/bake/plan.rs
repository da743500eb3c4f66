//! The decision which coarse nodes of a block get a baked texture.

use serde::{Deserialize, Serialize};

use super::classes::BakeClasses;
use crate::mesh::Mesh;
use crate::texture::block::BlockTextures;

/// Why a node was given a texture of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BakeReason {
    /// Its block's texture is in so many charts that the root has few triangles for each.
    Torn,
    /// Collapse within the seams leaves more triangles than the node may have.
    Seams,
    /// Too much of the node would show another material than the source.
    Colors,
    /// A node below it has one.
    Below,
}

impl BakeReason {
    /// For reports.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Torn => "texture baked, as its block's is in many small charts",
            Self::Seams => "texture baked, as seams kept the node from its triangle budget",
            Self::Colors => "texture baked, as too much of the node would have another material's",
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

/// The share of a node's surface that may show another material than the source does there.
const MOST_WRONG: f64 = 0.05;

/// The coarse nodes of a block that may be baked.
#[derive(Clone, Copy, Debug)]
pub struct BakePlan<'a> {
    /// The materials whose textures may be baked.
    pub classes: &'a BakeClasses,
    /// The reason to bake every coarse node; `None` if only those that need it are baked.
    pub always: Option<BakeReason>,
    /// A node that misses its budget is baked where this is true.
    pub where_over_budget: bool,
    /// The block whose colours nodes are compared with; `None` compares none.
    pub textures: Option<&'a BlockTextures<'a>>,
}

impl BakePlan<'_> {
    /// The reason to bake a node that was simplified to this mesh within its seams, which `fits` its budget.
    pub fn reason(&self, mesh: &Mesh, fits: bool) -> Option<BakeReason> {
        if self.where_over_budget && !fits {
            return Some(BakeReason::Seams);
        }
        let wrong = self.textures.map_or(0.0, |textures| textures.wrong_colors(mesh));
        (wrong > MOST_WRONG).then_some(BakeReason::Colors)
    }
}

/// Decides which coarse nodes of a block are baked, from its number of charts that are cut up and the triangles
/// of its root. Returns the reason to bake all of them, and whether to bake those that miss their budget.
pub(crate) fn bake_decision(charts: usize, triangles: usize) -> (Option<BakeReason>, bool) {
    let always = (charts * TORN > triangles).then_some(BakeReason::Torn);
    (always, charts * DOUBTFUL > triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_judged_by_the_triangles_that_their_root_has_for_a_chart() {
        assert_eq!(bake_decision(373, 900), (Some(BakeReason::Torn), true));
        assert_eq!(bake_decision(30, 900), (None, true));
        assert_eq!(bake_decision(7, 900), (None, false));
    }
}
