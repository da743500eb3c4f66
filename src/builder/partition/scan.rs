//! What is known of an input before the partition: how many triangles are where.

use rustc_hash::FxHashMap;

use super::CellBox;
use crate::mesh::Model;

/// The triangles of one cell of a grid over an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// How many.
    pub triangles: u32,
    /// The box around their middles.
    pub middles: CellBox,
    /// The longest side of any of their boxes, metres.
    pub largest: f64,
    /// The box around all of them.
    pub around: CellBox,
}

impl Cluster {
    /// The middle along an axis.
    pub fn middle(&self, axis: usize) -> f64 {
        self.middles.middle()[axis]
    }
}

/// What is known of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// The box around its vertices.
    pub bounds: CellBox,
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
        let middles = CellBox::around(boxes().map(|place| place.middle()));
        let (count, longest) = (boxes().count(), middles.longest());
        let across = (count as f64 / per_cluster.max(1.0)).sqrt().max(1.0);
        // A power of two, so that the grids of inputs are one.
        let side = (longest / across).max(f64::MIN_POSITIVE).log2().floor().exp2();
        let mut clusters: FxHashMap<[i64; 3], Cluster> = FxHashMap::default();
        for place in boxes() {
            let middle = place.middle();
            let cell = middle.map(|coordinate| (coordinate / side).floor() as i64);
            let middles = CellBox { low: middle, high: middle };
            let new = Cluster { triangles: 0, middles, largest: 0.0, around: place };
            let cluster = clusters.entry(cell).or_insert(new);
            cluster.triangles = cluster.triangles.saturating_add(1);
            cluster.middles = cluster.middles.and(&middles);
            cluster.largest = cluster.largest.max(place.longest());
            cluster.around = cluster.around.and(&place);
        }
        let mut clusters: Vec<([i64; 3], Cluster)> = clusters.into_iter().collect();
        clusters.sort_unstable_by_key(|(cell, _)| *cell);
        let clusters = clusters.into_iter().map(|(_, cluster)| cluster).collect();
        let [low, high] = model.bounds();
        Self { bounds: CellBox { low, high }, clusters }
    }
}

/// The box around the middles of all triangles.
pub(super) fn middles(clusters: &[Cluster]) -> CellBox {
    clusters.iter().fold(CellBox::NONE, |all, cluster| all.and(&cluster.middles))
}
