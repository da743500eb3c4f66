//! A walk that becomes a flight, as Lakhia and Zakhor (3DPVT 2004) made theirs in section IV.A: "a
//! walk-through at ground level, with many nodes culled away, that gradually becomes a fly-through
//! such that the entire model is visible".

use glam::{DVec2, DVec3};

use super::circuit::Circuit;
use super::ground::Ground;
use super::{Eye, WALK_M_S, smooth, travel};
use crate::camera::angles::turn;

/// The part of the frames that follows the streets: first on foot, then ever higher and faster.
const STREET_PART: f64 = 0.4;
/// The part of that which stays on the ground.
const FOOT_PART: f64 = 0.25;
/// The part of the frames that leads from above the roofs to where all is in view.
const RISE_PART: f64 = 0.3;
/// How much faster than a walk the last metres along the streets are.
const SPEED_UP: f64 = 10.0;
/// Degrees that the camera looks down where it leaves the streets.
const LOOK_DOWN_DEG: f64 = 10.0;
/// Distance to the middle, in radii of the scene, at which all of it is in view: a little over
/// 1 / sin 30°.
pub(super) const WHOLE_IN_VIEW: f64 = 2.05;
/// Degrees above the horizon at which all of it comes into view, and the highest over it.
pub(super) const LOWEST_DEG: f64 = 30.0;
const HIGHEST_DEG: f64 = 70.0;

pub(super) fn path(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let along = ((frames as f64 * STREET_PART).ceil() as usize).max(1);
    let rising = ((frames as f64 * RISE_PART) as usize).min(frames - along);
    let over = frames - along - rising;
    let mut eyes = street(ground, along, fps, seed);
    let Some(&last) = eyes.last() else { return eyes };
    let (centre, radius) = ground.sphere();
    let distance = radius * WHOLE_IN_VIEW;
    // Backwards from the middle, so that the city stays ahead while it shrinks.
    let away = (last.place - centre).truncate().normalize_or(DVec2::NEG_X);
    let first = arc(centre, distance, away, 0.0);
    let way = first - last.place;
    // Grows by equal factors, so that 100 m and 100 km are left behind alike.
    let height = (last.place.z - ground.bounds[0].z).abs().max(1e-3);
    let growth = libm::log((way.length() / height).max(2.0));
    for index in 1..=rising {
        let part = index as f64 / rising as f64;
        let eased = part * (2.0 - part);
        let place = last.place + way * (libm::expm1(growth * eased) / libm::expm1(growth));
        let target = Eye::towards(ground, place, centre);
        eyes.push(Eye { place, rotation: turn(last.rotation, target.rotation, smooth(part)) });
    }
    for index in 1..=over {
        let part = smooth(index as f64 / over as f64);
        eyes.push(Eye::towards(ground, arc(centre, distance, away, part), centre));
    }
    eyes
}

/// From the side `away` of the city past its zenith to the other side, always as far from its
/// middle.
fn arc(centre: DVec3, distance: f64, away: DVec2, part: f64) -> DVec3 {
    // A half circle, leaning by what lacks from its highest point to the zenith.
    let lean = HIGHEST_DEG.to_radians();
    let sideways = away.perp().extend(0.0);
    let (lean_sin, lean_cos) = libm::sincos(lean);
    let top = sideways * lean_cos + DVec3::Z * lean_sin;
    let begin = libm::asin(libm::sin(LOWEST_DEG.to_radians()) / lean_sin);
    let (sin, cos) = libm::sincos(begin + (std::f64::consts::PI - 2.0 * begin) * part);
    centre + (away.extend(0.0) * cos + top * sin) * distance
}

/// Along the streets, at first on the ground, in the end above every roof.
fn street(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let part = |index: usize| {
        let part = index as f64 / (frames.max(2) - 1) as f64;
        smooth((part - FOOT_PART) / (1.0 - FOOT_PART))
    };
    let route = Circuit::make(ground, seed, WALK_M_S * SPEED_UP / fps);
    let step = |index: usize| WALK_M_S * libm::pow(SPEED_UP, part(index)) / fps;
    let places = route.march(frames + travel::ahead(fps), step).unwrap_or_default();
    let yaws = travel::yaws(&places, fps);
    let top = ground.bounds[1].z + 2.0 * ground.eye_height();
    let eye = |(index, (&place, &yaw)): (usize, (&DVec3, &f64))| {
        let rise = (top - place.z).max(ground.eye_height());
        let growth = 1.0 + rise / ground.eye_height();
        let lift = rise * (libm::pow(growth, part(index)) - 1.0) / (growth - 1.0);
        let place = place + DVec3::Z * lift;
        Eye::level(ground, place, yaw, -LOOK_DOWN_DEG * part(index))
    };
    places.iter().zip(&yaws).take(frames).enumerate().map(eye).collect()
}

#[cfg(test)]
mod tests {
    use super::super::plan;
    use super::*;

    #[test]
    fn the_arc_keeps_its_distance_and_passes_over() {
        let (centre, away) = (DVec3::new(1.0, 2.0, 3.0), plan::direction(40.0));
        let above = |place: DVec3| ((place - centre).z / 50.0).asin().to_degrees();
        for index in 0..=100 {
            let place = arc(centre, 50.0, away, f64::from(index) / 100.0);
            assert!((place.distance(centre) - 50.0).abs() < 1e-9);
            assert!(above(place) >= LOWEST_DEG - 1e-9 && above(place) <= HIGHEST_DEG + 1e-9);
        }
        let along = |part| (arc(centre, 50.0, away, part) - centre).truncate().dot(away);
        assert!((above(arc(centre, 50.0, away, 0.5)) - HIGHEST_DEG).abs() < 1e-9);
        assert!(along(0.0) > 30.0 && along(0.5).abs() < 1e-9 && along(1.0) < -30.0);
    }
}
