//! Cameras that change all that is in view at once: what is hardest on choosing and on loading.

use glam::DVec2;

use super::fly::{LOWEST_DEG, WHOLE_IN_VIEW};
use super::ground::Ground;
use super::stand::stand;
use super::{Eye, plan, smooth};
use crate::camera::angles::turn as turned;

/// Seconds for which a camera that turns looks one way.
const LOOK_S: f64 = 4.0;
/// Seconds for which a camera that rises stays in the street, and above.
const STAY_S: f64 = 5.0;
/// Seconds from the street to where all of the city is in view, and back.
const RISE_S: f64 = 1.0;

/// Looks ahead for a while, away, and back, each at once.
pub(super) fn turn(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let (place, yaw) = stand(ground, seed);
    let looks = [0.0, 180.0].map(|more| Eye::level(ground, place, yaw + more, 0.0));
    (0..frames).map(|frame| looks[(frame as f64 / fps / LOOK_S) as usize % 2]).collect()
}

/// Stands in a street, is above the city a second later with all of it in view, and back.
pub(super) fn rise(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let (place, yaw) = stand(ground, seed);
    let street = Eye::level(ground, place, yaw, 0.0);
    let (centre, radius) = ground.sphere();
    // Back from where the camera looks, so that this stays ahead.
    let (sin, cos) = libm::sincos(LOWEST_DEG.to_radians());
    let away: DVec2 = -plan::direction(yaw);
    let above = centre + (away * cos).extend(sin) * (radius * WHOLE_IN_VIEW);
    let sky = Eye::towards(ground, above, centre);
    let eye = |frame: usize| {
        let second = (frame as f64 / fps) % (2.0 * (STAY_S + RISE_S));
        let up = smooth((second - STAY_S) / RISE_S);
        let down = smooth((second - 2.0 * STAY_S - RISE_S) / RISE_S);
        match up - down {
            part if part <= 0.0 => street,
            part if part >= 1.0 => sky,
            part => Eye {
                place: street.place.lerp(sky.place, part),
                rotation: turned(street.rotation, sky.rotation, part),
            },
        }
    };
    (0..frames).map(eye).collect()
}
