//! Cameras: where one stands and looks ([`Pose`]), what it sees ([`View`], [`Frustum`]), and the
//! paths that runs replay ([`CameraPath`]).
//!
//! A camera looks along its own −z, with x to the right and y up in the picture; the rotation
//! turns these axes into the scene's. Positions are source coordinates in f64.

mod angles;
mod csv;
mod frustum;
mod path;
mod pose;
mod view;

pub use angles::{from_angles, looking_at, up_vector};
pub use csv::{DEFAULT_FOV_Y_DEG, format_path, parse_path, read_path, write_path};
pub use frustum::Frustum;
pub use path::{CameraPath, PathFrame};
pub use pose::Pose;
pub use view::View;
