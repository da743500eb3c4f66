//! The mean distance between a mesh and several others, to choose among them.

use glam::Vec3;

use super::searchable_surface::{Search, SearchableSurface};
use crate::builder::constants::MeasureConstants;
use crate::mesh::Mesh;

/// A mesh that others are compared with.
pub struct MeanDistance {
    /// Others are measured to this surface.
    surface: SearchableSurface,
    /// Sample points of the mesh.
    points: Vec<Vec3>,
    constants: MeasureConstants,
}

impl MeanDistance {
    /// Of distances from this mesh.
    pub fn from(mesh: &Mesh, constants: MeasureConstants) -> Self {
        let surface = SearchableSurface::of_points(mesh, constants);
        let points = surface.samples();
        Self { surface, points, constants }
    }

    /// The mean distance from each of the two meshes to the other, added up, metres; infinite
    /// where one has no surface. Unlike the largest distance it tells a mesh that lost a lamp post
    /// from one that is bent all over. Once it is clear that it exceeds `limit`, some number above
    /// that.
    pub fn to(&self, other: &Mesh, limit: f64) -> f64 {
        let other = Self::from(other, self.constants);
        if self.points.is_empty() || other.points.is_empty() {
            return f64::INFINITY;
        }
        let there = mean(&self.points, &other.surface, limit);
        if there > limit {
            return there;
        }
        there + mean(&other.points, &self.surface, limit - there)
    }
}

fn mean(points: &[Vec3], surface: &SearchableSurface, limit: f64) -> f64 {
    let mut search = Search::new(surface);
    let count = points.len() as f64;
    let mut sum = 0.0;
    for &point in points {
        sum += f64::from(search.nearest(point, 0.0).squared).sqrt();
        if sum > limit * count {
            break;
        }
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::super::tests::mesh;
    use super::*;

    #[test]
    fn means_are_those_of_both_directions() {
        let square = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
        let flat = mesh(&square, &[[0, 1, 2], [0, 2, 3]]);
        let lifted = mesh(&square.map(|[x, y, _]| [x, y, 0.5]), &[[0, 1, 2], [0, 2, 3]]);
        let from = MeanDistance::from(&flat, MeasureConstants::default());
        assert!(from.to(&flat, f64::INFINITY) < 1e-6);
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
