//! Makes camera paths for any scene: along its streets, over it, around it.
//!
//! A [`Ground`] is read from the scene's coarse nodes once; [`make_path`] then makes any path on
//! it. The same ground, kind, numbers and seed give the same path.

mod aerial;
mod circuit;
mod eyes;
mod fly;
mod ground;
mod look;
mod orbit;
mod panorama;
mod plan;
mod raster;
mod route;
mod search;
mod sight;
mod stand;
mod streets;
mod sudden;
mod survey;
mod terrain;
#[cfg(test)]
mod tests;
mod travel;
mod window;

use glam::DVec3;

use super::{CameraPath, DEFAULT_FOV_Y_DEG, PathFrame, Pose, from_angles};
use crate::{Error, Result};

pub use eyes::{eyes_over, street_eyes};
pub use ground::Ground;
pub use stand::{SHAKE_PERIOD_S, SHAKE_SWAY_M, SHAKE_TURN_DEG};
pub use travel::{MAX_DRIVING_TURN_DEG_S, MAX_TURN_DEG_S};

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
/// that is too fast for its streets, and where it has none, walks and drives go around it; a drive
/// takes ten seconds across a scene at least. Pictures of 16 by 9 show the model in half of
/// their pixels, by a map of the scene, wherever that can be: cameras look aside or down for it, and
/// are no farther above a city that they should have in view than leaves that much.
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
        PathKind::Walk => route::path(ground, frames, fps, seed, route::WALK),
        PathKind::Drive => route::path(ground, frames, fps, seed, route::drive(ground)),
        PathKind::Fly => fly::path(ground, frames, fps, seed),
        PathKind::Orbit => orbit::path(ground, frames, fps),
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
            rotation: from_angles(ground.plan.up(), eye.yaw_deg, eye.pitch_deg, 0.0),
            fov_y_deg: DEFAULT_FOV_Y_DEG,
        },
    };
    Ok(CameraPath { frames: eyes.into_iter().zip(0..).map(frame).collect() })
}

/// A camera on the map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Eye {
    place: DVec3,
    /// May be beyond ±180°, so that nothing jumps.
    yaw_deg: f64,
    pitch_deg: f64,
}

impl Eye {
    /// Looks at another place.
    fn towards(place: DVec3, target: DVec3) -> Self {
        let ahead = target - place;
        let pitch = libm::atan2(ahead.z, ahead.truncate().length()).to_degrees();
        Self { place, yaw_deg: plan::yaw_deg(ahead.truncate()), pitch_deg: pitch }
    }

    /// On the straight way to another, turning the shorter way.
    fn between(&self, other: &Self, part: f64) -> Self {
        Self {
            place: self.place.lerp(other.place, part),
            yaw_deg: self.yaw_deg + travel::turn(self.yaw_deg, other.yaw_deg) * part,
            pitch_deg: self.pitch_deg + (other.pitch_deg - self.pitch_deg) * part,
        }
    }
}

/// From 0 to 1 without a jolt at either end, and 0 or 1 beyond.
fn smooth(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}
