//! What a node stores of its error.

/// How far two surfaces are apart, metres, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceError {
    /// No point of one surface is farther from the other (an upper bound of the Hausdorff
    /// distance). 0 where they are equal to within a tenth of what rounding coordinates to f32 does.
    pub bound: f64,
    /// Of points of both surfaces, evenly spread by area, half of them of each: the mean distance.
    pub mean: f64,
    /// Of the same points: the root of the mean squared distance.
    pub rms: f64,
    /// Of the same points: 95 of 100 are not farther.
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
