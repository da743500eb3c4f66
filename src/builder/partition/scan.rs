//! What is known of an input before the partition: how many triangles are where.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::CellBox;
use crate::mesh::Model;

/// The triangles of one cell of a grid over an input.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cluster {
    /// How many.
    pub triangles: u32,
    /// Least coordinates of their middles.
    pub low: [f64; 3],
    /// Greatest coordinates of their middles.
    pub high: [f64; 3],
    /// The longest side of any of their boxes, metres.
    pub largest: f64,
    /// The box around all of them: least and greatest coordinates.
    pub around: [[f64; 3]; 2],
}

impl Cluster {
    /// The middle along an axis.
    pub fn middle(&self, axis: usize) -> f64 {
        0.5 * (self.low[axis] + self.high[axis])
    }
}

/// What is known of an input.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// The box around its vertices; the greatest corner is below the least where it has none.
    pub bounds: [[f64; 3]; 2],
    /// Its triangles, in an order of places.
    pub clusters: Vec<Cluster>,
}

impl Scan {
    /// Looks at all triangles of a model; about `per_cluster` make a cluster, where they are of a surface.
    pub fn of(model: &Model, per_cluster: f64) -> Self {
        let boxes = || {
            model.parts.iter().flat_map(|part| {
                let corners = part.indices.as_chunks::<3>().0.iter();
                corners.map(|corners| {
                    CellBox::around(corners.map(|vertex| part.positions[vertex as usize]))
                })
            })
        };
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut count = 0u64;
        for place in boxes() {
            count += 1;
            for (axis, middle) in middle(&place).into_iter().enumerate() {
                low[axis] = low[axis].min(middle);
                high[axis] = high[axis].max(middle);
            }
        }
        let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let across = (count as f64 / per_cluster.max(1.0)).sqrt().max(1.0);
        // A power of two, so that the grids of inputs are one.
        let side = (longest / across).max(f64::MIN_POSITIVE).log2().floor().exp2();
        let mut clusters: FxHashMap<[i64; 3], Cluster> = FxHashMap::default();
        for place in boxes() {
            let middle = middle(&place);
            let cell = middle.map(|coordinate| (coordinate / side).floor() as i64);
            let around = [place.low, place.high];
            let new = Cluster { triangles: 0, low: middle, high: middle, largest: 0.0, around };
            let cluster = clusters.entry(cell).or_insert(new);
            cluster.triangles = cluster.triangles.saturating_add(1);
            for (axis, middle) in middle.into_iter().enumerate() {
                cluster.low[axis] = cluster.low[axis].min(middle);
                cluster.high[axis] = cluster.high[axis].max(middle);
                cluster.largest = cluster.largest.max(place.high[axis] - place.low[axis]);
                cluster.around[0][axis] = cluster.around[0][axis].min(place.low[axis]);
                cluster.around[1][axis] = cluster.around[1][axis].max(place.high[axis]);
            }
        }
        let mut clusters: Vec<([i64; 3], Cluster)> = clusters.into_iter().collect();
        clusters.sort_unstable_by_key(|(cell, _)| *cell);
        let clusters = clusters.into_iter().map(|(_, cluster)| cluster).collect();
        Self { bounds: model.bounds(), clusters }
    }
}

fn middle(place: &CellBox) -> [f64; 3] {
    std::array::from_fn(|axis| 0.5 * (place.low[axis] + place.high[axis]))
}

/// The box around the middles of all triangles.
pub(super) fn centres(clusters: &[Cluster]) -> [[f64; 3]; 2] {
    let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    clusters.iter().fold(none, |[low, high], cluster| {
        [
            std::array::from_fn(|axis| low[axis].min(cluster.low[axis])),
            std::array::from_fn(|axis| high[axis].max(cluster.high[axis])),
        ]
    })
}
