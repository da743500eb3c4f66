//! Histogram of the triangles of an input, which the partition is computed from.

use rustc_hash::FxHashMap;

use super::CellBox;
use crate::mesh::{Model, Part};

/// The triangles of one cell of a grid over an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// Number of triangles.
    pub triangles: u32,
    /// Texels of the source that they have, where each texture is spread evenly over the triangles that
    /// have it.
    pub texels: f64,
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

/// Histogram of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// The box around its vertices.
    pub bounds: CellBox,
    /// Clusters of its triangles, sorted by grid cell.
    pub clusters: Vec<Cluster>,
}

impl Scan {
    /// Looks at all triangles of a model, whose textures have so many texels each; about `per_cluster`
    /// triangles make a cluster, where they are of a surface.
    pub fn of(model: &Model, texels: &[u64], per_cluster: f64) -> Self {
        let texture_of = |part: &Part| model.materials.get(part.material as usize)?.texture;
        let mut triangles_of = vec![0u64; texels.len()];
        for part in &model.parts {
            if let Some(count) = texture_of(part).and_then(|of| triangles_of.get_mut(of as usize)) {
                *count += part.indices.len() as u64 / 3;
            }
        }
        let texels_each = model.parts.iter().flat_map(|part| {
            let texture = texture_of(part).map(|texture| texture as usize);
            let each = texture.map_or(0.0, |of| match (texels.get(of), triangles_of.get(of)) {
                (Some(&texels), Some(&triangles)) => texels as f64 / triangles.max(1) as f64,
                _ => 0.0,
            });
            std::iter::repeat_n(each, part.indices.len() / 3)
        });
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
        for (place, texels) in boxes().zip(texels_each) {
            let middle = place.middle();
            let cell = middle.map(|coordinate| (coordinate / side).floor() as i64);
            let middles = CellBox { low: middle, high: middle };
            let new = Cluster { triangles: 0, texels: 0.0, middles, largest: 0.0, around: place };
            let cluster = clusters.entry(cell).or_insert(new);
            cluster.triangles = cluster.triangles.saturating_add(1);
            cluster.texels += texels;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Material, Warnings};

    #[test]
    fn texels_are_spread_over_the_triangles_that_have_them() {
        let row = |first: f64, count: u32, material: u32| Part {
            positions: (0..count)
                .flat_map(|at| {
                    let x = first + f64::from(at);
                    [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]]
                })
                .collect(),
            indices: (0..3 * count).collect(),
            material,
            ..Part::default()
        };
        let textured = |texture| Material { texture: Some(texture), ..Material::plain("") };
        let model = Model {
            source: "a.obj".into(),
            dependencies: Vec::new(),
            groups: Vec::new(),
            parts: vec![row(0.0, 10, 0), row(100.0, 30, 0), row(200.0, 5, 1), row(300.0, 7, 2)],
            materials: vec![textured(0), Material::plain("plain"), textured(7)],
            textures: Vec::new(),
            up: None,
            warnings: Warnings::default(),
        };
        let scan = Scan::of(&model, &[4000], 1.0);
        let triangles: u32 = scan.clusters.iter().map(|cluster| cluster.triangles).sum();
        assert_eq!(triangles, 52);
        let between = |low: f64, high: f64| -> f64 {
            let inside = |cluster: &&Cluster| (low..high).contains(&cluster.middle(0));
            scan.clusters.iter().filter(inside).map(|cluster| cluster.texels).sum()
        };
        let found = [between(0.0, 90.0), between(90.0, 190.0), between(190.0, 400.0)];
        assert_eq!(found, [1000.0, 3000.0, 0.0]);
    }
}
