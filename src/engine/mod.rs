//! One frame after another, for every driver: replays, sweeps, windows.
//!
//! `policy → residency → backend → report`: [`Engine::frame`] takes a camera, has a
//! [`Policy`] choose what is drawn and what is loaded, and reports what the
//! frame took. Where it draws and how time passes is the [`Backend`]'s.

mod backend;
mod check_front;
mod cost_model;
#[expect(clippy::module_inception)]
mod engine;
pub mod policies;
mod policy;
mod report;

pub use backend::{Backend, Drawn, Inspect};
pub use check_front::{FrontCheck, FrontFault, FrontRule};
pub use cost_model::{CostModel, Estimate, Load, Prices};
pub use engine::{Engine, lock};
pub use policy::{FrameInput, FrameOutcome, Policy, Residents, Selection};
pub use report::FrameReport;
