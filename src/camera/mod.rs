//! Cameras: where one stands and looks ([`Pose`]), what it sees ([`View`], [`Frustum`]), and the
//! paths that runs replay ([`CameraPath`]).
//!
//! A camera looks along its own −z, with x to the right and y up in the picture; the rotation
//! turns these axes into the scene's. Positions are source coordinates in f64.

mod angles;
mod csv;
mod frustum;
mod make;
mod path;
mod pose;
mod view;

pub use angles::{from_angles, looking_at, up_vector};
pub use csv::{DEFAULT_FOV_Y_DEG, format_path, parse_path, read_path, write_path};
pub use frustum::Frustum;
pub use make::{
    DEFAULT_FPS, DRIVE_M_S, Ground, MAX_TURN_DEG_S, PathKind, SHAKE_PERIOD_S, SHAKE_SWAY_M,
    SHAKE_TURN_DEG, WALK_M_S, eyes_over, make_path, street_eyes,
};
pub use path::{CameraPath, LONGEST_INTERVAL_S, LongGaps, PathFrame};
pub use pose::Pose;
pub use view::View;
