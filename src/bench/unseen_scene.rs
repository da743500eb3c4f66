//! Says where scene and camera are where a path does not show the scene.

use glam::DVec3;

use crate::camera::{CameraPath, View};
use crate::runtime::SceneTree;

/// Metres from the centre of the earth to its surface, with mountains and aircraft.
const EARTH_RADIUS_M: std::ops::Range<f64> = 6.3e6..6.5e6;

/// Returns whether any frame of a path shows the scene in an image of `size` pixels.
pub(super) fn is_ever_in_view(tree: &SceneTree, path: &CameraPath, size: [u32; 2]) -> bool {
    path.frames.iter().any(|at| tree.is_in_view(&View::new(at.pose, DVec3::ZERO, size)))
}

/// Describes where the scene and the camera of a frame are, and what may be wrong with the coordinates.
pub(super) fn positions(bounds: [DVec3; 2], frame: u64, eye: DVec3) -> String {
    let [min, max] = bounds;
    let point = |at: DVec3| format!("({:.2}, {:.2}, {:.2})", at.x, at.y, at.z);
    let are_degrees = |at: DVec3| at.x.abs() <= 180.0 && at.y.abs() <= 90.0;
    let hint = if EARTH_RADIUS_M.contains(&eye.length()) {
        "; these look like earth-centred coordinates (ECEF), which are not the scene's"
    } else if are_degrees(eye) && !are_degrees(min) && !are_degrees(max) {
        "; these look like degrees of longitude and latitude, or metres from another origin"
    } else {
        ""
    };
    format!(
        "the scene lies between {} and {}, the camera of frame {frame} is at {}, {:.1} m from \
         it{hint}",
        point(min),
        point(max),
        point(eye),
        eye.distance(eye.clamp(min, max))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_of_other_systems_are_recognised() {
        let bounds =
            [DVec3::new(678_000.0, 5_403_400.0, 380.0), DVec3::new(678_500.0, 5_404_000.0, 420.0)];
        let at = |x: f64, y: f64, z: f64| positions(bounds, 7, DVec3::new(x, y, z));
        assert!(at(4_135_000.0, 835_000.0, 4_769_000.0).contains("ECEF"));
        assert!(at(11.42, 48.76, 400.0).contains("degrees"));
        let beside = at(678_600.0, 5_403_500.0, 400.0);
        assert!(!beside.contains("look like") && beside.ends_with("400.00), 100.0 m from it"));
        assert!(beside.contains("between (678000.00, 5403400.00, 380.00)"), "{beside}");
    }
}
