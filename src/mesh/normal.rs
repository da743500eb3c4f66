//! Unit normals in 32 bits.

use glam::DVec3;

/// A unit vector as two 16-bit octahedral coordinates, or none.
///
/// The encoding is `oct32` of Cigolle and others, "A Survey of Efficient Representations for
/// Independent Unit Vectors", 2014. It is off by 0.004° at most, and exact along the axes.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    bytemuck::Pod,
    bytemuck::Zeroable,
)]
#[repr(transparent)]
pub struct Normal(u32);

/// The largest coordinate, which encodes 1; coordinates are stored with 2^15 added, so that 0 is free.
const MOST: f64 = 32767.0;

/// The largest component of a normal of 8 bits, which encodes 1.
const MOST_8_BITS: f64 = 127.0;

impl Normal {
    /// No normal.
    pub const NONE: Self = Self(0);

    /// The normal along a vector of any length; none along a vector that is zero or not finite.
    pub fn along(vector: DVec3) -> Self {
        let largest = vector.abs().max_element();
        if !(vector.is_finite() && largest > 0.0) {
            return Self::NONE;
        }
        let [x, y, z] = (vector / largest).to_array();
        let sum = x.abs() + y.abs() + z.abs();
        let (x, y) = (x / sum, y / sum);
        let sign = |value: f64| if value < 0.0 { -1.0 } else { 1.0 };
        let folded = match z < 0.0 {
            true => [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)],
            false => [x, y],
        };
        let [mut u, mut v] = folded.map(|part| (part * MOST).round() as i32);
        // Points that mirror each other on an edge of the square are one vector.
        if v.abs() == MOST as i32 {
            u = u.abs();
        }
        if u.abs() == MOST as i32 {
            v = v.abs();
        }
        let [u, v] = [u, v].map(|part| (part + (1 << 15)) as u32);
        Self(u << 16 | v)
    }

    /// The unit vector; `None` without a normal.
    pub fn vector(self) -> Option<DVec3> {
        if self == Self::NONE {
            return None;
        }
        let part = |bits: u32| (f64::from(bits) - 32768.0) / MOST;
        let (u, v) = (part(self.0 >> 16), part(self.0 & 0xFFFF));
        let z = 1.0 - u.abs() - v.abs();
        let sign = |value: f64| if value < 0.0 { -1.0 } else { 1.0 };
        let vector = match z < 0.0 {
            true => DVec3::new((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v), z),
            false => DVec3::new(u, v, z),
        };
        Some(vector.normalize())
    }

    /// Components in 127ths, for vertices of 8 bits. Zero without a normal.
    pub fn to_8_bits(self) -> [i8; 3] {
        self.vector().unwrap_or_default().to_array().map(|part| (part * MOST_8_BITS).round() as i8)
    }

    /// A normal that 8 bits hold: [`Self::to_8_bits`] of it gives back the components that it has.
    ///
    /// Components in 127ths are not quite a unit vector; their direction may round to others. It is
    /// rounded until it stays.
    pub fn rounded_to_8_bits(self) -> Self {
        let mut rounded = self;
        for _ in 0..8 {
            let next = Self::along(DVec3::from(rounded.to_8_bits().map(f64::from)));
            if next == rounded {
                break;
            }
            rounded = next;
        }
        rounded
    }

    /// The number of a set of normals, which a vertex has in place of its normal while its mesh is
    /// simplified.
    pub(crate) fn of_set(number: usize) -> Self {
        Self(number as u32 + 1)
    }

    /// The number of a vertex's set of normals; `None` without one.
    pub(crate) fn set_number(self) -> Option<usize> {
        (self != Self::NONE).then(|| self.0 as usize - 1)
    }

    /// True within an angle whose cosine this is; false where one of the two is none.
    pub fn is_within(self, other: Self, cosine: f64) -> bool {
        self == other && self != Self::NONE
            || self.vector().zip(other.vector()).is_some_and(|(a, b)| a.dot(b) >= cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn directions() -> impl Iterator<Item = DVec3> {
        let mut random = Random::new(7, 0);
        (0..20_000).map(move |_| DVec3::from([0; 3].map(|_: i32| random.between(-1.0, 1.0))))
    }

    #[test]
    fn normals_are_off_by_four_thousandths_of_a_degree_at_most() {
        for direction in directions() {
            let normal = Normal::along(direction);
            let vector = normal.vector().unwrap();
            assert!((vector.length() - 1.0).abs() < 1e-12);
            let off = vector.cross(direction.normalize()).length().asin().to_degrees();
            assert!(off < 0.004 && vector.dot(direction) > 0.0, "{direction}: {off}");
            assert_eq!(Normal::along(vector), normal);
        }
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let along = DVec3::AXES[axis] * sign;
                assert_eq!(Normal::along(along * 1e-300).vector(), Some(along));
            }
        }
    }

    #[test]
    fn vectors_without_direction_have_no_normal() {
        for none in [
            DVec3::ZERO,
            DVec3::NAN,
            DVec3::new(0.0, f64::INFINITY, 0.0),
            DVec3::new(0.0, f64::NAN, 1.0),
        ] {
            assert_eq!(Normal::along(none), Normal::NONE);
        }
        assert_eq!(Normal::NONE.vector(), None);
        assert_eq!(Normal::NONE.rounded_to_8_bits(), Normal::NONE);
    }

    #[test]
    fn normals_of_8_bits_stay_what_they_are() {
        for direction in directions() {
            let rounded = Normal::along(direction).rounded_to_8_bits();
            let bits = rounded.to_8_bits();
            assert_eq!(Normal::along(DVec3::from(bits.map(f64::from))), rounded, "{direction}");
            let off = rounded.vector().unwrap().angle_between(direction).to_degrees();
            assert!(off < 0.6, "{direction}: {off}");
        }
    }
}
