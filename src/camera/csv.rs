//! Camera paths as text: a header, then one row a frame.
//!
//! ```text
//! frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg
//! ```
//!
//! Columns stand in any order. In place of the quaternion a row may have `yaw_deg,pitch_deg` and
//! perhaps `roll_deg`, or a target `tx,ty,tz`; [`from_angles`](super::from_angles) and
//! [`looking_at`](super::looking_at) say what they mean. `fov_y_deg` may be left out. Spaces
//! around fields, empty lines and lines that begin with `#` are passed over.
//!
//! `time_s` is in seconds from any origin, and never falls. Stamps that look like milliseconds,
//! microseconds or nanoseconds are refused.

mod columns;
mod read;
#[cfg(test)]
mod tests;
mod time_unit;
mod write;

pub use read::{parse_path, read_path};
pub use write::{format_path, write_path};

/// The vertical angle of view where a path does not give one, degrees.
pub const DEFAULT_FOV_Y_DEG: f64 = 60.0;
