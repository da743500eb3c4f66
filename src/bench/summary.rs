//! The figures that the thesis reports (chapter 6), for one run.

use std::fmt::Write;

use serde_json::{Value, json};

use super::statistics::{deviation, mean, percentile};
use super::{Accuracy, BenchOptions, FrameRecord, ReferenceContext, Run};
use crate::picture_error::psnr;

/// The version of the format of `summary.json`, raised where a key changes its meaning.
pub const SUMMARY_VERSION: u32 = 2;

/// Above the target by more than this part counts as late.
const LATE: f64 = 0.1;

/// What a summary says of a run beside its frames.
#[derive(Clone, Debug)]
pub struct Context {
    /// The scene as a person named it; for the report only, so that summaries of the same run
    /// are the same wherever it lies.
    pub scene_name: String,
    /// The path as a person named it, or nothing; for the report only.
    pub path_name: String,
    /// What determined the run.
    pub options: BenchOptions,
    /// Name of the policy.
    pub policy: &'static str,
    /// Names of what the policy says of itself.
    pub diagnostics: &'static [&'static str],
    /// `wall` or `model`.
    pub clock: &'static str,
    /// The constants of the clock.
    pub constants: super::ClockConstants,
    /// BLAKE3 of scene, hexadecimal.
    pub scene_fingerprint: String,
    /// BLAKE3 of the path's poses and times, hexadecimal.
    pub path_fingerprint: String,
    /// The graphics adapter; `None` where nothing was drawn.
    pub adapter: Option<Value>,
    /// Files that could not be used, each with what was wrong.
    pub broken: Vec<String>,
    /// How frames were compared with the leaves; `None` where they were not.
    pub reference: Option<super::ReferenceContext>,
    /// Number of levels of the scene.
    pub levels: usize,
}

/// The summary of a run, as `summary.json` holds it.
///
/// Means, deviations, percentiles and shares are over the frames that show the scene; image error
/// is over those of them after the loading phase. Sums and maxima of bytes are over all frames.
pub fn summary(run: &Run, context: &Context) -> Value {
    let frames = &run.frames;
    let target = context.options.target_ms;
    let shown: Vec<&FrameRecord> =
        frames.iter().filter(|frame| !frame.report.without_scene).collect();
    let (loading, warm): (Vec<&FrameRecord>, Vec<&FrameRecord>) =
        shown.iter().partition(|frame| frame.report.loading_phase);
    let of =
        |field: fn(&FrameRecord) -> f64| shown.iter().map(|at| field(at)).collect::<Vec<f64>>();
    let times = of(|frame| frame.report.frame_ms);
    let over: Vec<f64> =
        times.iter().filter(|&&time| time > target).map(|time| time - target).collect();
    let toggles = |frames: &[FrameRecord]| {
        let sum = |of: fn(&FrameRecord) -> u32| frames.iter().map(of).map(u64::from).sum::<u64>();
        let (up, down) =
            (sum(|frame| frame.report.toggles_up), sum(|frame| frame.report.toggles_down));
        let per_frame = (up + down) as f64 / (frames.len().max(1)) as f64;
        (up, down, per_frame)
    };
    let (up, down, per_frame) = toggles(frames);
    let (late_up, late_down, late_per_frame) = toggles(&frames[frames.len() / 2..]);
    let cap = context.options.residency.max_memory_bytes;
    let bytes = |of: fn(&FrameRecord) -> u64| frames.iter().map(of).sum::<u64>();
    let levels = |level: usize| {
        json!({
            "nodes": mean(shown.iter().map(|frame| f64::from(frame.report.nodes_by_level[level]))),
            "triangles": mean(shown.iter().map(|frame| frame.report.triangles_by_level[level] as f64)),
        })
    };
    let reference = context.reference.as_ref();
    json!({
        "format_version": SUMMARY_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "scene_fingerprint": context.scene_fingerprint,
        "path_fingerprint": context.path_fingerprint,
        "policy": context.policy,
        "clock": context.clock,
        "parameters": context.options,
        "clock_constants": context.constants,
        "adapter": context.adapter,
        "broken_files": context.broken,
        "frames": frames.len(),
        "frames_without_scene": frames.len() - shown.len(),
        // Until the first frame that needs nothing which is not in memory, two seconds at most.
        "loading_phase": phase(&loading, target),
        // After it.
        "warm": phase(&warm, target),
        "frame_ms": {
            "mean": mean(times.iter().copied()),
            "sd": deviation(&times),
            "p50": percentile(&times, 50.0),
            "p95": percentile(&times, 95.0),
            "p99": percentile(&times, 99.0),
            "max": percentile(&times, 100.0),
        },
        "over_target_share": share_above(&times, target),
        "late_share": share_above(&times, target * (1.0 + LATE)),
        "over_target_ms": { "mean": mean(over.iter().copied()), "max": percentile(&over, 100.0) },
        "utilisation": mean(of(|frame| frame.report.actual_ms)) / target,
        "estimate_error_percent": error(&shown, |frame| frame.report.estimated_ms),
        "without_feedback": {
            "estimate_error_percent":
                error(&shown, |frame| frame.report.estimated_without_feedback_ms),
        },
        // Of whole frames, uploads included, by the engine's cost model.
        "modelled_error_percent": error_of(
            &shown,
            |frame| frame.report.frame_ms,
            |frame| frame.report.modelled_ms,
        ),
        "toggles": {
            "up": up,
            "down": down,
            "per_frame": per_frame,
            "frames_per_toggle": frames_per_toggle(frames.len(), up + down),
            "longest_run": longest_run(frames),
            "longest_pause": longest_pause(frames),
            "second_half": { "up": late_up, "down": late_down, "per_frame": late_per_frame },
        },
        "memory": {
            "cap_bytes": cap,
            "start_bytes": run.start_bytes,
            "peak_bytes": run.peak_bytes,
            "peak_share": run.peak_bytes as f64 / cap as f64,
            "scene_bytes": run.scene_bytes,
            "mean_bytes": mean(of(|frame| frame.report.memory_bytes as f64)),
            "process_peak_bytes": frames.iter().map(|frame| frame.process_bytes).max(),
        },
        "loading": {
            "read_bytes": bytes(|frame| frame.report.read_bytes),
            "arrived": bytes(|frame| u64::from(frame.report.arrived)),
            "evictions": bytes(|frame| frame.report.evictions),
            "waiting_mean": mean(of(|frame| f64::from(frame.report.waiting))),
            "waiting_last": frames.last().map(|frame| frame.report.waiting),
            // Frames in which a node was not in memory that would have been drawn.
            "lacking_percent": mean(of(|frame| f64::from(u8::from(frame.report.lacking > 0)))) * 100.0,
        },
        "accuracy": reference.map(|reference| accuracy(frames, reference)),
        "select_ms": {
            "mean": mean(of(|frame| frame.report.select_ms)),
            "max": percentile(&of(|frame| frame.report.select_ms), 100.0),
        },
        // Of the front, and not drawn.
        "hidden": {
            "nodes_mean": mean(of(|frame| f64::from(frame.report.hidden_nodes))),
            "triangles_mean": mean(of(|frame| frame.report.hidden_triangles as f64)),
        },
        // In the place of nodes outside of cull boxes.
        "far_field": {
            "frames_percent": mean(of(|frame| f64::from(u8::from(frame.report.faces > 0)))) * 100.0,
            "faces_mean": mean(of(|frame| f64::from(frame.report.faces))),
            "triangles_mean": mean(of(|frame| frame.report.face_triangles as f64)),
            "changes": frames.iter().filter(|frame| frame.report.far_changed).count(),
        },
        "visited_mean": mean(of(|frame| f64::from(frame.report.visited))),
        "nodes_mean": mean(of(|frame| f64::from(frame.report.nodes))),
        "triangles_mean": mean(of(|frame| frame.report.triangles as f64)),
        "levels": (0..context.levels).map(levels).collect::<Vec<_>>(),
    })
}

/// Times of some of the frames that show the scene; `null` in place of figures of none.
fn phase(frames: &[&FrameRecord], target_ms: f64) -> Value {
    let times: Vec<f64> = frames.iter().map(|frame| frame.report.frame_ms).collect();
    let figure = |value: f64| (!times.is_empty()).then_some(value);
    let uploads = frames.iter().map(|frame| frame.report.upload_ms);
    json!({
        "frames": times.len(),
        "frame_ms": {
            "mean": figure(mean(times.iter().copied())),
            "p50": figure(percentile(&times, 50.0)),
            "p95": figure(percentile(&times, 95.0)),
            "max": figure(percentile(&times, 100.0)),
        },
        "upload_ms_mean": figure(mean(uploads)),
        "over_target_share": figure(share_above(&times, target_ms)),
        "late_share": figure(share_above(&times, target_ms * (1.0 + LATE))),
    })
}

/// The share of values above a limit; 0 of none.
fn share_above(values: &[f64], limit: f64) -> f64 {
    mean(values.iter().map(|&value| f64::from(u8::from(value > limit))))
}

/// The difference of frames from the leaves, over those that were looked at, show the scene and come
/// after the loading phase. FLIP of the loading phase stands apart.
fn accuracy(frames: &[FrameRecord], reference: &ReferenceContext) -> Value {
    // Frames that were looked at for what changed in them are no fair part of all.
    let every = usize::try_from(reference.every).unwrap_or(usize::MAX).max(1);
    let phase = |loading: bool| -> Vec<&Accuracy> {
        let fits = |frame: &&FrameRecord| {
            frame.report.loading_phase == loading && !frame.report.without_scene
        };
        frames.iter().step_by(every).filter(fits).filter_map(|at| at.accuracy.as_ref()).collect()
    };
    let (looked, loading) = (phase(false), phase(true));
    let of = |field: fn(&Accuracy) -> f64| looked.iter().map(|&a| field(a)).collect::<Vec<f64>>();
    // Nothing that was not looked at is without error.
    let figure = |values: &[f64], value: f64| (!values.is_empty()).then_some(value);
    let spread = |values: Vec<f64>| {
        json!({
            "mean": figure(&values, mean(values.iter().copied())),
            "p95": figure(&values, percentile(&values, 95.0)),
            "max": figure(&values, percentile(&values, 100.0)),
        })
    };
    let surface: u64 = looked.iter().map(|a| a.reference_pixels).sum();
    let pixels = |field: fn(&Accuracy) -> u64| {
        let sum: u64 = looked.iter().map(|&a| field(a)).sum();
        json!({
            "sum": sum,
            "max": looked.iter().map(|&a| field(a)).max(),
            "per_100000": sum as f64 / surface.max(1) as f64 * 1e5,
        })
    };
    let squared = of(|a| a.squared_error);
    let similar: Vec<f64> = looked.iter().filter_map(|a| a.ssim).collect();
    let pops = |far_changed: bool| {
        let of = frames.iter().filter(|frame| frame.report.far_changed == far_changed);
        of.filter_map(|frame| frame.accuracy.as_ref()?.pop_flip).collect::<Vec<f64>>()
    };
    let (pops, far_pops) = (pops(false), pops(true));
    json!({
        "every": reference.every,
        "adapter": reference.adapter,
        "frames": looked.len() + loading.len(),
        // Figures are over these, but for those of the loading phase and pops.
        "warm_frames": looked.len(),
        "loading_phase": {
            "frames": loading.len(),
            "flip_mean": spread(loading.iter().map(|a| a.flip_mean).collect()),
        },
        "flip_mean": spread(of(|a| a.flip_mean)),
        "flip_p95": spread(of(|a| a.flip_p95)),
        // Of all pixels together; null where no pixel differs.
        "psnr_db": {
            "all": figure(&squared, psnr(mean(squared.iter().copied()))),
            "min": figure(&squared, psnr(percentile(&squared, 100.0))),
        },
        "ssim": {
            "mean": figure(&similar, mean(similar.iter().copied())),
            "min": figure(&similar, percentile(&similar, 0.0)),
        },
        "reference_triangles_mean": figure(&squared, mean(of(|a| a.reference_triangles as f64))),
        "reference_pixels": surface,
        "gap_pixels": pixels(|a| a.gap_pixels),
        "inner_gap_pixels": pixels(|a| a.inner_gap_pixels),
        "extra_pixels": pixels(|a| a.extra_pixels),
        "pop_frames": pops.len(),
        "pop_flip": (!pops.is_empty()).then(|| spread(pops)),
        // Where what is far changed, by another cell or none.
        "far_pop_frames": far_pops.len(),
        "far_pop_flip": (!far_pops.is_empty()).then(|| spread(far_pops)),
    })
}

/// `(actual − estimated) / estimated` in percent: below 0 where estimates were cautious, as in
/// the thesis (section 6.3). `None` where nothing was estimated.
pub(super) fn error_percent(actual_ms: f64, estimated_ms: f64) -> Option<f64> {
    (estimated_ms > 0.0).then(|| (actual_ms / estimated_ms - 1.0) * 100.0)
}

fn error(frames: &[&FrameRecord], estimate: fn(&FrameRecord) -> f64) -> Value {
    error_of(frames, |frame| frame.report.actual_ms, estimate)
}

fn error_of(
    frames: &[&FrameRecord],
    actual: fn(&FrameRecord) -> f64,
    estimate: fn(&FrameRecord) -> f64,
) -> Value {
    let errors: Vec<f64> =
        frames.iter().filter_map(|frame| error_percent(actual(frame), estimate(frame))).collect();
    json!({ "mean": mean(errors.iter().copied()), "sd": deviation(&errors) })
}

fn frames_per_toggle(frames: usize, toggles: u64) -> Option<f64> {
    (toggles > 0).then(|| frames as f64 / toggles as f64)
}

/// The most frames in a row each of which toggled.
fn longest_run(frames: &[FrameRecord]) -> usize {
    longest(frames, |frame| frame.report.toggles() > 0)
}

/// The most frames in a row without any toggle.
fn longest_pause(frames: &[FrameRecord]) -> usize {
    longest(frames, |frame| frame.report.toggles() == 0)
}

fn longest(frames: &[FrameRecord], holds: fn(&FrameRecord) -> bool) -> usize {
    frames
        .chunk_by(|a, b| holds(a) == holds(b))
        .filter(|run| holds(&run[0]))
        .map(<[_]>::len)
        .max()
        .unwrap_or(0)
}

/// The summary for a person, on one screen.
pub fn summary_text(summary: &Value) -> String {
    let number = |path: &str| summary.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
    let mib = |path: &str| number(path) / f64::from(1 << 20);
    let target = number("/parameters/target_ms");
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{name:<12}{text}");
    };
    let without_scene = match number("/frames_without_scene") {
        frames if frames > 0.0 => format!("; {frames} do not show the scene: in no mean below"),
        _ => String::new(),
    };
    let clock = text(summary, "/clock");
    line("frames", format!("{}, {clock} clock{without_scene}", number("/frames")));
    line(
        "frame time",
        format!(
            "{:.1} ms mean, {:.1} p50, {:.1} p95, {:.1} p99 for a target of {target} ms",
            number("/frame_ms/mean"),
            number("/frame_ms/p50"),
            number("/frame_ms/p95"),
            number("/frame_ms/p99"),
        ),
    );
    line(
        "",
        format!(
            "{:.1} % of frames over the target, {:.1} % by more than a tenth; {:.0} % used",
            number("/over_target_share") * 100.0,
            number("/late_share") * 100.0,
            number("/utilisation") * 100.0
        ),
    );
    let phase = |key: &str| {
        format!(
            "{:.1} ms mean, {:.1} % over the target by more than a tenth",
            number(&format!("/{key}/frame_ms/mean")),
            number(&format!("/{key}/late_share")) * 100.0,
        )
    };
    if number("/loading_phase/frames") > 0.0 {
        let after = match number("/warm/frames") {
            frames if frames > 0.0 => format!("; after it {}", phase("warm")),
            _ => "; the path ends within it".into(),
        };
        let frames = number("/loading_phase/frames");
        line("start", format!("{frames} frames of loading, {}{after}", phase("loading_phase")));
    }
    line(
        "estimate",
        format!(
            "{:+.2} % off on average, deviation {:.2} % (without feedback {:+.2} %, {:.2} %)",
            number("/estimate_error_percent/mean"),
            number("/estimate_error_percent/sd"),
            number("/without_feedback/estimate_error_percent/mean"),
            number("/without_feedback/estimate_error_percent/sd"),
        ),
    );
    let toggles = number("/toggles/up") + number("/toggles/down");
    line(
        "toggles",
        match number("/toggles/frames_per_toggle") {
            frames if frames.is_nan() => "none".into(),
            frames => format!(
                "{toggles}: {} up, {} down, one in {frames:.1} frames",
                number("/toggles/up"),
                number("/toggles/down")
            ),
        },
    );
    line(
        "drawn",
        format!(
            "{:.0} nodes and {:.0} triangles a frame; {:.0} nodes visited in {:.3} ms",
            number("/nodes_mean"),
            number("/triangles_mean"),
            number("/visited_mean"),
            number("/select_ms/mean")
        ),
    );
    if number("/far_field/faces_mean") > 0.0 {
        line(
            "far field",
            format!(
                "{:.1} faces and {:.0} triangles a frame, in {:.0} % of frames; {} changes of cell",
                number("/far_field/faces_mean"),
                number("/far_field/triangles_mean"),
                number("/far_field/frames_percent"),
                number("/far_field/changes"),
            ),
        );
    }
    if number("/hidden/nodes_mean") > 0.0 {
        let hidden = number("/hidden/triangles_mean");
        line(
            "hidden",
            format!(
                "{:.1} nodes and {hidden:.0} triangles a frame, {:.0} % of those in view, not drawn",
                number("/hidden/nodes_mean"),
                100.0 * hidden / (hidden + number("/triangles_mean"))
            ),
        );
    }
    line(
        "memory",
        format!(
            "{:.1} MiB at first, {:.1} at most, {:.1} % of the cap of {:.1}; {:.1} for all of the scene",
            mib("/memory/start_bytes"),
            mib("/memory/peak_bytes"),
            number("/memory/peak_share") * 100.0,
            mib("/memory/cap_bytes"),
            mib("/memory/scene_bytes")
        ),
    );
    line(
        "loading",
        format!(
            "{:.1} MiB read, {} nodes arrived, {} evicted, {} still wanted at the end",
            mib("/loading/read_bytes"),
            number("/loading/arrived"),
            number("/loading/evictions"),
            number("/loading/waiting_last")
        ),
    );
    if summary.pointer("/accuracy").is_some_and(Value::is_object) {
        let frames = number("/accuracy/warm_frames");
        let loading = match number("/accuracy/loading_phase/frames") {
            frames if frames > 0.0 => format!(
                "; {frames} more of the loading phase, FLIP {:.4} mean",
                number("/accuracy/loading_phase/flip_mean/mean")
            ),
            _ => String::new(),
        };
        let warm = match frames > 0.0 {
            true => format!(
                "FLIP {:.4} mean, {:.4} at worst; SSIM {:.4}; PSNR {}; {frames} frames looked at",
                number("/accuracy/flip_mean/mean"),
                number("/accuracy/flip_mean/max"),
                number("/accuracy/ssim/mean"),
                match number("/accuracy/psnr_db/all") {
                    decibels if decibels.is_nan() => "infinite".into(),
                    decibels => format!("{decibels:.1} dB"),
                },
            ),
            false => "no frame was looked at after the loading phase; see --warm-up-frames".into(),
        };
        line("accuracy", format!("{warm}{loading}"));
        line(
            "gaps",
            format!(
                "{} pixels of {}, {} of them within the outline; {} pixels too many",
                number("/accuracy/gap_pixels/sum"),
                number("/accuracy/reference_pixels"),
                number("/accuracy/inner_gap_pixels/sum"),
                number("/accuracy/extra_pixels/sum"),
            ),
        );
        for (key, what) in [("pop", "frames with toggles"), ("far_pop", "changes of cell")] {
            let number = |at: &str| number(&format!("/accuracy/{key}_{at}"));
            if number("frames") > 0.0 {
                let (mean, most) = (number("flip/mean"), number("flip/max"));
                let frames = number("frames");
                line("pops", format!("FLIP {mean:.4} mean, {most:.4} at worst in {frames} {what}"));
            }
        }
    }
    let broken = summary.pointer("/broken_files").and_then(Value::as_array);
    for file in broken.into_iter().flatten() {
        line("unusable", file.as_str().unwrap_or_default().to_owned());
    }
    out
}

fn text<'a>(summary: &'a Value, path: &str) -> &'a str {
    summary.pointer(path).and_then(Value::as_str).unwrap_or("?")
}
