//! A sweep over targets as a page: the curve of image error against frame time, and its figures.

use maud::html;

use super::plot::{Axis, BLUE, Layer, ORANGE, Plot, Shape, VERMILLION};
use super::{figure_html, page};
use crate::Result;
use crate::bench::Sweep;
use crate::bench::report::figures::{Figure, axis};

/// The page of a sweep. The same sweep gives the same bytes.
pub fn sweep_html(sweep: &Sweep, title: &str) -> Result<String> {
    let table = sweep.table();
    let (heads, lines) = table.split_first().map_or((&[][..], &[][..]), |(a, b)| (&a[..], b));
    let figure = figure_html(&curve(sweep))?;
    let body = html! {
        h1 { (title) }
        div .figures { (figure) }
        table .sweep {
            thead { tr { @for head in heads { th { (head) } } } }
            tbody { @for line in lines { tr { @for field in line { td { (field) } } } } }
        }
    };
    Ok(page(&format!("{title} – hlod-bench sweep"), &body))
}

fn curve(sweep: &Sweep) -> Figure {
    let times = sweep.figures("frame_ms_mean");
    let points = |name: &str| {
        let mut points: Vec<[f64; 2]> =
            times.iter().zip(sweep.figures(name)).map(|(&time, error)| [time, error]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let most = times.iter().copied().fold(0.0, f64::max);
    let errors = ["flip_worst", "flip_p95", "flip_mean"].map(|name| (name, sweep.figures(name)));
    let y = axis("FLIP", &errors.each_ref().map(|(_, values)| &values[..]));
    let names = ["worst frame", "95 of 100 pixels", "mean"];
    let layers = errors.iter().zip(names).zip([VERMILLION, ORANGE, BLUE]);
    Figure {
        number: "",
        title: "Image error against frame time",
        caption: "A point for each target: the mean frame time that it led to, and FLIP against \
                  the leaves alone."
            .into(),
        plot: Plot {
            x: Axis { label: "mean frame time, ms".into(), range: [0.0, most * 1.05] },
            y,
            layers: layers
                .map(|(((column, _), name), colour)| {
                    Layer::new(name, colour, Shape::Line(points(column)))
                })
                .collect(),
        },
    }
}
