//! Parts of which simplification leaves nothing.
//!
//! A shed of twelve triangles in the middle of a field is little by its area, and all measures that
//! simplification goes by; but who stands before it misses it, and the error of its whole node is
//! the distance to what is left. So those of which nothing is left for a while around are given
//! back: as they are if they are few triangles, buildings as extruded footprints, others as their
//! largest triangles.

use glam::DVec3;

use super::aggregate::{Components, Extruded};
use super::compact::with_triangles;
use super::fallback::fallback_triangles;
use super::ladder::Method;
use super::parts::{Part, parts};
use super::simplified::Simplified;
use crate::builder::border::vertex::Border;
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
    method: &Method,
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
        if simplified.mesh.triangles.len() >= limit {
            return;
        }
        if given_back.iter().all(|other| other.distance(place) > reach) {
            let (part, border) = with_triangles(&source.mesh, &source.border, &triangles);
            let (mesh, border) = stand_in(part, border, method);
            if simplified.mesh.triangles.len() + mesh.triangles.len() <= limit {
                given_back.push(place);
                simplified.append(mesh, border);
            }
        }
    }
}

/// What stands for a part.
fn stand_in(part: Mesh, border: Border, method: &Method) -> (Mesh, Border) {
    if part.triangles.len() <= TRIANGLES {
        return (part, border);
    }
    let free = vec![false; part.positions.len()];
    let rules = method.bodies();
    match Components::of(&part, &free, &rules).extruded(&part, TRIANGLES, &rules) {
        Some(Extruded { prisms, rest: [], .. }) => {
            let border = Border::interior(prisms.positions.len());
            (prisms, border)
        }
        _ => {
            let largest = fallback_triangles(&part, &border, TRIANGLES);
            (largest.mesh, largest.border)
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
    use crate::builder::constants::Constants;
    use crate::builder::simplify::collapse::AppearanceWeights;
    use crate::builder::simplify::ladder::Simplifier;
    use crate::builder::simplify::simplified::LadderStep;
    use crate::mesh::UpAxis;

    fn method(constants: &Constants) -> Method<'_> {
        let (simplifier, weights) = (Simplifier::Qem, AppearanceWeights::default());
        Method {
            simplifier,
            weights,
            up: UpAxis::Z,
            reorientable: &[],
            extrudable: &[true],
            without: None,
            constants,
        }
    }

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
            let constants = Constants::default();
            let method = method(&constants);
            keep_far_parts(&mut simplified, &source, &locked, 10.0, limit, &method);
            assert_eq!(simplified.border.planes.len(), simplified.mesh.positions.len());
            let Mesh { positions, triangles, .. } = &simplified.mesh;
            triangles.iter().map(|t| positions[t[0] as usize][0]).collect()
        };
        assert_eq!(kept(&[], 9), [0.0, 140.0, 90.0, 44.0]);
        assert_eq!(kept(&[], 3), [0.0, 140.0, 90.0]);
        assert_eq!(kept(&[15], 9), [0.0, 90.0, 44.0]);
    }

    #[test]
    fn a_building_of_many_triangles_comes_back_as_a_block() {
        // A box of 8 by 6 by 5 m at x = 100, its sides of 4 by 4 quads.
        let mut source = triangles_at(&[0.0]);
        let mesh = &mut source.mesh;
        let side = |mesh: &mut Mesh, at: [f32; 3], along: [f32; 3], up: [f32; 3]| {
            let first = mesh.positions.len() as u32;
            for n in 0..25u8 {
                let (u, v) = (f32::from(n % 5) / 4.0, f32::from(n / 5) / 4.0);
                mesh.positions.push(std::array::from_fn(|i| at[i] + along[i] * u + up[i] * v));
            }
            for n in (0..20).filter(|n| n % 5 < 4).map(|n| first + n) {
                mesh.triangles.extend([[n, n + 1, n + 6], [n, n + 6, n + 5]]);
            }
        };
        let (x, y, z) = ([8.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 5.0]);
        side(mesh, [100.0, 0.0, 0.0], x, z);
        side(mesh, [108.0, 0.0, 0.0], y, z);
        side(mesh, [108.0, 6.0, 0.0], [-8.0, 0.0, 0.0], z);
        side(mesh, [100.0, 6.0, 0.0], [0.0, -6.0, 0.0], z);
        side(mesh, [100.0, 0.0, 5.0], x, y);
        mesh.materials = vec![0; mesh.positions.len()];
        source.border = Border::interior(mesh.positions.len());
        let mut simplified = triangles_at(&[0.0]);
        let constants = Constants::default();
        let free = vec![false; source.mesh.positions.len()];
        keep_far_parts(&mut simplified, &source, &free, 10.0, 20, &method(&constants));
        let part = &simplified.mesh.triangles[1..];
        assert!((8..=TRIANGLES).contains(&part.len()), "{}", part.len());
        let block = Mesh { triangles: part.to_vec(), ..simplified.mesh.clone() };
        // Walls of 28 m by 5 m, and the roof.
        assert!((block.area() - 188.0).abs() < 10.0, "{}", block.area());
    }
}
