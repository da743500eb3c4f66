//! `hlod-build verify`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use hlod::Result;
use hlod::builder::threads::with_threads;
use hlod::verify::{self, VerifyOptions, verify};
use indicatif::ProgressBar;

use crate::terminal::{bar, print};

/// The exit code of a verification that found a fault: the scene is no valid input.
const NOT_HELD: u8 = 3;

#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// The output folder of an earlier build
    out: PathBuf,
    /// The models that it was built from, or folders of them; without any, the leaves stand for
    /// the source and are not checked themselves
    #[arg(long, value_name = "MODEL", num_args = 1..)]
    source: Vec<PathBuf>,
    /// One JSON object with all figures
    #[arg(long)]
    json: bool,
    /// Sample points on the source, 1000 or more, and as many on each level; all vertices are
    /// measured as well. More: rarer faults are found, and it takes longer [default: 300000, or 60 for each
    /// leaf where that is more]
    #[arg(long, value_name = "N")]
    samples: Option<u64>,
    /// Seed of the sample points: the same seed gives the same figures
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Also measure a front of mixed levels, chosen by the errors that viewers are given, of at most
    /// this fraction of the leaves' triangles, above 0 and up to 1
    #[arg(long, value_name = "SHARE")]
    front: Option<f64>,
    /// Cells of which faces are drawn, at most, from corners that no picture was taken from; 0 draws none
    #[arg(long, value_name = "N", default_value_t = 8)]
    cells: usize,
    /// Number of worst nodes to list
    #[arg(long, value_name = "N", default_value_t = 5)]
    worst: usize,
    /// Threads, 0-1024; 0 is one for each core. The result does not depend on it
    #[arg(long, short = 'j', value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Show no progress
    #[arg(long, short)]
    quiet: bool,
}

/// Verifies, prints the report, and says with which code to end.
pub fn verify_scene(arguments: &VerifyArgs) -> Result<ExitCode> {
    let options = VerifyOptions {
        samples: arguments.samples,
        seed: arguments.seed,
        worst: arguments.worst,
        front: arguments.front,
        cells: arguments.cells,
        ..Default::default()
    };
    let bar = PhaseBar::new(arguments.quiet);
    let verified = with_threads(arguments.threads, || {
        verify(&arguments.out, &arguments.source, &options, &bar)
    });
    bar.0.finish_and_clear();
    let report = verified??;
    print(&if arguments.json { report.to_json()? } else { verify::text(&report) })?;
    Ok(if report.passed { ExitCode::SUCCESS } else { ExitCode::from(NOT_HELD) })
}

/// The phases of a verification on a terminal; nothing elsewhere.
struct PhaseBar(ProgressBar);

impl PhaseBar {
    fn new(quiet: bool) -> Self {
        Self(bar(quiet, "{msg:24} {wide_bar} {percent:>3} %  {eta} left"))
    }
}

impl verify::Progress for PhaseBar {
    fn phase(&self, name: &str, steps: u64) {
        self.0.reset();
        self.0.set_length(steps);
        self.0.set_message(name.to_owned());
    }

    fn done(&self, steps: u64) {
        self.0.inc(steps);
    }
}
