//! Paths with cuts.

use hlod::camera::Pose;

use super::rig::{Fault, Frames, Ground, LATE, SECOND, frames};

/// Frames from a cut to the next.
const SCENE: usize = 3 * SECOND;

const CUTS: usize = 12;

/// Seconds for which frames in a row may be late after a cut.
const LATE_S: f64 = 0.2;

/// All over the scene, in every direction, from below the roofs and from above.
fn pose(ground: &Ground, cut: usize) -> Pose {
    let part = |step: usize| (cut * step % CUTS) as f64 / CUTS as f64;
    ground.pose([part(5), 0.3 + 0.4 * part(7), 0.4 + part(1)], 97.0 * cut as f64, -12.0)
}

/// The longest time for which frames in a row are late, seconds.
fn longest_late_s(run: &Frames, target_ms: f64) -> f64 {
    let (mut longest, mut late) = (0.0f64, 0.0);
    for frame in &run.reports {
        late = if frame.frame_ms > LATE * target_ms { late + frame.frame_ms / 1e3 } else { 0.0 };
        longest = longest.max(late);
    }
    longest
}

#[test]
fn frames_keep_to_the_target_after_cuts() {
    for ground in [Ground::city(), Ground::street()] {
        for policy in ["gain-over-price", "best-first"] {
            let pose = |frame: usize| pose(&ground, frame / SCENE);
            let no_fault = |_| Fault::default();
            let run = frames(&ground, policy, CUTS * SCENE, 1 << 30, pose, no_fault);
            let late_s = longest_late_s(&run, ground.target_ms);
            assert!(late_s <= LATE_S, "{} {policy}: late for {late_s} s", ground.name);
            for cut in 0..CUTS {
                let steady = cut * SCENE + SECOND..(cut + 1) * SCENE;
                assert_eq!(run.late(steady), 0, "{} {policy} cut {cut}", ground.name);
            }
            // A test in which nothing is drawn would say nothing.
            let drawn = (0..CUTS).filter(|cut| run.triangles(cut * SCENE..cut * SCENE + 1) > 0.0);
            assert!(drawn.count() > CUTS / 2, "{}", ground.name);
        }
    }
}
