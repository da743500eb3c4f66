//! Whether a scene is compared with the files that it was built from.

use std::path::{Path, PathBuf};

use crate::Result;
use crate::format::REPORT_FILE;
use crate::import::find_inputs;
use crate::report::BuildReport;
use crate::report::build_report::FileReport;

/// Those of the source's model files whose contents `build.json` does not name. None where the
/// scene has no such report.
pub(super) fn other_sources(out: &Path, sources: &[PathBuf]) -> Result<Vec<String>> {
    let report = std::fs::read(out.join(REPORT_FILE)).ok();
    let report = report.and_then(|json| serde_json::from_slice::<BuildReport>(&json).ok());
    let Some(report) = report.filter(|_| !sources.is_empty()) else { return Ok(Vec::new()) };
    let known = |hash: &str| {
        report.inputs.iter().flat_map(|input| &input.files).any(|file| file.blake3 == hash)
    };
    let mut others = Vec::new();
    for input in find_inputs(sources)? {
        let file = FileReport::read(&input)?;
        if !known(&file.blake3) {
            others.push(file.path);
        }
    }
    Ok(others)
}
