//! Looking where one goes, without turning the head too fast.

use glam::DVec3;

use super::plan::yaw_deg;

/// Degrees a second that the camera turns at most while it walks along a route.
pub const MAX_TURN_DEG_S: f64 = 70.0;
/// And while it drives, which takes it round the same corners faster.
pub const MAX_DRIVING_TURN_DEG_S: f64 = 120.0;
/// The part of these that is yaw: it may look further down at the same time.
pub(super) const YAW_PART: f64 = 0.75;
/// Seconds that the camera looks ahead along its route.
const LOOK_AHEAD_S: f64 = 1.0;
/// Half the time over which turns are evened out, twice, seconds.
const EVEN_S: f64 = 0.5;

/// Places beyond the last frame that are needed to know where the last frame looks.
pub(super) fn ahead(fps: f64) -> usize {
    ahead_frames(fps) + 2 * even_frames(fps)
}

fn ahead_frames(fps: f64) -> usize {
    (LOOK_AHEAD_S * fps).round().max(1.0) as usize
}

fn even_frames(fps: f64) -> usize {
    (EVEN_S * fps).round() as usize
}

/// Yaw in each frame but the last [`ahead`], from the places of all. The yaw is not brought back
/// to ±180°: it goes on growing where the route winds.
pub(super) fn yaws(places: &[DVec3], fps: f64) -> Vec<f64> {
    let ahead = ahead_frames(fps);
    let mut yaws: Vec<f64> = Vec::with_capacity(places.len());
    for (place, later) in places.iter().zip(places.iter().skip(ahead)) {
        let towards = (*later - *place).truncate();
        let before = yaws.last().copied();
        let yaw = match (towards.length_squared() > 0.0, before) {
            (false, before) => before.unwrap_or(0.0),
            (true, None) => yaw_deg(towards),
            (true, Some(before)) => before + turn(before, yaw_deg(towards)),
        };
        yaws.push(yaw);
    }
    let even = even_frames(fps);
    evened(&evened(&yaws, even), even)
}

/// Holds each yaw where it would turn by more than `most` degrees from the one before.
pub(super) fn slow_down<'a>(yaws: impl Iterator<Item = &'a mut f64>, most: f64) {
    let mut before: Option<f64> = None;
    for yaw in yaws {
        *yaw = before.map_or(*yaw, |before| yaw.clamp(before - most, before + most));
        before = Some(*yaw);
    }
}

/// Degrees from one yaw to another the shorter way, −180 to 180.
pub(super) fn turn(from: f64, to: f64) -> f64 {
    (to - from + 180.0).rem_euclid(360.0) - 180.0
}

/// Means over `reach` values to both sides; only where there are as many after. Before the first,
/// the first is repeated.
fn evened(values: &[f64], reach: usize) -> Vec<f64> {
    let count = values.len().saturating_sub(reach);
    let mut sums = Vec::with_capacity(values.len() + reach + 1);
    let mut sum = 0.0;
    sums.push(sum);
    let first = values.first().copied().into_iter();
    for value in first.cycle().take(reach).chain(values.iter().copied()) {
        sum += value;
        sums.push(sum);
    }
    let width = 2 * reach + 1;
    (0..count).map(|index| (sums[index + width] - sums[index]) / width as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_slow_and_end_where_the_route_goes() {
        let fps = 30.0;
        // Along x, then back all of a sudden.
        let places: Vec<DVec3> = (0..900)
            .map(|index| DVec3::new(450.0 - (f64::from(index) - 450.0).abs(), 5.0, 0.0))
            .collect();
        let mut yaws = yaws(&places, fps);
        slow_down(yaws.iter_mut(), MAX_TURN_DEG_S / fps);
        assert_eq!(yaws.len(), 900 - ahead(fps));
        assert!(yaws[0].abs() < 1e-9);
        assert!((yaws[yaws.len() - 1].abs() - 180.0).abs() < 1e-6);
        for pair in yaws.windows(2) {
            assert!((pair[1] - pair[0]).abs() <= MAX_TURN_DEG_S / fps + 1e-9);
        }
        assert_eq!(turn(170.0, -170.0), 20.0);
        assert_eq!(turn(-170.0, 170.0), -20.0);
        assert_eq!(evened(&[1.0, 2.0, 3.0, 4.0], 1), [4.0 / 3.0, 2.0, 3.0]);
    }
}
