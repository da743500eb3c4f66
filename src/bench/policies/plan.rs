//! Which runs a comparison of policies is made of.

use crate::bench::{BenchOptions, ClockConstants, PolicyChoice};
use crate::camera::PathKind;
use crate::engine::FarFieldMode;
use crate::engine::policies::{POLICIES, PolicyKind, Settings};
use crate::{Error, Result};

/// The name of what policies are compared with: the first of the table with all that it asks for
/// in memory at the next frame, however large.
pub const ORACLE: &str = "oracle";

/// What is added to the name of a policy where what is far is drawn from the faces of cells.
pub const WITH_CELLS: &str = " with cells";

/// Bytes a millisecond at which all is there at once.
const AT_ONCE: f64 = 1e12;

/// What is compared along what.
#[derive(Clone, Debug)]
pub struct PoliciesPlan {
    /// Names of policies.
    pub policies: Vec<String>,
    /// Run each with the cells of the scene as well.
    pub with_cells: bool,
    /// Kinds of paths.
    pub paths: Vec<PathKind>,
    /// Routes, noise and stalls: seeds from 0.
    pub seeds: u64,
    /// Milliseconds that a frame may take.
    pub targets_ms: Vec<f64>,
    /// Frames of a path.
    pub frames: usize,
    /// Frames at the first pose before the log begins.
    pub warm_up_frames: u64,
    /// What is the same in all runs.
    pub options: BenchOptions,
}

/// What tells a run from the others over its scene.
#[derive(Clone, Debug, PartialEq)]
pub struct RunKey {
    /// The name of the policy, with [`WITH_CELLS`] or without, or [`ORACLE`].
    pub policy: String,
    /// The path.
    pub path: PathKind,
    /// Seed of the route, of noise and of stalls.
    pub seed: u64,
    /// Milliseconds that a frame may take.
    pub target_ms: f64,
}

impl PoliciesPlan {
    /// Refuses what cannot be run.
    pub fn check(&self) -> Result<()> {
        for name in &self.policies {
            PolicyKind::find(name)?;
        }
        let fits = |target: &&f64| **target > 0.0 && target.is_finite();
        if let Some(target) = self.targets_ms.iter().find(|target| !fits(target)) {
            return Err(Error::Usage(format!(
                "--targets: {target}, expected milliseconds above 0"
            )));
        }
        if self.seeds == 0 || self.targets_ms.is_empty() || self.paths.is_empty() {
            return Err(Error::Usage("--seeds, --targets, --paths: expected at least one".into()));
        }
        self.options.check()
    }

    /// All runs over one scene: by path, seed and target, and for each the policies and the oracle.
    pub fn runs(&self) -> Vec<RunKey> {
        let with_cells = |name: &String| [name.clone(), format!("{name}{WITH_CELLS}")];
        let ways = if self.with_cells { 2 } else { 1 };
        let names: Vec<String> =
            self.policies.iter().flat_map(|name| with_cells(name).into_iter().take(ways)).collect();
        let mut runs = Vec::new();
        for &path in &self.paths {
            for seed in 0..self.seeds {
                for &target_ms in &self.targets_ms {
                    let names = names.iter().map(String::as_str).chain([ORACLE]);
                    runs.extend(names.map(|policy| RunKey {
                        policy: policy.to_owned(),
                        path,
                        seed,
                        target_ms,
                    }));
                }
            }
        }
        runs
    }

    /// The options and the clock of a run.
    pub fn settings(
        &self,
        run: &RunKey,
        clock: &ClockConstants,
    ) -> Result<(BenchOptions, ClockConstants)> {
        let is_oracle = run.policy == ORACLE;
        let (name, far_field) = match run.policy.strip_suffix(WITH_CELLS) {
            _ if is_oracle => (POLICIES[0].name, FarFieldMode::Off),
            Some(name) => (name, FarFieldMode::Cells),
            None => (run.policy.as_str(), FarFieldMode::Off),
        };
        let mut options = BenchOptions {
            target_ms: run.target_ms,
            policy: PolicyChoice::new(name, &Settings::new())?,
            seed: run.seed,
            warm_up_frames: self.warm_up_frames,
            far_field,
            ..self.options.clone()
        };
        let mut clock = *clock;
        if is_oracle {
            options.residency.max_memory_bytes = u64::MAX / 4;
            options.residency.upload_bytes_per_s = u64::MAX / 4;
            clock.load_bytes_per_ms = AT_ONCE;
            clock.prices.uploaded_byte = 0.0;
            clock.cold_byte = 0.0;
        }
        Ok((options, clock))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> PoliciesPlan {
        PoliciesPlan {
            policies: vec!["lakhia".into(), "best-first".into()],
            with_cells: false,
            paths: vec![PathKind::Walk, PathKind::Rise],
            seeds: 2,
            targets_ms: vec![10.0, 30.0],
            frames: 10,
            warm_up_frames: 5,
            options: BenchOptions::default(),
        }
    }

    #[test]
    fn every_policy_and_the_oracle_run_along_every_path() {
        let runs = plan().runs();
        assert_eq!(runs.len(), 3 * 2 * 2 * 2);
        let mut different = runs.clone();
        different.dedup();
        assert_eq!(different.len(), runs.len());
        for run in &runs {
            let (options, clock) = plan().settings(run, &ClockConstants::default()).unwrap();
            assert_eq!((options.target_ms, options.seed), (run.target_ms, run.seed));
            let unbounded = options.residency.max_memory_bytes > 1 << 60;
            assert_eq!(unbounded, run.policy == ORACLE);
            assert_eq!(clock.load_bytes_per_ms == AT_ONCE, unbounded);
        }
    }

    #[test]
    fn each_policy_runs_with_cells_where_that_is_asked_for() {
        let plan = PoliciesPlan { with_cells: true, ..plan() };
        let runs = plan.runs();
        assert_eq!(runs.len(), (2 * 2 + 1) * 2 * 2 * 2);
        for run in &runs {
            let (options, _) = plan.settings(run, &ClockConstants::default()).unwrap();
            let uses_cells = options.far_field == FarFieldMode::Cells;
            assert_eq!(uses_cells, run.policy.ends_with(" with cells"));
            assert!(run.policy == ORACLE || run.policy.starts_with(options.policy.name()));
        }
    }

    #[test]
    fn what_cannot_be_run_is_refused() {
        assert!(plan().check().is_ok());
        let wrong: [fn(&mut PoliciesPlan); 4] = [
            |plan| plan.policies.push("latest".into()),
            |plan| plan.targets_ms.push(-1.0),
            |plan| plan.seeds = 0,
            |plan| plan.paths.clear(),
        ];
        for spoil in wrong {
            let mut plan = plan();
            spoil(&mut plan);
            assert_eq!(plan.check().unwrap_err().exit_code(), 2);
        }
    }
}
