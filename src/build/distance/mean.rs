//! The mean distance between a mesh and several others, to choose among them.

use glam::Vec3;

use super::grid::TriangleGrid;
use crate::mesh::Mesh;

/// Points in each direction, spread by area.
const POINTS: usize = 512;

/// A mesh that others are compared with.
pub struct MeanDistance<'a> {
    mesh: &'a Mesh,
    /// What others are measured to, and from where; made when first needed.
    grid: Option<(TriangleGrid, Vec<Vec3>)>,
}

impl<'a> MeanDistance<'a> {
    /// Of distances from this mesh.
    pub fn from(mesh: &'a Mesh) -> Self {
        Self { mesh, grid: None }
    }

    /// The mean distance from each of the two meshes to the other, added up, metres; infinite
    /// where one has no surface. Unlike the largest distance it tells a mesh that lost a lamp post
    /// from one that is bent all over. Once it is clear that it exceeds `limit`, some number above
    /// that.
    pub fn to(&mut self, other: &Mesh, limit: f64) -> f64 {
        let (grid, points) = self
            .grid
            .get_or_insert_with(|| (TriangleGrid::new(self.mesh), points_by_area(self.mesh)));
        let others_points = points_by_area(other);
        if points.is_empty() || others_points.is_empty() {
            return f64::INFINITY;
        }
        let there = mean(points, &TriangleGrid::new(other), limit);
        if there > limit {
            return there;
        }
        there + mean(&others_points, grid, limit - there)
    }
}

fn mean(points: &[Vec3], grid: &TriangleGrid, limit: f64) -> f64 {
    let count = points.len() as f64;
    let mut sum = 0.0;
    for &point in points {
        sum += f64::from(grid.distance_beyond(point, 0.0));
        if sum > limit * count {
            break;
        }
    }
    sum / count
}

/// As many points in equal areas; none where there is no area.
fn points_by_area(mesh: &Mesh) -> Vec<Vec3> {
    let step = mesh.area() / POINTS as f64;
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    let mut points = Vec::with_capacity(POINTS + 1);
    let mut passed = 0.0;
    for &triangle in &mesh.triangles {
        passed += mesh.triangle_area(triangle);
        while (points.len() as f64 + 0.5) * step < passed {
            let [u, v] = spread(points.len());
            let [a, b, c] = triangle.map(|v| Vec3::from(mesh.positions[v as usize]));
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

/// Barycentric coordinates that fill a triangle evenly one after the other: the additive
/// recurrence of the plastic number (Roberts 2018, "The unreasonable effectiveness of quasirandom
/// sequences"), folded along the diagonal of the square.
fn spread(number: usize) -> [f32; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let [u, v] = STEPS.map(|step| ((number as f64 + 0.5) * step).fract() as f32);
    if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }
}

#[cfg(test)]
mod tests {
    use super::super::tests::mesh;
    use super::*;

    #[test]
    fn points_lie_on_triangles_by_their_areas() {
        let mesh = mesh(
            &[[0.0; 3], [6.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]],
            &[[0, 1, 2], [2, 3, 4], [0, 1, 0]],
        );
        let points = points_by_area(&mesh);
        assert!(points.len().abs_diff(POINTS) <= 1);
        let of_first = points.iter().filter(|p| p.x / 6.0 + p.y <= 1.0 + 1e-6).count();
        assert!(of_first.abs_diff(POINTS * 6 / 7) <= 1, "{of_first}");
        // As many in the half beside the corner as its area is: an eighth beside each.
        let near = points.iter().filter(|p| p.x / 6.0 + p.y < 0.5).count();
        assert!(near.abs_diff(of_first / 4) <= 4, "{near} of {of_first}");
    }

    #[test]
    fn means_are_those_of_both_directions() {
        let square = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
        let flat = mesh(&square, &[[0, 1, 2], [0, 2, 3]]);
        let lifted = mesh(&square.map(|[x, y, _]| [x, y, 0.5]), &[[0, 1, 2], [0, 2, 3]]);
        let mut from = MeanDistance::from(&flat);
        assert_eq!(from.to(&flat, f64::INFINITY), 0.0);
        let apart = from.to(&lifted, f64::INFINITY);
        assert!((apart - 1.0).abs() < 1e-6, "{apart}");
        assert!(from.to(&lifted, 0.3) > 0.3);
        // Half of it is there: what is missing is 0 to 4 / √2 away, 4 / (3 √2) on average.
        let half = mesh(&square, &[[0, 1, 2]]);
        let apart = from.to(&half, f64::INFINITY);
        let expected = 0.5 * 4.0 / (3.0 * 2f64.sqrt());
        assert!((apart / expected - 1.0).abs() < 0.02, "{apart} {expected}");
        assert_eq!(from.to(&Mesh::default(), f64::INFINITY), f64::INFINITY);
    }
}
