//! Checks that the leaves cover each triangle of the source exactly once.
//!
//! A triangle of a leaf is a triangle of the source or a part of one, whose corners rounding has
//! moved by at most some distance d. So its centroid is within d of that triangle, and its area
//! differs from that of the exact part by at most `perimeter * d / 2 + 3 / 2 * d²` (expand the
//! cross product of two edges). Source triangles that have the centroid of one leaf triangle within
//! d, as coincident faces have, form a group, since it is not known which of them was built. In each
//! group the area of the leaves must be that of the source within the sum of these bounds. A limit on
//! the whole area would be much weaker: rounding may change all triangles of a regular grid alike.

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::sample::area;
use crate::mesh::{DisjointSet, Surface};

/// A group of source triangles, and their part in the leaves.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group {
    /// A source triangle of the group, the one with the least number.
    pub triangle: u32,
    /// Area of its source triangles, square metres.
    pub source: f64,
    /// Area of the leaf triangles on them, square metres.
    pub leaves: f64,
    /// The most that rounding may change, square metres.
    pub bound: f64,
}

impl Group {
    /// True if the areas differ by more than rounding explains.
    pub fn is_wrong(&self) -> bool {
        let difference = (self.leaves - self.source).abs();
        difference.is_nan() || difference > self.bound
    }
}

/// The leaves compared with the source, triangle by triangle.
#[derive(Debug)]
pub(super) struct Coverage {
    /// All groups, in order of their triangles.
    pub groups: Vec<Group>,
    /// Triangles of leaves with no source triangle near their centroid: leaf, triangle, centroid.
    pub strays: Vec<(u32, u32, DVec3)>,
}

/// A leaf triangle on a source triangle.
struct Covering {
    /// The source triangles near its centroid; at least one.
    triangles: Vec<u32>,
    area: f64,
    perimeter: f64,
}

/// Compares leaves with a source. `moved` is how far the corners of each leaf may be from where the
/// source has them, metres, by index among the leaves.
pub(super) fn coverage(
    source: &Surface,
    leaves: &[u32],
    geometry: &[NodeGeometry],
    moved: &[f64],
    done: impl Fn() + Sync,
) -> Coverage {
    let of_leaf = |(&leaf, &moved): (&u32, &f64)| {
        let node = &geometry[leaf as usize];
        let (mut coverings, mut strays) = (Vec::new(), Vec::new());
        for (number, &triangle) in (0..).zip(&node.triangles) {
            let corners = node.corners(triangle);
            let centroid = corners.iter().sum::<DVec3>() / 3.0;
            let hits = source.within(centroid, moved);
            if hits.is_empty() {
                strays.push((leaf, number, centroid));
                continue;
            }
            let triangles = hits.iter().map(|hit| hit.triangle).collect();
            let (area, perimeter) = (area(corners), perimeter(corners));
            coverings.push(Covering { triangles, area, perimeter });
        }
        done();
        (coverings, strays)
    };
    let found: Vec<_> = leaves.par_iter().zip(moved).map(of_leaf).collect();

    let count = source.triangles().len();
    let mut sets = DisjointSet::new(count);
    for covering in found.iter().flat_map(|(coverings, _)| coverings) {
        let first = covering.triangles[0];
        covering.triangles.iter().for_each(|&other| sets.join(first, other));
    }
    let roots: Vec<u32> = (0..count as u32).map(|triangle| sets.root(triangle)).collect();
    let mut sums = vec![Sums::default(); count];
    for ((coverings, _), &moved) in found.iter().zip(moved) {
        for covering in coverings {
            let sums = &mut sums[roots[covering.triangles[0] as usize] as usize];
            sums.leaves += covering.area;
            sums.bound += covering.perimeter * moved * 0.5 + 1.5 * moved * moved;
            sums.moved = sums.moved.max(moved);
        }
    }
    // A triangle that vanished had corners that rounding moved by no more than all others.
    let most_moved = moved.iter().copied().fold(0.0, f64::max);
    let mut groups: Vec<Group> = Vec::new();
    for (number, &root) in (0..).zip(&roots) {
        let corners = source.corners(number);
        let sums = &mut sums[root as usize];
        sums.source += area(corners);
        // Cuts leave slivers along a triangle's edges, which are dropped where rounding makes them
        // degenerate: they are in no leaf's perimeter.
        let moved = if sums.leaves > 0.0 { sums.moved } else { most_moved };
        sums.bound += perimeter(corners) * moved;
    }
    for (number, root) in (0..).zip(roots) {
        if number == root {
            let Sums { source, leaves, bound, .. } = sums[root as usize];
            groups.push(Group { triangle: root, source, leaves, bound });
        }
    }
    let strays = found.into_iter().flat_map(|(_, strays)| strays).collect();
    Coverage { groups, strays }
}

/// Sums over a group, and the largest distance that its corners may have moved.
#[derive(Clone, Copy, Default)]
struct Sums {
    source: f64,
    leaves: f64,
    bound: f64,
    moved: f64,
}

fn perimeter([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance(b) + b.distance(c) + c.distance(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 1.0 / 64.0;

    /// Separate squares of 9.295 m on a grid of 25 m: rounding changes all of them alike.
    fn grid(side: u32) -> Vec<[DVec3; 3]> {
        let square = |number: u32| {
            let (x, y) = (f64::from(number % side) * 25.0, f64::from(number / side) * 25.0);
            let corner = |dx: f64, dy: f64| DVec3::new(x + dx, y + dy, 0.0);
            let [a, b, c, d] = [
                corner(0.352, 0.352),
                corner(9.647, 0.352),
                corner(9.647, 9.647),
                corner(0.352, 9.647),
            ];
            [[a, b, c], [a, c, d]]
        };
        (0..side * side).flat_map(square).collect()
    }

    fn surface(triangles: &[[DVec3; 3]]) -> Surface {
        let numbers = (0..triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]);
        Surface::new(triangles.concat(), numbers.collect())
    }

    fn leaf(triangles: &[[DVec3; 3]]) -> NodeGeometry {
        let rounded = |at: &DVec3| (*at / STEP).round() * STEP;
        NodeGeometry {
            positions: triangles
                .as_flattened()
                .iter()
                .map(|at| rounded(at).as_vec3().into())
                .collect(),
            triangles: (0..triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
            ..NodeGeometry::default()
        }
    }

    fn compared(source: &[[DVec3; 3]], leaves: &[[DVec3; 3]]) -> Coverage {
        let moved = STEP * 0.5 * 3f64.sqrt();
        coverage(&surface(source), &[0], &[leaf(leaves)], &[moved], || {})
    }

    fn wrong(coverage: &Coverage) -> Vec<u32> {
        coverage.groups.iter().filter(|group| group.is_wrong()).map(|g| g.triangle).collect()
    }

    #[test]
    fn rounding_alone_is_never_wrong_and_one_lost_triangle_is() {
        let source = grid(30);
        let whole = compared(&source, &source);
        assert!(wrong(&whole).is_empty() && whole.strays.is_empty());
        let [of_source, of_leaves] = [|g: &Group| g.source, |g: &Group| g.leaves]
            .map(|of| whole.groups.iter().map(of).sum::<f64>());
        assert!((of_leaves / of_source - 1.0).abs() > 1e-4, "all rounded the same way");

        let mut lost = source.clone();
        lost.remove(777);
        assert_eq!(wrong(&compared(&source, &lost)), [777]);
        let mut twice = source.clone();
        twice.push(source[5]);
        assert_eq!(wrong(&compared(&source, &twice)), [5]);
    }

    #[test]
    fn moved_triangles_are_found() {
        let source = grid(4);
        // To another place, onto another triangle, and larger within its plane.
        let mut elsewhere = source.clone();
        elsewhere[3].iter_mut().for_each(|corner| corner.z += 0.1);
        let found = compared(&source, &elsewhere);
        assert_eq!((wrong(&found), found.strays.len()), (vec![3], 1));
        let mut onto = source.clone();
        onto[3] = onto[8];
        assert_eq!(wrong(&compared(&source, &onto)), [3, 8]);
        let mut larger = source.clone();
        larger[6][0].x -= 0.2;
        assert_eq!(wrong(&compared(&source, &larger)), [6]);
    }

    #[test]
    fn parts_of_triangles_and_coincident_triangles_add_up() {
        let mut source = grid(2);
        source.push(source[0]);
        let mut leaves = source.clone();
        let [a, b, c] = leaves.swap_remove(1);
        let middle = b.lerp(c, 0.4);
        leaves.extend([[a, b, middle], [a, middle, c]]);
        let found = compared(&source, &leaves);
        assert!(wrong(&found).is_empty() && found.strays.is_empty());
        assert_eq!(found.groups.len(), source.len() - 1, "two of them coincide");
        leaves.pop();
        assert_eq!(wrong(&compared(&source, &leaves)), [1]);
        let without_one = &source[1..];
        assert_eq!(wrong(&compared(&source, without_one)), [0]);
    }

    #[test]
    fn triangles_that_vanish_by_rounding_are_not_missed() {
        let mut source = grid(2);
        let at = DVec3::new(3.0, 20.0, 0.0);
        source.push([at, at + DVec3::X * 2.0, at + DVec3::Y * STEP * 0.4]);
        let leaves = &source[..source.len() - 1];
        assert!(wrong(&compared(&source, leaves)).is_empty());
    }
}
