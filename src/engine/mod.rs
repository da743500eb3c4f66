//! One frame after another, for every driver: replays, sweeps, windows.
//!
//! `policy → residency → backend → report`: [`Engine::frame`] takes a camera, has a
//! [`Policy`](crate::runtime::Policy) choose what is drawn and what is loaded, and reports what the
//! frame took. Where it draws and how time passes is the [`Backend`]'s.

mod backend;
mod check_front;
mod cost_model;
#[expect(clippy::module_inception)]
mod engine;
mod report;

pub use backend::{Backend, Drawn, Inspect};
pub use check_front::{FrontCheck, FrontFault, FrontRule};
pub use cost_model::{CostModel, Estimate, Load, Prices};
pub use engine::{Engine, lock};
pub use report::FrameReport;
