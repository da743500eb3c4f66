//! Vertices of borders that are nearly at one place, and may be one.

use rustc_hash::FxHashMap;

use crate::mesh::{key, wide};

/// Vertices of two inputs no farther apart than this may be one, metres: what is lost where coordinates are
/// written to millimetres, each tile with an origin of its own.
pub const NEAR: f64 = 0.005;

/// The vertices of some edges, found by place.
pub struct NearVertices {
    /// In order.
    positions: Vec<[f64; 3]>,
    /// Of each, the length of its shortest edge.
    shortest: Vec<f64>,
    /// Numbers of the vertices, those in one cube of a side of `distance` together.
    by_cube: Vec<u32>,
    /// From where to where there those in each cube are.
    cubes: FxHashMap<[i64; 3], [u32; 2]>,
    distance: f64,
}

impl NearVertices {
    /// To be looked for within `distance`.
    pub fn new(edges: impl Iterator<Item = [[f64; 3]; 2]>, distance: f64) -> Self {
        let of_edge = |ends: [[f64; 3]; 2]| {
            let length = wide(ends[0]).distance(wide(ends[1]));
            ends.map(|end| (end, length))
        };
        let mut all: Vec<([f64; 3], f64)> = edges.flat_map(of_edge).collect();
        all.sort_by_key(|(end, _)| key(*end));
        all.dedup_by(|next, first| {
            let is_same = key(next.0) == key(first.0);
            if is_same {
                first.1 = first.1.min(next.1);
            }
            is_same
        });
        let (positions, shortest): (Vec<[f64; 3]>, Vec<f64>) = all.into_iter().unzip();
        let in_cube = |number: &u32| cube(positions[*number as usize], distance);
        let mut by_cube: Vec<u32> = (0..positions.len() as u32).collect();
        by_cube.sort_by_cached_key(in_cube);
        let mut cubes: FxHashMap<[i64; 3], [u32; 2]> = FxHashMap::default();
        for (at, number) in (0..).zip(&by_cube) {
            cubes.entry(in_cube(number)).or_insert([at; 2])[1] = at + 1;
        }
        Self { positions, shortest, by_cube, cubes, distance }
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
        let ranges = cubes.filter_map(|cube| self.cubes.get(&cube));
        let numbers = ranges.flat_map(|&[from, to]| &self.by_cube[from as usize..to as usize]);
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
