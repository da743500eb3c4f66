//! Which axis points at the sky, where the format does not say.

use crate::mesh::{Model, UpAxis};

/// Cities are wider than they are high: Y is up only where the model is clearly flatter along Y
/// than along Z; else Z, as in nearly all surveyed data.
pub fn guess(model: &Model) -> UpAxis {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for position in model.parts.iter().flat_map(|part| &part.positions) {
        for i in 0..3 {
            low[i] = low[i].min(position[i]);
            high[i] = high[i].max(position[i]);
        }
    }
    let side = |axis: usize| high[axis] - low[axis];
    if side(1) * 3.0 < side(2) && side(1) * 3.0 < side(0) { UpAxis::Y } else { UpAxis::Z }
}
