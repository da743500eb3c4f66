//! Makes camera paths for any scene: along its streets, over it, around it.
//!
//! A [`Ground`] is read from the scene's coarse nodes once; [`make_path`] then makes any path on
//! it. The same ground, kind, numbers and seed give the same path.

mod circuit;
mod fly;
mod ground;
mod orbit;
mod plan;
mod raster;
mod search;
mod stand;
mod streets;
mod sudden;
mod survey;
mod terrain;
#[cfg(test)]
mod tests;
mod travel;
mod view_from;
mod window;

use glam::{DQuat, DVec3};

use super::{CameraPath, DEFAULT_FOV_Y_DEG, PathFrame, Pose, from_angles};
use crate::{Error, Result};
use circuit::Circuit;

pub use ground::Ground;
pub use stand::{SHAKE_PERIOD_S, SHAKE_SWAY_M, SHAKE_TURN_DEG};
pub use travel::MAX_TURN_DEG_S;

/// Frames a second where nothing else is asked for.
pub const DEFAULT_FPS: f64 = 30.0;
/// Metres a second of who walks.
pub const WALK_M_S: f64 = 1.5;
/// Metres a second of who drives: ten times as fast, as in Lakhia's thesis, section 6.5.
pub const DRIVE_M_S: f64 = 15.0;
/// Frames a second that can be asked for, least and most.
const FPS_RANGE: [f64; 2] = [0.1, 1000.0];
/// Frames that can be asked for at most.
const MAX_FRAMES: usize = 10_000_000;

/// A kind of camera path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum PathKind {
    /// Along the streets at eye height, 1.5 m/s, looking ahead
    Walk,
    /// Along the same streets ten times as fast
    Drive,
    /// Begins as a walk, rises until the whole city is in view, and passes over it
    Fly,
    /// A circle around the city, then through its middle and back
    Orbit,
    /// Stands still at a place with much in view
    Still,
    /// At the same place, sways back and forth and turns a little
    Shake,
    /// At the same place, looks away, and back, each at once
    Turn,
    /// From the same place to where all of the city is in view in one second, and back
    Rise,
}

impl PathKind {
    /// Frames where no number is asked for: at 30 a second, enough to see what the kind is for.
    pub fn default_frames(self) -> usize {
        match self {
            Self::Walk | Self::Drive | Self::Orbit => 1200,
            Self::Fly => 900,
            Self::Still => 300,
            Self::Shake | Self::Turn => 720,
            Self::Rise => 1080,
        }
    }
}

/// Makes a path of `frames` frames at `fps` frames a second.
///
/// All have a vertical angle of view of 60°. Eyes are 1.7 m above the ground; in a scene less than
/// 17 m wide, a tenth of its width. Speeds are in metres whatever the size of the scene; where
/// that is too fast for its streets, and where it has none, walks and drives go around it. The
/// whole city is in view, where it should be, in pictures at least as wide as high.
pub fn make_path(
    ground: &Ground,
    kind: PathKind,
    frames: usize,
    fps: f64,
    seed: u64,
) -> Result<CameraPath> {
    if !(1..=MAX_FRAMES).contains(&frames) {
        return Err(Error::Usage(format!("frames: expected 1 to {MAX_FRAMES}, found {frames}")));
    }
    let [least, most] = FPS_RANGE;
    if !(least..=most).contains(&fps) {
        return Err(Error::Usage(format!("fps: expected {least} to {most}, found {fps}")));
    }
    let eyes = match kind {
        PathKind::Walk => follow(ground, frames, fps, seed, WALK_M_S),
        PathKind::Drive => follow(ground, frames, fps, seed, DRIVE_M_S),
        PathKind::Fly => fly::path(ground, frames, fps, seed),
        PathKind::Orbit => orbit::path(ground, frames),
        PathKind::Still => stand::still(ground, frames, seed),
        PathKind::Shake => stand::shake(ground, frames, fps, seed),
        PathKind::Turn => sudden::turn(ground, frames, fps, seed),
        PathKind::Rise => sudden::rise(ground, frames, fps, seed),
    };
    let frame = |(eye, frame): (Eye, u64)| PathFrame {
        frame,
        time_s: frame as f64 / fps,
        pose: Pose {
            position: ground.plan.source(eye.place),
            rotation: eye.rotation,
            fov_y_deg: DEFAULT_FOV_Y_DEG,
        },
    };
    Ok(CameraPath { frames: eyes.into_iter().zip(0..).map(frame).collect() })
}

/// A camera on the map: its place there, but its rotation into the source's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Eye {
    place: DVec3,
    rotation: DQuat,
}

impl Eye {
    /// Looks along a yaw and a pitch.
    fn level(ground: &Ground, place: DVec3, yaw_deg: f64, pitch_deg: f64) -> Self {
        Self { place, rotation: from_angles(ground.plan.up(), yaw_deg, pitch_deg, 0.0) }
    }

    /// Looks at another place.
    fn towards(ground: &Ground, place: DVec3, target: DVec3) -> Self {
        let ahead = target - place;
        let pitch = libm::atan2(ahead.z, ahead.truncate().length()).to_degrees();
        Self::level(ground, place, plan::yaw_deg(ahead.truncate()), pitch)
    }
}

/// Along the streets at `speed` metres a second, looking ahead.
fn follow(ground: &Ground, frames: usize, fps: f64, seed: u64, speed: f64) -> Vec<Eye> {
    // The same route at any speed, wherever the streets are long enough for it.
    let route = Circuit::make(ground, seed, DRIVE_M_S / fps);
    let places = route.march(frames + travel::ahead(fps), |_| speed / fps);
    let places = places.unwrap_or_default();
    let yaws = travel::yaws(&places, fps);
    let eye = |(&place, &yaw): (&DVec3, &f64)| Eye::level(ground, place, yaw, 0.0);
    places.iter().zip(&yaws).take(frames).map(eye).collect()
}

/// From 0 to 1 without a jolt at either end, and 0 or 1 beyond.
fn smooth(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}
