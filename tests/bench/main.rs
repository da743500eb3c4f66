//! `hlod-bench` and what it rests on: scenes built from fixtures, replayed as a user would.
//!
//! One test program with a module for each promise, so that the library is linked once. What
//! draws says that it was skipped where there is no graphics adapter, or fails if
//! `HLOD_REQUIRE_GPU` is 1.

#[allow(dead_code)]
#[path = "../e2e/support/mod.rs"]
mod support;

#[cfg(feature = "render")]
#[path = "../common/adapter.rs"]
mod adapter;
mod bench_support;
mod camera_paths;
#[cfg(feature = "render")]
mod cells;
mod cli;
mod damage;
mod faults;
mod golden;
#[cfg(feature = "render")]
mod mixtures;
mod model_clock;
mod model_files;
mod output;
#[cfg(feature = "render")]
mod reference;
mod stress;
mod tall_street;
#[cfg(feature = "render")]
mod wall;
