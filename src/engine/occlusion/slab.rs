//! Flat pieces of a surface, behind which nothing is seen.

use glam::Vec3;

/// A box about a flat piece of a surface: a rectangle, and how far it reaches across.
///
/// Every line that comes in through one of its two faces and leaves through the other meets the
/// surface, so that nothing is seen along it of what is farther away than the box. No matter how the
/// surface is folded between the faces: its border goes round each of these lines, and does not touch
/// the box (see [`rectangles`](super::rectangles)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slab {
    /// The middle, metres from the node's origin.
    pub middle: Vec3,
    /// From the middle to two sides of the rectangle.
    pub half: [Vec3; 2],
    /// From the middle to the face from which the surface is seen from outside.
    pub half_across: Vec3,
    /// It is drawn from either side.
    pub both_sides: bool,
}

impl Slab {
    /// Square metres.
    pub fn area(&self) -> f32 {
        4.0 * self.half[0].cross(self.half[1]).length()
    }

    /// About the part of a sphere, seen from the middle of it, that a face takes; no more than 1.
    pub fn part_of_view(&self, from_eye: Vec3) -> f32 {
        let [u, v] = self.half;
        let area = 4.0 * u.cross(v);
        let squared = from_eye.length_squared().max(u.length_squared() + v.length_squared());
        (area.dot(from_eye).abs() / (squared * squared.sqrt())).min(1.0)
    }
}
