//! Cases beside their twins: what is asked, what was found, and a table of it.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use crate::figures::{Difference, Figures, differences};

/// What a case may be apart from its twin where nothing else is said.
pub const ALLOWED: f64 = 0.01;

/// Student's t for 1 in 100 on both sides together, of 2 twins and more.
const STUDENT: [f64; 7] = [63.66, 9.92, 5.84, 4.60, 4.03, 3.71, 3.50];

/// What cases are held against: one set of figures, or those of several that differ by less than
/// what coordinates are rounded by. Edge collapse is chaotic: where two edges are as good as each
/// other, a last bit decides, and with it what follows. A case may then be as far from the mean of
/// such twins as one more of them would be in 99 of 100 draws.
pub struct Twin {
    pub name: String,
    all: Vec<Figures>,
}

impl Twin {
    pub fn one(name: &str, figures: Figures) -> Self {
        Self::several(name, vec![figures])
    }

    pub fn several(name: &str, all: Vec<Figures>) -> Self {
        Self { name: name.into(), all }
    }

    /// The mean of each figure, and what part of it one more twin may be from it.
    fn mean(&self) -> (Figures, BTreeMap<String, f64>) {
        let mut mean = Figures::default();
        let mut spreads = BTreeMap::new();
        for figure in &self.all[0].0 {
            let values: Vec<f64> = self.all.iter().map(|one| one.get(&figure.name)).collect();
            let middle = values.iter().sum::<f64>() / values.len() as f64;
            let squares: f64 = values.iter().map(|value| (value - middle).powi(2)).sum();
            let count = values.len() as f64;
            let apart = match STUDENT.get(values.len().wrapping_sub(2)) {
                Some(t) => t * (squares / (count - 1.0)).sqrt() * (1.0 + 1.0 / count).sqrt(),
                None => 0.0,
            };
            spreads.insert(figure.name.clone(), apart / middle.abs().max(figure.least));
            mean.add(&figure.name, middle, figure.least);
        }
        (mean, spreads)
    }
}

/// Figures whose bound is said, by the beginnings of their names.
pub type Bounds<'a> = &'a [(&'a str, f64)];

/// Rows of one kind of hardness.
pub struct Table {
    /// Where it stands among the tables, and the name of its file.
    name: &'static str,
    title: &'static str,
    rows: Vec<[String; 6]>,
    failures: Vec<String>,
}

impl Table {
    pub fn new(name: &'static str, title: &'static str) -> Self {
        Self { name, title, rows: Vec::new(), failures: Vec::new() }
    }

    /// A case whose figures are those of its twin to 1 %, or to what twins are apart.
    pub fn same(&mut self, case: &str, figures: &Figures, twin: &Twin) {
        self.within(case, figures, twin, &[], "");
    }

    /// The same, but for figures of which `bounds` says how far they may be apart (infinite: they
    /// are not compared), and `why` for what reason.
    pub fn within(
        &mut self,
        case: &str,
        figures: &Figures,
        twin: &Twin,
        bounds: Bounds,
        why: &str,
    ) {
        assert_eq!(bounds.is_empty(), why.is_empty(), "{case}: a reason for what is said");
        let (mean, spreads) = twin.mean();
        let allowed = |name: &str| {
            let spread = spreads.get(name).copied().unwrap_or(0.0);
            let said = bounds.iter().find(|(start, _)| name.starts_with(start));
            said.map_or(ALLOWED, |(_, bound)| *bound).max(spread)
        };
        let mut all = differences(figures, &mean, allowed);
        all.retain(|difference| difference.allowed.is_finite());
        assert!(!all.is_empty(), "{case}: nothing is compared");
        if std::env::var_os("HLOD_STRESS_VERBOSE").is_some() {
            for d in &all {
                let parts = [d.part, d.allowed].map(percent);
                println!("  {case}: {} {} twin {}: {parts:?}", d.name, d.case, d.twin);
            }
        }
        // Every other row would name the same noise: what is beyond 1 % is told, if anything is.
        let strict = all.iter().filter(|d| d.part <= ALLOWED).count();
        let over = |d: &&Difference| d.part / d.allowed;
        let worst = all.iter().max_by(|a, b| over(a).total_cmp(&over(b))).unwrap();
        let reason = match why {
            "" if worst.part > ALLOWED => "; as twins among each other".into(),
            "" => String::new(),
            why => format!("; {why}"),
        };
        self.rows.push([
            case.into(),
            twin.name.clone(),
            format!("{strict} of {}", all.len()),
            worst.name.clone(),
            format!("{} / {}", number(worst.case), number(worst.twin)),
            format!("{} of {}{reason}", percent(worst.part), percent(worst.allowed)),
        ]);
        for d in all.iter().filter(|d| !d.is_allowed()) {
            self.failures.push(format!(
                "{case}: {} is {}, of {} {}: {} apart, {} allowed",
                d.name,
                d.case,
                twin.name,
                d.twin,
                percent(d.part),
                percent(d.allowed)
            ));
        }
    }

    /// What verification found of a case.
    pub fn verified(&mut self, case: &str, failures: Vec<String>) {
        let failures = failures.into_iter().map(|failure| format!("{case}: verify: {failure}"));
        self.failures.extend(failures);
    }

    /// A case that is refused, for the input's fault or that of an option, and says so with
    /// `words`.
    pub fn refused<T>(&mut self, case: &str, found: hlod::Result<T>, words: &str) {
        let Err(error) = found else {
            self.failures.push(format!("{case}: expected a refusal with {words:?}"));
            return;
        };
        let text = error.to_string();
        let what = match &error {
            hlod::Error::Input { what, .. } => what.clone(),
            other => other.to_string(),
        };
        // Folders are others each time.
        let words_of = what.split(' ').map(|word| word.rsplit('/').next().unwrap_or(word));
        let what = words_of.collect::<Vec<_>>().join(" ");
        let code = format!("exit code {}", error.exit_code());
        self.rows.push([
            case.into(),
            "refused".into(),
            "".into(),
            what.replace('|', "\\|"),
            "".into(),
            code,
        ]);
        if ![2, 3].contains(&error.exit_code()) || !text.contains(words) {
            self.failures.push(format!("{case}: expected a refusal with {words:?}, found {error}"));
        }
    }

    /// Writes the rows where asked, and fails where a case does.
    pub fn finish(self) {
        let head =
            "| case | twin | within 1 % | farthest apart | case / twin | apart, of allowed |";
        let mut text = format!("### {}\n\n{head}\n|---|---|---|---|---|---|\n", self.title);
        for row in &self.rows {
            text += &format!("| {} |\n", row.join(" | "));
        }
        println!("{text}");
        if let Some(folder) = std::env::var_os("HLOD_STRESS_TABLE") {
            let folder = PathBuf::from(folder);
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join(format!("{}.md", self.name)), text).unwrap();
        }
        assert!(self.failures.is_empty(), "{}", self.failures.join("\n"));
    }
}

fn percent(part: f64) -> String {
    match part * 100.0 {
        0.0 => "0 %".into(),
        percent if percent < 0.01 => format!("{percent:.0e} %"),
        percent if percent < 10.0 => format!("{percent:.2} %"),
        percent => format!("{percent:.0} %"),
    }
}

fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size >= 0.1 => format!("{value:.3}"),
        _ => format!("{value:.3e}"),
    }
}
