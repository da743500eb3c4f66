//! What a build tells people and programs: the hierarchy, and how it was made.

pub mod build_report;
pub mod build_summary;
mod decimal;
pub mod inspect;

pub use build_report::BuildReport;
pub use decimal::shortest;
