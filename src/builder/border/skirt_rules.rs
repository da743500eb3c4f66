//! What decides where skirts are and how far they reach.

use crate::builder::constants::BorderConstants;
use crate::lattice::Lattice;

/// A polyline that is no farther from its edge than this many lattice steps needs no skirt: two sides
/// that both leave theirs out are apart by rounding alone.
const CLOSED_STEPS: f64 = 1.5;

/// A polyline of lattice points along its edge is computed to be no farther from it than this.
const COMPUTED_STEPS: f64 = 1e-6;

/// What decides where skirts are and how far they reach.
#[derive(Clone, Copy, Debug)]
pub struct SkirtRules {
    /// Skirts reach beyond what they cover by some of these, metres.
    pub step: f64,
    /// What is open by no more than this needs no skirt, metres.
    pub closed: f64,
    /// See [`BorderConstants`].
    pub constants: BorderConstants,
}

impl SkirtRules {
    /// Of a block's lattice; `quantized` where corners are rounded to it and it shows.
    pub fn of(lattice: &Lattice, quantized: bool, constants: BorderConstants) -> Self {
        let (step, closed) = match quantized {
            // What is open by a step of a coarse lattice is seen, and its corners are rounded to
            // the nearest, which takes half the margin.
            true => (0.5, COMPUTED_STEPS),
            false => (1.0, CLOSED_STEPS),
        };
        Self { step: step * lattice.step, closed: closed * lattice.step, constants }
    }
}
