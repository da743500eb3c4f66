//! What a result was built from, and whether that has changed.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::Result;
use crate::builder::sources::Sources;
use crate::builder::stages::{Stage, Stages};
use crate::format::check_regular;
use crate::report::build_report::{FileReport, InputReport};
use crate::stage_timer::StageTimer;

/// Sizes and hashes of the files of an input.
pub fn describe(
    dependencies: &[PathBuf],
    sources: &Sources,
    stages: &Stages,
) -> Result<Vec<FileReport>> {
    let describe = |path: &PathBuf| stages.time(Stage::Compare, || sources.report(path));
    dependencies.par_iter().map(describe).collect()
}

/// True where every file of an input is as it was.
pub fn unchanged(earlier: &InputReport, sources: &Sources) -> bool {
    let timer = StageTimer::current();
    let is_same = |file: &FileReport| {
        let path = Path::new(&file.path);
        let size = check_regular(path).map_or(0, |metadata| metadata.len());
        size == file.bytes && sources.report(path).is_ok_and(|now| now == *file)
    };
    !earlier.files.is_empty() && earlier.files.par_iter().all(|file| timer.time(|| is_same(file)))
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
