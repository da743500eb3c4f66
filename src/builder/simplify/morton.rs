//! An order in which neighbours in the list are neighbours in space.

use glam::DVec3;

/// Bits of a place along each axis.
const BITS: u32 = 16;

/// The place of each point along a Morton curve.
pub(super) fn places(points: &[DVec3]) -> Vec<u64> {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let cells = f64::from((1u32 << BITS) - 1);
    let scale = cells / (high - low).max_element().max(f64::MIN_POSITIVE);
    let place = |point: &DVec3| {
        let cell = ((*point - low) * scale).clamp(DVec3::ZERO, DVec3::splat(cells));
        let [x, y, z] = cell.to_array().map(|value| value as u64);
        (0..BITS).fold(0, |place, bit| {
            let of = |value: u64, axis: u32| (value >> bit & 1) << (3 * bit + axis);
            place | of(x, 0) | of(y, 1) | of(z, 2)
        })
    };
    points.iter().map(place).collect()
}
