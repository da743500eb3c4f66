//! Frame time against the target (thesis figure 6.5).

use super::figures::{Figure, axis, line};
use super::plot::{Axis, BLUE, GREEN, Layer, ORANGE, PURPLE, Plot, Shape, VERMILLION};
use super::series::{Places, beyond, of, range};
use crate::bench::statistics::percentile;
use crate::bench::{Context, FrameRecord};

/// Bars of the histogram.
const BARS: usize = 60;

pub(super) fn figures(frames: &[FrameRecord], context: &Context) -> Vec<Figure> {
    let frame = Places::frames(frames);
    let target = context.options.target_ms;
    let actual = of(frames, |frame| frame.report.frame_ms);
    let (y, count) = range(&actual, &[target]);
    let told = beyond(&actual, count, "ms");
    let at = |percent| percentile(&actual, percent);
    let bars = histogram(&actual, y[1]);
    let upright = |name: &str, colour, ms: f64| {
        Layer::new(format!("{name} {ms:.1} ms"), colour, Shape::Upright(ms.min(y[1])))
    };
    vec![
        Figure {
            number: "6.5",
            title: "Frame time against the target",
            caption: format!(
                "Milliseconds that each frame took, from choosing to the complete picture, \
                 against what it may take.{told}"
            ),
            plot: Plot {
                x: frame.axis(),
                y: Axis { label: "frame time, ms".into(), range: y },
                layers: vec![
                    line("frame time", BLUE, &frame, &actual),
                    Layer::new(format!("target {target} ms"), VERMILLION, Shape::Across(target)),
                ],
            },
        },
        Figure {
            number: "",
            title: "Distribution of frame time",
            caption: format!(
                "How many frames took how long; half of them are left of p50, 95 and 99 in a \
                 hundred left of p95 and p99.{told}"
            ),
            plot: Plot {
                x: Axis { label: "frame time, ms".into(), range: y },
                y: axis("frames", &[&bars.iter().map(|bar| bar[1]).collect::<Vec<_>>()]),
                layers: vec![
                    Layer::new("frames", BLUE, Shape::Area(bars)),
                    upright("target", VERMILLION, target),
                    upright("p50", GREEN, at(50.0)),
                    upright("p95", PURPLE, at(95.0)),
                    upright("p99", ORANGE, at(99.0)),
                ],
            },
        },
    ]
}

/// The corners of bars over equal parts of 0 to `most`.
fn histogram(values: &[f64], most: f64) -> Vec<[f64; 2]> {
    let width = most / BARS as f64;
    let mut counts = [0u64; BARS];
    for value in values {
        counts[((value / width).max(0.0) as usize).min(BARS - 1)] += 1;
    }
    let corners = |(bar, &count): (usize, &u64)| {
        [0.0, 1.0].map(|side| [(bar as f64 + side) * width, count as f64])
    };
    counts.iter().enumerate().flat_map(corners).collect()
}
