//! The ways of choosing levels of detail, one module each, and the table of them.
//!
//! A new one is a module with a type that is a [`Policy`], and a line in [`POLICIES`].

mod adaptive_display;
mod best_first;
mod descent;
mod gain_over_price;
pub mod lakhia;
mod outlook;
mod parameter;
mod ranked;
mod screen_area;
mod screen_error;
#[cfg(test)]
mod tests;
mod unused;

use super::Policy;
use crate::{Error, Result};
pub(super) use gain_over_price::part_of_picture;
pub(super) use outlook::{Outlook, wrong};
pub use parameter::{ParameterInfo, Settings};

/// A policy that can be chosen.
#[derive(Clone, Copy, Debug)]
pub struct PolicyKind {
    /// The name by which a person chooses it.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// Where it is from.
    pub source: &'static str,
    parameters: fn() -> Vec<ParameterInfo>,
    make: fn(&Settings) -> Result<Box<dyn Policy>>,
}

/// All policies; the first is the default.
pub const POLICIES: [PolicyKind; 7] = [
    gain_over_price::KIND,
    best_first::KIND,
    lakhia::KIND,
    adaptive_display::KIND,
    screen_area::KIND,
    screen_error::FIXED,
    screen_error::LOOP,
];

/// The policy that chooses by error alone, for measurements.
pub const BY_ERROR: &str = screen_error::FIXED.name;

impl PolicyKind {
    /// The policy of a name.
    pub fn find(name: &str) -> Result<Self> {
        POLICIES.into_iter().find(|kind| kind.name == name).ok_or_else(|| {
            let names = POLICIES.map(|kind| kind.name).join(", ");
            Error::Usage(format!("--policy {name}: expected one of {names}"))
        })
    }

    /// Constants that can be set.
    pub fn parameters(&self) -> Vec<ParameterInfo> {
        (self.parameters)()
    }

    /// A policy that has seen no frame yet, with some constants set.
    pub fn make(&self, settings: &Settings) -> Result<Box<dyn Policy>> {
        (self.make)(settings)
    }

    /// All constants with their values once some are set.
    pub fn values(&self, settings: &Settings) -> Settings {
        let value = |parameter: ParameterInfo| {
            let value = settings.get(parameter.name).copied().unwrap_or(parameter.default);
            (parameter.name.to_owned(), value)
        };
        self.parameters().into_iter().map(value).collect()
    }
}
