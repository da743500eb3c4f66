//! Estimated against actual time (thesis figure 6.4).

use super::figures::{Figure, line};
use super::plot::{Axis, BLUE, GREEN, Layer, Plot, Shape, VERMILLION};
use super::series::{Places, WINDOW, beyond, moving_average, of, range};
use crate::bench::FrameRecord;
use crate::bench::statistics::mean;
use crate::bench::summary::error_percent;

pub(super) fn figures(frames: &[FrameRecord], diagnostics: &[&str]) -> Vec<Figure> {
    let frame = Places::frames(frames);
    let without = of(frames, |frame| {
        error_percent(frame.report.actual_ms, frame.report.estimated_without_feedback_ms)
            .unwrap_or(f64::NAN)
    });
    let with = of(frames, |frame| {
        error_percent(frame.report.actual_ms, frame.report.estimated_ms).unwrap_or(f64::NAN)
    });
    let finite = |values: &[f64]| -> Vec<f64> {
        values.iter().copied().filter(|value| value.is_finite()).collect()
    };
    let panel = |number, title, values: &[f64], colour, caption: &str| {
        let (y, count) = range(&finite(values), &[]);
        let off = mean(finite(values));
        Figure {
            number,
            title,
            caption: format!("{caption}{}", beyond(values, count, "%")),
            plot: Plot {
                x: frame.axis(),
                y: Axis { label: "actual to estimate, %".into(), range: y },
                layers: vec![
                    Layer::new("difference", colour, Shape::Line(frame.points(values))),
                    Layer::new(
                        format!("mean {off:+.2} %").replace('-', "−"),
                        GREEN,
                        Shape::Across(off),
                    ),
                ],
            },
        }
    };
    let averages = [&without, &with].map(|values| {
        // Frames without an estimate are no part of an average.
        let known: Vec<f64> = values.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
        moving_average(&known)
    });
    let (y, count) = range(&averages.concat(), &[]);
    let mut figures = vec![
        panel(
            "6.4 (a)",
            "Estimate against actual time, without feedback",
            &without,
            VERMILLION,
            "How far the actual time of each frame was from the estimate that cost alone gives; \
             below 0 the estimate was cautious.",
        ),
        panel(
            "6.4 (b)",
            "Estimate against actual time, with feedback",
            &with,
            BLUE,
            "The same for the estimate that follows the measured time of earlier frames.",
        ),
        Figure {
            number: "6.4 (d)",
            title: "Both, averaged",
            caption: format!(
                "Mean of (a) and of (b) over {WINDOW} frames each, which takes out noise and \
                 leaves what feedback corrects.{}",
                beyond(&averages.concat(), count, "%")
            ),
            plot: Plot {
                x: frame.axis(),
                y: Axis { label: "actual to estimate, %".into(), range: y },
                layers: vec![
                    line("without feedback", VERMILLION, &frame, &averages[0]),
                    line("with feedback", BLUE, &frame, &averages[1]),
                ],
            },
        },
    ];
    if let Some(at) = diagnostics.iter().position(|&name| name == "v_time") {
        let last = figures.len() - 1;
        figures.insert(last, v_time(frames, &frame, at));
    }
    figures
}

/// The diagnostic `v_time`, which is the one at `at`.
fn v_time(frames: &[FrameRecord], frame: &Places, at: usize) -> Figure {
    let of_frame =
        |frame: &FrameRecord| frame.report.diagnostics.get(at).map_or(f64::NAN, |v| v * 1e3);
    let v_time: Vec<f64> = frames.iter().map(of_frame).collect();
    let (low, high) =
        v_time.iter().fold((f64::INFINITY, 0f64), |(low, high), &v| (low.min(v), high.max(v)));
    Figure {
        number: "6.4 (c)",
        title: "v_time",
        caption: "Time that selection expects of one unit of cost, as feedback moves it.".into(),
        plot: Plot {
            x: frame.axis(),
            y: Axis { label: "µs a unit of cost".into(), range: padded(low, high) },
            layers: vec![Layer::new("v_time", BLUE, Shape::Line(frame.points(&v_time)))],
        },
    }
}

/// A range with some room on both sides.
fn padded(low: f64, high: f64) -> [f64; 2] {
    let room = (high - low) * 0.05;
    [low - room, high + room]
}
