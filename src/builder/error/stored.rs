//! What a node stores of its error.

use super::SurfaceError;

impl SurfaceError {
    /// The same of an original that is itself so many metres off the source at most.
    pub fn plus(self, moved: f64) -> Self {
        let Self { bound, mean, rms, p95 } = self;
        Self { bound: bound + moved, mean: mean + moved, rms: rms + moved, p95: p95 + moved }
    }

    /// With the bound of another where that is larger: bounds never shrink towards the root.
    pub fn at_least(self, other: &Self) -> Self {
        Self { bound: self.bound.max(other.bound), ..self }
    }
}
