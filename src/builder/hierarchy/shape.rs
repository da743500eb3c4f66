//! How deep a tree is, and how many triangles each of its nodes may have.
//!
//! A *resolution* is a step of simplification: resolution 0 is the block's coarsest, the last is
//! the original. With `N` triangles in the block, `desired_tris = D` and `level_factor = f` there
//! are `k = round(log_f(N / D))` steps of one ratio `r = (N / D)^(1/k)` between them, so that what
//! remains of the division is spread over all steps rather than left to the last. A node of `n`
//! source triangles at resolution `i` may have `n / r^(k - i)`.
//!
//! In [`TreeShape::Balanced`] a chunk is a leaf once no step of simplification is left that would
//! save anything (`n < sqrt(f) * D`, where `round(log_f(n / D))` is 0), and skips resolutions where
//! it has far fewer triangles than its siblings. In [`TreeShape::Thesis`] resolutions are levels.

use super::options::{HierarchyOptions, TreeShape};
use crate::builder::constants::TreeConstants;

/// A tree is not cut deeper than this many planes ([`crate::builder::border::vertex::PlaneSet`]
/// holds 64, and each child is behind at most 6 more).
const MOST_PLANES: usize = 58;

/// A chunk is divided while cuts have made at most so many triangles of each of the block's that it
/// has. Pieces of a surface stay near 1; of long triangles that overlap each cut makes two of most,
/// and n of them would become n^(5/3).
const MOST_PIECES: f64 = 3.0;

/// The resolutions of one block.
#[derive(Clone, Debug)]
pub struct Resolutions {
    tree: TreeShape,
    desired_tris: f64,
    level_factor: f64,
    constants: TreeConstants,
    /// Source triangles for one of a node, by resolution; the last is the leaves' and is 1.
    factors: Vec<f64>,
}

/// What becomes of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodePlan {
    /// It is a leaf.
    Leaf,
    /// It is divided, and a coarse node stands for it.
    Coarse {
        /// Of the coarse node.
        resolution: usize,
        /// The triangles that it may have.
        budget: usize,
        /// The chunk's share of the block's triangles, in proportion to those that cuts have made of
        /// them.
        share: usize,
    },
}

/// A node that is divided.
#[derive(Clone, Copy, Debug)]
pub struct Parent {
    /// Its resolution.
    pub resolution: usize,
    /// The source triangles of its chunk.
    pub triangles: usize,
    /// See [`NodePlan::Coarse`].
    pub share: usize,
    /// The triangles of all its children.
    pub of_children: usize,
}

impl Resolutions {
    /// For a block of so many triangles.
    pub fn new(triangles: usize, options: &HierarchyOptions) -> Self {
        let (desired_tris, level_factor) =
            (f64::from(options.desired_tris), f64::from(options.level_factor));
        let ratio = triangles as f64 / desired_tris;
        let factors = match options.tree {
            TreeShape::Thesis => thesis_factors(ratio, level_factor),
            TreeShape::Balanced => {
                let steps = steps(ratio, level_factor).max(0) as usize;
                let root = |exponent: usize| {
                    let share = exponent as f64 / steps as f64;
                    if exponent == 0 { 1.0 } else { libm::pow(ratio, share) }
                };
                (0..=steps).rev().map(root).collect()
            }
        };
        let constants = options.constants.tree;
        Self { tree: options.tree, desired_tris, level_factor, constants, factors }
    }

    /// Of a node of `budget` triangles that stands above others, which have so many.
    pub fn above(triangles: usize, budget: usize, options: &HierarchyOptions) -> Self {
        let factor = (triangles as f64 / budget as f64).max(1.0);
        Self { factors: vec![factor, 1.0], ..Self::new(1, options) }
    }

    /// Source triangles for one of a node, by resolution, coarsest first; the last is 1.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// How many times the triangles of a coarse node its children have.
    pub fn step(&self, resolution: usize) -> f64 {
        self.factors.get(resolution + 1).map_or(1.0, |next| self.factors[resolution] / next)
    }

    /// The resolution of leaves.
    pub fn last(&self) -> usize {
        self.factors.len() - 1
    }

    /// What becomes of the whole block.
    pub fn root(&self, triangles: usize) -> NodePlan {
        if self.last() == 0 { NodePlan::Leaf } else { self.coarse(triangles, 0, triangles) }
    }

    /// What becomes of a chunk of so many triangles, behind so many planes, below a node.
    pub fn child(&self, triangles: usize, planes: usize, parent: Parent) -> NodePlan {
        let next = parent.resolution + 1;
        let part = triangles as f64 / parent.of_children.max(1) as f64;
        let share = parent.share as f64 * part;
        if self.tree == TreeShape::Thesis {
            let deep = next == self.last() || planes > MOST_PLANES;
            let share = share.round() as usize;
            return if deep { NodePlan::Leaf } else { self.coarse(triangles, next, share) };
        }
        let ratio = triangles as f64 / self.desired_tris;
        let in_pieces = triangles as f64 > MOST_PIECES * share;
        if steps(ratio, self.level_factor) <= 0 || planes > MOST_PLANES || in_pieces {
            return NodePlan::Leaf;
        }
        let share = share.round() as usize;
        if next >= self.last() {
            let most = self.constants.last_step_tolerance * self.level_factor.sqrt();
            // Pieces of a surface shrink by their number, those of triangles that extend through a volume by
            // its cube root: these would be cut without end.
            let shrunk = parent.triangles as f64 / self.level_factor.sqrt();
            let leaf = ratio < most || triangles as f64 > shrunk;
            let coarse = || self.coarse(triangles, parent.resolution, share);
            return if leaf { NodePlan::Leaf } else { coarse() };
        }
        // The coarsest resolution that gives the node about the triangles that are desired.
        let nearest = (next..self.last()).min_by(|&a, &b| {
            let off = |resolution: usize| {
                let budget = ratio / self.factors[resolution];
                budget.max(1.0 / budget)
            };
            off(a).total_cmp(&off(b))
        });
        self.coarse(triangles, nearest.unwrap_or(next), share)
    }

    fn coarse(&self, triangles: usize, resolution: usize, share: usize) -> NodePlan {
        let budget = (triangles as f64 / self.factors[resolution]).round() as usize;
        NodePlan::Coarse { resolution, budget: budget.max(1), share }
    }
}

/// Steps by about `level_factor` that divide by `ratio` in all; none or fewer below its root.
fn steps(ratio: f64, level_factor: f64) -> i64 {
    // libm's, which is alike on all machines.
    (libm::log(ratio) / libm::log(level_factor)).round() as i64
}

/// The thesis's factors: divided by the level factor until they fall below 1.
fn thesis_factors(ratio: f64, level_factor: f64) -> Vec<f64> {
    let mut factors = Vec::new();
    let mut factor = ratio;
    while factor > 1.0 {
        factors.push(factor);
        factor /= level_factor;
    }
    factors.push(1.0);
    factors
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolutions(triangles: usize, tree: TreeShape) -> Resolutions {
        let options =
            HierarchyOptions { tree, desired_tris: 900, level_factor: 4, ..Default::default() };
        Resolutions::new(triangles, &options)
    }

    #[test]
    fn factors_follow_the_thesis() {
        let of = |triangles| resolutions(triangles, TreeShape::Thesis).factors;
        assert_eq!(of(900), [1.0], "within the budget: one node");
        assert_eq!(of(901).len(), 2);
        assert_eq!(of(900 * 64), [64.0, 16.0, 4.0, 1.0]);
        let factors = of(230_000);
        assert!((factors[0] - 255.5555).abs() < 1e-3);
        assert_eq!(factors.len(), 5, "255.6, 63.9, 16.0, 3.99, and the original");
    }

    #[test]
    fn ratios_are_even_and_never_a_small_last_one() {
        for triangles in (1..400).map(|n| n * n * 60) {
            let factors = resolutions(triangles, TreeShape::Balanced).factors;
            assert_eq!(factors[factors.len() - 1], 1.0);
            for pair in factors.windows(2) {
                let ratio = pair[0] / pair[1];
                assert!((2.0 - 1e-9..=8.0 + 1e-9).contains(&ratio), "{triangles}: {factors:?}");
                assert!((ratio / (factors[0] / factors[1]) - 1.0).abs() < 1e-9);
            }
            let root = triangles as f64 / factors[0];
            assert!(factors.len() == 1 || (root - 900.0).abs() < 1e-6, "{root}");
            assert!(factors.len() > 1 || triangles < 1800, "{triangles}");
        }
        // 4, 4, 4, 1.45 by the thesis's law.
        let factors = resolutions(83_520, TreeShape::Balanced).factors;
        assert_eq!(factors.len(), 4);
        assert!((factors[2] - 4.527).abs() < 1e-3, "{factors:?}");
    }

    #[test]
    fn chunks_that_fit_are_leaves_and_small_ones_skip_resolutions() {
        let all = resolutions(900 * 256, TreeShape::Balanced);
        assert_eq!(all.factors.len(), 5);
        let coarse = |resolution, budget, share| NodePlan::Coarse { resolution, budget, share };
        let parent = |resolution, triangles| Parent {
            resolution,
            triangles,
            share: triangles,
            of_children: triangles,
        };
        let below = |resolution| parent(resolution, (900 * 256) >> (2 * resolution));
        assert_eq!(all.root(900 * 256), coarse(0, 900, 900 * 256));
        assert_eq!(all.child(900 * 64, 2, below(0)), coarse(1, 900, 900 * 64));
        assert_eq!(all.child(900 * 4, 2, below(0)), coarse(3, 900, 900 * 4));
        for parent in 0..3 {
            assert_eq!(all.child(1700, 2, below(parent)), NodePlan::Leaf);
        }
        let large = parent(3, 900 * 16);
        assert_eq!(all.child(3500, 8, large), NodePlan::Leaf, "a little more than it should have");
        assert_eq!(all.child(3700, 8, large), coarse(3, 925, 3700));
        assert_eq!(all.child(900 * 64, 60, below(0)), NodePlan::Leaf, "no plane is left");
    }

    /// Triangles that reach all through a volume: an eighth of its side has 1/4 of them.
    #[test]
    fn what_cuts_do_not_divide_is_not_cut_for_ever() {
        let all = resolutions(900 * 4, TreeShape::Balanced);
        let mut triangles = 900 * 40;
        let mut resolution = 0;
        let mut depth = 0;
        while let NodePlan::Coarse { resolution: at, .. } = all.child(
            (triangles as f64 / 4f64.cbrt()) as usize,
            depth,
            Parent { resolution, triangles, share: triangles, of_children: triangles },
        ) {
            triangles = (triangles as f64 / 4f64.cbrt()) as usize;
            (resolution, depth) = (at, depth + 1);
        }
        assert!(depth <= 1, "{depth}");
    }

    /// Each of four children has as many triangles as the whole, or half as many.
    #[test]
    fn cuts_make_a_bounded_number_of_pieces() {
        for part in [1.0, 0.5] {
            let mut pieces = Vec::new();
            for triangles in [4, 16, 64].map(|times: usize| times * 9000) {
                let all = resolutions(triangles, TreeShape::Balanced);
                let mut nodes = vec![(triangles, all.root(triangles))];
                let mut in_leaves = 0;
                while let Some((triangles, plan)) = nodes.pop() {
                    let NodePlan::Coarse { resolution, share, .. } = plan else {
                        in_leaves += triangles;
                        continue;
                    };
                    let child = (triangles as f64 * part) as usize;
                    let parent = Parent { resolution, triangles, share, of_children: 4 * child };
                    nodes.extend((0..4).map(|_| (child, all.child(child, 2, parent))));
                }
                pieces.push(in_leaves as f64 / triangles as f64);
            }
            assert!(pieces.iter().all(|&pieces| pieces <= 4.0 * MOST_PIECES), "{pieces:?}");
        }
    }
}
