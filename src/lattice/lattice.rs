//! The lattice on which source and cut vertices lie, so that f32 offsets are exact.
//!
//! A city at UTM coordinates needs more digits than f32 has, and two nodes that meet at a cutting
//! plane must agree in every bit. So all coordinates of a block are rounded once, in f64, to
//! multiples of a power of two that is fine enough for f32 over the block's extent. From there on
//! a position is an exact f32 offset from the block's origin, whatever the origin is, and every
//! sum and difference of offsets along an axis is exact too.

use crate::lattice::Quantization;

/// Bits of a coordinate: offsets stay below 2^23 steps, so that sums of two are exact in f32.
const OFFSET_BITS: i32 = 23;

/// Rounds coordinates to multiples of `step`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The distance between neighbouring lattice points in metres, a power of two.
    pub step: f64,
}

impl Lattice {
    /// The finest lattice on which boxes of `extent` metres (the longest side) fit, whose
    /// coordinates are as large as `magnitude` metres: finer than f64 itself makes no sense.
    pub fn for_extent(extent: f64, magnitude: f64) -> Self {
        let finest = magnitude.max(f64::MIN_POSITIVE).log2().ceil() as i32 - 52;
        let exponent = extent.max(f64::MIN_POSITIVE).log2().ceil() as i32 - OFFSET_BITS;
        // f32 has no exponent below -126; offsets of 23 bits must stay normal numbers.
        Self { step: 2f64.powi(exponent.max(finest).max(-100)) }
    }

    /// The coarser of two lattices.
    pub fn coarser(self, other: Self) -> Self {
        Self { step: self.step.max(other.step) }
    }

    /// This lattice, or that of a quantised build where it is coarser. Of two powers of two the
    /// larger one's multiples are multiples of the other.
    pub fn or_coarser(self, quantization: Option<Quantization>) -> Self {
        Self { step: quantization.map_or(self.step, |coarse| coarse.step.max(self.step)) }
    }

    /// A coordinate rounded to the lattice.
    pub fn round(&self, coordinate: f64) -> f64 {
        // A power of two: both multiplications are exact.
        (coordinate / self.step).round() * self.step
    }

    /// The lattice point nearest to an offset from an origin on the lattice.
    pub fn nearest(&self, offset: [f32; 3]) -> [f32; 3] {
        // Adding 0 turns -0 into 0.
        offset.map(|coordinate| self.round(coordinate.into()) as f32 + 0.0)
    }

    /// An origin near `point`: on the lattice, and exactly representable in f32, since glTF
    /// stores a node's translation in f32.
    pub fn origin_near(&self, point: [f64; 3]) -> [f64; 3] {
        point.map(|coordinate| {
            let single = f64::from(coordinate as f32);
            // An f32 near zero has digits below the lattice; one far out is a multiple of it.
            self.round(single)
        })
    }

    /// The offset of a source coordinate from the origin, exact in f32.
    pub fn offset(&self, coordinate: f64, origin: f64) -> f32 {
        (self.round(coordinate) - origin) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_exact_at_utm_coordinates() {
        let lattice = Lattice::for_extent(300.0, 5_403_456.0);
        let origin = lattice.origin_near([678_016.123, 5_403_456.789, 412.3]);
        for (coordinate, origin) in
            [(678_100.456, origin[0]), (5_403_400.001, origin[1]), (0.7, origin[2])]
        {
            let offset = lattice.offset(coordinate, origin);
            assert_eq!(origin + f64::from(offset), lattice.round(coordinate));
            assert!((lattice.round(coordinate) - coordinate).abs() <= lattice.step / 2.0);
        }
        assert!(lattice.step < 1e-4);
    }

    #[test]
    fn origins_survive_f32() {
        for magnitude in [1.0, 678_016.3, 5_403_456.789, 1e8] {
            let lattice = Lattice::for_extent(100.0, magnitude);
            for coordinate in lattice.origin_near([magnitude, magnitude / 3.0, 1e-7]) {
                assert_eq!(f64::from(coordinate as f32), coordinate);
                assert_eq!(lattice.round(coordinate), coordinate);
            }
        }
    }

    #[test]
    fn translation_by_a_large_power_of_two_changes_nothing() {
        let near = Lattice::for_extent(64.0, 64.0);
        let far = Lattice::for_extent(64.0, 4_194_304.0);
        assert_eq!(near, far);
        for coordinate in [1.0 / 3.0, 17.25, 63.999] {
            let near_offset = near.offset(coordinate, 0.0);
            let far_offset = far.offset(coordinate + 4_194_304.0, 4_194_304.0);
            assert!((near_offset - far_offset).abs() <= near.step as f32);
        }
    }
}
