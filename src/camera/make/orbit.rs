//! Cossutti's path (2014, section 5.1 and figure 5.1): it "circles around the model and then moves
//! through the centre of the model and back". As in his figure 5.4 the circle takes half of the
//! frames. His passes lead past the edge of the model, where nothing is in view; ours turn round
//! while there is something.

use glam::DVec2;

use super::ground::Ground;
use super::look::{ENOUGH, Search};
use super::panorama::Picture;
use super::{Eye, aerial, plan, smooth};

/// The part of the frames that goes around.
pub(super) const CIRCLE_PART: f64 = 0.5;
/// The part that comes down from the circle to the edge of the model.
const DESCENT_PART: f64 = 0.05;
/// The part that turns round between the passes; the passes share what is left.
const TURN_PART: f64 = 0.05;
/// Parts of the way from the middle to the edge at which a pass may turn round.
const TURNS: u32 = 24;
/// Degrees by which who passes may look down.
const DOWN_DEG: [f64; 4] = [0.0, 20.0, 40.0, 60.0];
/// Directions in which a pass may lead.
const DIRECTIONS: u32 = 72;
/// Room to both sides of a pass, metres.
const ROOM_M: f64 = 2.0;

pub(super) fn path(ground: &Ground, frames: usize, fps: f64) -> Vec<Eye> {
    let (yaw, height) = corridor(ground);
    let at = |along: f64| {
        let place = ground.focus.truncate() + plan::direction(yaw) * along;
        Eye { place: place.extend(height), yaw_deg: yaw, pitch_deg: 0.0 }
    };
    let reach = reach(ground, at);
    let circle = aerial::around(ground, ground.focus, |elevation, part| {
        aerial::circle(yaw + 180.0, elevation, part)
    });
    let pass = (1.0 - CIRCLE_PART - DESCENT_PART - TURN_PART) / 2.0;
    let eye = |part: f64| {
        let mut left = part;
        if left <= CIRCLE_PART {
            return circle(left / CIRCLE_PART);
        }
        left -= CIRCLE_PART;
        if left <= DESCENT_PART {
            return circle(1.0).between(&at(-reach), smooth(left / DESCENT_PART));
        }
        left -= DESCENT_PART;
        if left <= pass {
            return at(reach * (2.0 * left / pass - 1.0));
        }
        left -= pass;
        let turned = smooth(left / TURN_PART);
        let along = reach * (1.0 - 2.0 * ((left - TURN_PART).max(0.0) / pass).min(1.0));
        Eye { yaw_deg: yaw + 180.0 * turned, ..at(along) }
    };
    let wished: Vec<Eye> =
        (0..frames).map(|index| eye(index as f64 / (frames.max(2) - 1) as f64)).collect();
    Search::flight(fps).look(ground, &wished)
}

/// How far from where most of the model is one can go, to both sides, and have enough in view all
/// along.
fn reach(ground: &Ground, at: impl Fn(f64) -> Eye) -> f64 {
    let half = (ground.bounds[1] - ground.bounds[0]).truncate().length() / 2.0;
    let is_enough = |along: f64| {
        let eye = at(along);
        let panorama = ground.panorama(eye.place);
        let pictures = DOWN_DEG.map(|down| Picture::new(-down));
        [0.0, 180.0].into_iter().all(|back| {
            pictures.iter().any(|picture| panorama.part(picture, eye.yaw_deg + back) >= ENOUGH)
        })
    };
    let reaches = (1..=TURNS).map(|part| half * f64::from(part) / f64::from(TURNS));
    let enough = reaches.take_while(|&reach| is_enough(-reach) && is_enough(reach));
    enough.last().unwrap_or(half / f64::from(TURNS))
}

/// The direction through where most of the model is in which one can pass lowest, and the height of
/// the eye there: down a street where one leads through, else over the roofs.
fn corridor(ground: &Ground) -> (f64, f64) {
    let eye = ground.eye_height();
    if ground.overview.is_some() {
        // What stands outside of the map is not known.
        return (0.0, ground.bounds[1].z + eye);
    }
    let half = (ground.bounds[1] - ground.bounds[0]).truncate().length() / 2.0;
    let cells = &ground.surfaces.cells;
    let steps = (half / cells.side).ceil() as i64;
    let aside = (ROOM_M * ground.scale / cells.side).ceil() as i64;
    let highest = |ahead: DVec2| {
        let lines = (-aside..=aside).map(|line| ahead.perp() * (line as f64 * cells.side));
        lines
            .flat_map(|line| (-steps..=steps).map(move |step| (line, step)))
            .filter_map(|(line, step)| {
                let along = ahead * (step as f64 * cells.side);
                let cell = cells.at(ground.focus.truncate() + line + along)?;
                Some(f64::from(ground.surfaces.high[cell].max(ground.height[cell])))
            })
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let mut best = (0.0, f64::INFINITY);
    for index in 0..DIRECTIONS {
        let yaw = f64::from(index) * 180.0 / f64::from(DIRECTIONS);
        let height = highest(plan::direction(yaw));
        if height < best.1 {
            best = (yaw, height);
        }
    }
    let height = if best.1.is_finite() { best.1 } else { ground.bounds[1].z };
    (best.0, height.min(ground.bounds[1].z) + eye)
}

/// Where the eye is on the circle's part of a path; for tests.
#[cfg(test)]
pub(super) fn circle_frames(frames: usize) -> usize {
    (CIRCLE_PART * (frames - 1) as f64) as usize
}
