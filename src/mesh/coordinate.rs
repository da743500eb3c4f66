//! Coordinates: f64 while a file is divided into blocks, f32 offsets inside a block.

use std::fmt::Debug;
use std::hash::Hash;

/// One coordinate of a position.
pub trait Coordinate:
    Copy + Debug + Default + PartialEq + PartialOrd + Send + Sync + 'static
{
    /// Equal for equal coordinates, ordered in a fixed way that is the same everywhere.
    type Bits: Copy + Debug + Eq + Ord + Hash + Send + Sync;

    /// Widened, exactly.
    fn wide(self) -> f64;
    /// Narrowed to the nearest.
    fn narrow(wide: f64) -> Self;
    /// The bits as a key; 0 and -0 have the same.
    fn bits(self) -> Self::Bits;
}

impl Coordinate for f32 {
    type Bits = u32;

    fn wide(self) -> f64 {
        f64::from(self)
    }

    fn narrow(wide: f64) -> Self {
        wide as f32
    }

    fn bits(self) -> u32 {
        // Adding 0 turns -0 into 0; flipping orders negative numbers before positive ones.
        let bits = (self + 0.0).to_bits();
        if bits >> 31 == 0 { bits ^ (1 << 31) } else { !bits }
    }
}

impl Coordinate for f64 {
    type Bits = u64;

    fn wide(self) -> f64 {
        self
    }

    fn narrow(wide: f64) -> Self {
        wide
    }

    fn bits(self) -> u64 {
        let bits = (self + 0.0).to_bits();
        if bits >> 63 == 0 { bits ^ (1 << 63) } else { !bits }
    }
}

/// The key of a position: equal positions have equal keys, and keys order by x, then y, then z.
pub type PositionKey<C> = [<C as Coordinate>::Bits; 3];

/// See [`PositionKey`].
pub fn key<C: Coordinate>(position: [C; 3]) -> PositionKey<C> {
    position.map(Coordinate::bits)
}

/// A position widened to f64.
pub fn wide<C: Coordinate>(position: [C; 3]) -> glam::DVec3 {
    glam::DVec3::from(position.map(Coordinate::wide))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_as_numbers_do_and_zero_has_one_key() {
        let numbers = [f32::NEG_INFINITY, -2.5, -1e-30, 0.0, 1e-30, 2.5, f32::INFINITY];
        for pair in numbers.windows(2) {
            assert!(pair[0].bits() < pair[1].bits(), "{pair:?}");
            assert!(pair[0].wide().bits() < pair[1].wide().bits(), "{pair:?}");
        }
        assert_eq!(0f32.bits(), (-0f32).bits());
        assert_eq!(0f64.bits(), (-0f64).bits());
    }
}
