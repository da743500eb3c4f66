//! Parts of which simplification leaves nothing.
//!
//! A shed of twelve triangles in the middle of a field is little by its area, and all measures that
//! simplification goes by; but who stands before it misses it, and the error of its whole node is
//! the distance to what is left. So those of which nothing is left for a while around are given
//! back.

use glam::DVec3;

use super::fallback::fallback_triangles;
use super::parts::{Part, parts};
use super::simplified::Simplified;
use crate::mesh::{Mesh, Surface, wide};

/// What is given back of a part: all of a box.
const TRIANGLES: usize = 12;

/// Gives `simplified` those parts of its `source` back that are farther than `reach` metres from
/// all that is left, the farthest first, as long as it then has at most `limit` triangles. What
/// has `locked` vertices is never gone.
pub fn keep_far_parts(
    simplified: &mut Simplified,
    source: &Simplified,
    locked: &[bool],
    reach: f64,
    limit: usize,
) {
    let is_free = |part: &Part| !part.triangles.iter().flatten().any(|&v| locked[v as usize]);
    let parts = parts(&source.mesh);
    if parts.len() < 2 || simplified.mesh.triangles.is_empty() {
        return;
    }
    let left = Surface::new(
        simplified.mesh.positions.iter().map(|&position| wide(position)).collect(),
        simplified.mesh.triangles.clone(),
    );
    let mut far: Vec<(f64, DVec3, Part)> = Vec::new();
    for part in parts.into_iter().filter(is_free) {
        let place = place(&source.mesh, &part);
        let distance = left.distance(place);
        if distance > reach {
            far.push((distance, place, part));
        }
    }
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut given_back: Vec<DVec3> = Vec::new();
    for (_, place, Part { triangles, .. }) in far {
        let fits = simplified.mesh.triangles.len() + triangles.len().min(TRIANGLES) <= limit;
        if fits && given_back.iter().all(|other| other.distance(place) > reach) {
            given_back.push(place);
            let part = Mesh { triangles, ..source.mesh.clone() };
            let part = fallback_triangles(&part, &source.border, TRIANGLES);
            simplified.append(part.mesh, part.border);
        }
    }
}

/// The middle of a part's largest triangle.
fn place(mesh: &Mesh, part: &Part) -> DVec3 {
    let area = |triangle: &[u32; 3]| mesh.triangle_area(*triangle);
    let largest = part.triangles.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
    largest.map_or(DVec3::ZERO, |&triangle| {
        let [a, b, c] = mesh.corners(triangle);
        (a + b + c) / 3.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::border::vertex::Border;
    use crate::builder::simplify::simplified::LadderStep;

    /// Small triangles at places along X.
    fn triangles_at(places: &[f32]) -> Simplified {
        let mut mesh = Mesh::default();
        for &x in places {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh.materials = vec![0; mesh.positions.len()];
        let border = Border::interior(mesh.positions.len());
        Simplified { mesh, border, error: 0.0, step: LadderStep::Collapse }
    }

    #[test]
    fn the_farthest_parts_come_back_and_what_is_near_them_or_others_does_not() {
        let source = triangles_at(&[0.0, 5.0, 40.0, 44.0, 90.0, 140.0]);
        let kept = |locked: &[usize], limit: usize| -> Vec<f32> {
            let mut simplified = triangles_at(&[0.0]);
            let locked: Vec<bool> = (0..18).map(|vertex| locked.contains(&vertex)).collect();
            keep_far_parts(&mut simplified, &source, &locked, 10.0, limit);
            assert_eq!(simplified.border.planes.len(), simplified.mesh.positions.len());
            let Mesh { positions, triangles, .. } = &simplified.mesh;
            triangles.iter().map(|t| positions[t[0] as usize][0]).collect()
        };
        assert_eq!(kept(&[], 9), [0.0, 140.0, 90.0, 44.0]);
        assert_eq!(kept(&[], 3), [0.0, 140.0, 90.0]);
        assert_eq!(kept(&[15], 9), [0.0, 90.0, 44.0]);
    }
}
