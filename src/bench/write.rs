//! Writes what a run gave: `frames.csv`, `summary.json` and `report.html`.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{Context, FrameRecord, Run, report_html};
use crate::{Error, Result};

/// Writes `frames.csv`, `summary.json` and `report.html` into a folder, which is made where it is
/// missing; each beside and renamed. The paths of the files.
pub fn write_run(
    dir: &Path,
    run: &Run,
    context: &Context,
    summary: &Value,
) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(dir)
        .map_err(|error| Error::output(dir, format!("cannot make the folder: {error}")))?;
    let frames = dir.join("frames.csv");
    write_beside(&frames, &frames_csv(run, context.levels)?)?;
    let json = dir.join("summary.json");
    let text = serde_json::to_string_pretty(summary)
        .map_err(|error| Error::Internal(format!("a summary that has no JSON form: {error}")))?;
    write_beside(&json, (text + "\n").as_bytes())?;
    let report = dir.join("report.html");
    write_beside(&report, report_html(run, context, summary)?.as_bytes())?;
    Ok(vec![frames, json, report])
}

/// The frames as CSV.
pub(super) fn frames_csv(run: &Run, levels: usize) -> Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let internal = |error: csv::Error| Error::Internal(format!("frames as CSV: {error}"));
    csv.write_record(FrameRecord::header(levels)).map_err(internal)?;
    for frame in &run.frames {
        csv.write_record(frame.fields()).map_err(internal)?;
    }
    csv.into_inner().map_err(|error| Error::Internal(format!("frames as CSV: {error}")))
}

/// Writes a file beside its place and renames it there, so that it is whole or as it was.
pub(crate) fn write_beside(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let failed = |error: std::io::Error| Error::output(path, format!("cannot write: {error}"));
    let mut file =
        tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new("."))).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    // Temporary files are for their owner only; what is written for a person is as umask has it.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(mode).map_err(failed)?;
    }
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}
