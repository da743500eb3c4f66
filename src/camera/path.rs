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

/// The longest time between two frames that a replay plays, seconds. Longer gaps in a recording
/// are shortened to it.
pub const LONGEST_INTERVAL_S: f64 = 1.0;

/// Gaps between time stamps that are longer than [`LONGEST_INTERVAL_S`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LongGaps {
    /// How many there are.
    pub count: usize,
    /// The longest of them as recorded, seconds; 0 without any.
    pub longest_s: f64,
    /// Index of the frame after which it comes.
    pub longest_after: usize,
}

impl CameraPath {
    /// Seconds from frame `index` to the next as a replay plays them: as recorded, at most
    /// [`LONGEST_INTERVAL_S`]. The last frame lasts as long as the one before it; the frame of a
    /// path of one takes no time.
    pub fn interval_s(&self, index: usize) -> f64 {
        let last = self.frames.len() - 1;
        let from = index.min(last.saturating_sub(1));
        let to = (from + 1).min(last);
        (self.frames[to].time_s - self.frames[from].time_s).min(LONGEST_INTERVAL_S)
    }

    /// Gaps that a replay shortens.
    pub fn long_gaps(&self) -> LongGaps {
        let mut gaps = LongGaps::default();
        for (index, pair) in self.frames.windows(2).enumerate() {
            let gap_s = pair[1].time_s - pair[0].time_s;
            gaps.count += usize::from(gap_s > LONGEST_INTERVAL_S);
            if gap_s > LONGEST_INTERVAL_S && gap_s > gaps.longest_s {
                (gaps.longest_s, gaps.longest_after) = (gap_s, index);
            }
        }
        gaps
    }

    /// Whether there are several frames and no time passes between any of them.
    pub fn is_without_time(&self) -> bool {
        self.frames.len() > 1 && self.frames.windows(2).all(|pair| pair[0].time_s == pair[1].time_s)
    }

    /// The same frames at a fixed rate, from the first time stamp on.
    pub fn at_rate(mut self, frames_per_s: f64) -> Self {
        let first_s = self.frames.first().map_or(0.0, |frame| frame.time_s);
        for (index, frame) in self.frames.iter_mut().enumerate() {
            frame.time_s = first_s + index as f64 / frames_per_s;
        }
        self
    }

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

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn path(stamps: &[f64]) -> CameraPath {
        let pose = Pose { position: DVec3::ZERO, rotation: DQuat::IDENTITY, fov_y_deg: 60.0 };
        let frame = |(frame, &time_s): (u64, &f64)| PathFrame { frame, time_s, pose };
        CameraPath { frames: (0..).zip(stamps).map(frame).collect() }
    }

    #[test]
    fn gaps_are_played_as_a_second_at_most() {
        let path = path(&[0.0, 0.5, 3600.5, 3601.5, 3603.0]);
        let played: Vec<f64> = (0..5).map(|index| path.interval_s(index)).collect();
        assert_eq!(played, [0.5, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(path.long_gaps(), LongGaps { count: 2, longest_s: 3600.0, longest_after: 1 });
    }

    #[test]
    fn paths_of_one_frame_have_no_gap_and_no_interval() {
        let path = path(&[7.0]);
        assert_eq!((path.interval_s(0), path.long_gaps()), (0.0, LongGaps::default()));
        assert!(!path.is_without_time());
    }

    #[test]
    fn stamps_that_are_all_equal_can_be_played_at_a_rate() {
        let still = path(&[5.0; 4]);
        assert!(still.is_without_time() && !path(&[5.0, 5.0, 6.0]).is_without_time());
        let played = still.at_rate(10.0);
        assert_eq!(
            played.frames.iter().map(|at| at.time_s).collect::<Vec<_>>(),
            [5.0, 5.1, 5.2, 5.3]
        );
    }
}
