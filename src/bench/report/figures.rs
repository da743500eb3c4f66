//! The plots of a report, in the order of the thesis's chapter 6.

use super::plot::{Axis, Layer, Plot, Shape};
use super::series::Places;
use super::{accuracy, detail, estimate, frame_time, memory, toggles};
use crate::Result;
use crate::bench::{Context, Run};

/// A plot with its words.
pub(super) struct Figure {
    /// What the thesis calls its own, or nothing.
    pub number: &'static str,
    pub title: &'static str,
    /// A sentence on what it shows, and what to know about it.
    pub caption: String,
    pub plot: Plot,
}

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
        section("Accuracy of estimated time", estimate::figures(frames)),
        section("Frame time", frame_time::figures(frames, context)),
        section("Toggles", toggles::figures(frames)),
    ];
    let accuracy = accuracy::figures(frames);
    if !accuracy.is_empty() {
        sections.push(section("Accuracy", accuracy));
    }
    sections
}

impl Figure {
    /// The plot as an `svg` element.
    pub(super) fn svg(&self) -> Result<String> {
        self.plot.svg()
    }

    /// What the colours mean, the roots first where levels lie over each other.
    pub(super) fn legend(&self) -> Vec<&Layer> {
        let mut layers: Vec<&Layer> = self.plot.layers.iter().collect();
        if layers.iter().all(|layer| matches!(layer.shape, Shape::Area(_))) {
            layers.reverse();
        }
        layers
    }
}

/// A line over all frames.
pub(super) fn line(name: &str, colour: plotters::style::RGBColor, at: &Places, y: &[f64]) -> Layer {
    Layer::new(name, colour, Shape::Line(at.points(y)))
}

/// An axis that has 0 and all values.
pub(super) fn axis(label: &str, values: &[&[f64]]) -> Axis {
    let all = values.iter().flat_map(|values| values.iter());
    let (low, high) = all.fold((0f64, 0f64), |(low, high), &v| (low.min(v), high.max(v)));
    let range = if low == high { [0.0, 1.0] } else { [low * 1.05, high * 1.05] };
    Axis { label: label.into(), range }
}
