//! Where the time goes, summed over threads.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A stage of the build, in the order in which a triangle meets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Hashing inputs to see what changed.
    Compare,
    /// Reading and parsing models.
    Import,
    /// Welding blocks and bringing them to their lattice.
    Gather,
    /// Decoding pictures and scaling them to the levels.
    Pictures,
    /// Cutting at planes.
    Cut,
    /// Simplification.
    Simplify,
    /// Measuring what simplification moved.
    Measure,
    /// Charts and textures of nodes that are simplified across seams.
    Bake,
    /// Packing and encoding atlases.
    Atlas,
    /// Making and writing node files.
    Write,
}

impl Stage {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Compare,
        Self::Import,
        Self::Gather,
        Self::Pictures,
        Self::Cut,
        Self::Simplify,
        Self::Measure,
        Self::Bake,
        Self::Atlas,
        Self::Write,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Compare => "compare",
            Self::Import => "import",
            Self::Gather => "gather",
            Self::Pictures => "pictures",
            Self::Cut => "cut",
            Self::Simplify => "simplify",
            Self::Measure => "measure",
            Self::Bake => "bake",
            Self::Atlas => "atlas",
            Self::Write => "write",
        }
    }
}

/// Adds up the time of each stage.
#[derive(Debug, Default)]
pub struct Stages {
    nanoseconds: [AtomicU64; Stage::ALL.len()],
}

impl Stages {
    /// Runs `work`, which must not hand work to other threads, and counts its time.
    pub fn time<T>(&self, stage: Stage, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        self.add(stage, begin.elapsed());
        result
    }

    /// Counts time that was measured elsewhere.
    pub fn add(&self, stage: Stage, spent: Duration) {
        self.nanoseconds[stage as usize].fetch_add(spent.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Seconds of a stage so far.
    pub fn seconds(&self, stage: Stage) -> f64 {
        self.nanoseconds[stage as usize].load(Ordering::Relaxed) as f64 * 1e-9
    }
}
