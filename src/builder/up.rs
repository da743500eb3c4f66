//! Which axis points at the sky, where the format does not say.

use crate::mesh::{Model, UpAxis};

/// Cities are wider than they are high: Y is up only where the model is clearly flatter along Y
/// than along Z; else Z, as in nearly all surveyed data.
pub fn guess(model: &Model) -> UpAxis {
    of_box(model.bounds())
}

/// The same of a model in a box: least and greatest coordinates.
pub fn of_box([low, high]: [[f64; 3]; 2]) -> UpAxis {
    let side = |axis: usize| high[axis] - low[axis];
    if side(1) * 3.0 < side(2) && side(1) * 3.0 < side(0) { UpAxis::Y } else { UpAxis::Z }
}
