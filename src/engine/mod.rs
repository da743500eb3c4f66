//! One frame after another, for every driver: replays, sweeps, windows.
//!
//! `policy → residency → backend → report`: [`Engine::frame`] takes a camera, has a
//! [`Policy`] choose what is drawn and what is loaded, and reports what the
//! frame took. Where it draws and how time passes is the [`Backend`]'s.

mod backend;
mod check_front;
mod choosing;
mod cost_model;
mod covered_parts;
#[expect(clippy::module_inception)]
mod engine;
mod far_field;
mod frame_load;
mod host_time;
pub(crate) mod least_squares;
mod margin;
mod occlusion;
pub mod policies;
mod policy;
mod predict;
mod report;
mod residents;
mod settling;
mod steady;
#[cfg(test)]
pub(crate) mod test_frame;
mod toggle_causes;
mod uploads;
mod visibility;

pub use backend::{Backend, Drawn, Inspect};
pub use check_front::{FrontCheck, FrontFault, FrontRule};
pub use cost_model::{CostModel, Estimate, Load, Prices};
pub use covered_parts::CoveredParts;
pub use engine::{Engine, lock};
pub use far_field::{FarField, FarFieldMode, FarShown};
pub use frame_load::{FrontLoad, geometry_load};
pub use occlusion::{HiddenNodes, NodeOcclusion, NodeScale, Occluders, SeenAreas};
pub use policy::{FrameEstimate, FrameInput, FrameOutcome, Policy, PredictedView, Selection};
pub use report::FrameReport;
pub use residents::Residents;
pub use toggle_causes::ToggleCauses;
pub use visibility::Visibility;
