//! The constants of the model clock, as `calibrate` measures them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::model_load::ModelLoad;
use crate::engine::Prices;
use crate::{Error, Result};

/// The version of the file that [`ClockConstants::write`] writes.
pub const CLOCK_FILE_VERSION: u32 = 4;

/// How long things take on some machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockConstants {
    /// The version of this format.
    pub version: u32,
    /// What things take, milliseconds each; at least 0.
    pub prices: Prices,
    /// Milliseconds for a pixel along the edge of a triangle, at least 0: machines shade in blocks,
    /// and what of a block is outside of the triangle is wasted.
    pub edge_fragment: f64,
    /// The part of the shorter of geometry and fragments that passes while the longer does, 0 to
    /// 1: none of it where one processor does both, all of it in a pipeline of many units.
    pub overlap: f64,
    /// Milliseconds for a byte of a node in the first frame that draws it, at least 0.
    pub cold_byte: f64,
    /// Standard deviation of the logarithm of a frame's time, at least 0.
    pub noise: f64,
    /// Stalls in a second, at least 0.
    pub stalls_per_s: f64,
    /// Milliseconds of a stall on average, at least 0.
    pub stall_ms: f64,
    /// Bytes of files that are read and decoded in a millisecond, above 0.
    pub load_bytes_per_ms: f64,
    /// `c_textured`: the time of a textured triangle over that of a textured and an untextured
    /// one together, 0 to 1. Costs (thesis, eq. 3.1) follow from it, whatever the build took it
    /// for.
    pub textured_weight: f64,
}

impl Default for ClockConstants {
    /// lavapipe on two cores of a Xeon, without noise: medians of what `calibrate` measured over
    /// six cities, photogrammetry and houses. Both stages share the processor, and none overlaps.
    fn default() -> Self {
        Self {
            version: CLOCK_FILE_VERSION,
            prices: Prices {
                frame: 0.55,
                draw: 0.009,
                vertex: 6e-5,
                triangle: 1.5e-4,
                plain_fragment: 3e-6,
                textured_fragment: 7e-6,
                hidden_fragment: 1.3e-6,
                uploaded_byte: 1e-6,
            },
            edge_fragment: 3.2e-6,
            overlap: 0.0,
            cold_byte: 3e-7,
            noise: 0.0,
            stalls_per_s: 0.0,
            stall_ms: 0.0,
            load_bytes_per_ms: 60_000.0,
            textured_weight: 0.58,
        }
    }
}

impl ClockConstants {
    /// Milliseconds to draw what a frame has, beside those of any frame.
    pub(super) fn drawing_ms(&self, load: &ModelLoad) -> f64 {
        let [geometry, fragments] = self.stages_ms(load);
        geometry + fragments - self.overlap * geometry.min(fragments)
    }

    /// Milliseconds of draw calls, vertices and triangles, and of fragments.
    pub(super) fn stages_ms(&self, load: &ModelLoad) -> [f64; 2] {
        let prices = &self.prices;
        let geometry = load.draws * prices.draw
            + load.vertices * prices.vertex
            + load.triangles * prices.triangle;
        let fragments = load.plain_fragments * prices.plain_fragment
            + load.textured_fragments * prices.textured_fragment
            + load.hidden_fragments * prices.hidden_fragment
            + load.edge_fragments * self.edge_fragment;
        [geometry, fragments]
    }

    /// Reads constants that were written earlier.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| Error::input(path, format!("cannot read clock constants: {error}")))?;
        Self::check_version(&text).map_err(|what| Error::input(path, what))?;
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

    /// A file of another version has other fields: it is told of before they are.
    fn check_version(text: &str) -> Result<(), String> {
        let file: serde_json::Value = serde_json::from_str(text).unwrap_or_default();
        match file.get("version").and_then(serde_json::Value::as_u64) {
            Some(version) if version != u64::from(CLOCK_FILE_VERSION) => Err(format!(
                "version: expected {CLOCK_FILE_VERSION}, found {version}; calibrate again"
            )),
            _ => Ok(()),
        }
    }

    fn check(&self) -> Result<(), String> {
        let not_negative = [
            ("prices.frame", self.prices.frame),
            ("prices.draw", self.prices.draw),
            ("prices.vertex", self.prices.vertex),
            ("prices.triangle", self.prices.triangle),
            ("prices.plain_fragment", self.prices.plain_fragment),
            ("prices.textured_fragment", self.prices.textured_fragment),
            ("prices.hidden_fragment", self.prices.hidden_fragment),
            ("prices.uploaded_byte", self.prices.uploaded_byte),
            ("edge_fragment", self.edge_fragment),
            ("cold_byte", self.cold_byte),
            ("noise", self.noise),
            ("stalls_per_s", self.stalls_per_s),
            ("stall_ms", self.stall_ms),
        ];
        let parts = [("overlap", self.overlap), ("textured_weight", self.textured_weight)];
        let loading = [("load_bytes_per_ms", self.load_bytes_per_ms)];
        let not_negative = not_negative.map(|at| (at, at.1 >= 0.0, "at least 0"));
        let parts = parts.map(|at| (at, (0.0..=1.0).contains(&at.1), "0 to 1"));
        let loading = loading.map(|at| (at, at.1 > 0.0, "above 0"));
        let mut all = not_negative.iter().chain(&parts).chain(&loading);
        match all.find(|((_, value), fits, _)| !(*fits && value.is_finite())) {
            Some(((name, value), _, range)) => {
                Err(format!("{name}: expected {range}, found {value}"))
            }
            None => Ok(()),
        }
    }
}
