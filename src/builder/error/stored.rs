//! What a node stores of its error.

/// The two-sided distance between two surfaces, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceError {
    /// No point of one surface is farther from the other (an upper bound of the Hausdorff
    /// distance). 0 where they are equal to within a tenth of what rounding coordinates to f32 does.
    pub bound: f64,
    /// Mean distance of points spread evenly by area, half of them on each surface.
    pub mean: f64,
    /// Root mean square of the same distances.
    pub rms: f64,
    /// 95th percentile of the same distances.
    pub p95: f64,
}

impl SurfaceError {
    /// All of a surface is so many metres off.
    pub fn everywhere(metres: f64) -> Self {
        Self { bound: metres, mean: metres, rms: metres, p95: metres }
    }

    /// The same of a surface that is itself so far off the source (the triangle inequality).
    pub fn plus(self, off: &Self) -> Self {
        let bound = self.bound + off.bound;
        let [mean, rms, p95] =
            [self.mean + off.mean, self.rms + off.rms, self.p95 + off.p95].map(|e| e.min(bound));
        Self { bound, mean, rms, p95 }
    }
}
