//! Seeded randomness: integers only, so that every machine draws the same. Not for cryptography.

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection that mixes all bits.
pub fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number for a seed and two keys, without state: neighbours may be drawn in any order.
pub fn hash(seed: u64, a: u64, b: u64) -> u64 {
    mix(mix(seed ^ a.wrapping_mul(0xd6e8_feb8_6659_fd93)) ^ b)
}

/// The upper 53 bits as a number in [0, 1).
pub fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// A sequence of numbers.
pub struct Random(u64);

impl Random {
    /// A sequence of its own for each seed and stream.
    pub fn new(seed: u64, stream: u64) -> Self {
        Self(hash(seed, stream, 0x5eed))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        unit(self.bits())
    }

    /// A number in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// An index below `count`, which is not 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// One of several, of which there is at least one.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// A whole number in [low, high], both included.
    pub fn whole(&mut self, low: u32, high: u32) -> u32 {
        let span = u64::from(high - low) + 1;
        low + (self.bits() % span) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_in_their_ranges_and_differ() {
        let mut random = Random::new(7, 3);
        let drawn: Vec<f64> = (0..1000).map(|_| random.between(-2.0, 3.0)).collect();
        assert!(drawn.iter().all(|x| (-2.0..3.0).contains(x)));
        let mean = drawn.iter().sum::<f64>() / 1000.0;
        assert!((mean - 0.5).abs() < 0.2, "mean {mean}");
        let mut seen = [false; 5];
        (0..200).for_each(|_| seen[random.whole(0, 4) as usize] = true);
        assert_eq!(seen, [true; 5]);
        assert_ne!(Random::new(7, 3).bits(), Random::new(7, 4).bits());
        assert_ne!(Random::new(7, 3).bits(), Random::new(8, 3).bits());
    }
}
