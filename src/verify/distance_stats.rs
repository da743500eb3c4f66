//! Distances added up: mean, root mean square, maximum.

/// Distances of samples. Sums are added up in a fixed order, so that sums do not depend on
/// threads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DistanceStats {
    count: u64,
    sum: f64,
    squares: f64,
    max: f64,
}

impl DistanceStats {
    /// Counts a sample that was drawn by area.
    pub fn add(&mut self, distance: f64) {
        self.count += 1;
        self.sum += distance;
        self.squares += distance * distance;
        self.reach(distance);
    }

    /// Counts a vertex: only for the maximum, since vertices are not spread by area.
    pub fn reach(&mut self, distance: f64) {
        self.max = self.max.max(distance);
    }

    /// Counts samples that are known to be at no distance.
    pub fn add_zeros(&mut self, count: u64) {
        self.count += count;
    }

    /// Takes over all of another.
    pub fn extend(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
        self.reach(other.max);
    }

    /// Samples drawn by area.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean distance, metres; 0 without samples.
    pub fn mean(&self) -> f64 {
        if self.count > 0 { self.sum / self.count as f64 } else { 0.0 }
    }

    /// Root mean square, metres; 0 without samples.
    pub fn rms(&self) -> f64 {
        if self.count > 0 { (self.squares / self.count as f64).sqrt() } else { 0.0 }
    }

    /// The largest distance, metres.
    pub fn max(&self) -> f64 {
        self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_the_maximum_are_kept() {
        let mut one = DistanceStats::default();
        one.add(3.0);
        one.reach(5.0);
        let mut other = DistanceStats::default();
        other.add(1.0);
        other.add_zeros(2);
        one.extend(&other);
        assert_eq!((one.count(), one.mean(), one.max()), (4, 1.0, 5.0));
        assert_eq!(one.rms(), (10f64 / 4.0).sqrt());
        assert_eq!(DistanceStats::default().rms(), 0.0);
    }
}
