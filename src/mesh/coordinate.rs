//! Coordinates: f64 while a file is divided into blocks, f32 offsets inside a block.

use std::fmt::Debug;
use std::hash::{Hash, Hasher};

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

    #[inline]
    fn wide(self) -> f64 {
        f64::from(self)
    }

    #[inline]
    fn narrow(wide: f64) -> Self {
        wide as f32
    }

    #[inline]
    fn bits(self) -> u32 {
        // Adding 0 turns -0 into 0; flipping orders negative numbers before positive ones.
        let bits = (self + 0.0).to_bits();
        if bits >> 31 == 0 { bits ^ (1 << 31) } else { !bits }
    }
}

impl Coordinate for f64 {
    type Bits = u64;

    #[inline]
    fn wide(self) -> f64 {
        self
    }

    #[inline]
    fn narrow(wide: f64) -> Self {
        wide
    }

    #[inline]
    fn bits(self) -> u64 {
        let bits = (self + 0.0).to_bits();
        if bits >> 63 == 0 { bits ^ (1 << 63) } else { !bits }
    }
}

/// The key of a position: equal positions have equal keys, and keys order by x, then y, then z.
pub type PositionKey<C> = Key<<C as Coordinate>::Bits>;

/// See [`PositionKey`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key<B>([B; 3]);

impl<B: Hash> Hash for Key<B> {
    /// As three numbers: an array is hashed as so many bytes, which takes several times as long.
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.iter().for_each(|bits| bits.hash(state));
    }
}

/// See [`PositionKey`].
#[inline]
pub fn key<C: Coordinate>(position: [C; 3]) -> PositionKey<C> {
    let [x, y, z] = position;
    Key([x.bits(), y.bits(), z.bits()])
}

/// A number that is the same for equal texture coordinates.
#[inline]
pub fn texcoord_key([u, v]: [f32; 2]) -> u64 {
    // Adding 0 turns -0 into 0.
    u64::from((u + 0.0).to_bits()) << 32 | u64::from((v + 0.0).to_bits())
}

/// A number that is the same for equal colours.
#[inline]
pub fn color_key(color: [u16; 4]) -> u64 {
    color.iter().fold(0, |key, &channel| key << 16 | u64::from(channel))
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
