//! What is told of a run in a comparison of policies.

use super::RunKey;
use crate::bench::statistics::{mean, percentile};
use crate::bench::{FrameRecord, Run};

/// Above the target by more than this part counts as late.
const LATE: f64 = 0.1;

/// A figure of a run: the name of its column, its head in a table and its digits there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figure {
    /// In files.
    pub name: &'static str,
    /// For people.
    pub head: &'static str,
    /// After the point.
    pub digits: usize,
}

const fn figure(name: &'static str, head: &'static str, digits: usize) -> Figure {
    Figure { name, head, digits }
}

/// The figures of a run, in the order of [`PolicyRun::values`].
pub const FIGURES: [Figure; 22] = [
    figure("flip_mean", "FLIP", 4),
    figure("flip_p95", "FLIP p95", 4),
    figure("flip_to_oracle", "to oracle", 4),
    figure("frame_ms_mean", "frame, ms", 1),
    figure("frame_ms_p95", "p95, ms", 1),
    figure("late_percent", "late, %", 1),
    figure("longest_late_s", "longest late, s", 2),
    figure("used_percent", "used, %", 0),
    figure("toggles_per_min", "toggles/min", 0),
    figure("settled_toggles_per_min", "of the second half", 0),
    figure("chosen_per_min", "chosen", 0),
    figure("arrived_per_min", "arrived", 0),
    figure("evicted_per_min", "evicted", 0),
    figure("came_into_view_per_min", "into view", 0),
    figure("lacking_percent", "lacking, %", 1),
    figure("pop_flip_sum", "pops, ΣFLIP", 3),
    figure("read_mb", "read, MB", 1),
    figure("reread_mb", "again, MB", 1),
    figure("peak_mb", "peak, MB", 1),
    figure("estimate_mean_percent", "estimate, %", 2),
    figure("estimate_sd_percent", "±", 2),
    figure("visited_mean", "visited", 0),
];

/// Which frames of a run were compared with the leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inspected {
    /// Those whose index is a multiple of this; 0: none.
    pub every: usize,
    /// And those in which levels toggled.
    pub every_toggle: bool,
}

/// A run of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct PolicyRun {
    /// The scene, as a person named it.
    pub scene: String,
    /// Which run over it.
    pub key: RunKey,
    /// One a [`FIGURES`]; NaN where there is none.
    pub values: Vec<f64>,
}

impl PolicyRun {
    /// The figures of a run.
    pub fn new(scene: &str, key: RunKey, run: &Run, inspected: Inspected) -> Self {
        let frames = &run.frames;
        let of = |field: fn(&FrameRecord) -> f64| frames.iter().map(field).collect::<Vec<f64>>();
        let times = of(|frame| frame.report.frame_ms);
        let late = |ms: f64| ms > key.target_ms * (1.0 + LATE);
        let looked = frames
            .iter()
            .step_by(inspected.every.max(1))
            .filter(|at| !(at.report.loading_phase || at.report.without_scene))
            .filter_map(|at| at.accuracy.as_ref());
        let flips: Vec<f64> = looked.map(|accuracy| accuracy.flip_mean).collect();
        let known = |values: &[f64], value: f64| if values.is_empty() { f64::NAN } else { value };
        let finer = frames.iter().filter(|frame| frame.report.finer_resident);
        let used: Vec<f64> = finer.map(|frame| frame.report.actual_ms / key.target_ms).collect();
        let second_half = &frames[frames.len() / 2..];
        let pops: Vec<f64> =
            frames.iter().filter_map(|at| at.accuracy.as_ref()?.pop_flip).collect();
        let mb = |bytes: u64| bytes as f64 / 1e6;
        let sum = |field: fn(&FrameRecord) -> u64| frames.iter().map(field).sum::<u64>();
        let errors: Vec<f64> = frames
            .iter()
            .filter(|frame| frame.report.modelled_ms > 0.0)
            .map(|frame| (frame.report.frame_ms / frame.report.modelled_ms - 1.0) * 100.0)
            .collect();
        let values = vec![
            known(&flips, mean(flips.iter().copied())),
            known(&flips, percentile(&flips, 95.0)),
            f64::NAN, // once the oracle's is known
            mean(times.iter().copied()),
            percentile(&times, 95.0),
            mean(times.iter().map(|&ms| f64::from(u8::from(late(ms))))) * 100.0,
            longest_late_s(frames, late),
            known(&used, mean(used.iter().copied()) * 100.0),
            per_min(frames, |frame| frame.report.toggles()),
            per_min(second_half, |frame| frame.report.toggles()),
            per_min(frames, |frame| frame.report.toggle_causes.chosen),
            per_min(frames, |frame| frame.report.toggle_causes.arrived),
            per_min(frames, |frame| frame.report.toggle_causes.evicted),
            per_min(frames, |frame| frame.report.toggle_causes.came_into_view),
            mean(of(|frame| f64::from(u8::from(frame.report.lacking > 0)))) * 100.0,
            // Without any, −0 would be said.
            if inspected.every_toggle { 0.0 + pops.iter().sum::<f64>() } else { f64::NAN },
            mb(sum(|frame| frame.report.read_bytes)),
            mb(sum(|frame| frame.report.reread_bytes)),
            mb(run.peak_bytes),
            mean(errors.iter().copied()),
            crate::bench::statistics::deviation(&errors),
            mean(of(|frame| f64::from(frame.report.visited))),
        ];
        Self { scene: scene.to_owned(), key, values }
    }

    /// A figure by its name; NaN where there is none.
    pub fn value(&self, name: &str) -> f64 {
        let at = FIGURES.iter().position(|figure| figure.name == name);
        at.map_or(f64::NAN, |at| self.values[at])
    }

    /// Sets a figure by its name.
    pub(super) fn set(&mut self, name: &str, value: f64) {
        if let Some(at) = FIGURES.iter().position(|figure| figure.name == name) {
            self.values[at] = value;
        }
    }
}

/// How many there were of something in a minute.
fn per_min(frames: &[FrameRecord], field: fn(&FrameRecord) -> u32) -> f64 {
    frames.iter().map(field).map(f64::from).sum::<f64>() * 60.0 / seconds(frames)
}

/// Seconds of a path.
fn seconds(frames: &[FrameRecord]) -> f64 {
    match (frames.first(), frames.last()) {
        (Some(first), Some(last)) if frames.len() > 1 => {
            let between = last.time_s - first.time_s;
            between + between / (frames.len() - 1) as f64
        }
        _ => f64::NAN,
    }
}

/// Seconds for which frames were late in a row, at the longest: how long it takes until they are
/// within the target again.
fn longest_late_s(frames: &[FrameRecord], late: impl Fn(f64) -> bool) -> f64 {
    let (mut longest, mut since) = (0.0, None);
    for frame in frames {
        match (late(frame.report.frame_ms), since) {
            (true, None) => since = Some(frame.time_s),
            (false, Some(begin)) => {
                longest = f64::max(longest, frame.time_s - begin);
                since = None;
            }
            _ => {}
        }
    }
    match (since, frames.last()) {
        (Some(begin), Some(last)) => f64::max(longest, last.time_s - begin),
        _ => longest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Accuracy;
    use crate::camera::PathKind;
    use crate::engine::{FrameReport, ToggleCauses};

    fn frame(index: u64, ms: f64) -> FrameRecord {
        FrameRecord {
            frame: index,
            time_s: index as f64 / 10.0,
            report: FrameReport {
                frame_ms: ms,
                actual_ms: ms,
                modelled_ms: 10.0,
                toggles_up: if index < 5 { 3 } else { 1 },
                toggle_causes: ToggleCauses { arrived: 1, ..ToggleCauses::default() },
                finer_resident: index < 3,
                lacking: u32::from(index == 5),
                read_bytes: 1_000_000,
                ..FrameReport::default()
            },
            accuracy: index.is_multiple_of(2).then(|| Accuracy {
                flip_mean: 0.1 * (1 + index) as f64,
                pop_flip: Some(0.5),
                ..Accuracy::default()
            }),
            ..FrameRecord::default()
        }
    }

    #[test]
    fn figures_are_those_of_the_frames() {
        // Late for 0.2 s, and from 0.6 s to the end.
        let times = [10.0, 12.0, 12.0, 10.0, 10.0, 10.0, 12.0, 12.0, 12.0, 12.0];
        let frames = times.iter().zip(0..).map(|(&ms, index)| frame(index, ms)).collect();
        let run = Run { frames, start_bytes: 0, peak_bytes: 5_000_000, scene_bytes: 0 };
        let key = RunKey { policy: "x".into(), path: PathKind::Walk, seed: 0, target_ms: 10.0 };
        let found = PolicyRun::new("city", key, &run, Inspected { every: 4, every_toggle: true });
        for (name, expected) in [
            ("flip_mean", (0.1 + 0.5 + 0.9) / 3.0),
            ("frame_ms_p95", 12.0),
            ("late_percent", 60.0),
            ("longest_late_s", 0.3),
            ("used_percent", (1.0 + 1.2 + 1.2) / 3.0 * 100.0),
            ("toggles_per_min", 1200.0),
            ("settled_toggles_per_min", 600.0),
            ("arrived_per_min", 600.0),
            ("chosen_per_min", 0.0),
            ("lacking_percent", 10.0),
            ("pop_flip_sum", 2.5),
            ("read_mb", 10.0),
            ("peak_mb", 5.0),
            ("estimate_mean_percent", 12.0),
        ] {
            assert!((found.value(name) - expected).abs() < 1e-9, "{name} {}", found.value(name));
        }
        assert!(found.value("flip_to_oracle").is_nan());
        assert_eq!(found.values.len(), FIGURES.len());
    }
}
