//! What a node stores of its error.

use super::SurfaceError;

impl SurfaceError {
    /// All of a surface is so many metres off.
    pub fn everywhere(metres: f64) -> Self {
        Self { bound: metres, mean: metres, rms: metres, p95: metres }
    }

    /// The same of an original that is itself so far off the source, at most: of distances, the
    /// triangle inequality.
    pub fn plus(self, off: &Self) -> Self {
        Self {
            bound: self.bound + off.bound,
            mean: self.mean + off.mean,
            rms: self.rms + off.rms,
            p95: self.p95 + off.p95,
        }
    }

    /// With the bound of another where that is larger: bounds never shrink towards the root.
    pub fn at_least(self, other: &Self) -> Self {
        Self { bound: self.bound.max(other.bound), ..self }
    }
}
