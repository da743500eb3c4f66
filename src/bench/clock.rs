//! The constants of the model clock, as `calibrate` measures them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::engine::policies::lakhia::TimeModel;
use crate::{Error, Result};

/// The version of the file that [`ClockConstants::write`] writes.
pub const CLOCK_FILE_VERSION: u32 = 2;

/// How long things take on some machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockConstants {
    /// The version of this format.
    pub version: u32,
    /// Milliseconds of a frame in which nothing is drawn, at least 0.
    pub fixed_ms: f64,
    /// Milliseconds for one unit of cost (`v_time`), above 0.
    pub ms_per_cost: f64,
    /// What filling the whole picture takes, in units of cost, at least 0.
    pub fill_cost: f64,
    /// Milliseconds for each node drawn beside its cost, at least 0.
    pub ms_per_node: f64,
    /// Bytes of files that are read and decoded in a millisecond, above 0.
    pub load_bytes_per_ms: f64,
    /// `c_textured`: the time of a textured triangle over that of a textured and an untextured
    /// one together, 0 to 1. Costs follow from it, whatever the build took it for.
    pub textured_weight: f64,
}

impl Default for ClockConstants {
    /// lavapipe on two cores.
    fn default() -> Self {
        let TimeModel { fixed_ms, ms_per_cost, fill_cost } = TimeModel::default();
        Self {
            version: CLOCK_FILE_VERSION,
            fixed_ms,
            ms_per_cost,
            fill_cost,
            ms_per_node: 0.01,
            load_bytes_per_ms: 40_000.0,
            textured_weight: 0.6,
        }
    }
}

impl ClockConstants {
    /// What selection expects of time before it has seen any.
    pub fn time_model(&self) -> TimeModel {
        TimeModel {
            fixed_ms: self.fixed_ms,
            ms_per_cost: self.ms_per_cost,
            fill_cost: self.fill_cost,
        }
    }

    /// Reads constants that were written earlier.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| Error::input(path, format!("cannot read clock constants: {error}")))?;
        let constants: Self = serde_json::from_str(&text).map_err(|error| {
            Error::input(path, format!("expected constants as `calibrate` writes them: {error}"))
        })?;
        constants.check().map_err(|what| Error::input(path, what))?;
        Ok(constants)
    }

    /// The constants as the text of a file.
    pub fn to_json(&self) -> String {
        // A struct of numbers always has a JSON form.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Writes the constants, beside and renamed.
    pub fn write(&self, path: &Path) -> Result<()> {
        super::write::write_beside(path, self.to_json().as_bytes())
    }

    fn check(&self) -> Result<(), String> {
        if self.version != CLOCK_FILE_VERSION {
            return Err(format!(
                "version: expected {CLOCK_FILE_VERSION}, found {}; calibrate again",
                self.version
            ));
        }
        let ranges = [
            ("fixed_ms", self.fixed_ms, self.fixed_ms >= 0.0, "at least 0"),
            ("ms_per_cost", self.ms_per_cost, self.ms_per_cost > 0.0, "above 0"),
            ("fill_cost", self.fill_cost, self.fill_cost >= 0.0, "at least 0"),
            ("ms_per_node", self.ms_per_node, self.ms_per_node >= 0.0, "at least 0"),
            ("load_bytes_per_ms", self.load_bytes_per_ms, self.load_bytes_per_ms > 0.0, "above 0"),
            (
                "textured_weight",
                self.textured_weight,
                (0.0..=1.0).contains(&self.textured_weight),
                "0 to 1",
            ),
        ];
        match ranges.iter().find(|(_, value, fits, _)| !(*fits && value.is_finite())) {
            Some((name, value, _, range)) => {
                Err(format!("{name}: expected {range}, found {value}"))
            }
            None => Ok(()),
        }
    }
}
