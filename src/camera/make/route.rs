//! Walks and drives: along the streets, looking ahead, with the model in view.

use rayon::prelude::*;

use super::circuit::Circuit;
use super::ground::Ground;
use super::look::Search;
use super::panorama::Picture;
use super::streets::Streets;
use super::{DRIVE_M_S, Eye, MAX_DRIVING_TURN_DEG_S, MAX_TURN_DEG_S, WALK_M_S, travel};

/// Routes that are tried.
const TRIED: u64 = 6;
/// The first is taken of which every picture shows this part of the model.
const SURE: f64 = 0.45;
/// Of so many frames one is looked at for that.
const STRIDE: usize = 6;
/// A drive along the route tells how good it is: frames, and frames a second.
const TRIAL: (usize, f64) = (600, 15.0);
/// Seconds from one end of a scene to the other that a drive takes at least.
const ACROSS_S: f64 = 10.0;

/// How fast one goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    m_s: f64,
    /// Degrees a second by which one turns at most.
    turn_deg_s: f64,
}

pub(super) const WALK: Pace = Pace { m_s: WALK_M_S, turn_deg_s: MAX_TURN_DEG_S };

/// How fast one drives in a scene.
pub(super) fn drive(ground: &Ground) -> Pace {
    Pace { m_s: drive_m_s(ground), turn_deg_s: MAX_DRIVING_TURN_DEG_S }
}

/// Metres a second at which one drives in a scene.
pub(super) fn drive_m_s(ground: &Ground) -> f64 {
    let [min, max] = ground.bounds;
    let across = (max - min).truncate().max_element() / ACROSS_S;
    if across > 0.0 { across.min(DRIVE_M_S) } else { DRIVE_M_S }
}

/// Along the streets. The route is the same at any pace, wherever the streets are long enough.
pub(super) fn path(ground: &Ground, frames: usize, fps: f64, seed: u64, pace: Pace) -> Vec<Eye> {
    let streets = Streets::find(ground);
    let route = best(ground, TRIED, |attempt| {
        let route = Circuit::make(ground, streets.as_ref(), seed, attempt, drive_m_s(ground) / fps);
        let eyes = along(ground, &route, TRIAL.0, TRIAL.1, drive(ground));
        (route, eyes)
    });
    along(ground, &route, frames, fps, pace)
}

/// What is made of the first of some routes of which all frames show enough, or of the one that shows most.
pub(super) fn best<T>(ground: &Ground, tries: u64, make: impl Fn(u64) -> (T, Vec<Eye>)) -> T {
    let part =
        |eye: &Eye| ground.panorama(eye.place).part(&Picture::new(eye.pitch_deg), eye.yaw_deg);
    let tried = |attempt: u64| {
        let (made, eyes) = make(attempt);
        let parts: Vec<f64> = eyes.par_iter().step_by(STRIDE).map(part).collect();
        (made, parts.into_iter().fold(f64::INFINITY, f64::min))
    };
    let mut best = tried(0);
    for attempt in 1..tries {
        if best.1 >= SURE {
            break;
        }
        let next = tried(attempt);
        if next.1 > best.1 {
            best = next;
        }
    }
    best.0
}

fn along(ground: &Ground, route: &Circuit, frames: usize, fps: f64, pace: Pace) -> Vec<Eye> {
    let search = Search::calm(fps, pace.turn_deg_s);
    let count = search.frames(frames) + travel::ahead(fps);
    let places = route.march(count, |_| pace.m_s / fps).unwrap_or_default();
    let yaws = travel::yaws(&places, fps);
    let wished: Vec<Eye> = places
        .iter()
        .zip(&yaws)
        .map(|(&place, &yaw_deg)| Eye { place, yaw_deg, pitch_deg: 0.0 })
        .collect();
    let mut eyes = search.look(ground, &wished);
    let most_deg = pace.turn_deg_s * travel::YAW_PART / fps;
    travel::slow_down(eyes.iter_mut().map(|eye| &mut eye.yaw_deg), most_deg);
    eyes.truncate(frames);
    eyes
}
