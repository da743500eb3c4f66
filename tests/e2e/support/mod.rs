//! What the end-to-end tests share: inputs, runs, and reading results back.

pub mod geometry;
pub mod inputs;
pub mod result;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use hlod::build::progress::Silent;
use hlod::build::{BuildOptions, Outcome, build};

/// A fixed sequence of numbers.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits (SplitMix64).
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in 0–1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number in a range.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// An index below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// One of several.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

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
