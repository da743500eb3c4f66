//! A run as a page that a person can read: `report.html`, which needs nothing beside itself.

mod accuracy;
mod decimate;
mod detail;
mod estimate;
mod figures;
mod frame_time;
mod memory;
mod plot;
mod policies;
mod sections;
mod series;
mod sweep;
mod table;
#[cfg(test)]
mod tests;
mod toggles;

use maud::{DOCTYPE, Markup, PreEscaped, html};
use plotters::style::RGBColor;
use serde_json::Value;

use super::{Context, Run};
use crate::Result;
use figures::Figure;
pub use policies::policies_html;
use sections::{Section, sections};
pub use sweep::sweep_html;

const STYLE: &str = include_str!("style.css");

/// The page for a run with its summary. The same run gives the same bytes.
pub fn report_html(run: &Run, context: &Context, summary: &Value) -> Result<String> {
    let sections: Vec<Markup> =
        sections(run, context).iter().map(section_html).collect::<Result<_>>()?;
    let title = match context.path_name.as_str() {
        "" => context.scene_name.clone(),
        path => format!("{} along {path}", context.scene_name),
    };
    let body = html! {
        h1 { (title) }
        (facts(run, context, summary))
        (broken(context))
        h2 { "Figures of this run and the thesis's" }
        p {
            "The thesis is A. Lakhia, Interactive Rendering for Large City Models (Berkeley, \
             2004), with its section at each heading. Its figures are from another city, \
             another machine and paths of its own."
        }
        (summary_tables(summary))
        @for section in &sections { (section) }
        @if let Some(reference) = &context.reference { (accuracy::worst(reference)) }
        h2 { "Options" }
        (options(context, summary))
    };
    Ok(page(&format!("{title} – hlod-bench"), &body))
}

/// A whole page that needs nothing beside itself.
fn page(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}

fn facts(run: &Run, context: &Context, summary: &Value) -> Markup {
    let seconds = match (run.frames.first(), run.frames.last()) {
        (Some(first), Some(last)) => last.time_s - first.time_s,
        _ => 0.0,
    };
    let clock = match context.clock {
        "model" => "model: time and loading follow from constants, nothing was drawn".to_owned(),
        "wall" => "wall: every frame was drawn and timed".to_owned(),
        other => other.to_owned(),
    };
    html! {
        dl {
            dt { "Scene" } dd { (context.scene_name) " (" code { (context.scene_fingerprint) } ")" }
            dt { "Path" }
            dd {
                @if !context.path_name.is_empty() { (context.path_name) ", " }
                (run.frames.len()) " frames, " (format!("{seconds:.1}")) " s ("
                code { (context.path_fingerprint) } ")"
            }
            dt { "Policy" } dd { (context.policy) }
            dt { "Clock" } dd { (clock) }
            @if let Some(adapter) = &context.adapter {
                dt { "Adapter" } dd { (line(adapter)) }
            }
            dt { "Program" }
            dd { "hlod " (summary.get("version").and_then(Value::as_str).unwrap_or("?")) }
        }
    }
}

/// Files that could not be used.
fn broken(context: &Context) -> Markup {
    html! {
        @if !context.broken.is_empty() {
            h2 { "Files that could not be used" }
            p { "What is above each of them in the hierarchy was drawn in its place." }
            ul .broken { @for file in &context.broken { li { (file) } } }
        }
    }
}

fn summary_tables(summary: &Value) -> Markup {
    html! {
        div .tables {
            @for group in table::groups(summary) {
                table {
                    thead { tr { th { (group.title) } th { "this run" } th { "thesis" } } }
                    tbody {
                        @for table::Row(name, here, thesis) in &group.rows {
                            tr { td { (name) } td { (here) } td { (thesis) } }
                        }
                    }
                }
            }
        }
    }
}

fn section_html(section: &Section) -> Result<Markup> {
    let figures: Vec<Markup> = section.figures.iter().map(figure_html).collect::<Result<_>>()?;
    Ok(html! {
        h2 { (section.title) }
        div .figures { @for figure in &figures { (figure) } }
    })
}

fn figure_html(figure: &Figure) -> Result<Markup> {
    let svg = figure.svg()?;
    Ok(html! {
        figure {
            h3 {
                (figure.title)
                @if !figure.number.is_empty() { small { " · thesis figure " (figure.number) } }
            }
            ul .legend {
                @for layer in figure.legend() {
                    li { i style=(format!("background:{}", hexadecimal(layer.colour))) {} (layer.name) }
                }
            }
            (PreEscaped(svg))
            figcaption { (figure.caption) }
        }
    })
}

/// Everything that determined the run, a line a leaf.
fn options(context: &Context, summary: &Value) -> Markup {
    let mut leaves = Vec::new();
    collect("", summary.get("parameters").unwrap_or(&Value::Null), &mut leaves);
    if context.clock == "model" {
        collect("clock", summary.get("clock_constants").unwrap_or(&Value::Null), &mut leaves);
    }
    html! {
        div .options {
            dl { @for (name, value) in &leaves { div { dt { (name) } dd { (value) } } } }
        }
    }
}

fn collect(name: &str, value: &Value, leaves: &mut Vec<(String, String)>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let dot = if name.is_empty() { "" } else { "." };
                collect(&format!("{name}{dot}{key}"), value, leaves);
            }
        }
        Value::Null => {}
        _ => leaves.push((name.to_owned(), line(value))),
    }
}

/// A value in one line.
fn line(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Object(fields) => {
            fields.values().map(line).filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", ")
        }
        Value::Array(values) => values.iter().map(line).collect::<Vec<_>>().join(" × "),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

fn hexadecimal(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
