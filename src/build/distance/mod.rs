//! The distance between a mesh and its simplification, measured, both ways.
//!
//! The Hausdorff distance obeys the triangle inequality, so the distances between a node and its
//! children's meshes, summed down to the leaves, bound the distance to the original.
//!
//! It is measured at all vertices of both meshes, and on sides and triangles wherever what is
//! known does not exclude that some point there is more than twice as far (`farthest`):
//! [`ALLOWANCE`] then makes the result a bound. Where a surface comes back so exactly, or so bent,
//! that this would take too many divisions, what is left is covered by likelihood alone.

mod farthest;
mod grid;
mod mean;
mod triangle;

use glam::Vec3;

use self::farthest::farthest;
use self::grid::TriangleGrid;
pub use self::mean::MeanDistance;
use crate::mesh::Mesh;

/// The measured distance is multiplied by this, since the farthest point of a surface need not be
/// one of those that are measured.
pub const ALLOWANCE: f64 = 2.0;

/// A bound on the two-sided distance between two meshes over the same surface, metres.
pub fn hausdorff(source: &Mesh, simplified: &Mesh) -> f64 {
    hausdorff_with(source, simplified, 1)
}

/// [`hausdorff`] with so many times as many divisions: for surfaces that come back less exactly.
pub fn hausdorff_with(source: &Mesh, simplified: &Mesh, effort: usize) -> f64 {
    if source.triangles.is_empty() || simplified.triangles.is_empty() {
        return 0.0;
    }
    let rounding = rounding(source).max(rounding(simplified));
    let worst = farthest(source, &TriangleGrid::new(simplified), rounding, effort);
    let worst = farthest(simplified, &TriangleGrid::new(source), worst, effort);
    if worst > rounding { f64::from(worst) * ALLOWANCE } else { 0.0 }
}

/// How far apart rounding may leave equal surfaces.
fn rounding(mesh: &Mesh) -> f32 {
    let (low, high) = mesh.bounds().unwrap_or_default();
    4.0 * f32::EPSILON * Vec3::from(low).abs().max(Vec3::from(high).abs()).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.to_vec(),
            materials: vec![0; positions.len()],
            triangles: triangles.to_vec(),
            ..Default::default()
        }
    }

    #[test]
    fn equal_meshes_are_at_no_distance_and_a_lifted_one_at_its_lift() {
        let square = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
        let flat = mesh(&square, &[[0, 1, 2], [0, 2, 3]]);
        let lifted = mesh(&square.map(|[x, y, _]| [x, y, 0.5]), &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(hausdorff(&flat, &flat), 0.0);
        let distance = hausdorff(&flat, &lifted) / ALLOWANCE;
        assert!((distance - 0.5).abs() < 1e-6, "{distance}");
    }

    /// A hole in the middle of a triangle whose corners all stay, which no vertex is far from.
    #[test]
    fn what_is_missing_between_kept_vertices_is_found() {
        let square = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, 9.0, 0.0], [0.0, 9.0, 0.0]];
        let whole = mesh(&square, &[[0, 1, 2], [0, 2, 3]]);
        let half = mesh(&square, &[[0, 1, 2]]);
        let farthest = 9.0 * 0.5f64.sqrt();
        for (source, simplified) in [(&whole, &half), (&half, &whole)] {
            let bound = hausdorff(source, simplified);
            assert!(
                bound >= farthest && bound <= farthest * ALLOWANCE + 1e-6,
                "{bound} {farthest}"
            );
        }
    }

    /// A side that leaves the other's outline between vertices that both have.
    #[test]
    fn a_side_across_a_shallow_notch_is_found() {
        let corners = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [10.0, 15.0, 0.0], [7.3, 0.04, 0.0]];
        let notched = mesh(&corners, &[[0, 3, 2], [3, 1, 2]]);
        let straight = mesh(&corners[..3], &[[0, 1, 2]]);
        // From the foot of the notch to the nearer of the notch's two sides.
        let deepest = 0.04 * f64::cos(f64::atan(0.04 / 7.3));
        for (source, simplified) in [(&notched, &straight), (&straight, &notched)] {
            let bound = hausdorff(source, simplified);
            assert!(bound >= deepest && bound <= deepest * ALLOWANCE + 1e-6, "{bound} {deepest}");
        }
    }

    /// Long strips that are divided the other way are no farther for it, and must not take all
    /// effort from a small notch.
    #[test]
    fn a_small_notch_beside_long_strips_is_found() {
        let mut meshes = [Mesh::default(), Mesh::default()];
        let mut add = |corners: &[[f32; 3]], triangles: [&[[u32; 3]]; 2]| {
            for (mesh, triangles) in meshes.iter_mut().zip(triangles) {
                let first = mesh.positions.len() as u32;
                mesh.positions.extend_from_slice(corners);
                mesh.materials.resize(mesh.positions.len(), 0);
                mesh.triangles.extend(triangles.iter().map(|t| t.map(|v| v + first)));
            }
        };
        for strip in 0..100u8 {
            let y = f32::from(strip);
            let corners =
                [[0.0, y, 0.0], [100.0, y, 0.0], [100.0, y + 0.7, 0.0], [0.0, y + 0.7, 0.0]];
            add(&corners, [&[[0, 1, 2], [0, 2, 3]], &[[0, 1, 3], [1, 2, 3]]]);
        }
        let notch = [[0.0, 0.0, 9.0], [2.0, 0.0, 9.0], [1.0, 1.5, 9.0], [0.73, 0.04, 9.0]];
        add(&notch, [&[[0, 3, 2], [3, 1, 2]], &[[0, 1, 2]]]);
        let bound = hausdorff(&meshes[0], &meshes[1]);
        let deepest = 0.04 * f64::cos(f64::atan(0.04 / 0.73));
        assert!(bound >= deepest && bound <= deepest * ALLOWANCE + 1e-6, "{bound} {deepest}");
    }

    #[test]
    fn the_bound_holds_for_points_all_over_both_surfaces() {
        let mut state = 3u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for _ in 0..20 {
            let side = 8u32;
            let positions: Vec<[f32; 3]> = (0..side * side)
                .map(|at| [(at % side) as f32, (at / side) as f32, random() * random()])
                .collect();
            let mut triangles = Vec::new();
            for at in (0..side * (side - 1)).filter(|at| at % side != side - 1) {
                triangles.push([at, at + 1, at + side]);
                triangles.push([at + 1, at + side + 1, at + side]);
            }
            let source = mesh(&positions, &triangles);
            triangles.retain(|_| random() < 0.6);
            let fewer = mesh(&positions, &triangles);
            let bound = hausdorff(&source, &fewer);
            let grid = TriangleGrid::new(&fewer);
            let at_vertices = positions.iter().map(|&p| grid.distance_beyond(p.into(), 0.0));
            let mut farthest = at_vertices.fold(0f32, f32::max);
            for &triangle in &source.triangles {
                let [a, b, c] = triangle.map(|v| Vec3::from(positions[v as usize]));
                for _ in 0..30 {
                    let (u, v) = (random(), random());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let point = a + (b - a) * u + (c - a) * v;
                    farthest = farthest.max(grid.distance_beyond(point, 0.0));
                }
            }
            assert!(f64::from(farthest) <= bound, "{farthest} {bound}");
            assert!(bound <= f64::from(farthest) * ALLOWANCE * 1.1, "{farthest} {bound}");
        }
    }
}
