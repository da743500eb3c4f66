//! Cameras that stay where they are: still, or swaying a little.
//!
//! Lakhia's thesis, section 5.1, names what makes levels flicker: places "where a small movement
//! will cause flickering", and viewpoints "where a slight movement or rotation can cause a
//! substantial change in the number of objects in the view frustum". Swaying goes back and forth
//! over both.

use std::f64::consts::TAU;

use super::Eye;
use super::circuit::Circuit;
use super::ground::Ground;
use super::plan;
use super::streets::Streets;
use super::view_from;
use crate::random::Random;

/// Metres to both sides of the middle, along the line of sight, of a camera that sways. In a scene
/// less than 17 m wide, less in proportion.
pub const SHAKE_SWAY_M: f64 = 0.75;
/// Degrees to both sides that it turns.
pub const SHAKE_TURN_DEG: f64 = 10.0;
/// Seconds after which it is where it was, and looks where it looked.
pub const SHAKE_PERIOD_S: f64 = 12.0;
/// It sways so many times in that time, and turns so many times.
const SWAYS: f64 = 3.0;
const TURNS: f64 = 2.0;

/// Where one stands, and the yaw of the sight; `None` where there is no room.
fn place(ground: &Ground, seed: u64) -> Option<(glam::DVec3, f64)> {
    let streets = Streets::find(ground)?;
    let (cell, yaw) = view_from::best(&streets, &mut Random::new(seed, 1));
    let place = ground.cells.middle(cell);
    Some((place.extend(ground.height_at(place) + ground.eye_height()), yaw))
}

/// Where one stands, in any scene.
pub(super) fn stand(ground: &Ground, seed: u64) -> (glam::DVec3, f64) {
    place(ground, seed).unwrap_or_else(|| {
        let start = Circuit::around(ground, 0.0).start();
        let towards = ground.sphere().0 - start;
        (start, plan::yaw_deg(towards.truncate()))
    })
}

pub(super) fn still(ground: &Ground, frames: usize, seed: u64) -> Vec<Eye> {
    let (place, yaw) = stand(ground, seed);
    vec![Eye::level(ground, place, yaw, 0.0); frames]
}

pub(super) fn shake(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let (middle, yaw) = stand(ground, seed);
    let ahead = plan::direction(yaw).extend(0.0) * (SHAKE_SWAY_M * ground.scale);
    let eye = |frame: usize| {
        let part = frame as f64 / fps / SHAKE_PERIOD_S;
        let place = middle + ahead * libm::sin(TAU * SWAYS * part);
        Eye::level(ground, place, yaw + SHAKE_TURN_DEG * libm::sin(TAU * TURNS * part), 0.0)
    };
    (0..frames).map(eye).collect()
}
