//! Writes what a run gave: `frames.csv`, `summary.json` and `report.html`.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::NamedTempFile;

use super::{Context, FrameRecord, Run, report_html};
use crate::format::resolve;
use crate::{Error, Result};

/// Whether results can be written into a folder, before a run that would be in vain. Leaves
/// nothing behind.
pub fn check_output(dir: &Path) -> Result<()> {
    let fails = |what: String| Err(Error::output(dir, what));
    // The folder itself, or the nearest above it that exists and in which it will be made.
    let above = dir.ancestors().map(|above| match above.as_os_str().is_empty() {
        true => Path::new("."),
        false => above,
    });
    let Some(existing) = above.into_iter().find(|above| above.exists()) else {
        return fails("cannot make the folder: nothing above it exists".into());
    };
    if !existing.is_dir() {
        return fails(format!("expected a folder; {} is a file", existing.display()));
    }
    match NamedTempFile::new_in(existing) {
        Ok(_) => Ok(()),
        Err(error) => fails(format!("cannot write into {}: {error}", existing.display())),
    }
}

/// Refuses results inside of the folder that `hlod-build` wrote: the next build replaces that
/// folder as a whole, and refuses to where it holds anything else.
pub fn check_outside_scene(out: &Path, scene: &Path) -> Result<()> {
    let (Ok(target), Ok(scene)) = (resolve(out), std::fs::canonicalize(scene)) else {
        return Ok(()); // whoever reads the one or writes the other says why
    };
    match target.starts_with(&scene) {
        true => Err(Error::output(
            out,
            "lies within the folder of the built scene, which could not be built again then; \
             choose another place",
        )),
        false => Ok(()),
    }
}

/// Writes `frames.csv`, `summary.json` and `report.html` into a folder, which is made where it is
/// missing. An earlier result stays whole until all of the new one is written beside it. The paths of the
/// files.
pub fn write_run(
    dir: &Path,
    run: &Run,
    context: &Context,
    summary: &Value,
) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(dir)
        .map_err(|error| Error::output(dir, format!("cannot make the folder: {error}")))?;
    let text = serde_json::to_string_pretty(summary)
        .map_err(|error| Error::Internal(format!("a summary that has no JSON form: {error}")))?;
    let files = [
        ("frames.csv", frames_csv(run, context)?),
        ("summary.json", (text + "\n").into_bytes()),
        ("report.html", report_html(run, context, summary)?.into_bytes()),
    ]
    .map(|(name, bytes)| (dir.join(name), bytes));
    write_all(&files)?;
    Ok(files.map(|(path, _)| path).into())
}

/// The frames as CSV.
pub(super) fn frames_csv(run: &Run, context: &Context) -> Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let internal = |error: csv::Error| Error::Internal(format!("frames as CSV: {error}"));
    csv.write_record(FrameRecord::header(context.levels, context.diagnostics)).map_err(internal)?;
    for frame in &run.frames {
        csv.write_record(frame.fields()).map_err(internal)?;
    }
    csv.into_inner().map_err(|error| Error::Internal(format!("frames as CSV: {error}")))
}

/// Writes a file beside its place and renames it there, so that it is whole or as it was.
pub(crate) fn write_beside(path: &Path, bytes: &[u8]) -> Result<()> {
    place(path, stage(path, bytes)?)
}

/// Writes files beside their places, and only once all of them are whole renames them there.
pub(super) fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<()> {
    let mut staged = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        if path.is_dir() {
            return Err(Error::output(path, "cannot write: a folder is in its place"));
        }
        staged.push(stage(path, bytes)?);
    }
    files.iter().zip(staged).try_for_each(|((path, _), file)| place(path, file))
}

fn failed(path: &Path) -> impl Fn(std::io::Error) -> Error {
    move |error| Error::output(path, format!("cannot write: {error}"))
}

/// A file beside the place where it belongs; gone again where it is not placed there.
fn stage(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let failed = failed(path);
    let mut file = NamedTempFile::new_in(folder.unwrap_or(Path::new("."))).map_err(&failed)?;
    file.write_all(bytes).map_err(&failed)?;
    // Temporary files are for their owner only; what is written for a person is as umask has it.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(mode).map_err(failed)?;
    }
    Ok(file)
}

fn place(path: &Path, file: NamedTempFile) -> Result<()> {
    file.persist(path).map_err(|error| failed(path)(error.error))?;
    Ok(())
}
