//! A plot as SVG that stands in a page and takes its ink from it.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::decimate::decimate;
use crate::{Error, Result};

/// Width and height, in half pixels of a page at its usual size.
const SIZE: (u32, u32) = (1240, 560);
/// Columns to which series are thinned out: pixels of the plot in the page.
const COLUMNS: usize = 540;
/// Height of letters.
const LETTERS: u32 = 30;
/// What the page replaces by the colour of its text.
const INK: RGBColor = BLACK;

/// Colours that people see as different whatever their colour vision, on paper and on black
/// (Okabe and Ito's; the blue is lighter than theirs, which black swallows).
pub(super) const BLUE: RGBColor = RGBColor(31, 136, 209);
pub(super) const VERMILLION: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const PURPLE: RGBColor = RGBColor(204, 121, 167);
pub(super) const ORANGE: RGBColor = RGBColor(230, 159, 0);

/// A colour for each of some steps from few to many: an order that reads as one.
pub(super) fn steps(count: usize) -> Vec<RGBColor> {
    let last = count.saturating_sub(1).max(1) as f32;
    // Its ends are too near to paper and to black.
    (0..count)
        .map(|step| ViridisRGB.get_color_normalized(0.2 + 0.75 * step as f32 / last, 0.0, 1.0))
        .collect()
}

/// One side of a plot.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// What it shows and in what.
    pub label: String,
    /// From and to.
    pub range: [f64; 2],
}

/// What is drawn.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A line through points.
    Line(Vec<[f64; 2]>),
    /// What is between 0 and points.
    Area(Vec<[f64; 2]>),
    /// A stroke from 0 to each point; none where that is 0.
    Strokes(Vec<[f64; 2]>),
    /// A line across at some height.
    Across(f64),
    /// A line upright at some place.
    Upright(f64),
}

/// What is drawn in one colour.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// What it is, for the legend.
    pub name: String,
    /// Its colour.
    pub colour: RGBColor,
    /// What is drawn.
    pub shape: Shape,
}

impl Layer {
    pub(super) fn new(name: impl Into<String>, colour: RGBColor, shape: Shape) -> Self {
        Self { name: name.into(), colour, shape }
    }
}

/// A plot.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub x: Axis,
    pub y: Axis,
    /// From the back to the front.
    pub layers: Vec<Layer>,
}

impl Plot {
    /// The plot as an `svg` element.
    pub(super) fn svg(&self) -> Result<String> {
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            self.draw(&root)
                .and_then(|()| root.present().map_err(|error| error.to_string()))
                .map_err(|what| Error::Internal(format!("a plot that cannot be drawn: {what}")))?;
        }
        // In a page the element needs no name space.
        let svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
        let start = svg.find("<svg").unwrap_or(0);
        Ok(svg[start..].trim().to_owned())
    }

    fn draw(&self, root: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), String> {
        let text = |error: DrawingAreaErrorKind<std::io::Error>| error.to_string();
        let [x, y] = [&self.x, &self.y].map(|axis| widened(axis.range));
        let mut chart = ChartBuilder::on(root)
            .margin_top(16)
            .margin_right(24)
            .x_label_area_size(84)
            .y_label_area_size(130)
            .build_cartesian_2d(x[0]..x[1], y[0]..y[1])
            .map_err(text)?;
        let label = |size: u32| ("sans-serif", size).into_font().color(&INK);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(INK.mix(0.15))
            .axis_style(INK.mix(0.6))
            .x_labels(8)
            .y_labels(6)
            .x_label_formatter(&|&value| tick(value, x))
            .y_label_formatter(&|&value| tick(value, y))
            .label_style(label(LETTERS))
            .axis_desc_style(label(LETTERS + 2))
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .draw()
            .map_err(text)?;
        for layer in &self.layers {
            let colour = layer.colour;
            match &layer.shape {
                Shape::Line(points) => {
                    let points = shown(points, x, y);
                    match points[..] {
                        [] => {}
                        [point] => {
                            let dot = Circle::new(point, 6, colour.filled());
                            chart.draw_series([dot]).map_err(text)?;
                        }
                        _ => {
                            let path = PathElement::new(points, colour.stroke_width(3));
                            chart.draw_series([path]).map_err(text)?;
                        }
                    }
                }
                Shape::Area(points) => {
                    let mut points = shown(points, x, y);
                    let zero = 0f64.clamp(y[0], y[1]);
                    if let [(x, height)] = points[..] {
                        // As wide as can be seen.
                        points = vec![(x - 0.25, height), (x + 0.25, height)];
                    }
                    if let (Some(first), Some(last)) = (points.first(), points.last()) {
                        let base = [(last.0, zero), (first.0, zero)];
                        points.extend(base);
                        let area = Polygon::new(points, colour.filled());
                        chart.draw_series([area]).map_err(text)?;
                    }
                }
                Shape::Strokes(points) => {
                    let zero = 0f64.clamp(y[0], y[1]);
                    // One path from stroke to stroke along 0, where the axis is.
                    let path = shown(points, x, y)
                        .into_iter()
                        .filter(|point| point.1 != 0.0)
                        .flat_map(|(x, height)| [(x, zero), (x, height), (x, zero)]);
                    let path: Vec<_> = path.collect();
                    if !path.is_empty() {
                        let path = PathElement::new(path, colour.stroke_width(2));
                        chart.draw_series([path]).map_err(text)?;
                    }
                }
                Shape::Across(height) => {
                    let ends = [(x[0], *height), (x[1], *height)];
                    let path = PathElement::new(ends, colour.stroke_width(3));
                    chart.draw_series([path]).map_err(text)?;
                }
                Shape::Upright(place) => {
                    let ends = [(*place, y[0]), (*place, y[1])];
                    let path = PathElement::new(ends, colour.stroke_width(3));
                    chart.draw_series([path]).map_err(text)?;
                }
            }
        }
        Ok(())
    }
}

/// Points as they are drawn: numbers only, thinned out, inside of the plot.
fn shown(points: &[[f64; 2]], x: [f64; 2], y: [f64; 2]) -> Vec<(f64, f64)> {
    let finite: Vec<[f64; 2]> =
        points.iter().copied().filter(|point| point.iter().all(|v| v.is_finite())).collect();
    let inside = |[at, height]: [f64; 2]| (at.clamp(x[0], x[1]), height.clamp(y[0], y[1]));
    decimate(&finite, x, COLUMNS).into_iter().map(inside).collect()
}

/// A range that is one: ordered, of numbers, and wider than rounding.
fn widened([from, to]: [f64; 2]) -> [f64; 2] {
    if !(from.is_finite() && to.is_finite() && from <= to) {
        return [0.0, 1.0];
    }
    if to - from > 1e-6 * from.abs().max(to.abs()) {
        return [from, to];
    }
    let half = match from.abs() * 0.1 {
        0.0 => 0.5,
        half => half,
    };
    [from - half, to + half]
}

/// A number at an axis, with as many digits as tell it from its neighbours.
fn tick(value: f64, [from, to]: [f64; 2]) -> String {
    let digits = (-((to - from) / 8.0).log10()).ceil().clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    // No −0.
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_at_axes_tell_neighbours_apart() {
        assert_eq!(tick(30.0, [0.0, 40.0]), "30");
        assert_eq!(tick(0.25, [0.0, 1.0]), "0.2");
        assert_eq!(tick(-0.5, [-1.0, 2.0]), "−0.5");
        assert_eq!(tick(-0.0, [-1.0, 1.0]), "0.0");
    }

    #[test]
    fn ranges_are_never_empty() {
        assert_eq!(widened([0.0, 0.0]), [-0.5, 0.5]);
        assert_eq!(widened([10.0, 10.0]), [9.0, 11.0]);
        assert_eq!(widened([f64::NAN, 1.0]), [0.0, 1.0]);
        assert_eq!(widened([1.0, -1.0]), [0.0, 1.0]);
        assert_eq!(widened([1.0, 3.0]), [1.0, 3.0]);
    }

    #[test]
    fn what_is_no_number_is_left_out() {
        let points = vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, f64::INFINITY], [3.0, 2.0]];
        let axis = |range| Axis { label: "a < b".into(), range };
        for shape in [Shape::Line, Shape::Area, Shape::Strokes] {
            let layers = vec![Layer::new("", BLUE, shape(points.clone()))];
            let svg = Plot { x: axis([0.0, 3.0]), y: axis([0.0, 2.0]), layers }.svg().unwrap();
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>"));
            assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("http"));
            assert!(svg.contains("a &lt; b"));
        }
    }
}
