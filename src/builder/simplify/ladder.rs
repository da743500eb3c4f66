//! Simplification of a node to its triangle budget, by methods that change ever more.
//!
//! 1. Quadric edge collapse with attributes (Garland & Heckbert as meshoptimizer has it, with
//!    vertex positions and attributes solved for afterwards), inside texture seams.
//! 2. The same, allowed to collapse across texture seams but not across material borders.
//! 3. Where that misses the budget, or moves the surface far for the triangles that it leaves,
//!    whichever of these and it is measured to stay nearest to the input on average:
//!    - the same, across material borders too, and leaving out the smallest separate parts; triangles
//!      then get one material each again ([`crate::builder::simplify::split_mixed`]);
//!    - the first, of faces with a consistent winding ([`crate::builder::simplify::orient`]);
//!    - vertex clustering ([`crate::builder::simplify::cluster`]), which has no topology to respect.
//!
//! Extruded footprints (`crate::builder::simplify::aggregate`) are compared with these results, by the
//! same measure, if the mesh has many separate components and the budget leaves few triangles to each. If
//! it leaves so few that no other method would keep the components, footprints are used without a
//! comparison.
//!
//! Border vertices that the level keeps are locked throughout.

use std::cmp::Ordering;

use crate::builder::border::vertex::{Border, BorderVertexState, Path};
use crate::builder::constants::Constants;
use crate::builder::error::MeanDistance;
use crate::builder::simplify::aggregate::{BodyRules, Extruded, extrude, without_floors};
use crate::builder::simplify::cluster::cluster;
pub use crate::builder::simplify::collapse::AppearanceWeights;
use crate::builder::simplify::collapse::collapse;
use crate::builder::simplify::compact::compact;
use crate::builder::simplify::far_parts::keep_far_parts;
use crate::builder::simplify::one_sheet::is_one_sheet;
use crate::builder::simplify::orient::{has_duplicate_faces, oriented};
use crate::builder::simplify::simplified::{LadderStep, Simplified};
use crate::mesh::{Mesh, UpAxis};

/// Which method makes the coarse levels.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Simplifier {
    /// Quadric error metrics, with the ladder below it.
    #[default]
    Qem,
    /// Vertex clustering alone (Cozzi & Loo, section 3).
    Clustering,
}

/// A node may exceed its budget by this factor before the ladder goes on.
pub const BUDGET_TOLERANCE: f64 = 1.1;

/// How chunks are simplified.
#[derive(Clone, Copy, Debug)]
pub struct Method<'a> {
    /// See [`Simplifier`].
    pub simplifier: Simplifier,
    /// See [`AppearanceWeights`].
    pub weights: AppearanceWeights,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// For each material, whether its faces may be flipped ([`crate::builder::simplify::orient`]).
    pub reorientable: &'a [bool],
    /// See [`BodyRules`].
    pub extrudable: &'a [bool],
    /// A step that is not tried, to measure its effect.
    pub without: Option<LadderStep>,
    /// See [`Constants`].
    pub constants: &'a Constants,
}

impl Method<'_> {
    /// The rules by which a component counts as a building.
    pub fn bodies(&self) -> BodyRules<'_> {
        let &Self { up, extrudable, constants, .. } = self;
        BodyRules { up, extrudable, constants: &constants.prisms }
    }
}

/// Simplifies `mesh`, whose border is thinned already ([`crate::builder::border::thin`]), to at most about
/// `target` triangles as a node of `path` at `level`.
pub fn simplify(
    mesh: &Mesh,
    border: &Border,
    path: &Path,
    level: u8,
    target: usize,
    method: &Method,
) -> Simplified {
    let &Method { simplifier, constants, .. } = method;
    let (mesh, border) = compact(mesh, border);
    let locked: Vec<bool> = border
        .planes
        .iter()
        .zip(&border.keep)
        .map(|(&planes, &keep)| path.state(planes, keep, level) != BorderVertexState::Free)
        .collect();
    let limit = (target as f64 * BUDGET_TOLERANCE) as usize;
    if simplifier == Simplifier::Clustering {
        return clustered(&mesh, &border, &locked, target);
    }
    let source = Simplified { mesh, border, error: 0.0, step: LadderStep::Collapse };
    if source.mesh.triangles.len() <= target {
        return source;
    }
    let mut simplified = nearest(&source, &locked, target, limit, method);
    let reach = constants.simplify.far_part * target_edge(&source.mesh, target);
    keep_far_parts(&mut simplified, &source, &locked, reach, limit, method);
    simplified
}

/// The side, in metres, of a square with the mean area of a triangle of the target.
fn target_edge(mesh: &Mesh, target: usize) -> f64 {
    (mesh.area() / target as f64).sqrt()
}

/// The result of the ladder's steps that is nearest to the source.
fn nearest(
    source: &Simplified,
    locked: &[bool],
    target: usize,
    limit: usize,
    method: &Method,
) -> Simplified {
    let &Method { weights, up, reorientable, without, constants, .. } = method;
    let tries = |step| without != Some(step);
    let collapsed = |step| collapse(&source.mesh, &source.border, locked, target, step, weights);
    let mut prisms = None;
    if tries(LadderStep::Prisms)
        && let Some(extruded) = extrude(&source.mesh, locked, target, &method.bodies())
    {
        let is_sure = extruded.triangles_per_body < constants.prisms.sure;
        let completed = completed(source, extruded, locked, target, weights);
        if is_sure && completed.mesh.triangles.len() <= limit {
            return completed;
        }
        prisms = Some(completed);
    }
    let mut best = collapsed(LadderStep::Collapse);
    if best.mesh.triangles.len() > limit && tries(LadderStep::Permissive) {
        let permissive = collapsed(LadderStep::Permissive);
        if permissive.mesh.triangles.len() < best.mesh.triangles.len() {
            best = permissive;
        }
    }
    let mut candidates = Vec::new();
    let target_edge = target_edge(&source.mesh, target);
    let rules = &constants.simplify;
    let is_unfit =
        best.mesh.triangles.len() > limit || has_duplicate_faces(&source.mesh, rules.few_faces);
    if is_unfit || best.error > rules.doubtful * target_edge {
        // Over one sheet it does what collapse did.
        if tries(LadderStep::Prune) && !is_one_sheet(&source.mesh, locked) {
            candidates.push(collapsed(LadderStep::Prune));
        }
        if tries(LadderStep::Clustering) {
            candidates.push(clustered(&source.mesh, &source.border, locked, target));
        }
        if tries(LadderStep::Oriented) {
            let few = rules.few_faces;
            candidates.extend(collapsed_with_set_winding(
                source,
                locked,
                target,
                weights,
                reorientable,
                few,
            ));
        }
    }
    // Prisms have no floors; these are left out of the comparison.
    let seen = |mesh: &Mesh| without_floors(mesh, up);
    let has_prisms = prisms.is_some();
    candidates.extend(prisms);
    if candidates.is_empty() {
        return best;
    }
    let source_seen = if has_prisms { &seen(&source.mesh) } else { &source.mesh };
    let mut from_source = MeanDistance::from(source_seen, constants.measure);
    let mut rank = |candidate: &Simplified, best: (Rank, f64)| {
        let nearest = if best.0 == Rank::WithinBudget { best.1 } else { f64::INFINITY };
        let distance = || match has_prisms {
            true => from_source.to(&seen(&candidate.mesh), nearest),
            false => from_source.to(&candidate.mesh, nearest),
        };
        Rank::of(candidate.mesh.triangles.len(), limit, distance, target_edge)
    };
    let mut best = (rank(&best, (Rank::OverBudgetSevere, f64::INFINITY)), best);
    for candidate in candidates {
        let rank = rank(&candidate, best.0);
        if !candidate.mesh.triangles.is_empty() && rank.partial_cmp(&best.0) == Some(Ordering::Less)
        {
            best = (rank, candidate);
        }
    }
    best.1
}

/// The ranks of candidates, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Within the budget. The nearest to the input is best.
    WithinBudget,
    /// Over the budget, by at most its double. The one with the fewest triangles is best.
    OverBudget,
    /// On average farther from the input than [`target_edge`], so that whole sides are missing. The
    /// nearest is best.
    Distant,
    /// More than twice the budget. The one with the fewest triangles is best.
    OverBudgetSevere,
}

impl Rank {
    /// The rank of a candidate by its triangles and its distance from the input, and the value that
    /// orders candidates of the same rank. Less is better.
    fn of(
        triangles: usize,
        limit: usize,
        distance: impl FnOnce() -> f64,
        target_edge: f64,
    ) -> (Self, f64) {
        if triangles > 2 * limit {
            return (Self::OverBudgetSevere, triangles as f64);
        }
        let distance = distance();
        match (triangles <= limit, distance <= target_edge) {
            (true, true) => (Self::WithinBudget, distance),
            (false, true) => (Self::OverBudget, triangles as f64),
            (_, false) => (Self::Distant, distance),
        }
    }
}

/// Edge collapse after duplicate faces are removed and all have a consistent winding; `None` where this
/// changes nothing.
fn collapsed_with_set_winding(
    source: &Simplified,
    locked: &[bool],
    target: usize,
    weights: AppearanceWeights,
    reorientable: &[bool],
    few: f64,
) -> Option<Simplified> {
    let triangles = oriented(&source.mesh, reorientable, few)?;
    let mesh = Mesh { triangles, ..source.mesh.clone() };
    let step = LadderStep::Oriented;
    if mesh.triangles.len() > target {
        return Some(collapse(&mesh, &source.border, locked, target, step, weights));
    }
    let (mesh, border) = compact(&mesh, &source.border);
    Some(Simplified { mesh, border, error: 0.0, step })
}

/// Extruded components, with the rest simplified by edge collapse.
fn completed(
    source: &Simplified,
    extruded: Extruded,
    locked: &[bool],
    target: usize,
    weights: AppearanceWeights,
) -> Simplified {
    let Extruded { prisms, rest, .. } = extruded;
    let step = LadderStep::Prisms;
    let for_rest = target.saturating_sub(prisms.triangles.len()).max(1);
    let rest = Mesh { triangles: rest, ..source.mesh.clone() };
    let mut result = if rest.triangles.len() > for_rest {
        // Nothing is left out here: that is for small bodies, which are prisms.
        collapse(&rest, &source.border, locked, for_rest, step, weights)
    } else {
        let (mesh, border) = compact(&rest, &source.border);
        Simplified { mesh, border, error: 0.0, step }
    };
    let border = Border::interior(prisms.positions.len());
    result.append(prisms, border);
    result
}

fn clustered(mesh: &Mesh, border: &Border, locked: &[bool], target: usize) -> Simplified {
    let (mesh, border, error) = cluster(mesh, border, locked, target);
    Simplified { mesh, border, error, step: LadderStep::Clustering }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::constants::MeasureConstants;

    #[test]
    fn a_budget_is_no_reason_to_leave_out_whole_sides() {
        // The second of each pair is worse; the target edge is 4 m.
        let of = |triangles, distance| Rank::of(triangles, 100, || distance, 4.0);
        for [better, worse] in [
            [of(90, 1.0), of(20, 2.0)],
            [of(90, 3.9), of(101, 0.0)],
            [of(150, 3.0), of(160, 1.0)],
            [of(200, 3.0), of(6, 12.0)],
            [of(90, 5.0), of(150, 6.0)],
            [of(90, f64::INFINITY), of(201, 0.0)],
        ] {
            assert!(better < worse, "{better:?} {worse:?}");
        }
    }

    /// Houses of 12 triangles each, all apart.
    fn houses(count: u16) -> Mesh {
        let mut mesh = Mesh::default();
        for house in 0..count {
            let (x, y) = (f32::from(house % 20) * 14.0, f32::from(house / 20) * 18.0);
            let first = mesh.positions.len() as u32;
            for z in [0.0, 6.0] {
                let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 11.0], [0.0, 11.0]];
                mesh.positions.extend(corners.map(|[i, j]| [x + i, y + j, z]));
            }
            let mut triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
            for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
                triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
            }
            mesh.triangles.extend(triangles.iter().map(|t| t.map(|vertex| first + vertex)));
        }
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    #[test]
    fn many_houses_with_few_triangles_each_become_prisms() {
        let mesh = houses(200);
        let border = Border::interior(mesh.positions.len());
        let simplified = |target| {
            let weights = AppearanceWeights::default();
            let (simplifier, up, every) = (Simplifier::Qem, UpAxis::Z, &[true][..]);
            let constants = &Constants::default();
            let method = Method {
                simplifier,
                weights,
                up,
                reorientable: every,
                extrudable: every,
                without: None,
                constants,
            };
            simplify(&mesh, &border, &Path::default(), 0, target, &method)
        };
        let few = simplified(600);
        assert_eq!(few.step, LadderStep::Prisms);
        assert!(few.mesh.triangles.len() <= 660, "{}", few.mesh.triangles.len());
        assert_eq!(few.border.keep.len(), few.mesh.positions.len());
        let alone = collapse(
            &mesh,
            &border,
            &vec![false; mesh.positions.len()],
            600,
            LadderStep::Prisms,
            AppearanceWeights::default(),
        );
        let to = |other: &Mesh| {
            MeanDistance::from(&mesh, MeasureConstants::default()).to(other, f64::INFINITY)
        };
        assert!(to(&few.mesh) < to(&alone.mesh), "{} {}", to(&few.mesh), to(&alone.mesh));
        assert_ne!(simplified(2400).step, LadderStep::Prisms, "enough for all");
    }
}
