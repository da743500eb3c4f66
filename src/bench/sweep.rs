//! The same path at several targets: how much image error a shorter frame time costs.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::report::sweep_html;
use super::write::write_all;
use crate::{Error, Result};

/// A figure of a sweep: the name of its column, what it is called in a table, its digits there,
/// and where it stands in a summary.
type Column = (&'static str, &'static str, usize, &'static str);

/// In the order of the table; the first is the target.
const COLUMNS: [Column; 14] = [
    ("target_ms", "target, ms", 1, "/parameters/target_ms"),
    ("frame_ms_mean", "frame, ms", 1, "/frame_ms/mean"),
    ("frame_ms_p95", "p95", 1, "/frame_ms/p95"),
    ("late_share", "late", 3, "/late_share"),
    ("triangles_mean", "triangles", 0, "/triangles_mean"),
    ("toggles_per_frame", "toggles", 3, "/toggles/per_frame"),
    ("flip_mean", "FLIP", 4, "/accuracy/flip_mean/mean"),
    ("flip_p95", "FLIP p95", 4, "/accuracy/flip_p95/mean"),
    ("flip_worst", "worst", 4, "/accuracy/flip_mean/max"),
    ("ssim", "SSIM", 4, "/accuracy/ssim/mean"),
    ("psnr_db", "PSNR, dB", 1, "/accuracy/psnr_db/all"),
    ("gap_pixels", "gaps", 0, "/accuracy/gap_pixels/sum"),
    ("inner_gap_pixels", "inner", 0, "/accuracy/inner_gap_pixels/sum"),
    ("pop_flip", "pop", 4, "/accuracy/pop_flip/mean"),
];

/// Runs of the same path at several targets, by their summaries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// One a target.
    pub summaries: Vec<Value>,
}

impl Sweep {
    /// A figure of each run, by the name of its column; NaN where there is none.
    pub(super) fn figures(&self, name: &str) -> Vec<f64> {
        let key = COLUMNS.iter().find(|column| column.0 == name).map_or("", |column| column.3);
        let figure = |summary: &Value| summary.pointer(key).and_then(Value::as_f64);
        self.summaries.iter().map(|summary| figure(summary).unwrap_or(f64::NAN)).collect()
    }

    /// The table, a line a target: first the heads of its columns.
    pub(super) fn table(&self) -> Vec<Vec<String>> {
        let columns = COLUMNS.map(|(name, head, digits, _)| (head, digits, self.figures(name)));
        let heads = columns.iter().map(|(head, ..)| (*head).to_owned()).collect();
        let line = |run: usize| {
            let field = |(_, digits, figures): &(&str, usize, Vec<f64>)| match figures[run] {
                figure if figure.is_finite() => format!("{figure:.digits$}"),
                _ => "-".into(),
            };
            columns.iter().map(field).collect()
        };
        std::iter::once(heads).chain((0..self.summaries.len()).map(line)).collect()
    }

    /// The table for a person.
    pub fn text(&self) -> String {
        let lines = self.table();
        let width = |column: usize| {
            lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
        let padded = |line: &Vec<String>| {
            let fields = line.iter().zip(&widths).map(|(field, &width)| format!("{field:>width$}"));
            fields.collect::<Vec<_>>().join("  ") + "\n"
        };
        lines.iter().map(padded).collect()
    }

    /// The figures in full, empty where there are none.
    fn csv(&self) -> Result<Vec<u8>> {
        let failed = |error: String| Error::Internal(format!("a sweep as CSV: {error}"));
        let mut csv = csv::Writer::from_writer(Vec::new());
        let columns = COLUMNS.map(|(name, ..)| (name, self.figures(name)));
        csv.write_record(columns.iter().map(|(name, _)| *name))
            .map_err(|error| failed(error.to_string()))?;
        for run in 0..self.summaries.len() {
            let field =
                |figure: f64| if figure.is_nan() { String::new() } else { figure.to_string() };
            csv.write_record(columns.iter().map(|(_, figures)| field(figures[run])))
                .map_err(|error| failed(error.to_string()))?;
        }
        csv.into_inner().map_err(|error| failed(error.to_string()))
    }

    /// Writes `sweep.csv` and `sweep.html` into a folder that is there. Their paths.
    pub fn write(&self, dir: &Path, title: &str) -> Result<Vec<PathBuf>> {
        let files = [
            (dir.join("sweep.csv"), self.csv()?),
            (dir.join("sweep.html"), sweep_html(self, title)?.into_bytes()),
        ];
        write_all(&files)?;
        Ok(files.map(|(path, _)| path).into())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn run(target: f64, frame: f64, flip: Option<f64>) -> Value {
        json!({
            "parameters": { "target_ms": target },
            "frame_ms": { "mean": frame, "p95": frame * 1.2 },
            "accuracy": flip.map(|flip| json!({ "flip_mean": { "mean": flip, "max": 2.0 * flip } })),
        })
    }

    #[test]
    fn a_sweep_has_a_line_and_a_point_for_each_target() {
        let summaries = vec![run(5.0, 4.5, Some(0.08)), run(60.0, 40.25, Some(0.01))];
        let sweep = Sweep { summaries };
        let text = sweep.text();
        let words =
            |line: usize| text.lines().nth(line).unwrap().split_whitespace().collect::<Vec<_>>();
        assert_eq!(words(1)[..3], ["5.0", "4.5", "5.4"]);
        assert_eq!(words(2)[6..9], ["0.0100", "-", "0.0200"]);
        let dir = tempfile::tempdir().unwrap();
        let files = sweep.write(dir.path(), "city & walk").unwrap();
        let csv = std::fs::read_to_string(&files[0]).unwrap();
        assert_eq!(csv.lines().count(), 3);
        assert!(csv.lines().nth(2).unwrap().starts_with("60,40.25,48.3,,"), "{csv}");
        let page = std::fs::read_to_string(&files[1]).unwrap();
        assert!(page.contains("city &amp; walk") && page.matches("<svg").count() == 1);
        assert!(page.contains("<td>0.0800</td>") && !page.contains("NaN"));
    }

    #[test]
    fn runs_that_were_not_compared_have_no_error_to_show() {
        let sweep = Sweep { summaries: vec![run(5.0, 4.0, None)] };
        assert!(sweep.figures("flip_mean")[0].is_nan());
        assert!(sweep_html(&sweep, "x").unwrap().contains("<td>-</td>"));
    }
}
