//! A recorded path: one pose a frame.

use glam::DVec3;

use super::Pose;

/// One frame of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFrame {
    /// Its number, as the file gives it.
    pub frame: u64,
    /// Seconds; never less than in the frame before.
    pub time_s: f64,
    /// The camera.
    pub pose: Pose,
}

/// A camera path; at least one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// In the order in which they are drawn.
    pub frames: Vec<PathFrame>,
}

impl CameraPath {
    /// Metres a second of the eye between frame `index − 1` and `index`; zero in the first frame,
    /// and where no time passes between the two.
    pub fn velocity(&self, index: usize) -> DVec3 {
        let Some(before) = index.checked_sub(1) else { return DVec3::ZERO };
        let (before, now) = (&self.frames[before], &self.frames[index]);
        let seconds = now.time_s - before.time_s;
        if seconds > 0.0 {
            (now.pose.position - before.pose.position) / seconds
        } else {
            DVec3::ZERO
        }
    }
}
