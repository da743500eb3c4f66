//! Vertices of borders that are nearly at one place, and may be one.

use rustc_hash::FxHashMap;

use crate::mesh::{PositionKey, key, wide};

/// Vertices of two inputs no farther apart than this may be one, metres: what is lost where coordinates are
/// written to millimetres, each tile with an origin of its own.
pub const NEAR: f64 = 0.005;

/// The vertices of some edges, found by place.
pub struct NearVertices {
    /// In order.
    positions: Vec<[f64; 3]>,
    /// Of each, the length of its shortest edge.
    shortest: Vec<f64>,
    /// Numbers of the vertices in each cube of a side of `distance`.
    in_cube: FxHashMap<[i64; 3], Vec<u32>>,
    distance: f64,
}

impl NearVertices {
    /// To be looked for within `distance`.
    pub fn new(edges: impl Iterator<Item = [[f64; 3]; 2]>, distance: f64) -> Self {
        let mut shortest: FxHashMap<PositionKey<f64>, ([f64; 3], f64)> = FxHashMap::default();
        for ends in edges {
            let length = wide(ends[0]).distance(wide(ends[1]));
            for end in ends {
                let (_, least) = shortest.entry(key(end)).or_insert((end, length));
                *least = least.min(length);
            }
        }
        let mut all: Vec<_> = shortest.into_iter().collect();
        all.sort_unstable_by_key(|(key, _)| *key);
        let mut in_cube: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        for (number, (_, (position, _))) in (0..).zip(&all) {
            in_cube.entry(cube(*position, distance)).or_default().push(number);
        }
        let (positions, shortest) = all.into_iter().map(|(_, vertex)| vertex).unzip();
        Self { positions, shortest, in_cube, distance }
    }

    /// All of them, in order.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Whether the boxes of these and others come near each other.
    pub fn meet(&self, others: &Self) -> bool {
        let bounds = |of: &Self| {
            let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            of.positions.iter().fold(empty, |[low, high], at| {
                let axes = [0, 1, 2];
                [axes.map(|i| low[i].min(at[i])), axes.map(|i| high[i].max(at[i]))]
            })
        };
        let ([low, high], [other_low, other_high]) = (bounds(self), bounds(others));
        let reach = self.distance;
        (0..3).all(|i| low[i] <= other_high[i] + reach && other_low[i] <= high[i] + reach)
    }

    /// How far another vertex may be from one of these to be the same: no farther than half of
    /// the shortest edge there.
    fn reach(&self, number: u32) -> f64 {
        self.distance.min(self.shortest[number as usize] / 2.0)
    }

    /// The nearest vertex that may be the same as one at `position`, the first of equally near ones, of those
    /// that `may_be` says of.
    fn nearest(&self, position: [f64; 3], may_be: impl Fn(u32) -> bool) -> Option<(f64, u32)> {
        let [x, y, z] = cube(position, self.distance);
        let around = |at: i64| [at.saturating_sub(1), at, at.saturating_add(1)];
        let cubes = around(x)
            .into_iter()
            .flat_map(|x| around(y).into_iter().flat_map(move |y| around(z).map(|z| [x, y, z])));
        let numbers = cubes.filter_map(|cube| self.in_cube.get(&cube)).flatten();
        let near = numbers.filter_map(|&number| {
            let distance = wide(self.positions[number as usize]).distance(wide(position));
            (distance <= self.reach(number) && may_be(number)).then_some((distance, number))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    /// The vertex nearest to one of them that may be the same, of those that `may_be` says of.
    pub fn nearest_to(&self, number: u32, may_be: impl Fn(u32) -> bool) -> Option<u32> {
        let reach = self.reach(number);
        let nearest = self.nearest(self.positions[number as usize], may_be);
        nearest.filter(|&(distance, _)| distance <= reach).map(|(_, other)| other)
    }

    /// Whether one of them may be the same as one at `position`.
    pub fn has_near(&self, position: [f64; 3]) -> bool {
        self.nearest(position, |_| true).is_some()
    }

    /// The pairs of one of these and one of others that are nearest to each other, by number, and
    /// how far they are apart.
    pub fn pairs(&self, others: &Self) -> Vec<([u32; 2], f64)> {
        let pair = |(number, &position): (u32, &[f64; 3])| {
            let (distance, other) = others.nearest(position, |_| true)?;
            let (_, back) = self.nearest(others.positions[other as usize], |_| true)?;
            (back == number).then_some(([number, other], distance))
        };
        (0..).zip(&self.positions).filter_map(pair).collect()
    }
}

/// The cube of a grid that a position is in.
fn cube(position: [f64; 3], side: f64) -> [i64; 3] {
    // Far out several cubes are one, which is slower and no less right.
    position.map(|coordinate| (coordinate / side).floor() as i64)
}
