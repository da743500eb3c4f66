//! Rotations of a camera from angles, and from the point that it looks at.

use glam::{DMat3, DQuat, DVec3};

use crate::mesh::UpAxis;

/// The direction of the sky.
pub fn up_vector(up: UpAxis) -> DVec3 {
    match up {
        UpAxis::Y => DVec3::Y,
        UpAxis::Z => DVec3::Z,
    }
}

/// The direction of yaw 90° with pitch 0; that of yaw 0 is +x.
fn left_of_x(up: UpAxis) -> DVec3 {
    up_vector(up).cross(DVec3::X)
}

/// The rotation of a camera by angles in degrees.
///
/// `yaw` turns counter-clockwise as seen from the sky, 0 being along +x; `pitch` raises the view
/// above the horizon; `roll` turns the camera clockwise about its line of sight.
pub fn from_angles(up: UpAxis, yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> DQuat {
    // The same on every machine, unlike the system's.
    let (yaw_sin, yaw_cos) = libm::sincos(yaw_deg.to_radians());
    let (pitch_sin, pitch_cos) = libm::sincos(pitch_deg.to_radians());
    let sky = up_vector(up);
    let level = DVec3::X * yaw_cos + left_of_x(up) * yaw_sin;
    let forward = level * pitch_cos + sky * pitch_sin;
    // Unlike a cross product of the line of sight and the sky, this holds at the zenith too.
    let right = DVec3::X * yaw_sin - left_of_x(up) * yaw_cos;
    let upright = DQuat::from_mat3(&DMat3::from_cols(right, right.cross(forward), -forward));
    let (sin, cos) = libm::sincos(-roll_deg.to_radians() / 2.0);
    (upright * DQuat::from_xyzw(0.0, 0.0, sin, cos)).normalize()
}

/// The rotation of an upright camera at `eye` that looks at `target`; `None` where the two
/// coincide. Straight up or down, the picture's top is what yaw 0 makes it.
pub fn looking_at(up: UpAxis, eye: DVec3, target: DVec3) -> Option<DQuat> {
    let forward = (target - eye).try_normalize()?;
    let sky = up_vector(up);
    let height = forward.dot(sky).clamp(-1.0, 1.0);
    let yaw = libm::atan2(forward.dot(left_of_x(up)), forward.x);
    Some(from_angles(up, yaw.to_degrees(), libm::asin(height).to_degrees(), 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-12
    }

    #[test]
    fn angles_turn_as_they_say_under_either_sky() {
        for up in [UpAxis::Y, UpAxis::Z] {
            let sky = up_vector(up);
            let ahead = from_angles(up, 0.0, 0.0, 0.0);
            assert!(near(ahead * DVec3::NEG_Z, DVec3::X));
            assert!(near(ahead * DVec3::Y, sky));
            let left = from_angles(up, 90.0, 0.0, 0.0);
            assert!(near(left * DVec3::NEG_Z, sky.cross(DVec3::X)));
            let zenith = from_angles(up, 0.0, 90.0, 0.0);
            assert!(near(zenith * DVec3::NEG_Z, sky));
            assert!(near(zenith * DVec3::Y, DVec3::NEG_X));
            // A camera that rolls clockwise sees its top turn to the right.
            let rolled = from_angles(up, 0.0, 0.0, 90.0);
            assert!(near(rolled * DVec3::Y, ahead * DVec3::X));
        }
    }

    #[test]
    fn a_target_is_in_the_middle_and_the_camera_upright() {
        for up in [UpAxis::Y, UpAxis::Z] {
            let eye = DVec3::new(5e6, -3.0, 7.0);
            for target in [DVec3::new(1.0, 2.0, 3.0), eye + DVec3::Y, eye - DVec3::Z * 4.0] {
                let rotation = looking_at(up, eye, target).unwrap();
                let forward = (target - eye).normalize();
                assert!((rotation * DVec3::NEG_Z - forward).length() < 1e-7);
                assert!((rotation * DVec3::X).dot(up_vector(up)).abs() < 1e-9);
                assert!((rotation * DVec3::Y).dot(up_vector(up)) > -1e-9);
            }
            assert_eq!(looking_at(up, eye, eye), None);
        }
    }
}
