//! Runs on a graphics adapter, by the clock on the wall.

mod calibrate;
mod fit;
mod process;
mod snapshots;
mod stage;
mod world;

pub use calibrate::{calibrate, measure_start};
pub use snapshots::Snapshots;
pub use world::WallWorld;
pub(in crate::bench) use world::near_plane;
