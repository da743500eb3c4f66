//! The figures of all runs, and what policies come to over them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{FIGURES, ORACLE, PolicyRun};
use crate::bench::report::policies_html;
use crate::bench::statistics::mean;
use crate::bench::write::write_all;
use crate::camera::PathKind;
use crate::{Error, Result};

/// Half of an interval in which 95 of 100 means lie, in standard errors.
const INTERVAL: f64 = 1.96;

/// All runs of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoliciesTable {
    /// In the order in which they were made.
    pub runs: Vec<PolicyRun>,
}

/// A mean with half of its 95 % interval; NaN where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Of all values that there are.
    pub mean: f64,
    /// 0 of a single value.
    pub half: f64,
}

impl Interval {
    fn of(values: &[f64]) -> Self {
        let known: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        if known.is_empty() {
            return Self { mean: f64::NAN, half: f64::NAN };
        }
        let middle = mean(known.iter().copied());
        let count = known.len() as f64;
        let variance = known.iter().map(|value| (value - middle).powi(2)).sum::<f64>()
            / (count - 1.0).max(1.0);
        Self { mean: middle, half: INTERVAL * (variance / count).sqrt() }
    }
}

impl PoliciesTable {
    /// Adds the runs over a scene, each beside its oracle.
    pub fn add(&mut self, mut runs: Vec<PolicyRun>) {
        let oracles: Vec<PolicyRun> =
            runs.iter().filter(|run| run.key.policy == ORACLE).cloned().collect();
        for run in &mut runs {
            let same = |oracle: &&PolicyRun| {
                let (a, b) = (&oracle.key, &run.key);
                (a.path, a.seed, a.target_ms) == (b.path, b.seed, b.target_ms)
            };
            let oracle = oracles.iter().find(same).map_or(f64::NAN, |at| at.value("flip_mean"));
            run.set("flip_to_oracle", run.value("flip_mean") - oracle);
        }
        self.runs.extend(runs);
    }

    /// The policies, in the order of the runs.
    pub fn policies(&self) -> Vec<&str> {
        self.in_order(|run| run.key.policy.as_str())
    }

    /// The targets, ascending.
    pub fn targets_ms(&self) -> Vec<f64> {
        let mut targets = self.in_order(|run| run.key.target_ms);
        targets.sort_by(f64::total_cmp);
        targets
    }

    /// Scenes and paths, in the order of the runs.
    pub fn places(&self) -> Vec<(&str, PathKind)> {
        self.in_order(|run| (run.scene.as_str(), run.key.path))
    }

    fn in_order<'a, T: PartialEq>(&'a self, of: impl Fn(&'a PolicyRun) -> T) -> Vec<T> {
        let mut found = Vec::new();
        for run in &self.runs {
            let value = of(run);
            if !found.contains(&value) {
                found.push(value);
            }
        }
        found
    }

    /// A figure of the runs of a policy that `holds` is true for.
    pub fn interval(
        &self,
        policy: &str,
        name: &str,
        holds: impl Fn(&PolicyRun) -> bool,
    ) -> Interval {
        let runs = self.runs.iter().filter(|run| run.key.policy == policy && holds(run));
        Interval::of(&runs.map(|run| run.value(name)).collect::<Vec<_>>())
    }

    /// How much more a figure is than that of another policy in the same place, by the same seed
    /// and at the same target: pairs, so that what is hard for all does not count.
    pub fn difference(
        &self,
        policy: &str,
        than: &str,
        name: &str,
        holds: impl Fn(&PolicyRun) -> bool,
    ) -> Interval {
        let key = |run: &PolicyRun| {
            let key = &run.key;
            format!("{}\0{:?}\0{}\0{}", run.scene, key.path, key.seed, key.target_ms)
        };
        let of = |policy: &str| -> BTreeMap<String, f64> {
            let runs = self.runs.iter().filter(|run| run.key.policy == policy && holds(run));
            runs.map(|run| (key(run), run.value(name))).collect()
        };
        let other = of(than);
        let pairs = of(policy);
        let pairs = pairs.iter().filter_map(|(key, value)| Some(value - other.get(key)?));
        Interval::of(&pairs.collect::<Vec<_>>())
    }

    /// One line a policy at a target, over all scenes, paths and seeds: first the heads.
    pub fn lines(&self, target_ms: f64, holds: impl Fn(&PolicyRun) -> bool) -> Vec<Vec<String>> {
        let heads = std::iter::once("policy").chain(FIGURES.map(|figure| figure.head));
        let line = |policy: &str| {
            let figures = FIGURES.map(|figure| {
                let at = |run: &PolicyRun| run.key.target_ms == target_ms && holds(run);
                let Interval { mean, .. } = self.interval(policy, figure.name, at);
                if mean.is_finite() { format!("{mean:.*}", figure.digits) } else { "-".into() }
            });
            std::iter::once(policy.to_owned()).chain(figures).collect()
        };
        std::iter::once(heads.map(str::to_owned).collect())
            .chain(self.policies().into_iter().map(line))
            .collect()
    }

    /// The tables for a person, one a target.
    pub fn text(&self) -> String {
        let mut out = String::new();
        for target_ms in self.targets_ms() {
            let lines = self.lines(target_ms, |_| true);
            let width = |column: usize| {
                lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0)
            };
            let widths: Vec<usize> = (0..=FIGURES.len()).map(width).collect();
            out += &format!("target {target_ms} ms, all scenes, paths and seeds\n");
            for line in &lines {
                let fields = line.iter().zip(&widths).enumerate();
                let padded = fields.map(|(at, (field, &width))| match at {
                    0 => format!("{field:<width$}"),
                    _ => format!("{field:>width$}"),
                });
                out += &(padded.collect::<Vec<_>>().join("  ") + "\n");
            }
            out.push('\n');
        }
        out
    }

    /// All runs, empty where there is no figure.
    fn csv(&self) -> Result<Vec<u8>> {
        let failed = |error: String| Error::Internal(format!("policies as CSV: {error}"));
        let mut csv = csv::Writer::from_writer(Vec::new());
        let keys = ["scene", "path", "seed", "target_ms", "policy"];
        csv.write_record(keys.into_iter().chain(FIGURES.map(|figure| figure.name)))
            .map_err(|error| failed(error.to_string()))?;
        for run in &self.runs {
            let key = &run.key;
            let keys = [
                run.scene.clone(),
                format!("{:?}", key.path).to_lowercase(),
                key.seed.to_string(),
                key.target_ms.to_string(),
                key.policy.clone(),
            ];
            let field =
                |&value: &f64| if value.is_nan() { String::new() } else { value.to_string() };
            csv.write_record(keys.into_iter().chain(run.values.iter().map(field)))
                .map_err(|error| failed(error.to_string()))?;
        }
        csv.into_inner().map_err(|error| failed(error.to_string()))
    }

    /// Means and intervals of each policy at each target, and the differences to the first.
    pub fn to_json(&self) -> Value {
        let policies = self.policies();
        let first = policies.first().copied().unwrap_or_default();
        let interval = |of: Interval| json!({ "mean": number(of.mean), "half": number(of.half) });
        let figures = |policy: &str, target_ms: f64| -> Value {
            let at = |run: &PolicyRun| run.key.target_ms == target_ms;
            let figure = |figure: &super::Figure| {
                let value = json!({
                    "value": interval(self.interval(policy, figure.name, at)),
                    "more_than_first": interval(self.difference(policy, first, figure.name, at)),
                });
                (figure.name.to_owned(), value)
            };
            Value::Object(FIGURES.iter().map(figure).collect())
        };
        let targets = self.targets_ms().into_iter().map(|target_ms| {
            let of = |policy: &&str| ((*policy).to_owned(), figures(policy, target_ms));
            json!({
                "target_ms": target_ms,
                "policies": policies.iter().map(of).collect::<serde_json::Map<_, _>>(),
            })
        });
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "first": first,
            "runs": self.runs.len(),
            "targets": targets.collect::<Vec<_>>(),
        })
    }

    /// Writes `policies.csv`, `policies.json` and `policies.html` into a folder, which is made
    /// where it is missing. Their paths.
    pub fn write(&self, dir: &Path) -> Result<Vec<PathBuf>> {
        std::fs::create_dir_all(dir)
            .map_err(|error| Error::output(dir, format!("cannot make the folder: {error}")))?;
        let json = format!("{:#}\n", self.to_json());
        let files = [
            (dir.join("policies.csv"), self.csv()?),
            (dir.join("policies.json"), json.into_bytes()),
            (dir.join("policies.html"), policies_html(self)?.into_bytes()),
        ];
        write_all(&files)?;
        Ok(files.map(|(path, _)| path).into())
    }
}

/// What is no number has no JSON form.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

#[cfg(test)]
mod tests {
    use super::super::RunKey;
    use super::*;

    fn run(policy: &str, seed: u64, flip: f64) -> PolicyRun {
        let key = RunKey { policy: policy.into(), path: PathKind::Walk, seed, target_ms: 30.0 };
        let mut run =
            PolicyRun { scene: "a < b".into(), key, values: vec![f64::NAN; FIGURES.len()] };
        run.set("flip_mean", flip);
        run.set("frame_ms_p95", 20.0 + flip);
        run
    }

    fn table() -> PoliciesTable {
        let mut table = PoliciesTable::default();
        table.add(vec![
            run("one", 0, 0.10),
            run("two", 0, 0.12),
            run(ORACLE, 0, 0.09),
            run("one", 1, 0.50),
            run("two", 1, 0.52),
            run(ORACLE, 1, 0.45),
        ]);
        table
    }

    #[test]
    fn differences_are_between_pairs() {
        let table = table();
        let alone = table.interval("two", "flip_mean", |_| true);
        let pairs = table.difference("two", "one", "flip_mean", |_| true);
        assert!((alone.mean - 0.32).abs() < 1e-12 && alone.half > 0.3);
        assert!((pairs.mean - 0.02).abs() < 1e-12 && pairs.half < 1e-9, "{pairs:?}");
        let distances: Vec<f64> =
            table.runs.iter().map(|run| run.value("flip_to_oracle")).collect();
        assert!((distances[0] - 0.01).abs() < 1e-12 && (distances[4] - 0.07).abs() < 1e-12);
    }

    #[test]
    fn three_files_are_written_with_all_runs() {
        let dir = tempfile::tempdir().unwrap();
        let files = table().write(&dir.path().join("new")).unwrap();
        let text = |at: usize| std::fs::read_to_string(&files[at]).unwrap();
        assert_eq!(text(0).lines().count(), 7);
        assert!(text(0).lines().nth(1).unwrap().starts_with("a < b,walk,0,30,one,0.1,,"));
        let json: Value = serde_json::from_str(&text(1)).unwrap();
        let more = &json["targets"][0]["policies"]["two"]["flip_mean"]["more_than_first"]["mean"];
        assert!((more.as_f64().unwrap() - 0.02).abs() < 1e-12);
        assert!(json["targets"][0]["policies"]["two"]["read_mb"]["value"]["mean"].is_null());
        let page = text(2);
        assert!(page.contains("a &lt; b") && page.contains("<svg") && !page.contains("NaN"));
        assert!(table().text().contains("oracle"));
    }
}
