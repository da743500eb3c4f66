//! A plot with its words, and what plots share.

use super::plot::{Axis, Layer, Plot, Shape};
use super::series::Places;
use crate::Result;

/// A plot with its words.
pub(super) struct Figure {
    /// What the thesis calls its own, or nothing.
    pub number: &'static str,
    pub title: &'static str,
    /// A sentence on what it shows, and what to know about it.
    pub caption: String,
    pub plot: Plot,
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
