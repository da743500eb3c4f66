//! Points of a surface, spread evenly by area.

use glam::Vec3;

use super::bvh::Bvh;
use super::searchable_surface::SearchableSurface;
use crate::builder::constants::MeasureConstants;

/// Points of one mesh, each for as much area as any other, in the order of the leaves of its
/// tree: neighbours in the list are neighbours in space.
#[derive(Debug)]
pub(super) struct Samples {
    pub points: Vec<Vec3>,
    pub area: f64,
}

impl Samples {
    pub fn of(bvh: &Bvh, constants: &MeasureConstants) -> Self {
        let lanes = || {
            let leaves = bvh.leaves.iter().zip(&bvh.counts);
            leaves.flat_map(|(leaf, &count)| (0..usize::from(count)).map(|lane| leaf.lane(lane)))
        };
        let area: f64 = lanes().map(|triangle| triangle.area()).sum();
        let count = constants.points;
        let step = area / count as f64;
        let mut points = Vec::with_capacity(count + 1);
        if !(step > 0.0 && step.is_finite()) {
            return Self { points, area: 0.0 };
        }
        let mut passed = 0.0;
        for triangle in lanes() {
            passed += triangle.area();
            while (points.len() as f64 + 0.5) * step < passed && points.len() < count {
                points.push(point_of(triangle.corners(), points.len()));
            }
        }
        Self { points, area }
    }
}

impl SearchableSurface {
    /// Points from each part, as many as its area asks for; none where there is no area.
    pub(super) fn samples(&self) -> Vec<Vec3> {
        let area: f64 = self.parts.iter().map(|part| part.samples.area).sum();
        let count = self.constants.points;
        let step = area / count as f64;
        if !(step > 0.0 && step.is_finite()) {
            return Vec::new();
        }
        let mut chosen = Vec::with_capacity(count);
        let mut passed = 0.0;
        for samples in self.parts.iter().map(|part| &part.samples) {
            let begin = passed;
            passed += samples.area;
            loop {
                let at = (chosen.len() as f64 + 0.5) * step;
                if at >= passed || chosen.len() == count || samples.points.is_empty() {
                    break;
                }
                let index = (at - begin) / samples.area * samples.points.len() as f64;
                chosen.push(samples.points[(index as usize).min(samples.points.len() - 1)]);
            }
        }
        chosen
    }
}

/// A point of a triangle: with successive numbers, points fill it evenly.
pub fn point_of([a, b, c]: [Vec3; 3], number: usize) -> Vec3 {
    let [u, v] = spread(number);
    a + (b - a) * u + (c - a) * v
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
    use super::super::tests::{mesh, surface_of};
    use super::*;

    #[test]
    fn points_lie_on_triangles_by_their_areas() {
        let mesh = mesh(
            &[[0.0; 3], [6.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]],
            &[[0, 1, 2], [2, 3, 4], [0, 1, 0]],
        );
        let points = surface_of(&mesh).samples();
        let count = MeasureConstants::default().points;
        assert!(points.len().abs_diff(count) <= 1);
        let of_first = points.iter().filter(|p| p.x / 6.0 + p.y <= 1.0 + 1e-6).count();
        assert!(of_first.abs_diff(count * 6 / 7) <= 1, "{of_first}");
        // As many in the half beside the corner as its area is: an eighth beside each.
        let near = points.iter().filter(|p| p.x / 6.0 + p.y < 0.5).count();
        assert!(near.abs_diff(of_first / 4) <= 4, "{near} of {of_first}");
    }
}
