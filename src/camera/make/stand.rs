//! Cameras that stay where they are: still, or swaying a little.
//!
//! Lakhia's thesis, section 5.1, names what makes levels flicker: places "where a small movement
//! will cause flickering", and viewpoints "where a slight movement or rotation can cause a
//! substantial change in the number of objects in the view frustum". Swaying goes back and forth
//! over both.

use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use super::circuit::Circuit;
use super::ground::Ground;
use super::look::ENOUGH;
use super::panorama::{Panorama, Picture};
use super::streets::Streets;
use super::{Eye, plan};
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

/// Places drawn, and how many of them are tried: those with most to see.
const DRAWN: usize = 256;
const TRIED: usize = 64;
/// Degrees by which one may look down, as little as shows enough.
const DOWN_DEG: [f64; 5] = [0.0, 15.0, 30.0, 45.0, 60.0];
/// Directions of sight around a place.
const RAYS: usize = 64;
/// How many of those a picture shows: 90° of 360°.
const IN_PICTURE: usize = RAYS / 4;
/// How far one looks, metres.
const FAR_M: f64 = 300.0;

/// Where one stands, in any scene, with much of it in view: in the streets where there are any.
/// Pictures turned by each of `yaws_deg` show enough of the model, where that can be.
pub(super) fn stand(ground: &Ground, seed: u64, yaws_deg: &[f64]) -> Eye {
    let Some(streets) = Streets::find(ground) else {
        let start = Circuit::around(ground, 0.0).start();
        return Eye { pitch_deg: 0.0, ..Eye::towards(start, ground.middle()) };
    };
    let mut random = Random::new(seed, 1);
    let mut drawn: Vec<usize> = (0..DRAWN).map(|_| streets.draw(&mut random)).collect();
    drawn.sort_by(|&a, &b| streets.interest(b).total_cmp(&streets.interest(a)).then(a.cmp(&b)));
    drawn.truncate(TRIED);
    let best = drawn.par_iter().map(|&cell| best(ground, cell, yaws_deg)).collect::<Vec<_>>();
    let first = (Quality::default(), Eye::default());
    best.into_iter().fold(first, |best, next| if next.0 > best.0 { next } else { best }).1
}

/// What is better than what: enough of the model in every picture, then looking less far down, then
/// seeing more places; where nothing is enough, more of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct Quality {
    is_enough: bool,
    part: f64,
    up: usize,
    seen: u32,
}

/// The best direction from a cell.
fn best(ground: &Ground, cell: usize, yaws_deg: &[f64]) -> (Quality, Eye) {
    let place = ground.surfaces.cells.middle(cell);
    let place = place.extend(ground.height_at(place) + ground.eye_height());
    let panorama = Panorama::new(&ground.surfaces, place);
    let seen: Vec<u32> = (0..RAYS).map(|ray| seen(ground, place.truncate(), ray)).collect();
    let pictures = DOWN_DEG.map(|down| Picture::new(-down));
    let mut best = (Quality::default(), Eye::default());
    for first in 0..RAYS {
        let yaw_deg = degrees(first as f64 + (IN_PICTURE - 1) as f64 / 2.0);
        let seen = (0..IN_PICTURE).map(|ray| seen[(first + ray) % RAYS]).sum();
        for (index, picture) in pictures.iter().enumerate() {
            let parts = yaws_deg.iter().map(|more| panorama.part(picture, yaw_deg + more));
            let part = parts.fold(1.0, f64::min);
            let is_enough = part >= ENOUGH;
            let part = if is_enough { 1.0 } else { part };
            let quality = Quality { is_enough, part, up: DOWN_DEG.len() - index, seen };
            if quality > best.0 {
                best = (quality, Eye { place, yaw_deg, pitch_deg: -DOWN_DEG[index] });
            }
            if is_enough {
                break;
            }
        }
    }
    best
}

fn degrees(ray: f64) -> f64 {
    360.0 * ray / RAYS as f64
}

/// Cells along a line of sight whose surfaces show above all that stands before them.
fn seen(ground: &Ground, place: DVec2, ray: usize) -> u32 {
    let cells = &ground.surfaces.cells;
    let eye = ground.height_at(place) + ground.eye_height();
    let ahead = plan::direction(degrees(ray as f64)) * cells.side;
    let steps = (FAR_M * ground.scale / cells.side) as u32;
    let (mut horizon, mut count) = (f64::NEG_INFINITY, 0);
    for step in 1..=steps {
        let Some(cell) = cells.at(place + ahead * f64::from(step)) else { break };
        let slope = (f64::from(ground.surfaces.high[cell]) - eye) / f64::from(step);
        if slope > horizon {
            horizon = slope;
            count += u32::from(ground.clearance[cell] == 0.0);
        }
    }
    count
}

pub(super) fn still(ground: &Ground, frames: usize, seed: u64) -> Vec<Eye> {
    vec![stand(ground, seed, &[0.0]); frames]
}

pub(super) fn shake(ground: &Ground, frames: usize, fps: f64, seed: u64) -> Vec<Eye> {
    let middle = stand(ground, seed, &[-SHAKE_TURN_DEG, 0.0, SHAKE_TURN_DEG]);
    let ahead = plan::direction(middle.yaw_deg).extend(0.0) * (SHAKE_SWAY_M * ground.scale);
    let eye = |frame: usize| {
        let part = frame as f64 / fps / SHAKE_PERIOD_S;
        let place = middle.place + ahead * libm::sin(TAU * SWAYS * part);
        let yaw_deg = middle.yaw_deg + SHAKE_TURN_DEG * libm::sin(TAU * TURNS * part);
        Eye { place, yaw_deg, ..middle }
    };
    (0..frames).map(eye).collect()
}
