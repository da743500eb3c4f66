//! Replays camera paths over a built scene and logs what a user would have felt.

mod accuracy;
mod broken_files;
mod clock;
mod compare;
mod model_backend;
mod model_files;
mod model_load;
#[cfg(feature = "render")]
mod node_cache;
mod options;
pub mod policies;
mod record;
#[cfg(feature = "render")]
mod reference;
mod replay;
mod report;
mod session;
mod statistics;
mod summary;
mod sweep;
#[cfg(test)]
mod tests;
mod unseen_scene;
#[cfg(feature = "render")]
mod wall;
mod write;

pub use accuracy::{Accuracy, FrameInspector, FrameSample, ReferenceContext, WorstFrame};
pub use broken_files::BrokenFiles;
pub use clock::{CLOCK_FILE_VERSION, ClockConstants};
pub use compare::{Comparison, Limit, Limits, Row, SummaryFile, Unit, compare};
pub use model_backend::ModelBackend;
pub use model_files::ModelFiles;
pub use options::{BenchOptions, Pace, PolicyChoice, Size};
pub use record::FrameRecord;
#[cfg(feature = "render")]
pub use reference::{Reference, ReferenceRenderer, SilhouetteTolerance};
pub use replay::{Replay, Run, run};
pub use report::report_html;
pub use session::Session;
pub use summary::{Context, SUMMARY_VERSION, summary, summary_text};
pub use sweep::Sweep;
#[cfg(feature = "render")]
pub use wall::{Calibration, GpuBackend, Snapshots, calibrate, measure_start};
#[cfg(feature = "render")]
pub(crate) use write::write_beside;
pub use write::{check_output, check_outside_scene, write_run};
