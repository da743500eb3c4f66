//! Runs on a graphics adapter, by the clock on the wall.

mod backend;
mod calibrate;
mod clock_fit;
mod measurement_scene;
mod process;
mod snapshots;

pub use backend::GpuBackend;
pub use calibrate::{Calibration, calibrate, measure_start};
pub use snapshots::Snapshots;
