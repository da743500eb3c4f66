//! Which cells there are to be.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::camera::CameraPath;
use crate::format::cells::place_of;

/// The cells in which eyes are, in the order of their places.
pub fn around(eyes: impl IntoIterator<Item = DVec3>, cell_m: f64) -> Vec<[i64; 3]> {
    let places: BTreeSet<_> =
        eyes.into_iter().map(|eye| place_of(cell_m, eye.to_array())).collect();
    places.into_iter().collect()
}

/// The cells that a path passes through, in the order of their places. Between two frames no more
/// than a quarter of a cell is taken at once, up to a jump of ten cells, between which nobody goes.
pub fn along(path: &CameraPath, cell_m: f64) -> Vec<[i64; 3]> {
    let mut places = BTreeSet::new();
    let positions = path.frames.iter().map(|frame| frame.pose.position);
    let mut before = None;
    for at in positions {
        places.insert(place_of(cell_m, at.to_array()));
        if let Some(before) = before.replace(at) {
            let steps = (at.distance(before) / (cell_m / 4.0)).ceil();
            if steps <= 40.0 {
                let steps = steps as u32;
                let between = |step: u32| before.lerp(at, f64::from(step) / f64::from(steps));
                places.extend((1..steps).map(|step| place_of(cell_m, between(step).to_array())));
            }
        }
    }
    places.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::camera::{PathFrame, Pose};

    #[test]
    fn a_path_passes_through_all_cells_between_its_frames() {
        let frame = |x: f64| PathFrame {
            frame: 0,
            time_s: 0.0,
            pose: Pose {
                position: DVec3::new(x, 1.0, -1.0),
                rotation: DQuat::IDENTITY,
                fov_y_deg: 60.0,
            },
        };
        let path = |xs: &[f64]| CameraPath { frames: xs.iter().map(|&x| frame(x)).collect() };
        let xs = |xs: &[f64]| along(&path(xs), 2.0).iter().map(|at| at[0]).collect::<Vec<_>>();
        assert_eq!(xs(&[-0.1, 7.9]), [-1, 0, 1, 2, 3]);
        assert_eq!(xs(&[7.9, -0.1, 7.9]), [-1, 0, 1, 2, 3]);
        assert_eq!(xs(&[0.0, 1000.0]), [0, 500], "a jump");
        assert_eq!(along(&path(&[5.0]), 2.0), [[2, 0, -1]]);
    }
}
