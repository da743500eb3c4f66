//! The plots of a report, in the order of the thesis's chapter 6.

use super::figures::Figure;
use super::{accuracy, detail, estimate, frame_time, memory, toggles};
use crate::bench::{Context, Run};

/// Plots that belong together.
pub(super) struct Section {
    pub title: &'static str,
    pub figures: Vec<Figure>,
}

/// All plots.
pub(super) fn sections(run: &Run, context: &Context) -> Vec<Section> {
    let frames = &run.frames;
    let section = |title, figures| Section { title, figures };
    let mut sections = vec![
        section("Memory and loading", memory::figures(run, context)),
        section("Level of detail", detail::figures(frames, context.levels)),
        section("Accuracy of estimated time", estimate::figures(frames, context.diagnostics)),
        section("Frame time", frame_time::figures(frames, context)),
        section("Toggles", toggles::figures(frames)),
    ];
    let accuracy = accuracy::figures(frames);
    if !accuracy.is_empty() {
        sections.push(section("Accuracy", accuracy));
    }
    sections
}
