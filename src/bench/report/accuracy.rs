//! How far what was drawn is from the leaves. The thesis has no such figures.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use super::figures::{Figure, axis, line};
use super::plot::{BLUE, GREEN, Layer, ORANGE, Plot, Shape, VERMILLION};
use super::series::{Places, of};
use crate::bench::{Accuracy, FrameRecord, ReferenceContext};

/// The plots; none where no frame was looked at.
pub(super) fn figures(frames: &[FrameRecord]) -> Vec<Figure> {
    if frames.iter().all(|frame| frame.accuracy.is_none()) {
        return Vec::new();
    }
    let frame = Places::frames(frames);
    let looked = |value: &dyn Fn(&Accuracy) -> Option<f64>| {
        of(frames, |frame| frame.accuracy.as_ref().and_then(value).unwrap_or(f64::NAN))
    };
    let mean = looked(&|accuracy| Some(accuracy.flip_mean));
    let p95 = looked(&|accuracy| Some(accuracy.flip_p95));
    let pops = looked(&|accuracy| accuracy.pop_flip);
    let [gaps, inner, extra] = [
        looked(&|accuracy| Some(accuracy.gap_pixels as f64)),
        looked(&|accuracy| Some(accuracy.inner_gap_pixels as f64)),
        looked(&|accuracy| Some(accuracy.extra_pixels as f64)),
    ];
    let figure = |title, caption: &str, y, layers| Figure {
        number: "",
        title,
        caption: caption.into(),
        plot: Plot { x: frame.axis(), y, layers },
    };
    vec![
        figure(
            "Difference from the leaves",
            "FLIP between each frame that was looked at and the same view of the leaves alone: its \
             mean over all pixels, and what 95 in a hundred pixels do not exceed. 0 is no \
             difference, 1 the largest there is.",
            axis("FLIP", &[&mean, &p95]),
            vec![line("p95", ORANGE, &frame, &p95), line("mean", BLUE, &frame, &mean)],
        ),
        figure(
            "Gaps",
            "Pixels with background where the leaves have surface, those of them that no outline \
             a little further in explains, and pixels with surface where the leaves have \
             background.",
            axis("pixels", &[&gaps, &inner, &extra]),
            vec![
                line("surface too much", GREEN, &frame, &extra),
                line("gaps", BLUE, &frame, &gaps),
                line("gaps within the outline", VERMILLION, &frame, &inner),
            ],
        ),
        figure(
            "Pops",
            "FLIP between each frame with toggles that was looked at and the same view on the \
             levels of the frame before.",
            axis("FLIP", &[&pops]),
            vec![Layer::new("pop", VERMILLION, Shape::Strokes(frame.points(&pops)))],
        ),
    ]
}

/// The frames that are furthest off, each beside its reference and their difference.
pub(super) fn worst(reference: &ReferenceContext) -> Markup {
    let picture = |bytes: &[u8], what: &str| {
        let data = format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes));
        html! { div { img src=(data) alt=(what); (what) } }
    };
    html! {
        @if !reference.worst.is_empty() {
            h2 { "The frames that are furthest off" }
            @for worst in &reference.worst {
                section .worst {
                    h3 {
                        "Frame " (worst.frame)
                        @if worst.loading_phase { ", in the loading phase" }
                        small { (format!(
                            " · FLIP {:.4}, of 95 in a hundred pixels {:.4}; {} gaps",
                            worst.accuracy.flip_mean,
                            worst.accuracy.flip_p95,
                            worst.accuracy.gap_pixels,
                        )) }
                    }
                    div .pictures {
                        (picture(&worst.drawn, "drawn"))
                        (picture(&worst.reference, "the leaves alone"))
                        (picture(&worst.difference, "FLIP: black where there is no difference"))
                    }
                }
            }
        }
    }
}
