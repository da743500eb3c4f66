//! A walk that becomes a flight, as Lakhia and Zakhor (3DPVT 2004) made theirs in section IV.A: "a
//! walk-through at ground level, with many nodes culled away, that gradually becomes a fly-through
//! such that the entire model is visible".

use glam::{DVec2, DVec3};

use super::circuit::Circuit;
use super::ground::Ground;
use super::look::{ENOUGH, Search};
use super::panorama::Picture;
use super::route::{self, drive_m_s};
use super::streets::Streets;
use super::{Eye, WALK_M_S, aerial, smooth, travel};

/// Routes that are tried.
const TRIED: u64 = 3;
/// The part of the frames that follows the streets: first on foot, then ever higher and faster.
const STREET_PART: f64 = 0.4;
/// The part of that which stays on the ground.
const FOOT_PART: f64 = 0.25;
/// The part of the frames that leads from above the roofs to where all is in view.
const RISE_PART: f64 = 0.3;
/// Degrees that the camera looks down where it leaves the streets.
const LOOK_DOWN_DEG: f64 = 10.0;
/// Parts of the height above every roof to which it rises there, and directions in which enough of
/// the model must be seen from it.
const LIFTS: [f64; 7] = [1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.0];
const DOWN_DEG: [f64; 4] = [0.0, 20.0, 40.0, 60.0];
const YAWS: u32 = 36;
/// Within so many metres of where it leaves the streets is what stays in view.
const ANCHOR_M: f64 = 80.0;
/// The highest over it, in degrees above the horizon.
const HIGHEST_DEG: f64 = 70.0;

pub(super) fn path(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let streets = Streets::find(ground);
    route::best(ground, TRIED, |attempt| {
        let route = Circuit::make(ground, streets.as_ref(), seed, attempt, drive_m_s(ground) / fps);
        let eyes = along(ground, &route, frames, fps);
        (eyes.clone(), eyes)
    })
}

fn along(ground: &Ground, route: &Circuit, frames: usize, fps: f64) -> Vec<Eye> {
    let along = ((frames as f64 * STREET_PART).ceil() as usize).max(1);
    let rising = ((frames as f64 * RISE_PART) as usize).min(frames - along);
    let over = frames - along - rising;
    let mut eyes = street(ground, route, along, fps);
    let Some(&last) = eyes.last() else { return eyes };
    // Backwards from the middle, so that the city stays ahead while it shrinks.
    let away = (last.place - ground.middle()).truncate().normalize_or(DVec2::NEG_X);
    let arc = aerial::around(
        ground,
        ground.focus_near(last.place, ANCHOR_M * ground.scale),
        |lowest, part| arc(away, lowest, part),
    );
    let way = arc(0.0).place - last.place;
    // Grows by equal factors, so that 100 m and 100 km are left behind alike.
    let height = (last.place.z - ground.bounds[0].z).abs().max(1e-3);
    let growth = libm::log((way.length() / height).max(2.0));
    for index in 1..=rising {
        let part = index as f64 / rising as f64;
        let eased = part * (2.0 - part);
        let mut place = last.place + way * (libm::expm1(growth * eased) / libm::expm1(growth));
        place.z = place.z.max(ground.clear_height(place.truncate()));
        eyes.push(Eye { place, ..last.between(&arc(0.0), smooth(part)) });
    }
    eyes.extend((1..=over).map(|index| arc(smooth(index as f64 / over as f64))));
    Search::flight(fps).look(ground, &eyes)
}

/// From the side `away` of the city past its zenith to the other side: directions to the eye.
fn arc(away: DVec2, lowest_deg: f64, part: f64) -> DVec3 {
    // A half circle, leaning by what lacks from its highest point to the zenith.
    let lean = HIGHEST_DEG.to_radians();
    let sideways = away.perp().extend(0.0);
    let (lean_sin, lean_cos) = libm::sincos(lean);
    let top = sideways * lean_cos + DVec3::Z * lean_sin;
    let begin = libm::asin(libm::sin(lowest_deg.to_radians()) / lean_sin);
    let (sin, cos) = libm::sincos(begin + (std::f64::consts::PI - 2.0 * begin) * part);
    away.extend(0.0) * cos + top * sin
}

/// Along the streets, at first on the ground, in the end above every roof.
fn street(ground: &Ground, route: &Circuit, frames: usize, fps: f64) -> Vec<Eye> {
    let part = |index: usize| {
        let part = index as f64 / (frames.max(2) - 1) as f64;
        smooth((part - FOOT_PART) / (1.0 - FOOT_PART))
    };
    // The last metres along the streets are as fast as a drive.
    let speed_up = drive_m_s(ground) / WALK_M_S;
    let step = |index: usize| WALK_M_S * libm::pow(speed_up, part(index)) / fps;
    let places = route.march(frames + travel::ahead(fps), step).unwrap_or_default();
    let yaws = travel::yaws(&places, fps);
    let most = places.get(frames - 1).map_or(0.0, |&end| most_lift(ground, end));
    let eye = |(index, (&place, &yaw_deg)): (usize, (&DVec3, &f64))| {
        let growth = 1.0 + most / ground.eye_height();
        let lift = most * (libm::pow(growth, part(index)) - 1.0) / (growth - 1.0);
        let place = place + DVec3::Z * lift;
        Eye { place, yaw_deg, pitch_deg: -LOOK_DOWN_DEG * part(index) }
    };
    places.iter().zip(&yaws).take(frames).enumerate().map(eye).collect()
}

/// Metres by which one can rise where the streets are left: above every roof, or as far as leaves
/// enough of the model in some direction.
fn most_lift(ground: &Ground, end: DVec3) -> f64 {
    let top = ground.bounds[1].z + 2.0 * ground.eye_height() - end.z;
    let lifts = LIFTS.map(|part| (top * part).max(ground.eye_height()));
    let is_enough = |lift: &f64| {
        let panorama = ground.panorama(end + DVec3::Z * *lift);
        let pictures = DOWN_DEG.map(|down| Picture::new(-down));
        let yaws = (0..YAWS).map(|yaw| 360.0 * f64::from(yaw) / f64::from(YAWS));
        pictures.iter().any(|p| yaws.clone().any(|yaw| panorama.part(p, yaw) >= ENOUGH))
    };
    lifts.into_iter().find(is_enough).unwrap_or(lifts[LIFTS.len() - 1])
}

#[cfg(test)]
mod tests {
    use super::super::plan;
    use super::*;

    #[test]
    fn the_arc_passes_over() {
        let away = plan::direction(40.0);
        let lowest = 45.0;
        let arc = |part| arc(away, lowest, part);
        let above = |part| libm::asin(arc(part).z).to_degrees();
        for index in 0..=100 {
            let part = f64::from(index) / 100.0;
            assert!((arc(part).length() - 1.0).abs() < 1e-12);
            assert!(above(part) >= lowest - 1e-9 && above(part) <= HIGHEST_DEG + 1e-9);
        }
        let along = |part| arc(part).truncate().dot(away);
        assert!((above(0.5) - HIGHEST_DEG).abs() < 1e-9);
        assert!(along(0.0) > 0.6 && along(0.5).abs() < 1e-9 && along(1.0) < -0.6);
    }
}
