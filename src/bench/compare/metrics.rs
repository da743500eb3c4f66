//! The figures that are compared.

use super::Unit;

/// One figure of a summary.
pub(super) struct Metric {
    /// In tables, in JSON and on the command line.
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
    /// Unless a limit is given, neither run may have any.
    pub none_allowed: bool,
}

const fn metric(name: &'static str, unit: Unit, keys: &'static [&'static str]) -> Metric {
    Metric { name, unit, keys, scale: 1.0, optional: false, magnitude: false, none_allowed: false }
}

/// A share, 0 to 1 in the summary.
const fn share(name: &'static str, keys: &'static [&'static str]) -> Metric {
    Metric { scale: 100.0, ..metric(name, Unit::Percent, keys) }
}

const fn of_images(name: &'static str, unit: Unit, keys: &'static [&'static str]) -> Metric {
    Metric { optional: true, ..metric(name, unit, keys) }
}

/// In the order of the table.
pub(super) const METRICS: &[Metric] = &[
    metric("toggles", Unit::Count, &["/toggles/up", "/toggles/down"]),
    metric("toggles-up", Unit::Count, &["/toggles/up"]),
    metric("toggles-down", Unit::Count, &["/toggles/down"]),
    metric("longest-toggle-run", Unit::Count, &["/toggles/longest_run"]),
    metric("frame-time-mean", Unit::Ms, &["/frame_ms/mean"]),
    metric("frame-time-p50", Unit::Ms, &["/frame_ms/p50"]),
    metric("frame-time-p95", Unit::Ms, &["/frame_ms/p95"]),
    metric("frame-time-p99", Unit::Ms, &["/frame_ms/p99"]),
    share("over-target", &["/over_target_share"]),
    share("late", &["/late_share"]),
    share("utilisation", &["/utilisation"]),
    Metric {
        magnitude: true,
        ..metric("estimate-error", Unit::Percent, &["/estimate_error_percent/mean"])
    },
    metric("estimate-deviation", Unit::Percent, &["/estimate_error_percent/sd"]),
    metric("peak-memory", Unit::Bytes, &["/memory/peak_bytes"]),
    metric("bytes-read", Unit::Bytes, &["/loading/read_bytes"]),
    metric("evictions", Unit::Count, &["/loading/evictions"]),
    metric("selection", Unit::Ms, &["/select_ms/mean"]),
    metric("nodes-visited", Unit::Count, &["/visited_mean"]),
    metric("nodes", Unit::Count, &["/nodes_mean"]),
    metric("triangles", Unit::Count, &["/triangles_mean"]),
    Metric {
        optional: true,
        none_allowed: true,
        ..metric("broken-files", Unit::Count, &["/broken_files"])
    },
    of_images("flip", Unit::Flip, &["/accuracy/flip_mean/mean"]),
    of_images("flip-p95", Unit::Flip, &["/accuracy/flip_p95/mean"]),
    of_images("flip-of-toggles", Unit::Flip, &["/accuracy/pop_flip/mean"]),
    of_images("gap-pixels", Unit::Count, &["/accuracy/gap_pixels/sum"]),
    of_images("inner-gap-pixels", Unit::Count, &["/accuracy/inner_gap_pixels/sum"]),
];

/// What each metric is, for help.
pub(super) fn help() -> String {
    let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
    format!(
        "The most that a metric may be (`flip=0.03`), or how much more than it was in the base, in \
         its unit or in percent (`frame-time-p95=+0.5ms`, `toggles=+5%`). What is met exactly holds; \
         what has no limit is shown and not judged. Several may be given.\n\n\
         METRIC is one of {}. `late` is the share of frames over the target by more than a tenth, \
         in percentage points (`late=+2pp`), as are other shares; those of FLIP and of gaps need \
         --reference-every. `broken-files` exceeds its limit where either run has any, unless a limit \
         is given for it",
        names.join(", ")
    )
}
