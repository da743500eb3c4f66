//! Which planes that divided a source what is left of its borders belongs to.
//!
//! Vertices near a cut count as on it and stay where they are ([`crate::builder::cut::split`]): those
//! from which an edge would have been cut into slivers, and ends of edges along an earlier cut, which
//! no later one divides.

use blake3::Hasher;

use super::made_of::update;
use crate::builder::border::shared::Bounds;

/// What reaches no farther from a plane than this share of its extent is in it.
const CLOSE: f64 = 0.02;

/// An edge with one end so close may go on to one that is off the plane by this share, along an earlier
/// cut: half of an edge there may be beyond a later one.
const ALONG: f64 = 0.5;

/// A plane: its axis and the bits of its coordinate, which order as they are hashed.
pub type PlaneKey = (usize, u64);

/// The planes, by axis in order.
pub struct Cuts {
    across: [Vec<f64>; 3],
}

impl Cuts {
    /// Of axes and coordinates.
    pub fn new(cuts: &[(usize, f64)]) -> Self {
        let mut across: [Vec<f64>; 3] = Default::default();
        cuts.iter().for_each(|&(axis, coordinate)| across[axis].push(coordinate + 0.0));
        across.iter_mut().for_each(|all| all.sort_by(f64::total_cmp));
        Self { across }
    }

    /// The planes that points are in, at most one across each axis.
    pub fn of(&self, points: &[[f64; 3]]) -> impl Iterator<Item = PlaneKey> + use<> {
        self.within(points, [CLOSE; 2])
    }

    /// Those that an edge is along, also where it goes from one to where that meets another.
    pub fn along(&self, ends: &[[f64; 3]; 2]) -> impl Iterator<Item = PlaneKey> {
        let is_along = |&(axis, bits): &PlaneKey| {
            let coordinate = f64::from_bits(bits);
            let off = |end: &&[f64; 3]| (end[axis] - coordinate).abs();
            let farther = ends.iter().max_by(|a, b| off(a).total_cmp(&off(b)));
            let on_another = |end: &[f64; 3]| {
                (0..3).any(|other| other != axis && self.across[other].contains(&end[other]))
            };
            is_in_plane(ends, axis, coordinate) || farther.is_some_and(on_another)
        };
        self.within(ends, [CLOSE, ALONG]).filter(is_along)
    }

    /// Adds to a hash all planes that anything within bounds may be in or along.
    pub fn hash(&self, (low, high): &Bounds, hasher: &mut Hasher) {
        for (axis, all) in self.across.iter().enumerate() {
            let first = all.partition_point(|at| *at < low[axis]).saturating_sub(1);
            let behind = all.partition_point(|at| *at <= high[axis]) + 1;
            hasher.update(b"across");
            all[first..behind.min(all.len())].iter().for_each(|at| update(hasher, *at));
        }
    }

    fn within(
        &self,
        points: &[[f64; 3]],
        shares: [f64; 2],
    ) -> impl Iterator<Item = PlaneKey> + use<> {
        let planes = [0, 1, 2].map(|axis| {
            let all = &self.across[axis];
            let first = points.first()?[axis];
            let next = all.partition_point(|&coordinate| coordinate < first);
            let near = all[next.saturating_sub(1)..].iter().take(2);
            let near = near.min_by(|&&a, &&b| (a - first).abs().total_cmp(&(b - first).abs()))?;
            is_within(points, axis, *near, shares).then(|| (axis, near.to_bits()))
        });
        planes.into_iter().flatten()
    }
}

/// Whether points are in the plane across an axis at a coordinate.
pub fn is_in_plane(points: &[[f64; 3]], axis: usize, coordinate: f64) -> bool {
    is_within(points, axis, coordinate, [CLOSE; 2])
}

/// Whether a skirt is one along the plane: it lies in it, but for ends of edges that are beside it.
pub fn is_strip(corners: &[[f64; 3]], axis: usize, coordinate: f64) -> bool {
    is_within(corners, axis, coordinate, [0.0, ALONG])
}

/// Whether the nearest and the farthest of points are off a plane by no more than shares of their extent.
fn is_within(points: &[[f64; 3]], axis: usize, coordinate: f64, shares: [f64; 2]) -> bool {
    let off = || points.iter().map(|point| (point[axis] - coordinate).abs());
    let extent = |of: usize| {
        let all = points.iter().map(|point| point[of]);
        let (low, high) =
            all.fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(at), high.max(at)));
        (high - low).powi(2)
    };
    let extent = (extent(0) + extent(1) + extent(2)).sqrt();
    let [near, far] = [off().fold(f64::INFINITY, f64::min), off().fold(0.0, f64::max)];
    near <= shares[0] * extent && far <= shares[1] * extent
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_as_near_to_a_cut_as_cutting_leaves_it_is_in_it() {
        let cuts = Cuts::new(&[(0, 8.0), (0, -2.0), (2, 3.0), (0, 8.5)]);
        let of = |points: &[[f64; 3]]| -> Vec<(usize, f64)> {
            cuts.of(points).map(|(axis, bits)| (axis, f64::from_bits(bits))).collect()
        };
        assert_eq!(of(&[[8.0, 0.0, 0.0], [8.0, 4.0, 1.0]]), [(0, 8.0)]);
        assert_eq!(of(&[[8.0, 0.0, 3.0], [8.0, 4.0, 3.0]]), [(0, 8.0), (2, 3.0)]);
        assert_eq!(of(&[[-2.0, 0.0, 0.0], [-2.03, 4.0, 1.0]]), [(0, -2.0)]);
        assert_eq!(of(&[[-2.0, 0.0, 0.0], [-2.2, 4.0, 1.0]]), []);
        assert_eq!(of(&[[8.3, 0.0, 0.0], [8.3, 4.0, 1.0]]), []);
        let along = |points: &[[f64; 3]; 2]| cuts.along(points).count();
        assert_eq!(along(&[[-2.0, 0.0, 0.0], [-1.0, 2.0, 9.0]]), 0);
        assert_eq!(along(&[[-2.0, 0.0, 0.0], [-1.0, 2.0, 3.0]]), 1, "to an earlier cut");
        assert_eq!(along(&[[-2.0, 0.0, 0.0], [40.0, 0.0, 9.0]]), 0);
        assert_eq!(Cuts::new(&[]).of(&[[0.0; 3]; 2]).count(), 0);
    }
}
