//! How much of a city one sees from a place in its streets.

use glam::DVec2;

use super::ground::Ground;
use super::plan::direction;
use super::streets::Streets;
use crate::random::Random;

/// Places drawn, and how many of them are tried: those with most buildings around them.
const DRAWN: usize = 256;
const TRIED: usize = 64;
/// Directions of sight around a place.
const RAYS: usize = 64;
/// How many of those a picture shows: 90° of 360°.
const IN_PICTURE: usize = RAYS / 4;
/// How far one looks, metres.
const FAR_M: f64 = 300.0;

/// The cell of the streets and the yaw with most in view, of some that are drawn.
pub(super) fn best(streets: &Streets<'_>, random: &mut Random) -> (usize, f64) {
    let mut best = (0, (streets.open[0], 0.0));
    let mut drawn: Vec<usize> = (0..DRAWN).map(|_| streets.draw(random)).collect();
    drawn.sort_by(|&a, &b| streets.interest(b).total_cmp(&streets.interest(a)).then(a.cmp(&b)));
    for cell in drawn.into_iter().take(TRIED) {
        let place = streets.ground.cells.middle(cell);
        let seen: Vec<u32> = (0..RAYS).map(|ray| seen(streets.ground, place, ray)).collect();
        for first in 0..RAYS {
            let count: u32 = (0..IN_PICTURE).map(|ray| seen[(first + ray) % RAYS]).sum();
            if count > best.0 {
                let yaw = degrees(first as f64 + (IN_PICTURE - 1) as f64 / 2.0);
                best = (count, (cell, yaw));
            }
        }
    }
    best.1
}

fn degrees(ray: f64) -> f64 {
    360.0 * ray / RAYS as f64
}

/// Cells along a line of sight whose surfaces show above all that stands before them.
fn seen(ground: &Ground, place: DVec2, ray: usize) -> u32 {
    let cells = &ground.cells;
    let eye = ground.height_at(place) + ground.eye_height();
    let ahead = direction(degrees(ray as f64)) * cells.side;
    let steps = (FAR_M * ground.scale / cells.side) as u32;
    let (mut horizon, mut count) = (f64::NEG_INFINITY, 0);
    for step in 1..=steps {
        let Some(cell) = cells.at(place + ahead * f64::from(step)) else { break };
        let slope = (f64::from(ground.high[cell]) - eye) / f64::from(step);
        if slope > horizon {
            horizon = slope;
            count += u32::from(ground.clearance[cell] == 0.0);
        }
    }
    count
}
