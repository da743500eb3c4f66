//! Which bodies stand side by side, and so become one prism when there are few triangles.

use glam::DVec2;
use rustc_hash::FxHashMap;

use super::prisms::Body;
use crate::mesh::DisjointSet;

/// Bodies are side by side whose boxes meet if each is wider by this share of the side of a square
/// as large as its footprint, all around: two houses of ten metres if they are a metre apart.
const WIDER: f64 = 0.05;

/// What is larger than so many others in a row counts as alone.
const MOST_CELLS: i64 = 64;

/// No more are looked at that lie at one place.
const MOST_AT_ONE_PLACE: usize = 32;

/// The number of rows that some bodies make: those side by side with each other, or one alone.
pub(super) fn rows(bodies: &[Body]) -> usize {
    let boxes: Vec<[DVec2; 2]> = bodies.iter().map(wider).collect();
    let sides: f64 = boxes.iter().map(|[low, high]| (high - low).element_sum() * 0.5).sum();
    let side = sides / boxes.len() as f64;
    let mut joined = DisjointSet::new(boxes.len());
    let mut rows = boxes.len();
    let mut entered: FxHashMap<[i64; 2], Vec<u32>> = FxHashMap::default();
    for (number, &[low, high]) in (0u32..).zip(&boxes) {
        let cell = |at: DVec2| (at / side).floor().as_i64vec2();
        let (first, last) = (cell(low), cell(high));
        if (last - first).max_element() > MOST_CELLS {
            continue;
        }
        for (x, y) in (first.x..=last.x).flat_map(|x| (first.y..=last.y).map(move |y| (x, y))) {
            let there = entered.entry([x, y]).or_default();
            for &other in there.iter().rev().take(MOST_AT_ONE_PLACE) {
                let [other_low, other_high] = boxes[other as usize];
                let meet = low.cmple(other_high).all() && other_low.cmple(high).all();
                if meet && joined.root(number) != joined.root(other) {
                    joined.join(number, other);
                    rows -= 1;
                }
            }
            there.push(number);
        }
    }
    rows
}

fn wider(body: &Body) -> [DVec2; 2] {
    let by = WIDER * body.footprint.sqrt();
    [body.low - by, body.high + by]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::constants::PrismConstants;
    use crate::mesh::{Mesh, UpAxis};

    /// Boxes of ten metres and five high, their corners at these places.
    fn rows_of(places: &[[f32; 2]]) -> usize {
        let mut mesh = Mesh::default();
        let mut parts: Vec<Vec<[u32; 3]>> = Vec::new();
        for [x, y] in places {
            let first = mesh.positions.len() as u32;
            for z in [0.0, 5.0] {
                let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
                mesh.positions.extend(corners.map(|[i, j]| [x + i, y + j, z]));
            }
            let mut triangles = vec![[4, 5, 6], [4, 6, 7]];
            for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
                triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
            }
            parts.push(triangles.iter().map(|t| t.map(|vertex| first + vertex)).collect());
        }
        mesh.materials = vec![0; mesh.positions.len()];
        let constants = PrismConstants::default();
        let body = |part: &Vec<_>| Body::of(&mesh, part, UpAxis::Z, &constants).is_some();
        assert!(parts.iter().all(body));
        let body = |part| Body::of(&mesh, part, UpAxis::Z, &constants);
        rows(&parts.iter().filter_map(|part| body(part)).collect::<Vec<_>>())
    }

    #[test]
    fn houses_in_a_row_are_one_and_those_across_a_street_are_not() {
        let row: Vec<[f32; 2]> = (0..7u8).map(|n| [10.5 * f32::from(n), 0.0]).collect();
        assert_eq!(rows_of(&row), 1);
        let across: Vec<[f32; 2]> = row.iter().flat_map(|&[x, _]| [[x, 0.0], [x, 22.0]]).collect();
        assert_eq!(rows_of(&across), 2);
        assert_eq!(rows_of(&[[0.0, 0.0], [13.0, 0.0], [0.0, -40.0]]), 3);
        assert_eq!(rows_of(&[[5.0, 5.0]; 100]), 1);
    }
}
