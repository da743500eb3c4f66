//! Runs on a graphics adapter, by the clock on the wall.

mod calibrate;
mod process;
mod snapshots;
mod world;

pub use calibrate::{calibrate, measure_start};
pub use snapshots::Snapshots;
pub use world::WallWorld;
