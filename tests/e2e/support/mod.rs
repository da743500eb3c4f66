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
