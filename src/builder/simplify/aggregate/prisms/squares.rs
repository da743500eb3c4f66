//! An index of segments, which move.

use glam::{DVec2, IVec2};

/// Cells of the grid of heights along the side of a square.
const SQUARE: f64 = 8.0;

/// The segments by the squares that they touch.
pub(super) struct Squares {
    low: DVec2,
    size: IVec2,
    /// Where they start, row by row.
    pub starts: Vec<Vec<u32>>,
}

impl Squares {
    pub fn around(points: impl Iterator<Item = DVec2> + Clone) -> Self {
        let low = points.clone().fold(DVec2::INFINITY, DVec2::min);
        let high = points.fold(DVec2::NEG_INFINITY, DVec2::max);
        let size = ((high - low) / SQUARE).floor().as_ivec2().max(IVec2::ZERO) + 1;
        Self { low, size, starts: vec![Vec::new(); (size.x * size.y) as usize] }
    }

    /// The squares that a rectangle touches; what is beyond all of them is in the outermost.
    pub fn between(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = usize> + use<> {
        let [low, high] = [low, high].map(|p| {
            ((p - self.low) / SQUARE).floor().as_ivec2().clamp(IVec2::ZERO, self.size - 1)
        });
        let columns = self.size.x;
        (low.y..=high.y)
            .flat_map(move |y| (low.x..=high.x).map(move |x| (y * columns + x) as usize))
    }
}
