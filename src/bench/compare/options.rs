//! What a person may set about a comparison.

use super::limit::{Bytes, Count, Flip, Limit, Milliseconds, Points};

/// How much figures may rise. Each is a limit in the figure's own unit or a percentage of what it
/// was in the base; what is not given is shown and not judged. What is met exactly holds.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "Limits (in the unit shown, or in percent of the base: 5%)")]
pub struct Limits {
    /// Toggles, up and down together (a number: 3)
    #[arg(long, value_name = "N|%")]
    pub max_toggle_increase: Option<Limit<Count>>,
    /// Longest run of frames that all toggled (a number: 3)
    #[arg(long, value_name = "N|%")]
    pub max_toggle_run_increase: Option<Limit<Count>>,
    /// Mean frame time (with its unit: 0.5ms)
    #[arg(long, value_name = "MS|%")]
    pub max_mean_increase: Option<Limit<Milliseconds>>,
    /// 95th percentile of frame time (with its unit: 0.5ms)
    #[arg(long, value_name = "MS|%")]
    pub max_p95_increase: Option<Limit<Milliseconds>>,
    /// 99th percentile of frame time (with its unit: 0.5ms)
    #[arg(long, value_name = "MS|%")]
    pub max_p99_increase: Option<Limit<Milliseconds>>,
    /// Share of frames over the target (percentage points: 2pp)
    #[arg(long, value_name = "PP|%")]
    pub max_over_target_increase: Option<Limit<Points>>,
    /// Share of frames over the target by more than a tenth (percentage points: 2pp)
    #[arg(long, value_name = "PP|%")]
    pub max_late_increase: Option<Limit<Points>>,
    /// Mean error of estimated frame times, in either direction (percentage points: 0.5pp)
    #[arg(long, value_name = "PP|%")]
    pub max_estimate_error_increase: Option<Limit<Points>>,
    /// Standard deviation of that error (percentage points: 0.5pp)
    #[arg(long, value_name = "PP|%")]
    pub max_estimate_deviation_increase: Option<Limit<Points>>,
    /// Peak memory (with its unit: 10MiB)
    #[arg(long, value_name = "BYTES|%")]
    pub max_memory_increase: Option<Limit<Bytes>>,
    /// Bytes read from files (with their unit: 10MiB)
    #[arg(long, value_name = "BYTES|%")]
    pub max_read_increase: Option<Limit<Bytes>>,
    /// Evicted nodes (a number: 3)
    #[arg(long, value_name = "N|%")]
    pub max_eviction_increase: Option<Limit<Count>>,
    /// Mean time of selection (with its unit: 20us)
    #[arg(long, value_name = "MS|%")]
    pub max_select_increase: Option<Limit<Milliseconds>>,
    /// Nodes that selection visits in a frame, on average (a number: 3)
    #[arg(long, value_name = "N|%")]
    pub max_visited_increase: Option<Limit<Count>>,
    /// Mean difference from the leaves, of runs with --reference-every (FLIP, 0-1: 0.002)
    #[arg(long, value_name = "FLIP|%")]
    pub max_flip_increase: Option<Limit<Flip>>,
    /// Background where the leaves have surface, of the same runs (pixels: 3)
    #[arg(long, value_name = "N|%")]
    pub max_gap_increase: Option<Limit<Count>>,
}
