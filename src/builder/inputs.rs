//! What a result was built from, and whether that has changed.

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::builder::stages::{Stage, Stages};
use crate::report::build_report::{FileReport, InputReport};
use crate::{Error, Result};

/// Sizes and hashes of the files of an input.
pub fn describe(dependencies: &[PathBuf], stages: &Stages) -> Result<Vec<FileReport>> {
    let describe = |path: &PathBuf| stages.time(Stage::Compare, || describe_file(path));
    dependencies.par_iter().map(describe).collect()
}

/// True where every file of an input is as it was.
pub fn unchanged(earlier: &InputReport) -> bool {
    !earlier.files.is_empty()
        && earlier.files.par_iter().all(|file| {
            let path = Path::new(&file.path);
            let size = std::fs::metadata(path).map_or(0, |facts| facts.len());
            size == file.bytes && describe_file(path).is_ok_and(|now| now == *file)
        })
}

fn describe_file(path: &Path) -> Result<FileReport> {
    let failed = |error: std::io::Error| Error::input(path, format!("cannot be read: {error}"));
    let file = match File::open(path) {
        // A file that a model names and that is not there: should it appear, that is a change.
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Ok(FileReport { path: text_of(path), ..FileReport::default() });
        }
        opened => opened.map_err(failed)?,
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file).map_err(failed)?;
    Ok(FileReport {
        path: text_of(path),
        bytes: hasher.count(),
        blake3: hasher.finalize().to_hex().to_string(),
    })
}

/// A path as text, for reports.
pub fn text_of(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// A fingerprint of version, parameters and inputs.
pub fn fingerprint(parameters: &serde_json::Value, inputs: &[InputReport]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut add = |text: &str| {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    };
    add(env!("CARGO_PKG_VERSION"));
    add(&parameters.to_string());
    for input in inputs {
        // As given: it is part of the nodes' file names and ids.
        add(&input.path);
        for file in &input.files {
            add(&file.blake3);
        }
    }
    *hasher.finalize().as_bytes()
}
