//! Whether a camera goes to and fro, and what time is kept free where it does.
//!
//! To and fro, the same front takes longer at one end than at the other. What fills the time at the one does
//! not fit at the other, is taken back there, and fills it again. So the time that a front took where it took most
//! of late is what is filled up from, everywhere; and since what is refined may take more there than here, some is kept
//! free for each time that it did.

use std::collections::VecDeque;

use glam::DVec3;

use super::levels::BACK_WITHIN_S;
use crate::camera::Pose;

/// Where it went is half forgotten after so many seconds.
const OF_LATE_S: f64 = 8.0;

/// A camera gets on where what it covers of late is at least this part of the way that it went.
const GETS_ON: f64 = 0.5;

/// It goes to and fro once it has not for so many seconds: going back once is none.
const LASTS_S: f64 = 3.0;

/// So often it is remembered where a camera looked, seconds.
const EVERY_S: f64 = 0.5;

/// It has turned away where it looked this cosine aside of late: by 45°.
const AWAY: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// By this part of the budget less is filled for each time that what filled it was taken back,
const STEP: f64 = 0.04;

/// and by no more than this.
const MOST: f64 = 0.3;

/// What a camera went of late, each step counted less the longer ago it is.
#[derive(Clone, Debug, Default)]
pub(super) struct Sway {
    moved: Way,
    turned: Way,
    now_s: f64,
    /// Where it looked, and when.
    looked: VecDeque<(f64, DVec3)>,
    /// For so long it does not get on, seconds.
    stays_s: f64,
    /// When, and how many milliseconds the front took then, without what it was changed by: of late, and each less
    /// than the one before it.
    took: VecDeque<(f64, f64)>,
    /// Milliseconds that it takes more by all changes to it.
    changed_ms: f64,
    reserve: f64,
}

impl Sway {
    /// It went from one pose to another within `dt_s` seconds.
    pub fn go(&mut self, from: &Pose, to: &Pose, dt_s: f64) {
        let kept = libm::exp2(-dt_s / OF_LATE_S);
        self.moved.go(to.position - from.position, kept);
        let turn = (to.rotation * from.rotation.conjugate()).normalize();
        // A turn and its opposite stand for the same.
        let half = DVec3::new(turn.x, turn.y, turn.z) * turn.w.signum();
        self.turned.go(half, kept);
        self.now_s += dt_s;
        let forward = to.forward();
        let is_old = |&(at_s, _): &(f64, DVec3)| self.now_s - at_s > BACK_WITHIN_S;
        while self.looked.front().is_some_and(is_old) {
            self.looked.pop_front();
        }
        if self.looked.back().is_none_or(|&(at_s, _)| self.now_s - at_s >= EVERY_S) {
            self.looked.push_back((self.now_s, forward));
        }
        let has_turned = || self.looked.iter().any(|(_, looked)| looked.dot(forward) < AWAY);
        if self.moved.gets_on() || self.turned.gets_on() || has_turned() {
            (self.stays_s, self.reserve) = (0.0, 0.0);
        } else if from != to {
            self.stays_s += dt_s;
        }
    }

    /// Whether for some time it has not got on by place, nor by direction, nor turned away, though it moved.
    pub fn is_to_and_fro(&self) -> bool {
        self.stays_s >= LASTS_S
    }

    /// How many milliseconds more than the `ms` of this frame the front, as it is now, took where it took most of late;
    /// none unless the camera goes to and fro.
    pub fn takes_more(&mut self, ms: f64) -> f64 {
        if !self.is_to_and_fro() {
            self.took.clear();
            self.changed_ms = 0.0;
            return 0.0;
        }
        let is_old = |&(at_s, _): &(f64, f64)| self.now_s - at_s > BACK_WITHIN_S;
        while self.took.front().is_some_and(is_old) {
            self.took.pop_front();
        }
        let unchanged_ms = ms - self.changed_ms;
        while self.took.back().is_some_and(|&(_, less_ms)| less_ms <= unchanged_ms) {
            self.took.pop_back();
        }
        self.took.push_back((self.now_s, unchanged_ms));
        self.took[0].1 - unchanged_ms
    }

    /// The front was changed, by so many milliseconds.
    pub fn change(&mut self, ms: f64) {
        self.changed_ms += ms;
    }

    /// What was refined shortly before is taken back, for want of time.
    pub fn take_back(&mut self) {
        if self.is_to_and_fro() {
            self.reserve = (self.reserve + STEP).min(MOST);
        }
    }

    /// The part of the budget that is kept free.
    pub fn reserve(&self) -> f64 {
        self.reserve
    }
}

/// Steps: their sum, and the sum of their lengths.
#[derive(Clone, Debug, Default)]
struct Way {
    covered: DVec3,
    length: f64,
}

impl Way {
    fn go(&mut self, step: DVec3, kept: f64) {
        self.covered = self.covered * kept + step;
        self.length = self.length * kept + step.length();
    }

    fn gets_on(&self) -> bool {
        self.length > 0.0 && self.covered.length() >= GETS_ON * self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::from_angles;
    use crate::mesh::UpAxis;

    const DT_S: f64 = 1.0 / 30.0;

    /// Whether a camera goes to and fro at each frame of a minute, after a quarter of it, that is at `metres` and
    /// looks by `degrees` aside at a time.
    fn is_to_and_fro(metres: impl Fn(f64) -> [f64; 2], degrees: impl Fn(f64) -> f64) -> Vec<bool> {
        let pose = |frame: u32| {
            let time_s = f64::from(frame) * DT_S;
            let [x, y] = metres(time_s);
            let rotation = from_angles(UpAxis::Z, degrees(time_s), 0.0, 0.0);
            Pose { position: DVec3::new(x, y, 1.7), rotation, fov_y_deg: 60.0 }
        };
        let mut sway = Sway::default();
        let mut found = Vec::new();
        for frame in 1..1800 {
            sway.go(&pose(frame - 1), &pose(frame), DT_S);
            found.push(sway.is_to_and_fro());
        }
        found.split_off(450)
    }

    /// A sine of so many seconds.
    fn wave(time_s: f64, period_s: f64) -> f64 {
        (time_s * std::f64::consts::TAU / period_s).sin()
    }

    #[test]
    fn who_walks_turns_or_flies_back_does_not_go_to_and_fro() {
        let stands = |_: f64| [3.0, 4.0];
        // A head goes from side to side at each step.
        let walks = is_to_and_fro(|s| [1.4 * s, 0.03 * wave(s, 1.0)], |s| wave(s, 1.0));
        let turns = is_to_and_fro(stands, |s| 20.0 * s);
        let pans = is_to_and_fro(stands, |s| 2.0 * s);
        let back = |s: f64| (s - 30.0) / 2.0;
        let flies_back = is_to_and_fro(
            |s| [-60.0 * back(s).cosh().ln(), 20.0 * wave(s, 7.0)],
            |s| 90.0 * back(s).tanh() + 15.0 * wave(s, 3.0),
        );
        let goes_back_once =
            is_to_and_fro(|s| [100.0 * (20.0 * (s - 30.0)).tanh().powi(2), 0.0], |_| 0.0);
        let still = is_to_and_fro(stands, |_| 30.0);
        for found in [walks, turns, pans, flies_back, goes_back_once, still] {
            assert!(found.iter().all(|&is| !is));
        }
        let sways = is_to_and_fro(|s| [0.75 * wave(s, 12.0), 0.0], |_| 0.0);
        let looks = is_to_and_fro(stands, |s| 10.0 * wave(s, 12.0));
        for found in [sways, looks] {
            assert!(found.iter().all(|&is| is));
        }
    }

    /// A camera that sways once in six seconds, of which the same front takes 20 ms on one side and 10 on the other.
    #[test]
    fn the_longest_that_a_front_took_of_late_counts_everywhere() {
        let pose = |frame: u32| Pose {
            position: DVec3::new(wave(f64::from(frame) * DT_S, 6.0), 0.0, 0.0),
            rotation: from_angles(UpAxis::Z, 0.0, 0.0, 0.0),
            fov_y_deg: 60.0,
        };
        let ms = |frame: u32| 15.0 + 5.0 * pose(frame).position.x;
        let mut sway = Sway::default();
        let mut more = Vec::new();
        for frame in 1..1800 {
            sway.go(&pose(frame - 1), &pose(frame), DT_S);
            // By a third less from the middle on, wherever it is.
            let part = if frame >= 900 { 2.0 / 3.0 } else { 1.0 };
            more.push((ms(frame) * part, sway.takes_more(ms(frame) * part)));
            if frame == 899 {
                sway.change(-20.0 / 3.0);
            }
        }
        assert_eq!(more[10].1, 0.0, "not yet to and fro");
        let all = |frames: std::ops::Range<usize>, most: f64| {
            more[frames].iter().all(|(ms, more)| (ms + more - most).abs() < 0.01)
        };
        assert!(all(450..898, 20.0));
        // What a change takes there is known once it was there again.
        assert!(all(900 + 450..1799, 40.0 / 3.0));
        sway.go(&pose(0), &Pose { position: DVec3::X * 50.0, ..pose(0) }, DT_S);
        assert_eq!(sway.takes_more(10.0), 0.0, "it gets on");
    }

    #[test]
    fn time_is_kept_free_until_the_camera_gets_on() {
        let pose = |x: f64| Pose {
            position: DVec3::new(x, 0.0, 0.0),
            rotation: from_angles(UpAxis::Z, 0.0, 0.0, 0.0),
            fov_y_deg: 60.0,
        };
        let mut sway = Sway::default();
        let mut sways = |seconds: u32| {
            for _ in 0..seconds {
                sway.go(&pose(0.0), &pose(1.0), 0.5);
                sway.go(&pose(1.0), &pose(0.0), 0.5);
            }
            sway.take_back();
            sway.clone()
        };
        assert_eq!(sways(2).reserve(), 0.0, "not for long");
        assert!((sways(2).reserve() - STEP).abs() < 1e-12);
        let mut sway = (0..100).map(|_| sways(0)).last().unwrap();
        assert!((sway.reserve() - MOST).abs() < 1e-12);
        sway.go(&pose(0.0), &pose(9.0), DT_S);
        assert_eq!(sway.reserve(), 0.0);
    }
}
