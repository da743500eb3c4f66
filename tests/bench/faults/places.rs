//! Cameras where none should be.

use glam::DVec3;
use hlod::Error;
use hlod::camera::{Pose, from_angles};
use hlod::mesh::UpAxis;

use super::rig::{Fault, Ground, SECOND, frames, refused_view};
use super::steady::{Detail, assert_steady};

/// The frame in which the camera is first there, and the one in which it is back.
const THERE: [usize; 2] = [300, 390];

const ROOM: u64 = 1 << 30;

/// Cameras inside of geometry, at the edge of a box, far and very far outside, and turned away.
fn places(ground: &Ground) -> Vec<(&'static str, Pose)> {
    let here = ground.walk(THERE[0]);
    let at = |position: DVec3| Pose { position, ..here };
    let bbox = ground.tree.node(ground.tree.roots()[0]).bbox;
    let up = from_angles(UpAxis::Z, 0.0, 90.0, 0.0);
    let back = from_angles(UpAxis::Z, 180.0, 0.0, 0.0);
    let away = |metres: f64| at(here.position + DVec3::new(-metres, metres / 2.0, 0.0));
    vec![
        ("in a wall", at(ground.wall)),
        ("in a box", at((bbox[0] + bbox[1]) / 2.0)),
        ("at a corner", at(bbox[0])),
        ("100 km away", away(1e5)),
        ("a million km away", away(1e9)),
        ("at the end of numbers", away(1e300)),
        ("looking up", Pose { rotation: up, ..at(bbox[1] + 10.0) }),
        ("looking away", Pose { rotation: back, ..at(bbox[0] - 10.0) }),
        ("through a pinhole", Pose { fov_y_deg: 1e-3, ..here }),
    ]
}

#[test]
fn cameras_in_odd_places_are_steady_there_and_when_they_are_back() {
    for ground in [Ground::city(), Ground::street()] {
        let still = |_| ground.walk(THERE[0]);
        let policy = "gain-over-price";
        let undisturbed = frames(&ground, policy, 540, ROOM, still, |_| Fault::default());
        for (place, pose) in places(&ground) {
            let what = format!("{} {place}", ground.name);
            let at = |frame| match (THERE[0]..THERE[1]).contains(&frame) {
                true => pose,
                false => still(frame),
            };
            let run = frames(&ground, policy, 540, ROOM, at, |_| Fault::default());
            let there = THERE[0] + SECOND..THERE[1];
            assert_eq!(run.late(there.clone()), 0, "{what}");
            // What was seen before is forgotten over seconds, for which a few nodes make way.
            let chosen = run.chosen(there);
            assert!(chosen <= 6, "{what}: {chosen} toggles");
            assert_steady(&what, &run, &undisturbed, THERE[1], Detail::AtOnce);
        }
    }
}

#[test]
fn a_camera_that_is_nowhere_is_refused() {
    let ground = Ground::street();
    let here = ground.walk(0);
    for nowhere in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut turned = here;
        turned.rotation.y = nowhere;
        let away = Pose { position: DVec3::new(1.0, nowhere, 2.0), ..here };
        for pose in [away, turned, Pose { fov_y_deg: nowhere, ..here }] {
            let error = refused_view(&ground, pose);
            assert!(matches!(error, Error::Usage(_)), "{error}");
            assert!(error.to_string().starts_with("camera: expected finite numbers"), "{error}");
        }
    }
}
