//! Joins the results of all subsets to the result of a build of all inputs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::builder::plan::KnownInput;
use crate::builder::reuse::PreviousBuild;
use crate::format::Subset;
use crate::format::{REPORT_FILE, SUBSETS_DIR};
use crate::report::build_report::BuildReport;
use crate::{Error, Result};

/// The results of all subsets of one build, which fit together.
pub struct Subsets {
    results: Vec<PreviousBuild>,
    /// Index of the result that has a block, by name.
    of_blocks: BTreeMap<String, usize>,
}

impl Subsets {
    /// Reads those that stand in an output folder. Fails where one is missing, damaged, or of another
    /// version, or where they were built with different options or of different inputs.
    pub fn open(out: &Path) -> Result<Self> {
        let subsets = found(out)?;
        let reports = subsets.iter().map(|&at| report(out, at)).collect::<Result<Vec<_>>>()?;
        for (&subset, report) in subsets.iter().zip(&reports) {
            fits(subset, report, subsets[0], &reports[0]).map_err(|what| {
                let what = format!("{what}; run hlod-build --subset {subset} again, as the others");
                Error::input(subset.dir(out), what)
            })?;
        }
        let mut results = Vec::with_capacity(subsets.len());
        let mut of_blocks = BTreeMap::new();
        for (&subset, report) in subsets.iter().zip(&reports) {
            let dir = subset.dir(out);
            let result = PreviousBuild::open(&dir, &report.parameters).ok_or_else(|| {
                let what = "expected a whole result, found files missing, or of another size";
                Error::input(&dir, format!("{what}; run hlod-build --subset {subset} again"))
            })?;
            let BuildReport { blocks, empty_blocks, .. } = &result.report;
            let names = blocks.iter().map(|block| &block.name);
            let names = names.chain(empty_blocks.iter().map(|block| &block.name));
            of_blocks.extend(names.map(|block| (block.clone(), results.len())));
            results.push(result);
        }
        Ok(Self { results, of_blocks })
    }

    /// What all of them were asked for.
    pub fn parameters(&self) -> &serde_json::Value {
        &self.results[0].report.parameters
    }

    /// All inputs, in order.
    pub fn inputs(&self) -> &[KnownInput] {
        self.results[0].inputs()
    }

    /// The result that has a block, and the block's numbers there.
    pub fn blocks(&self, name: &str, content_hash: &str) -> Option<(&PreviousBuild, &[usize])> {
        let result = &self.results[*self.of_blocks.get(name)?];
        Some((result, result.blocks(name, content_hash)?))
    }
}

/// The subsets in an output folder, all that there are of them.
fn found(out: &Path) -> Result<Vec<Subset>> {
    let dir = out.join(SUBSETS_DIR);
    let none = || {
        let what = "expected what hlod-build --subset K/N INPUT... OUT builds there, found nothing";
        Error::input(&dir, what)
    };
    let listing = std::fs::read_dir(&dir).map_err(|_| none())?;
    let names = listing.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut found: Vec<Subset> = names.filter_map(|name| Subset::of_dir(&name)).collect();
    found.sort_unstable();
    let &Subset { of, .. } = found.first().ok_or_else(none)?;
    if let Some(other) = found.iter().find(|subset| subset.of != of) {
        let what = format!("expected subsets of one build, found {} and {other}", found[0]);
        return Err(Error::input(&dir, format!("{what}; remove those that are not wanted")));
    }
    let missing: Vec<String> = Subset::all(of)
        .filter(|subset| found.binary_search(subset).is_err())
        .map(|subset| subset.to_string())
        .collect();
    if missing.is_empty() {
        return Ok(found);
    }
    let what =
        format!("expected {of} subsets, found {}: missing {}", found.len(), missing.join(", "));
    Err(Error::input(&dir, format!("{what}; build them with hlod-build --subset")))
}

fn report(out: &Path, subset: Subset) -> Result<BuildReport> {
    let file: PathBuf = subset.dir(out).join(REPORT_FILE);
    let cannot = |what: &dyn std::fmt::Display| Error::input(&file, format!("cannot read: {what}"));
    let text = std::fs::read_to_string(&file).map_err(|error| cannot(&error))?;
    serde_json::from_str(&text).map_err(|error| cannot(&error))
}

/// All inputs of the build that a result is a subset of.
fn inputs_of(report: &BuildReport) -> &[String] {
    report.subset.as_ref().map_or(&[], |subset| &subset.all_inputs)
}

/// Refuses a result that is no such subset, or not of the build that the first is of.
fn fits(
    subset: Subset,
    report: &BuildReport,
    first: Subset,
    of_first: &BuildReport,
) -> Result<(), String> {
    let version = env!("CARGO_PKG_VERSION");
    if report.version != version {
        return Err(format!(
            "expected a result of hlod {version}, found one of {}",
            report.version
        ));
    }
    let is_of = |part: &crate::report::build_report::SubsetReport| part.subset == subset;
    if !report.subset.as_ref().is_some_and(is_of) {
        return Err(format!("expected subset {subset}, found another result"));
    }
    if let Some((name, [expected, found])) =
        first_difference(&of_first.parameters, &report.parameters)
    {
        let expected = format!("{name} {expected} as in subset {first}");
        return Err(format!("expected the option {expected}, found {found}"));
    }
    let (expected, found) = (inputs_of(of_first), inputs_of(report));
    if expected != found {
        let only = |some: &[String], others: &[String]| {
            some.iter().find(|input| !others.contains(input)).cloned()
        };
        let what = match (only(found, expected), only(expected, found)) {
            (Some(more), _) => format!("{more}, which subset {first} was not built beside"),
            (_, Some(fewer)) => format!("none of {fewer}"),
            _ => "another order".into(),
        };
        return Err(format!("expected the inputs of subset {first}, found {what}"));
    }
    Ok(())
}

/// The first parameter that differs, with both values.
fn first_difference(
    one: &serde_json::Value,
    other: &serde_json::Value,
) -> Option<(String, [String; 2])> {
    let names = |parameters: &serde_json::Value| -> Vec<String> {
        parameters.as_object().map(|at| at.keys().cloned().collect()).unwrap_or_default()
    };
    let text = |value: Option<&serde_json::Value>| {
        value.map_or_else(|| "nothing".into(), serde_json::Value::to_string)
    };
    names(one).into_iter().chain(names(other)).find_map(|name| {
        let values = [one.get(&name), other.get(&name)];
        (values[0] != values[1]).then(|| (name.clone(), values.map(text)))
    })
}
