//! Processor time of each stage, summed over threads.

use crate::stage_timer::StageTimer;

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

/// Sums the processor time of each stage.
#[derive(Debug, Default)]
pub struct Stages([StageTimer; Stage::ALL.len()]);

impl Stages {
    /// Runs `work` and counts the processor time that it takes on this thread, less that of stages
    /// within it. Work for other threads is counted as [`StageTimer::current`] says.
    pub fn time<T>(&self, stage: Stage, work: impl FnOnce() -> T) -> T {
        self.0[stage as usize].time(work)
    }

    /// Processor seconds of a stage so far.
    pub fn seconds(&self, stage: Stage) -> f64 {
        self.0[stage as usize].total().as_secs_f64()
    }
}
