//! Cameras that change all that is in view at once: what is hardest on choosing and on loading.

use super::ground::Ground;
use super::look::Search;
use super::stand::stand;
use super::{Eye, aerial, plan, smooth};

/// Seconds for which a camera that turns looks one way.
const LOOK_S: f64 = 4.0;
/// Within so many metres of where it stands is what stays in view.
const ANCHOR_M: f64 = 40.0;
/// Seconds for which it stays in the street, and above.
const STAY_S: f64 = 5.0;
/// Seconds from the street to where all of the city is in view, and back.
const RISE_S: f64 = 1.0;
/// How often on the way up it decides where to look, and by how much it may turn until then.
const DECISIONS: f64 = 10.0;
const MOST_DEG: f64 = 40.0;

/// Looks ahead for a while, away, and back, each at once.
pub(super) fn turn(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let ahead = stand(ground, seed, &[0.0, 180.0]);
    let looks = [ahead, Eye { yaw_deg: ahead.yaw_deg + 180.0, ..ahead }];
    (0..frames).map(|frame| looks[(frame as f64 / fps / LOOK_S) as usize % 2]).collect()
}

/// Stands in a street, is above the city a second later with all of it in view, and back.
pub(super) fn rise(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let street = stand(ground, seed, &[0.0]);
    let anchor = ground.focus_near(street.place, ANCHOR_M * ground.scale);
    // Back from where the camera looks, so that this stays ahead.
    let sky = aerial::above(ground, anchor, -plan::direction(street.yaw_deg));
    let steps = ((RISE_S * fps) as usize).max(1);
    let wished: Vec<Eye> = (0..=steps)
        .map(|step| {
            let part = smooth(step as f64 / steps as f64);
            // At first straight up, so that nothing is in the way.
            let (aside, up) = (part * part * part, part * (2.0 - part));
            let place = street.place.lerp(sky.place, aside);
            let z = street.place.z + (sky.place.z - street.place.z) * up;
            Eye { place: place.with_z(z), ..street.between(&sky, part) }
        })
        .collect();
    let stride = (RISE_S * fps / DECISIONS).round().max(1.0) as usize;
    let up = Search { stride, most_deg: MOST_DEG, keeps_ends: true }.look(ground, &wished);
    let eye = |frame: usize| {
        let second = (frame as f64 / fps) % (2.0 * (STAY_S + RISE_S));
        let step = |seconds: f64| (seconds * fps).round().max(0.0) as usize;
        if second < STAY_S + RISE_S {
            up[step(second - STAY_S).min(steps)]
        } else {
            up[steps - step(second - 2.0 * STAY_S - RISE_S).min(steps)]
        }
    };
    (0..frames).map(eye).collect()
}
