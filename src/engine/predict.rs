//! Where the camera is expected to be soon.

use glam::{DQuat, DVec3};

use super::PredictedView;
use crate::camera::{Pose, View};

/// Seconds for which views are predicted.
const AFTER_S: [f64; 3] = [0.25, 0.5, 1.0];

/// Turns of more than this in a frame are cuts, and not expected to go on; radians.
const CUT: f64 = 0.5;

/// Expects a camera to go on moving and turning as it did since the frame before.
///
/// `before` is its pose `dt_s` seconds ago; without one it is expected to go on straight.
pub fn predict(before: Option<&Pose>, view: &View, dt_s: f64, out: &mut Vec<PredictedView>) {
    out.clear();
    let turn = before.filter(|_| dt_s > 0.0).and_then(|before| turn(before, &view.pose));
    out.extend(AFTER_S.map(|after_s| {
        let position = view.pose.position + view.velocity * after_s;
        let rotation = match turn {
            Some((axis, angle)) => {
                about(axis, (angle * after_s / dt_s).min(std::f64::consts::PI)) * view.pose.rotation
            }
            None => view.pose.rotation,
        };
        let pose = Pose { position, rotation: rotation.normalize(), ..view.pose };
        PredictedView { after_s, view: View::new(pose, view.velocity, view.size) }
    }));
}

/// Axis and angle by which a camera turned; `None` where it did not, or was cut.
fn turn(before: &Pose, now: &Pose) -> Option<(DVec3, f64)> {
    let turn = now.rotation * before.rotation.inverse();
    // The short way round.
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let across = DVec3::new(turn.x, turn.y, turn.z);
    let angle = 2.0 * libm::atan2(across.length(), turn.w);
    across.try_normalize().map(|axis| (axis, angle)).filter(|&(_, angle)| angle < CUT)
}

/// The same on every machine, unlike [`DQuat::from_axis_angle`].
fn about(axis: DVec3, angle: f64) -> DQuat {
    let across = axis * libm::sin(angle / 2.0);
    DQuat::from_xyzw(across.x, across.y, across.z, libm::cos(angle / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::view;

    #[test]
    fn a_camera_goes_on_as_it_moves_and_turns() {
        let mut now = view();
        now.velocity = DVec3::new(2.0, 0.0, 0.0);
        let step = DQuat::from_rotation_z(0.01);
        let before = Pose { rotation: step.inverse() * now.pose.rotation, ..now.pose };
        let mut out = Vec::new();
        predict(Some(&before), &now, 0.1, &mut out);
        let expected = DQuat::from_rotation_z(0.1) * now.pose.rotation;
        let found = &out[2];
        assert_eq!((found.after_s, found.view.pose.position.x), (1.0, 2.0));
        assert!(found.view.pose.rotation.dot(expected).abs() > 1.0 - 1e-12);
    }

    #[test]
    fn cuts_and_first_frames_are_not_extrapolated() {
        let now = view();
        let mut out = Vec::new();
        let turned = Pose { rotation: DQuat::from_rotation_z(2.0) * now.pose.rotation, ..now.pose };
        for (before, dt_s) in [(None, 0.0), (Some(&turned), 0.03), (Some(&turned), 0.0)] {
            predict(before, &now, dt_s, &mut out);
            assert!(out.iter().all(|at| at.view.pose == now.pose), "{out:?}");
        }
    }
}
