//! The figures that are compared.

use super::limit::Limit;
use super::options::Limits;

/// How a figure is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// A number of things.
    Count,
    /// Milliseconds.
    Ms,
    /// Bytes; MiB in a table.
    Bytes,
    /// Percent.
    Percent,
    /// A difference of pictures, 0 to 1.
    Flip,
}

/// One figure of a summary.
pub(super) struct Metric {
    pub name: &'static str,
    pub unit: Unit,
    /// Where it stands, as JSON pointers; the sum of all.
    pub keys: &'static [&'static str],
    /// What stands there in units of ours.
    pub scale: f64,
    /// Runs that were not compared with the leaves have none.
    pub optional: bool,
    /// Only how large it is matters, not in which direction.
    pub magnitude: bool,
    /// Its limit: how it reads and whether it is exceeded.
    pub judge: fn(&Limits, f64, f64) -> Option<Verdict>,
}

/// A limit as it was given and whether it is exceeded.
pub(super) struct Verdict {
    pub limit: String,
    pub exceeded: bool,
}

fn verdict<D>(limit: &Option<Limit<D>>, base: f64, new: f64) -> Option<Verdict> {
    let limit = limit.as_ref()?;
    Some(Verdict { limit: limit.to_string(), exceeded: limit.is_exceeded(base, new) })
}

/// A figure with the name of its limit, or without one.
macro_rules! metric {
    ($name:literal, $unit:ident, [$($key:literal),+], $limit:ident) => {
        Metric {
            name: $name,
            unit: Unit::$unit,
            keys: &[$($key),+],
            scale: 1.0,
            optional: false,
            magnitude: false,
            judge: |limits, base, new| verdict(&limits.$limit, base, new),
        }
    };
    ($name:literal, $unit:ident, [$($key:literal),+]) => {
        Metric {
            name: $name,
            unit: Unit::$unit,
            keys: &[$($key),+],
            scale: 1.0,
            optional: false,
            magnitude: false,
            judge: |_, _, _| None,
        }
    };
}

/// In the order of the table. Those without a limit are there to explain the others.
#[rustfmt::skip]
pub(super) const METRICS: &[Metric] = &[
    metric!("toggles", Count, ["/toggles/up", "/toggles/down"], max_toggle_increase),
    metric!("toggles up", Count, ["/toggles/up"]),
    metric!("toggles down", Count, ["/toggles/down"]),
    metric!("longest toggle run", Count, ["/toggles/longest_run"], max_toggle_run_increase),
    metric!("frame time mean", Ms, ["/frame_ms/mean"], max_mean_increase),
    metric!("frame time p50", Ms, ["/frame_ms/p50"]),
    metric!("frame time p95", Ms, ["/frame_ms/p95"], max_p95_increase),
    metric!("frame time p99", Ms, ["/frame_ms/p99"], max_p99_increase),
    Metric {
        scale: 100.0,
        ..metric!("over target", Percent, ["/over_target_share"], max_over_target_increase)
    },
    Metric {
        scale: 100.0,
        ..metric!("over target by a tenth", Percent, ["/late_share"], max_late_increase)
    },
    Metric { scale: 100.0, ..metric!("utilisation", Percent, ["/utilisation"]) },
    Metric {
        magnitude: true,
        ..metric!("estimate error", Percent, ["/estimate_error_percent/mean"],
                  max_estimate_error_increase)
    },
    metric!("estimate deviation", Percent, ["/estimate_error_percent/sd"],
            max_estimate_deviation_increase),
    metric!("peak memory", Bytes, ["/memory/peak_bytes"], max_memory_increase),
    metric!("bytes read", Bytes, ["/loading/read_bytes"], max_read_increase),
    metric!("evictions", Count, ["/loading/evictions"], max_eviction_increase),
    metric!("selection mean", Ms, ["/select_ms/mean"], max_select_increase),
    metric!("nodes visited", Count, ["/visited_mean"], max_visited_increase),
    metric!("nodes drawn", Count, ["/nodes_mean"]),
    metric!("triangles drawn", Count, ["/triangles_mean"]),
    Metric {
        optional: true,
        ..metric!("FLIP", Flip, ["/accuracy/flip_mean/mean"], max_flip_increase)
    },
    Metric { optional: true, ..metric!("FLIP p95", Flip, ["/accuracy/flip_p95/mean"]) },
    Metric { optional: true, ..metric!("FLIP of toggles", Flip, ["/accuracy/pop_flip/mean"]) },
    Metric {
        optional: true,
        ..metric!("gap pixels", Count, ["/accuracy/gap_pixels/sum"], max_gap_increase)
    },
    Metric {
        optional: true,
        ..metric!("inner gap pixels", Count, ["/accuracy/inner_gap_pixels/sum"])
    },
];
