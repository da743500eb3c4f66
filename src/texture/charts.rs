//! Charts: triangles that hang together over shared vertices, and the box of their texture
//! coordinates.

use crate::mesh::DisjointSet;

/// No chart: the vertex is in no triangle that was asked for.
pub(crate) const NO_CHART: u32 = u32::MAX;

/// How far outside 0–1 still counts as inside, in tiles: exporters round.
pub(crate) const TILE_TOLERANCE: f64 = 1e-4;

/// The charts of a mesh.
#[derive(Debug, Default)]
pub(crate) struct Charts {
    /// The chart of each vertex, or [`NO_CHART`].
    pub of_vertex: Vec<u32>,
    /// Lowest and highest texture coordinate of each chart, in tiles; in order of first vertex.
    pub boxes: Vec<UvBox>,
}

/// A box of texture coordinates, in tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UvBox {
    pub min: [f64; 2],
    pub max: [f64; 2],
}

impl UvBox {
    /// Contains nothing.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    pub fn add(&mut self, uv: [f64; 2]) {
        self.unite(&Self { min: uv, max: uv });
    }

    pub fn unite(&mut self, other: &UvBox) {
        for axis in 0..2 {
            // Comparisons, as the functions of f64 also look for what is not a number.
            if other.min[axis] < self.min[axis] {
                self.min[axis] = other.min[axis];
            }
            if other.max[axis] > self.max[axis] {
                self.max[axis] = other.max[axis];
            }
        }
    }

    /// The whole tiles by which the chart is moved so that it lies in 0–1, where it can.
    pub fn tile(&self, axis: usize) -> f64 {
        let (min, max) = (self.min[axis], self.max[axis]);
        if min >= -TILE_TOLERANCE && max <= 1.0 + TILE_TOLERANCE {
            0.0
        } else {
            // The middle, as an end may lie on a tile's border or by rounding beyond it.
            (0.5 * (min + max)).floor()
        }
    }

    /// True where no shift by whole tiles brings the chart into 0–1.
    pub fn crosses_border(&self, axis: usize) -> bool {
        let tile = self.tile(axis);
        self.min[axis] - tile < -TILE_TOLERANCE || self.max[axis] - tile > 1.0 + TILE_TOLERANCE
    }

    /// True where the chart is longer than one tile.
    pub fn exceeds_tile(&self, axis: usize) -> bool {
        self.max[axis] - self.min[axis] > 1.0 + 2.0 * TILE_TOLERANCE
    }
}

/// A texture coordinate that arithmetic can rely on: not a number, infinite and absurdly far
/// (where f32 no longer tells texels apart) become 0.
pub(crate) fn sane(uv: [f32; 2]) -> [f64; 2] {
    uv.map(|value| if value.abs() < 65536.0 { f64::from(value) } else { 0.0 })
}

impl Charts {
    /// Finds the charts of `triangles` over vertices with these texture coordinates.
    pub fn find(texcoords: &[[f32; 2]], triangles: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut connected = DisjointSet::new(texcoords.len());
        let mut of_vertex = vec![NO_CHART; texcoords.len()];
        for [a, b, c] in triangles {
            connected.join(a, b);
            connected.join(b, c);
            for vertex in [a, b, c] {
                of_vertex[vertex as usize] = 0;
            }
        }
        // Roots are the least of their sets, so each is numbered before the others.
        let mut boxes: Vec<UvBox> = Vec::new();
        for vertex in 0..of_vertex.len() {
            if of_vertex[vertex] == NO_CHART {
                continue;
            }
            let root = connected.root(vertex as u32) as usize;
            of_vertex[vertex] = if root == vertex {
                boxes.push(UvBox::EMPTY);
                boxes.len() as u32 - 1
            } else {
                of_vertex[root]
            };
            boxes[of_vertex[vertex] as usize].add(sane(texcoords[vertex]));
        }
        Self { of_vertex, boxes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_over_shared_vertices_are_one_chart() {
        let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [3.0, 3.0], [9.0, 9.0], [0.5, 0.5]];
        let triangles = [[5, 1, 2], [0, 1, 5], [3, 3, 3]];
        let charts = Charts::find(&uvs, triangles.into_iter());
        assert_eq!(charts.of_vertex, [0, 0, 0, 1, NO_CHART, 0]);
        assert_eq!(charts.boxes[0], UvBox { min: [0.0; 2], max: [1.0; 2] });
        assert_eq!(charts.boxes[1], UvBox { min: [3.0; 2], max: [3.0; 2] });
    }

    #[test]
    fn a_long_strip_in_any_order_is_one_chart() {
        let uvs = vec![[0.25, 0.5]; 1002];
        for triangles in [
            (0..1000).map(|i| [i, i + 1, i + 2]).collect::<Vec<_>>(),
            (0..1000).rev().map(|i| [i + 2, i, i + 1]).collect(),
            (0..1000).map(|i| (i * 7) % 1000).map(|i| [i + 1, i, i + 2]).collect(),
        ] {
            let charts = Charts::find(&uvs, triangles.into_iter());
            assert_eq!(charts.boxes.len(), 1);
            assert!(charts.of_vertex.iter().all(|chart| *chart == 0));
        }
    }

    #[test]
    fn shifts_bring_a_chart_into_the_tile() {
        let at = |min: f64, max: f64| UvBox { min: [min; 2], max: [max; 2] };
        assert_eq!(at(0.0, 1.0).tile(0), 0.0);
        assert_eq!(at(1.0, 1.0).tile(0), 0.0);
        assert_eq!(at(-0.00001, 1.00001).tile(0), 0.0);
        assert_eq!(at(3.0, 4.0).tile(0), 3.0);
        assert_eq!(at(-1.0, 0.0).tile(0), -1.0);
        assert!(!at(-1.0, 0.0).crosses_border(0));
        assert!(at(0.5, 1.2).crosses_border(0) && !at(0.5, 1.2).exceeds_tile(0));
        assert!(at(0.0, 1.2).exceeds_tile(1));
    }

    #[test]
    fn absurd_coordinates_become_zero() {
        assert_eq!(sane([f32::NAN, 1e30]), [0.0, 0.0]);
        assert_eq!(sane([f32::NEG_INFINITY, -0.5]), [0.0, -0.5]);
    }
}
