//! What the processor takes of a frame beside the graphics card.

use super::least_squares::{LeastSquares, dot};

/// Learns what the processor takes of frames whose time on the graphics card is known: for the
/// frame, for each draw call and for what is uploaded.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HostTime {
    prices: [f64; 3],
    frames: LeastSquares<3>,
}

impl HostTime {
    /// Expects these prices until frames tell otherwise, which count as `prior` squares of terms.
    pub fn new(expected: [f64; 3], prior: f64) -> Self {
        Self { prices: expected, frames: LeastSquares::new(expected, prior) }
    }

    /// Milliseconds of a frame, a draw call and an uploaded byte, in the units of the terms.
    pub fn prices(&self) -> [f64; 3] {
        self.prices
    }

    /// Milliseconds.
    pub fn ms(&self, terms: [f64; 3]) -> f64 {
        dot(&self.prices, &terms)
    }

    /// A frame took `ms` beside the card's time; frames before it keep this part of their weight.
    pub fn observe(&mut self, terms: [f64; 3], ms: f64, weight: f64, kept: f64) {
        self.frames.observe(&terms, ms, weight, kept);
        self.frames.fit(&mut self.prices);
    }
}
