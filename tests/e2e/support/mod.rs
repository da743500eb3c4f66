//! What the end-to-end tests share: inputs, runs, and reading results back.

pub mod files;
pub mod geometry;
pub mod inputs;
pub mod result;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use hlod::builder::progress::Silent;
use hlod::builder::{BuildOptions, Outcome, build};
pub use hlod::random::Random;

/// The program.
pub fn hlod_build() -> Command {
    Command::cargo_bin("hlod-build").unwrap()
}

/// Runs the program and expects success; standard output.
pub fn run_build(folder: &Path, arguments: &[&str]) -> String {
    let done = hlod_build().current_dir(folder).args(arguments).assert().success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

/// Builds through the library.
pub fn build_with(inputs: &[PathBuf], out: &Path, options: &BuildOptions) -> Outcome {
    build(inputs, out, options, &Silent).unwrap()
}

/// A set of the real data, `HLOD_DATA` or `../shared/data` beside the repository; `None`, said, where
/// it is not there.
pub fn data(set: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("HLOD_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = folder.join(set);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there", path.display());
    None
}
