//! The selection of Lakhia's thesis (2004, chapter 4), also in Lakhia, "Efficient Interactive
//! Rendering of Detailed Models with Hierarchical Levels of Detail" (3DPVT 2004, section III).
//!
//! To the letter but for units: what the thesis does once a frame is done once in 30 ms, the time
//! of its frames.

mod benefit;
mod feedback;
mod front;
mod hysteresis;
mod options;
#[cfg(test)]
mod tests;

use super::PolicyKind;
use super::parameter::{info, with_settings};
pub use front::Lakhia;
pub use options::LakhiaOptions;
use options::PARAMETERS;

pub(super) const KIND: PolicyKind = PolicyKind {
    name: front::NAME,
    summary: "time shared out by benefit over cost, with hysteresis over time",
    source: "Lakhia, Interactive Rendering for Large City Models, 2004, chapter 4",
    parameters: || info(&LakhiaOptions::DEFAULT, &PARAMETERS),
    make: |settings| {
        let options = with_settings(front::NAME, LakhiaOptions::DEFAULT, &PARAMETERS, settings)?;
        Ok(Box::new(Lakhia::new(options)))
    },
};
