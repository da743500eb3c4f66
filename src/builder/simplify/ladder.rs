//! Simplification of a node to its triangle budget, by methods that change ever more.
//!
//! 1. Extruded footprints (`crate::builder::simplify::aggregate`), where the mesh has so many separate
//!    bodies that the budget leaves few triangles to each; or fewer and larger boxes ([`BodyPlacement`]).
//! 2. Elsewhere quadric edge collapse with attributes (Garland & Heckbert as meshoptimizer has it, with
//!    vertex positions and attributes solved for afterwards), inside texture seams.
//! 3. Where that misses the budget, or moves the surface far for the triangles that it leaves,
//!    whichever of these and it is measured to stay nearest to the input on average:
//!    - the same, across seams and material borders, and leaving out the smallest separate parts;
//!      triangles then get one material each again ([`crate::builder::simplify::split_mixed`]);
//!    - the second, of faces with a consistent winding ([`crate::builder::simplify::orient`]);
//!    - vertex clustering ([`crate::builder::simplify::cluster`]), which has no topology to respect.
//!
//! Border vertices that the level keeps are locked throughout.

use std::cell::OnceCell;
use std::cmp::Ordering;

use crate::builder::border::vertex::{Border, BorderVertexState, Path};
use crate::builder::constants::Constants;
use crate::builder::error::MeanDistance;
use crate::builder::simplify::aggregate::{ComponentRules, Components, Extruded};
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

/// Tells what stands for many separate bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyPlacement {
    /// Prisms stand where the bodies do. Of bodies that stand apart only the largest stay if there are few triangles.
    InPlace,
    /// Fewer and larger boxes cover as much ground.
    Spread,
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
    /// See [`ComponentRules`].
    pub extrudable: &'a [bool],
    /// A step that is not tried, to measure its effect.
    pub without: Option<LadderStep>,
    /// See [`Constants`].
    pub constants: &'a Constants,
}

impl Method<'_> {
    /// The rules by which a component counts as a building.
    pub fn bodies(&self) -> ComponentRules<'_> {
        let &Self { up, extrudable, constants, .. } = self;
        ComponentRules { up, extrudable, constants: &constants.prisms }
    }
}

/// Tells of each vertex whether it stays where it is in a node of `path` at `level`.
pub fn locked_vertices(border: &Border, path: &Path, level: u8) -> Vec<bool> {
    let states = border.planes.iter().zip(&border.keep);
    states
        .map(|(&planes, &keep)| path.state(planes, keep, level) != BorderVertexState::Free)
        .collect()
}

/// A mesh that is simplified, to one budget or to several: what does not depend on the budget is found
/// once.
pub struct Ladder<'a> {
    source: Simplified,
    locked: Vec<bool>,
    method: Method<'a>,
    bodies: OnceCell<Components>,
    has_duplicate_faces: OnceCell<bool>,
    is_one_sheet: OnceCell<bool>,
    /// The mesh with a consistent winding; `None` if it had one before.
    oriented: OnceCell<Option<Mesh>>,
    distance: OnceCell<MeanDistance>,
}

impl<'a> Ladder<'a> {
    /// Prepares a mesh whose border is thinned ([`crate::builder::border::thin`]) for a node of `path` at
    /// `level`.
    pub fn new(mesh: &Mesh, border: &Border, path: &Path, level: u8, method: Method<'a>) -> Self {
        let (mesh, border) = compact(mesh, border);
        let locked = locked_vertices(&border, path, level);
        Self {
            source: Simplified { mesh, border, error: 0.0, step: LadderStep::Collapse },
            locked,
            method,
            bodies: OnceCell::new(),
            has_duplicate_faces: OnceCell::new(),
            is_one_sheet: OnceCell::new(),
            oriented: OnceCell::new(),
            distance: OnceCell::new(),
        }
    }

    /// Simplifies to at most about `target` triangles.
    pub fn simplified(&self, target: usize, for_bodies: BodyPlacement) -> Simplified {
        let Self { source, locked, method, .. } = self;
        if method.simplifier == Simplifier::Clustering {
            return clustered(&source.mesh, &source.border, locked, target);
        }
        if source.mesh.triangles.len() <= target {
            return source.clone();
        }
        let limit = (target as f64 * BUDGET_TOLERANCE) as usize;
        let mut simplified = self.nearest(target, limit, for_bodies);
        let reach = method.constants.simplify.far_part * target_edge(&source.mesh, target);
        keep_far_parts(&mut simplified, source, locked, reach, limit, method);
        simplified
    }

    fn tries(&self, step: LadderStep) -> bool {
        self.method.without != Some(step)
    }

    fn collapsed(&self, mesh: &Mesh, target: usize, step: LadderStep) -> Simplified {
        collapse(mesh, &self.source.border, &self.locked, target, step, self.method.weights)
    }

    /// The result of the ladder's steps that is nearest to the source.
    fn nearest(&self, target: usize, limit: usize, for_bodies: BodyPlacement) -> Simplified {
        let Self { source, locked, method, .. } = self;
        let constants = method.constants;
        let prisms = self.extruded(target, for_bodies);
        if let Some(prisms) = prisms.filter(|prisms| prisms.mesh.triangles.len() <= limit) {
            return prisms;
        }
        let best = self.collapsed(&source.mesh, target, LadderStep::Collapse);
        let target_edge = target_edge(&source.mesh, target);
        let rules = &constants.simplify;
        let has_duplicate_faces = || has_duplicate_faces(&source.mesh, rules.few_faces);
        let is_unfit = best.mesh.triangles.len() > limit
            || *self.has_duplicate_faces.get_or_init(has_duplicate_faces);
        let mut candidates = Vec::new();
        if is_unfit || best.error > rules.doubtful * target_edge {
            // Over one sheet it does what collapse did.
            let is_one_sheet = || is_one_sheet(&source.mesh, locked);
            if self.tries(LadderStep::Prune) && !*self.is_one_sheet.get_or_init(is_one_sheet) {
                candidates.push(self.collapsed(&source.mesh, target, LadderStep::Prune));
            }
            if self.tries(LadderStep::Clustering) {
                candidates.push(clustered(&source.mesh, &source.border, locked, target));
            }
            if self.tries(LadderStep::Oriented) {
                candidates.extend(self.collapsed_with_set_winding(target));
            }
        }
        if candidates.is_empty() {
            return best;
        }
        let rank = |candidate: &Simplified, best: (Rank, f64)| {
            let nearest = if best.0 == Rank::WithinBudget { best.1 } else { f64::INFINITY };
            let distance = || {
                let from = || MeanDistance::from(&source.mesh, constants.measure);
                self.distance.get_or_init(from).to(&candidate.mesh, nearest)
            };
            Rank::of(candidate.mesh.triangles.len(), limit, distance, target_edge)
        };
        let mut best = (rank(&best, (Rank::OverBudgetSevere, f64::INFINITY)), best);
        for candidate in candidates {
            let rank = rank(&candidate, best.0);
            if !candidate.mesh.triangles.is_empty()
                && rank.partial_cmp(&best.0) == Some(Ordering::Less)
            {
                best = (rank, candidate);
            }
        }
        best.1
    }

    fn components(&self) -> &Components {
        let Self { source, locked, method, .. } = self;
        self.bodies.get_or_init(|| Components::of(&source.mesh, locked, &method.bodies()))
    }

    /// Returns the number of its separate bodies.
    pub fn bodies(&self) -> usize {
        self.components().count()
    }

    /// Extruded bodies with the rest simplified by edge collapse; `None` where there are few bodies.
    fn extruded(&self, target: usize, for_bodies: BodyPlacement) -> Option<Simplified> {
        let Self { source, method, .. } = self;
        if !self.tries(LadderStep::Prisms) {
            return None;
        }
        let rules = method.bodies();
        let bodies = self.components();
        if !bodies.are_many(target, &rules) {
            return None;
        }
        let (extruded, step) = match for_bodies {
            BodyPlacement::InPlace => {
                (bodies.extruded(&source.mesh, target, &rules), LadderStep::Prisms)
            }
            BodyPlacement::Spread => {
                (bodies.spread(&source.mesh, target, rules.up), LadderStep::Boxes)
            }
        };
        let Extruded { prisms, rest } = extruded?;
        let for_rest = target.saturating_sub(prisms.triangles.len()).max(1);
        let rest = Mesh { triangles: rest.to_vec(), ..source.mesh.clone() };
        let mut result = if rest.triangles.len() > for_rest {
            // Nothing is left out here: that is for small bodies, which are prisms.
            self.collapsed(&rest, for_rest, step)
        } else {
            let (mesh, border) = compact(&rest, &source.border);
            Simplified { mesh, border, error: 0.0, step }
        };
        let border = Border::interior(prisms.positions.len());
        result.append(prisms, border);
        Some(result)
    }

    /// Edge collapse after duplicate faces are removed and all have a consistent winding; `None` where this
    /// changes nothing.
    fn collapsed_with_set_winding(&self, target: usize) -> Option<Simplified> {
        let Self { source, method, .. } = self;
        let few = method.constants.simplify.few_faces;
        let oriented = || {
            let triangles = oriented(&source.mesh, method.reorientable, few)?;
            Some(Mesh { triangles, ..source.mesh.clone() })
        };
        let mesh = self.oriented.get_or_init(oriented).as_ref()?;
        let step = LadderStep::Oriented;
        if mesh.triangles.len() > target {
            return Some(self.collapsed(mesh, target, step));
        }
        let (mesh, border) = compact(mesh, &source.border);
        Some(Simplified { mesh, border, error: 0.0, step })
    }
}

/// The side, in metres, of a square with the mean area of a triangle of the target.
fn target_edge(mesh: &Mesh, target: usize) -> f64 {
    (mesh.area() / target as f64).sqrt()
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

fn clustered(mesh: &Mesh, border: &Border, locked: &[bool], target: usize) -> Simplified {
    let (mesh, border, error) = cluster(mesh, border, locked, target);
    Simplified { mesh, border, error, step: LadderStep::Clustering }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::builder::constants::MeasureConstants;
    use crate::builder::simplify::test_box::add_box;

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
            let (x, y) = (f64::from(house % 20) * 14.0, f64::from(house / 20) * 18.0);
            let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 11.0], [0.0, 11.0]];
            add_box(&mut mesh, corners.map(|[i, j]| DVec2::new(x + i, y + j)), 6.0);
        }
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
            Ladder::new(&mesh, &border, &Path::default(), 0, method)
                .simplified(target, BodyPlacement::InPlace)
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
