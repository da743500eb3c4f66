//! A comparison of policies as a page: image error against frame time, and its figures.

use maud::{Markup, html};
use plotters::style::RGBColor;

use super::figures::{Figure, axis};
use super::plot::{Axis, BLUE, GREEN, Layer, ORANGE, PURPLE, Plot, Shape, VERMILLION};
use super::{figure_html, page};
use crate::Result;
use crate::bench::policies::{FIGURES, ORACLE, PoliciesTable, PolicyRun};

/// So many of the first figures are told of as differences: as many as fit a page.
const COMPARED: usize = 9;

/// One a policy; the oracle has its own.
const COLOURS: [RGBColor; 7] =
    [BLUE, VERMILLION, GREEN, ORANGE, PURPLE, RGBColor(120, 120, 120), RGBColor(150, 90, 40)];

/// The page of a comparison. The same runs give the same bytes.
pub fn policies_html(table: &PoliciesTable) -> Result<String> {
    let everywhere = section(table, "All scenes and paths", |_| true)?;
    let places = table.places();
    let sections: Vec<Markup> = places
        .iter()
        .map(|&(scene, path)| {
            let title = format!("{scene}, {}", format!("{path:?}").to_lowercase());
            section(table, &title, |run| run.scene == scene && run.key.path == path)
        })
        .collect::<Result<_>>()?;
    let body = html! {
        h1 { "Policies side by side" }
        p {
            (table.runs.len()) " runs by the model clock: every policy along the same paths, over the \
             same loader, memory cap and targets, with the same noise and stalls. FLIP is against \
             the leaves. The oracle chooses as the first policy does with everything in memory."
        }
        (everywhere)
        (differences(table))
        @for section in &sections { (section) }
    };
    Ok(page("Policies – hlod-bench", &body))
}

fn section(
    table: &PoliciesTable,
    title: &str,
    holds: impl Fn(&PolicyRun) -> bool + Copy,
) -> Result<Markup> {
    let curves = [
        ("flip_mean", "FLIP", "Image error against frame time"),
        ("toggles_per_min", "toggles a minute", "Toggles against frame time"),
    ];
    let figures: Vec<Markup> = curves
        .iter()
        .map(|&(name, label, title)| figure_html(&curve(table, name, label, title, holds)))
        .collect::<Result<_>>()?;
    let tables = table.targets_ms().into_iter().map(|target_ms| {
        let lines = table.lines(target_ms, holds);
        html! {
            h3 { "Target " (target_ms) " ms" }
            table .sweep {
                @for (at, line) in lines.iter().enumerate() {
                    tr { @for field in line { @if at == 0 { th { (field) } } @else { td { (field) } } } }
                }
            }
        }
    });
    Ok(html! {
        h2 { (title) }
        div .figures { @for figure in &figures { (figure) } }
        @for table in tables { (table) }
    })
}

/// A point for each target, a line for each policy, and the best of all of them.
fn curve(
    table: &PoliciesTable,
    name: &str,
    label: &str,
    title: &'static str,
    holds: impl Fn(&PolicyRun) -> bool + Copy,
) -> Figure {
    let mut layers = Vec::new();
    let (mut all, mut times) = (Vec::new(), Vec::new());
    let policies = table.policies();
    let named = policies.iter().filter(|policy| **policy != ORACLE).zip(COLOURS);
    let oracle = policies.iter().find(|policy| **policy == ORACLE);
    for (policy, colour) in named.chain(oracle.map(|policy| (policy, RGBColor(0, 0, 0)))) {
        let points = table.targets_ms().into_iter().map(|target_ms| {
            let at = |run: &PolicyRun| run.key.target_ms == target_ms && holds(run);
            let of = |name: &str| table.interval(policy, name, at).mean;
            [of("frame_ms_p95"), of(name)]
        });
        let mut points: Vec<[f64; 2]> =
            points.filter(|point| point.iter().all(|value| value.is_finite())).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points.dedup(); // a policy that does not know of targets is a dot
        times.extend(points.iter().map(|point| point[0]));
        all.extend(points.iter().copied().filter(|_| *policy != ORACLE));
        layers.push(Layer::new(*policy, colour, Shape::Line(points)));
    }
    let values: Vec<f64> = all.iter().map(|point| point[1]).collect();
    layers.insert(0, Layer::new("Pareto front", RGBColor(200, 200, 200), Shape::Line(pareto(all))));
    let most = times.iter().copied().fold(1.0, f64::max);
    Figure {
        number: "",
        title,
        caption: "A point for each target, means over seeds. Further left and lower is better."
            .into(),
        plot: Plot {
            x: Axis { label: "p95 frame time, ms".into(), range: [0.0, most * 1.05] },
            y: axis(label, &[&values]),
            layers,
        },
    }
}

/// The points that no other is both left of and below, as steps.
fn pareto(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut front: Vec<[f64; 2]> = Vec::new();
    for point in points {
        match front.last().copied() {
            Some(last) if point[1] >= last[1] => {}
            Some(last) => front.extend([[point[0], last[1]], point]),
            None => front.push(point),
        }
    }
    front
}

/// What each policy has more than the first, with intervals.
fn differences(table: &PoliciesTable) -> Markup {
    let policies = table.policies();
    let Some((first, others)) = policies.split_first() else { return html! {} };
    html! {
        h2 { "More than " (first) ", in the same places" }
        p { "Means over pairs of runs, and the interval in which 95 of 100 such means lie." }
        table .sweep {
            tr { th { "policy" } @for figure in &FIGURES[..COMPARED] { th { (figure.head) } } }
            @for policy in others {
                tr {
                    td { (policy) }
                    @for figure in &FIGURES[..COMPARED] {
                        @let of = table.difference(policy, first, figure.name, |_| true);
                        td {
                            @if of.mean.is_finite() {
                                (format!("{:+.*} ± {:.*}", figure.digits, of.mean, figure.digits, of.half))
                            } @else { "-" }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pareto_front_is_of_points_that_no_other_is_better_than() {
        let points = vec![[3.0, 1.0], [1.0, 3.0], [2.0, 3.5], [4.0, 0.5], [2.5, 2.0]];
        let corners: Vec<[f64; 2]> = pareto(points).into_iter().step_by(2).collect();
        assert_eq!(corners, [[1.0, 3.0], [2.5, 2.0], [3.0, 1.0], [4.0, 0.5]]);
        assert!(pareto(Vec::new()).is_empty());
    }
}
