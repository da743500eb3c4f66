//! Scans inputs, and finds which have changed since the previous build.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::Result;
use crate::builder::partition::Scan;
use crate::builder::plan::KnownInput;
use crate::builder::prepare::{Prepared, Preparing};
use crate::builder::progress::Progress;
use crate::builder::reuse::PreviousBuild;
use crate::builder::sources::{Sources, unchanged};
use crate::builder::stages::{Stage, Stages};
use crate::decode::texture_size;
use crate::report::build_report::{Count, FileReport, InputReport};

/// Sizes and hashes of the files of an input.
fn describe(
    dependencies: &[PathBuf],
    sources: &Sources,
    stages: &Stages,
) -> Result<Vec<FileReport>> {
    let describe = |path: &PathBuf| stages.time(Stage::Compare, || sources.report(path));
    dependencies.par_iter().map(describe).collect()
}

/// Returns the facts of an input from the previous build if it has not changed.
pub fn known(
    input: &Path,
    earlier: Option<&PreviousBuild>,
    preparing: &Preparing,
) -> Option<KnownInput> {
    let known = earlier?.input(&text_of(input))?;
    let is_same = || unchanged(&known.report, preparing.sources);
    preparing.stages.time(Stage::Compare, is_same).then(|| known.clone())
}

/// Reads an input and looks at its triangles; the model is returned too.
pub fn look_at(
    input: &Path,
    preparing: &Preparing,
    progress: &dyn Progress,
) -> Result<(KnownInput, Prepared)> {
    let prepared = preparing.read(input)?;
    let Prepared { model, up, up_from } = &prepared;
    let triangles = model.triangle_count() as u64;
    progress.found(triangles);
    let per_cluster = preparing.options.most_in_block() as f64 / CLUSTERS;
    let (scan, files) = rayon::join(
        || {
            // One that cannot be read is missing, and warned of, when its block is built.
            let size = |texture| texture_size(texture).unwrap_or_default();
            let texels = model.textures.iter().map(size);
            let texels: Vec<u64> =
                texels.map(|(width, height)| u64::from(width) * u64::from(height)).collect();
            preparing.stages.time(Stage::Gather, || Scan::of(model, &texels, per_cluster))
        },
        || describe(&model.dependencies, preparing.sources, preparing.stages),
    );
    let report = InputReport {
        path: text_of(input),
        files: files?,
        triangles,
        up: *up,
        up_from: Some(*up_from),
        warnings: Count::of_warnings(&model.warnings),
    };
    Ok((KnownInput { report, scan }, prepared))
}

/// Clusters of a block that is as large as blocks may be.
const CLUSTERS: f64 = 512.0;

/// A path as text, for reports.
pub fn text_of(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// A fingerprint of version, parameters and inputs.
pub fn fingerprint<'a>(
    parameters: &serde_json::Value,
    inputs: impl Iterator<Item = &'a InputReport>,
) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut add = |text: &str| {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    };
    add(env!("CARGO_PKG_VERSION"));
    add(&parameters.to_string());
    for input in inputs {
        add(&input.path);
        for file in &input.files {
            add(&file.blake3);
        }
    }
    *hasher.finalize().as_bytes()
}
