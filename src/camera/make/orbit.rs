//! Cossutti's path (2014, section 5.1 and figure 5.1): it "circles around the model and then moves
//! through the centre of the model and back". As in his figure 5.4 the circle takes half of the
//! frames, and each pass leads past the edge of the model, so that nothing is in view before the
//! camera turns round.

use glam::DVec2;

use super::fly::WHOLE_IN_VIEW;
use super::ground::Ground;
use super::{Eye, plan, smooth};
use crate::camera::angles::turn;

/// The part of the frames that goes around.
pub(super) const CIRCLE_PART: f64 = 0.5;
/// The part that comes down from the circle to the edge of the model.
const DESCENT_PART: f64 = 0.05;
/// The part that turns round between the passes; the passes share what is left.
const TURN_PART: f64 = 0.05;
/// Height of the circle, in degrees above the horizon of the model's middle.
const ELEVATION_DEG: f64 = 30.0;
/// Where a pass begins and ends, in half widths of the model from its middle.
const BEYOND: f64 = 1.2;
/// Directions in which a pass may lead.
const DIRECTIONS: u32 = 72;
/// Room to both sides of a pass, metres.
const ROOM_M: f64 = 2.0;

pub(super) fn path(ground: &Ground, frames: usize) -> Vec<Eye> {
    let (centre, radius) = ground.sphere();
    let (yaw, height) = corridor(ground);
    let ahead = plan::direction(yaw);
    let half = (ground.bounds[1] - ground.bounds[0]).truncate().length() / 2.0;
    let middle = centre.truncate();
    let reach = half * BEYOND + 2.0 * ground.eye_height();
    let at = |along: f64| (middle + ahead * along).extend(height);
    let (sin, cos) = libm::sincos(ELEVATION_DEG.to_radians());
    let (circle_height, circle_radius) =
        (radius * WHOLE_IN_VIEW * sin, radius * WHOLE_IN_VIEW * cos);
    let circle = |part: f64| {
        let from = plan::direction(360.0 * part).rotate(-ahead);
        centre + (from * circle_radius).extend(circle_height)
    };
    let end = Eye::towards(ground, circle(1.0), centre);
    let pass = (1.0 - CIRCLE_PART - DESCENT_PART - TURN_PART) / 2.0;
    let eye = |part: f64| {
        let mut left = part;
        if left <= CIRCLE_PART {
            return Eye::towards(ground, circle(left / CIRCLE_PART), centre);
        }
        left -= CIRCLE_PART;
        if left <= DESCENT_PART {
            let part = smooth(left / DESCENT_PART);
            let begin = Eye::level(ground, at(-reach), yaw, 0.0);
            return Eye {
                place: end.place.lerp(begin.place, part),
                rotation: turn(end.rotation, begin.rotation, part),
            };
        }
        left -= DESCENT_PART;
        if left <= pass {
            return Eye::level(ground, at(reach * (2.0 * left / pass - 1.0)), yaw, 0.0);
        }
        left -= pass;
        if left <= TURN_PART {
            return Eye::level(ground, at(reach), yaw + 180.0 * smooth(left / TURN_PART), 0.0);
        }
        left -= TURN_PART;
        Eye::level(ground, at(reach * (1.0 - 2.0 * (left / pass).min(1.0))), yaw + 180.0, 0.0)
    };
    (0..frames).map(|index| eye(index as f64 / (frames.max(2) - 1) as f64)).collect()
}

/// The direction through the middle in which one can pass lowest, and the height of the eye there:
/// down a street where one leads through the middle, else over the roofs.
fn corridor(ground: &Ground) -> (f64, f64) {
    let eye = ground.eye_height();
    if !ground.is_whole {
        // What stands outside of the map is not known.
        return (0.0, ground.bounds[1].z + eye);
    }
    let (centre, _) = ground.sphere();
    let half = (ground.bounds[1] - ground.bounds[0]).truncate().length() / 2.0;
    let cells = &ground.cells;
    let steps = (half / cells.side).ceil() as i64;
    let aside = (ROOM_M * ground.scale / cells.side).ceil() as i64;
    let highest = |ahead: DVec2| {
        let lines = (-aside..=aside).map(|line| ahead.perp() * (line as f64 * cells.side));
        lines
            .flat_map(|line| (-steps..=steps).map(move |step| (line, step)))
            .filter_map(|(line, step)| {
                let place = centre.truncate() + line + ahead * (step as f64 * cells.side);
                cells.at(place).map(|cell| f64::from(ground.high[cell].max(ground.height[cell])))
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

#[cfg(test)]
pub(super) fn centre(ground: &Ground) -> glam::DVec3 {
    ground.plan.source(ground.sphere().0)
}
