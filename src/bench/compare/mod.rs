//! Compares a run with an earlier one, for people and for their CI.

mod limit;
mod metrics;
mod options;
mod summary_file;
#[cfg(test)]
mod tests;
mod unit;

use std::fmt::Write;

use serde_json::{Value, json};

use crate::{Error, Result};
pub use limit::Limit;
use metrics::METRICS;
pub use options::Limits;
pub use summary_file::SummaryFile;
pub use unit::Unit;

/// What became of the figures from one run to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// In what the runs themselves differ; empty unless that was to be passed over.
    pub differences: Vec<String>,
    /// One a figure.
    pub rows: Vec<Row>,
}

/// One figure of two runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is.
    pub metric: &'static str,
    /// What it is in.
    pub unit: Unit,
    /// What it was; NaN where the run had none.
    pub base: f64,
    /// What it is now; NaN where the run has none.
    pub new: f64,
    /// Its limits as they were given, the ones that are exceeded first.
    pub limit: Option<String>,
    /// It is above one of them.
    pub exceeded: bool,
}

/// Compares two runs. Those over different scenes, paths or parameters are refused unless `force`
/// says to compare them all the same.
pub fn compare(
    base: &SummaryFile,
    new: &SummaryFile,
    limits: &Limits,
    force: bool,
) -> Result<Comparison> {
    let differences = summary_file::differences(base, new)?;
    if !(differences.is_empty() || force) {
        return Err(Error::Usage(format!(
            "{} and {} are not runs of the same thing:\n  {}\nFigures of runs that differ in \
             these say nothing about the program; --force compares them all the same",
            base.path.display(),
            new.path.display(),
            differences.join("\n  ")
        )));
    }
    let rows = METRICS.iter().map(|metric| {
        let figure = |file: &SummaryFile| -> Result<f64> {
            let values: Vec<f64> = metric
                .keys
                .iter()
                .map(|key| file.figure(key, metric.optional))
                .collect::<Result<_>>()?;
            let value = values.iter().sum::<f64>() * metric.scale;
            Ok(if metric.magnitude { value.abs() } else { value })
        };
        let (base, new) = (figure(base)?, figure(new)?);
        let mut limits: Vec<&Limit> = limits.of(metric.name).collect();
        limits.sort_by_key(|limit| !limit.is_exceeded(base, new));
        let mut texts: Vec<String> = limits.iter().map(|limit| limit.to_string()).collect();
        let mut exceeded = limits.first().is_some_and(|limit| limit.is_exceeded(base, new));
        if metric.none_allowed && limits.is_empty() {
            texts.push("0".into());
            // A run that went on without some files says nothing about the others.
            exceeded = base > 0.0 || new > 0.0;
        }
        Ok(Row {
            metric: metric.name,
            unit: metric.unit,
            base,
            new,
            exceeded,
            limit: (!texts.is_empty()).then(|| texts.join(", ")),
        })
    });
    let rows: Vec<Row> = rows.collect::<Result<_>>()?;
    // What neither run need have is of interest only where it was to be judged.
    let missing = |row: &Row| !row.exceeded && row.base.is_nan() && row.new.is_nan();
    let rows = METRICS.iter().zip(rows).filter(|(metric, row)| !(metric.optional && missing(row)));
    Ok(Comparison { differences, rows: rows.map(|(_, row)| row).collect() })
}

impl Row {
    /// How much it rose.
    pub fn change(&self) -> f64 {
        self.new - self.base
    }

    /// How much it rose in percent of what it was; `None` where it was 0 and is not, or where
    /// either is no number.
    pub fn change_percent(&self) -> Option<f64> {
        let percent = match self.change() {
            0.0 => 0.0,
            change => change / self.base.abs() * 100.0,
        };
        percent.is_finite().then_some(percent)
    }
}

impl Comparison {
    /// Whether any limit was exceeded.
    pub fn exceeded(&self) -> bool {
        self.rows.iter().any(|row| row.exceeded)
    }

    /// A table for a person.
    pub fn text(&self) -> String {
        let header = ["metric", "base", "new", "change", "change %", "limit"].map(String::from);
        let lines: Vec<[String; 6]> = std::iter::once(header)
            .chain(self.rows.iter().map(|row| {
                let percent = row.change_percent();
                let limit = match (&row.limit, row.exceeded) {
                    (None, _) => String::new(),
                    (Some(limit), false) => limit.clone(),
                    (Some(limit), true) => format!("{limit} EXCEEDED"),
                };
                [
                    row.metric.into(),
                    row.unit.text(row.base, false),
                    row.unit.text(row.new, false),
                    row.unit.text(row.change(), true),
                    percent.map_or_else(|| "-".into(), |percent| format!("{percent:+.1} %")),
                    limit,
                ]
            }))
            .collect();
        let width = |column: usize| {
            lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0)
        };
        let widths: [usize; 6] = std::array::from_fn(width);
        let mut out = String::new();
        for [metric, numbers @ .., limit] in &lines {
            let mut line = format!("{metric:<0$}", widths[0]);
            for (number, width) in numbers.iter().zip(&widths[1..]) {
                // Writing to a string cannot fail.
                let _ = write!(line, "  {number:>width$}");
            }
            let _ = writeln!(out, "{}", format!("{line}  {limit}").trim_end());
        }
        for difference in &self.differences {
            let _ = writeln!(out, "not the same run: {difference}");
        }
        out
    }

    /// The same for programs. Bytes are bytes and shares are percent here too.
    pub fn to_json(&self) -> Value {
        json!({
            "exceeded": self.exceeded(),
            "differences": self.differences,
            "metrics": self.rows.iter().map(|row| json!({
                "metric": row.metric,
                "unit": row.unit,
                "base": row.base,
                "new": row.new,
                "change": row.change(),
                "change_percent": row.change_percent(),
                "limit": row.limit,
                "exceeded": row.exceeded,
            })).collect::<Vec<_>>(),
        })
    }
}
