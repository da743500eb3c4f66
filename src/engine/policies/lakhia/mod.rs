//! The selection of Lakhia's thesis (2004, chapter 4), also in Lakhia, "Efficient Interactive
//! Rendering of Detailed Models with Hierarchical Levels of Detail" (3DPVT 2004, section III).

mod benefit;
mod feedback;
mod front;
mod hysteresis;
mod options;
#[cfg(test)]
mod tests;

pub use front::Lakhia;
pub use options::{LakhiaOptions, ShareFeedback, StartOfHysteresis, TimeModel};
