//! What a user sees as flicker (thesis figure 6.6).

use super::figures::{Figure, axis, line};
use super::plot::{BLUE, Layer, Plot, Shape, VERMILLION};
use super::series::{Places, WINDOW, moving_average, of};
use crate::bench::FrameRecord;

pub(super) fn figures(frames: &[FrameRecord]) -> Vec<Figure> {
    let frame = Places::frames(frames);
    let up = of(frames, |frame| f64::from(frame.report.toggles_up));
    let down = of(frames, |frame| -f64::from(frame.report.toggles_down));
    let averages = [moving_average(&up), moving_average(&down)];
    vec![
        Figure {
            number: "6.6",
            title: "Toggles",
            caption: "Nodes that gave way to their children (up) and that replaced them (down) in \
                      each frame: what a user sees as flicker."
                .into(),
            plot: Plot {
                x: frame.axis(),
                y: axis("toggles a frame", &[&up, &down]),
                layers: vec![
                    Layer::new("up", BLUE, Shape::Strokes(frame.points(&up))),
                    Layer::new("down", VERMILLION, Shape::Strokes(frame.points(&down))),
                ],
            },
        },
        Figure {
            number: "6.6",
            title: "Toggles, averaged",
            caption: format!(
                "Mean of the same over {WINDOW} frames: up and down at the same time would be \
                 oscillation."
            ),
            plot: Plot {
                x: frame.axis(),
                y: axis("toggles a frame", &[&averages[0], &averages[1]]),
                layers: vec![
                    line("up", BLUE, &frame, &averages[0]),
                    line("down", VERMILLION, &frame, &averages[1]),
                ],
            },
        },
    ]
}
