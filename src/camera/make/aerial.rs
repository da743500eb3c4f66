//! Views from above: of all of the city, or of as much as leaves a good part of the picture to it.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::ground::Ground;
use super::look::ENOUGH;
use super::panorama::{ASPECT, Picture};
use super::{Eye, plan, smooth};
use crate::camera::{DEFAULT_FOV_Y_DEG, from_angles};

/// Degrees above the horizon from which a city is looked at, the first that shows enough.
const ELEVATIONS_DEG: [f64; 3] = [30.0, 45.0, 60.0];
/// What is left around the city, as a part of the picture's half.
const MARGIN: f64 = 0.05;
/// Distances that are tried, each by this factor less than the one before.
const NEARER: f64 = 0.75;
const TRIED: usize = 16;
/// How often the distance between two of these is halved.
const HALVED: usize = 4;
/// Places of a way around that are looked at; between them distances go over into each other.
const AROUND: usize = 24;

/// A view of the city from one side.
struct View<'a> {
    ground: &'a Ground,
    /// What stays in view where all of it would be too little.
    anchor: DVec3,
    /// From the city to the eye, of length 1.
    out: DVec3,
    /// Distance to the middle at which all is in view.
    whole: f64,
}

impl<'a> View<'a> {
    fn new(ground: &'a Ground, anchor: DVec3, out: DVec3) -> Self {
        let up = ground.plan.up();
        let towards = Eye::towards(out, DVec3::ZERO);
        let rotation = from_angles(up, towards.yaw_deg, towards.pitch_deg, 0.0).inverse();
        let middle = ground.middle();
        let half = libm::tan(DEFAULT_FOV_Y_DEG.to_radians() / 2.0) * (1.0 - MARGIN);
        let away = (0..8).map(|corner| {
            let side = |axis: usize| ground.bounds[corner >> axis & 1][axis];
            let corner = DVec3::new(side(0), side(1), side(2)) - middle;
            let seen = rotation * up.from_z_up(corner);
            seen.z + (seen.x.abs() / ASPECT).max(seen.y.abs()) / half
        });
        let whole = away.fold(0.0, f64::max);
        Self { ground, anchor, out, whole: if whole > 0.0 { whole } else { 1.0 } }
    }

    /// The eye at a part of the distance from which all is in view: the nearer it is, the nearer
    /// is what it looks at to the anchor.
    fn eye(&self, part: f64) -> Eye {
        let target = self.anchor.lerp(self.ground.middle(), part);
        let mut place = target + self.out * (self.whole * part);
        place.z = place.z.max(self.ground.clear_height(place.truncate()));
        Eye::towards(place, target)
    }

    /// How much of the model is in the picture.
    fn seen(&self, part: f64) -> f64 {
        let eye = self.eye(part);
        self.ground.panorama(eye.place).part(&Picture::new(eye.pitch_deg), eye.yaw_deg)
    }

    /// The greatest part of the distance that shows enough of the model, and how much; where none
    /// does, that which shows most.
    fn farthest(&self) -> (f64, f64) {
        let mut most = (1.0, 0.0);
        let mut part = 1.0;
        for _ in 0..TRIED {
            let seen = self.seen(part);
            if seen >= ENOUGH {
                return (self.between(part, (part / NEARER).min(1.0)), seen);
            }
            if seen > most.1 {
                most = (part, seen);
            }
            part *= NEARER;
        }
        most
    }

    /// From `near`, which shows enough, on to `far`.
    fn between(&self, mut near: f64, mut far: f64) -> f64 {
        for _ in 0..HALVED {
            let middle = (near + far) / 2.0;
            *(if self.seen(middle) >= ENOUGH { &mut near } else { &mut far }) = middle;
        }
        near
    }
}

/// The eye above the city, on its side `away`. The `anchor` stays in view where not all of the city
/// does.
pub(super) fn above(ground: &Ground, anchor: DVec3, away: DVec2) -> Eye {
    let view = |elevation: f64| {
        let (sin, cos) = libm::sincos(elevation.to_radians());
        View::new(ground, anchor, (away * cos).extend(sin))
    };
    let mut views = ELEVATIONS_DEG.into_iter().map(view);
    if let Some(view) = views.find(|view| view.seen(1.0) >= ENOUGH) {
        return view.eye(1.0);
    }
    let part = |elevation: f64| {
        let view = view(elevation);
        let (part, seen) = view.farthest();
        (view.eye(part), seen)
    };
    best(part).unwrap_or_default()
}

/// A way around the city: `out` is the direction from it at a part of the way, 0 to 1, that is
/// nowhere less than so many degrees above the horizon.
pub(super) fn around<'a>(
    ground: &'a Ground,
    anchor: DVec3,
    out: impl Fn(f64, f64) -> DVec3 + Sync + 'a,
) -> impl Fn(f64) -> Eye + 'a {
    let way = |elevation: f64| {
        let at = |index: usize| out(elevation, index as f64 / AROUND as f64);
        let views = (0..=AROUND).into_par_iter().map(|index| View::new(ground, anchor, at(index)));
        let found: Vec<(f64, f64)> = views.map(|view| view.farthest()).collect();
        let least = found.iter().map(|&(_, seen)| seen).fold(f64::INFINITY, f64::min);
        // As near as between the places on both sides.
        let is_closed = at(0).distance(at(AROUND)) < 1e-9;
        let near = |index: usize| {
            let end = |end: usize, other: usize| if is_closed { other } else { end };
            let before = if index == 0 { end(0, AROUND - 1) } else { index - 1 };
            let after = if index == AROUND { end(AROUND, 1) } else { index + 1 };
            [before, index, after].map(|at| found[at].0).into_iter().fold(f64::INFINITY, f64::min)
        };
        ((elevation, (0..=AROUND).map(near).collect()), least)
    };
    let shows_all = |&elevation: &f64| {
        (0..=AROUND).into_par_iter().all(|index| {
            let out = out(elevation, index as f64 / AROUND as f64);
            View::new(ground, anchor, out).seen(1.0) >= ENOUGH
        })
    };
    let all = |elevation: f64| (elevation, vec![1.0; AROUND + 1]);
    let (elevation, parts): (f64, Vec<f64>) = match ELEVATIONS_DEG.into_iter().find(shows_all) {
        Some(elevation) => all(elevation),
        None => best(way).unwrap_or_else(|| all(ELEVATIONS_DEG[0])),
    };
    move |part: f64| {
        let place = part.clamp(0.0, 1.0) * AROUND as f64;
        let before = (place as usize).min(AROUND - 1);
        let between = smooth(place - before as f64);
        let near = parts[before] + (parts[before + 1] - parts[before]) * between;
        View::new(ground, anchor, out(elevation, part)).eye(near)
    }
}

/// What is seen from the lowest elevation that shows enough, or from the one that shows most.
fn best<T>(look: impl Fn(f64) -> (T, f64)) -> Option<T> {
    let mut best: Option<(T, f64)> = None;
    for elevation in ELEVATIONS_DEG {
        if best.as_ref().is_some_and(|&(_, seen)| seen >= ENOUGH) {
            break;
        }
        let found = look(elevation);
        if best.as_ref().is_none_or(|&(_, seen)| found.1 > seen) {
            best = Some(found);
        }
    }
    best.map(|(found, _)| found)
}

/// The direction from a city to an eye that circles around it, at a part of the way, beginning at
/// `yaw_deg`.
pub(super) fn circle(yaw_deg: f64, elevation_deg: f64, part: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(elevation_deg.to_radians());
    (plan::direction(yaw_deg + 360.0 * part) * cos).extend(sin)
}
