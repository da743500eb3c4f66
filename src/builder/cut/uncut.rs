//! Bodies that a cut leaves whole.
//!
//! A house that a plane cuts in two costs both halves a border, which every level keeps, and skirts
//! along it; a city of separate houses spends half its coarse triangles so. Any labelling of
//! vertices gives two chunks that fit together ([`crate::builder::cut::split`]), so small separate bodies go to one
//! side as they are.

use rustc_hash::FxHashMap;

use crate::builder::constants::CutConstants;
use crate::mesh::{Coordinate, DisjointSet, Mesh, PositionKey, key};

/// Bodies up to this size stay whole.
#[derive(Clone, Copy, Debug, Default)]
pub struct WholeComponents {
    /// The most that they extend across the plane, metres; 0 where all are cut.
    pub extent: f64,
    /// The most triangles that they have.
    pub triangles: usize,
}

/// What is known of a body.
#[derive(Clone, Copy)]
struct Body {
    low: f64,
    high: f64,
    triangles: usize,
    /// It goes on beyond where one that may stay whole can be.
    open: bool,
}

impl WholeComponents {
    /// Those small beside slabs of `width` metres, with so many triangles at most.
    pub fn in_slabs(width: f64, triangles: usize, constants: &CutConstants) -> Self {
        Self { extent: width * constants.uncut, triangles }
    }

    /// The vertices of bodies that the plane through `coordinate` would cut and that stay whole,
    /// with the side of each: true above.
    pub fn sides<C: Coordinate>(
        self,
        mesh: &Mesh<C>,
        axis: usize,
        coordinate: C,
    ) -> Vec<(u32, bool)> {
        let at = |vertex: u32| mesh.positions[vertex as usize][axis].wide() - coordinate.wide();
        let crosses = |triangle: &[u32; 3]| {
            let along = triangle.map(at);
            along.iter().any(|&at| at < 0.0) && along.iter().any(|&at| at > 0.0)
        };
        if self.extent <= 0.0 || !mesh.triangles.iter().any(crosses) {
            return Vec::new();
        }
        // All vertices of such a body are so near to the plane.
        const FAR: u32 = u32::MAX;
        let mut numbers: FxHashMap<PositionKey<C>, u32> = FxHashMap::default();
        let number_of: Vec<u32> = (0..mesh.positions.len() as u32)
            .map(|vertex| {
                if at(vertex).abs() > self.extent {
                    return FAR;
                }
                let next = numbers.len() as u32;
                *numbers.entry(key(mesh.positions[vertex as usize])).or_insert(next)
            })
            .collect();
        let near = |triangle: &[u32; 3]| {
            let numbers = triangle.map(|vertex| number_of[vertex as usize]);
            numbers.into_iter().find(|&number| number != FAR)
        };
        let mut connected = DisjointSet::new(numbers.len());
        for triangle in &mesh.triangles {
            let Some(first) = near(triangle) else { continue };
            for number in triangle.map(|vertex| number_of[vertex as usize]) {
                if number != FAR {
                    connected.join(first, number);
                }
            }
        }
        let empty = Body { low: f64::INFINITY, high: f64::NEG_INFINITY, triangles: 0, open: false };
        let mut bodies = vec![empty; numbers.len()];
        for triangle in &mesh.triangles {
            let Some(first) = near(triangle) else { continue };
            let body = &mut bodies[connected.root(first) as usize];
            body.triangles += 1;
            for vertex in *triangle {
                body.low = body.low.min(at(vertex));
                body.high = body.high.max(at(vertex));
                body.open |= number_of[vertex as usize] == FAR;
            }
        }
        let stays = |body: &Body| {
            let cut = body.low < 0.0 && body.high > 0.0;
            let small = body.high - body.low <= self.extent && body.triangles <= self.triangles;
            cut && small && !body.open
        };
        (0..)
            .zip(number_of)
            .filter(|&(_, number)| number != FAR)
            .filter_map(|(vertex, number)| {
                let body = bodies[connected.root(number) as usize];
                stays(&body).then_some((vertex, body.low + body.high > 0.0))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles along x from `low` to `high`, whose chunks share no vertex but lie at
    /// the same places.
    fn strip(mesh: &mut Mesh, low: i32, high: i32, y: f32) {
        for x in low..high {
            let first = mesh.positions.len() as u32;
            let [x, next] = [x as f32, (x + 1) as f32];
            mesh.positions.extend([[x, y, 0.0], [next, y, 0.0], [x, y + 1.0, 0.0]]);
            mesh.positions.push([next, y + 1.0, 0.0]);
            mesh.triangles
                .extend([[first, first + 1, first + 2], [first + 1, first + 3, first + 2]]);
        }
    }

    #[test]
    fn small_bodies_go_to_the_side_where_most_of_them_is() {
        let mut mesh = Mesh::default();
        strip(&mut mesh, -3, 1, 0.0);
        strip(&mut mesh, -1, 3, 5.0);
        strip(&mut mesh, -8, 8, 10.0);
        strip(&mut mesh, 1, 3, 15.0);
        let sides = |extent, triangles, at: f32| {
            let found = WholeComponents { extent, triangles }.sides(&mesh, 0, at);
            let of = |low: f32| {
                let mut sides: Vec<bool> = found
                    .iter()
                    .filter(|(vertex, _)| (mesh.positions[*vertex as usize][1] - low).abs() < 2.0)
                    .map(|side| side.1)
                    .collect();
                assert!(sides.is_empty() || sides.len().is_multiple_of(4), "whole squares");
                sides.dedup();
                assert!(sides.len() < 2, "all of a body on one side");
                sides.first().copied()
            };
            [of(0.0), of(5.0), of(10.0), of(15.0)]
        };
        assert_eq!(sides(4.0, 100, 0.25), [Some(false), Some(true), None, None]);
        assert_eq!(sides(3.9, 100, 0.25), [None; 4], "too large");
        assert_eq!(sides(4.0, 7, 0.25), [None; 4], "too many triangles");
        assert_eq!(sides(4.0, 100, 0.0), [None; 4], "no triangle is cut");
        assert_eq!(sides(16.0, 100, 0.25)[2], Some(false));
        assert_eq!(sides(0.0, 100, 0.25), [None; 4]);
    }
}
