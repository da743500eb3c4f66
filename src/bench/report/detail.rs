//! Which levels were drawn (thesis figures 6.2 and 6.3).

use super::figures::Figure;
use super::plot::{Axis, Layer, Plot, Shape, steps};
use super::series::Places;
use crate::bench::FrameRecord;

/// Levels that have a colour of their own; deeper ones share one.
const MOST_LEVELS: usize = 8;

/// What was drawn of each level, as it is and in percent.
pub(super) fn figures(frames: &[FrameRecord], levels: usize) -> Vec<Figure> {
    let nodes = stacks(frames, levels, |frame, level| {
        frame.report.nodes_by_level.get(level).copied().map_or(0.0, f64::from)
    });
    let triangles = stacks(frames, levels, |frame, level| {
        frame.report.triangles_by_level.get(level).map_or(0.0, |&count| count as f64)
    });
    let figure = |number, title, caption: &str, label: &str, stacks: &[Vec<f64>]| Figure {
        number,
        title,
        caption: caption.into(),
        plot: plot(frames, label, stacks, levels),
    };
    let most = triangles.last().into_iter().flatten().copied().fold(0.0, f64::max);
    let (scale, unit) = match most {
        most if most >= 1e6 => (1e-6, "million triangles"),
        most if most >= 1e4 => (1e-3, "thousand triangles"),
        _ => (1.0, "triangles"),
    };
    let scaled: Vec<Vec<f64>> =
        triangles.iter().map(|stack| stack.iter().map(|count| count * scale).collect()).collect();
    vec![
        figure(
            "6.2, 6.3 (a)",
            "Nodes drawn by level",
            "Nodes drawn in each frame, coarse levels below and fine ones on top of them.",
            "nodes",
            &nodes,
        ),
        figure(
            "6.2, 6.3 (b)",
            "Nodes drawn by level, in percent",
            "The share of each level in them: the more of the upper colours, the finer the picture.",
            "% of nodes",
            &percent(&nodes),
        ),
        figure(
            "",
            "Triangles drawn by level",
            "Triangles drawn in each frame, which is what time is spent on.",
            unit,
            &scaled,
        ),
        figure(
            "",
            "Triangles drawn by level, in percent",
            "The share of each level in them.",
            "% of triangles",
            &percent(&triangles),
        ),
    ]
}

/// For each frame what levels have up to and with one; the last of them is all there is.
fn stacks(
    frames: &[FrameRecord],
    levels: usize,
    count: impl Fn(&FrameRecord, usize) -> f64,
) -> Vec<Vec<f64>> {
    let shown = levels.clamp(1, MOST_LEVELS);
    let upto = |level: usize| if level + 1 == shown { levels } else { level + 1 };
    (0..shown)
        .map(|level| {
            let sum = |frame| (0..upto(level)).map(|level| count(frame, level)).sum();
            frames.iter().map(sum).collect()
        })
        .collect()
}

/// Stacks as parts of the whole; nothing where nothing is drawn.
fn percent(stacks: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let whole = stacks.last().map_or(&[][..], Vec::as_slice);
    let part = |(&part, &whole): (&f64, &f64)| if whole > 0.0 { part / whole * 100.0 } else { 0.0 };
    stacks.iter().map(|stack| stack.iter().zip(whole).map(part).collect()).collect()
}

fn plot(frames: &[FrameRecord], label: &str, stacks: &[Vec<f64>], levels: usize) -> Plot {
    let places = Places::frames(frames);
    let most = stacks.iter().flatten().copied().fold(0.0, f64::max);
    let top = match label.starts_with('%') {
        true => 100.0,
        false if most > 0.0 => most * 1.05,
        false => 1.0,
    };
    let name = |level: usize| match level {
        0 => "level 0 (roots)".to_owned(),
        level if level + 1 == stacks.len() && stacks.len() < levels => {
            format!("level {level} and below")
        }
        level => format!("level {level}"),
    };
    let colours = steps(stacks.len());
    // The whole first, and what lies lower in front of it.
    let layers = stacks.iter().zip(colours).enumerate().rev().map(|(level, (stack, colour))| {
        Layer::new(name(level), colour, Shape::Area(places.points(stack)))
    });
    let layers = layers.collect();
    Plot { x: places.axis(), y: Axis { label: label.into(), range: [0.0, top] }, layers }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stacks_end_with_the_whole_and_deep_levels_share_one() {
        let mut frame = FrameRecord::default();
        frame.report.nodes_by_level = (1..=12).collect();
        let frames = [frame, FrameRecord::default()];
        let count = |frame: &FrameRecord, level: usize| {
            frame.report.nodes_by_level.get(level).copied().map_or(0.0, f64::from)
        };
        let stacks = stacks(&frames, 12, count);
        assert_eq!(stacks.len(), MOST_LEVELS);
        assert_eq!(stacks[1], [3.0, 0.0]);
        assert_eq!(stacks[7], [78.0, 0.0]);
        let shares = percent(&stacks);
        assert_eq!(shares[7], [100.0, 0.0]);
        assert!((shares[0][0] - 100.0 / 78.0).abs() < 1e-12);
    }
}
