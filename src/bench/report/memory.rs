//! Memory and what comes and goes in it (thesis figure 6.1).

use super::figures::{Figure, axis};
use super::plot::{Axis, BLUE, Layer, Plot, Shape, VERMILLION};
use super::series::{Places, byte_unit, of};
use crate::bench::{Context, Run};

pub(super) fn figures(run: &Run, context: &Context) -> Vec<Figure> {
    let frames = &run.frames;
    let (frame, seconds) = (Places::frames(frames), Places::seconds(frames));
    let used = of(frames, |frame| frame.report.memory_bytes as f64);
    let cap = context.options.residency.max_memory_bytes as f64;
    let most = used.iter().fold(run.peak_bytes as f64, |most, &bytes| most.max(bytes));
    // A cap that is far above would leave nothing to see.
    let near = cap <= 4.0 * most;
    let top = if near { most.max(cap) } else { most };
    let (unit, name) = byte_unit(top);
    let scaled: Vec<f64> = used.iter().map(|bytes| bytes / unit).collect();
    let mut layers = vec![Layer::new("in use", BLUE, Shape::Line(seconds.points(&scaled)))];
    let far = if near {
        layers.push(Layer::new("cap (maxMemory)", VERMILLION, Shape::Across(cap / unit)));
        String::new()
    } else {
        format!(" The cap, {:.1} {name}, is far above the plot.", cap / unit)
    };
    let memory = Figure {
        number: "6.1",
        title: "Memory in use",
        caption: format!(
            "Bytes that nodes and loads under way take over time, which must stay below the \
             cap.{far}"
        ),
        plot: Plot {
            x: seconds.axis(),
            y: Axis { label: format!("memory, {name}"), range: [0.0, top / unit * 1.05] },
            layers,
        },
    };

    let read = of(frames, |frame| frame.report.read_bytes as f64);
    let (unit, name) = byte_unit(read.iter().copied().fold(0.0, f64::max));
    let read: Vec<f64> = read.iter().map(|bytes| bytes / unit).collect();
    let waiting = of(frames, |frame| f64::from(frame.report.waiting));
    let arrived = of(frames, |frame| f64::from(frame.report.arrived));
    let evicted = of(frames, |frame| -(frame.report.evictions as f64));
    vec![
        memory,
        Figure {
            number: "",
            title: "Loads waiting",
            caption: "Nodes that are wanted and not in memory: falls to 0 where loading keeps up \
                      and memory suffices."
                .into(),
            plot: Plot {
                x: frame.axis(),
                y: axis("nodes", &[&waiting]),
                layers: vec![Layer::new("waiting", BLUE, Shape::Line(frame.points(&waiting)))],
            },
        },
        Figure {
            number: "",
            title: "Bytes read",
            caption: "What was read from node files during each frame.".into(),
            plot: Plot {
                x: frame.axis(),
                y: axis(&format!("{name} a frame"), &[&read]),
                layers: vec![Layer::new("read", BLUE, Shape::Strokes(frame.points(&read)))],
            },
        },
        Figure {
            number: "",
            title: "Nodes that arrived and that were evicted",
            caption: "Nodes that became resident (up) and that were let go (down) in each frame: \
                      many of both at once mean that memory is too small for what is in view."
                .into(),
            plot: Plot {
                x: frame.axis(),
                y: axis("nodes a frame", &[&arrived, &evicted]),
                layers: vec![
                    Layer::new("arrived", BLUE, Shape::Strokes(frame.points(&arrived))),
                    Layer::new("evicted", VERMILLION, Shape::Strokes(frame.points(&evicted))),
                ],
            },
        },
    ]
}
