//! Summaries of earlier runs, and in what two of them differ that makes them incomparable.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::bench::SUMMARY_VERSION;
use crate::{Error, Result};

/// Differences that are named one by one before the rest is only counted.
const MOST_DIFFERENCES: usize = 8;

/// What stands among the parameters and is measured when a run by the clock on the wall begins.
/// Of a run by the model clock the same is among the constants of the clock.
const MEASURED: &str = "parameters.selection.time";

/// A `summary.json` with where it is from.
#[derive(Clone, Debug, PartialEq)]
pub struct SummaryFile {
    /// Where it is from, for messages.
    pub path: PathBuf,
    /// What it says.
    pub value: Value,
}

impl SummaryFile {
    /// Reads a summary; whether it has all the figures is known once they are looked up.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path)
            .map_err(|error| Error::input(path, format!("cannot read the summary: {error}")))?;
        let value = serde_json::from_slice(&bytes)
            .map_err(|error| Error::input(path, format!("expected a summary in JSON: {error}")))?;
        let file = Self { path: path.to_owned(), value };
        file.get("/format_version")?;
        Ok(file)
    }

    /// What stands at a JSON pointer.
    pub(super) fn get(&self, key: &str) -> Result<&Value> {
        self.value.pointer(key).ok_or_else(|| self.wrong(key, "found nothing there"))
    }

    /// The number at a JSON pointer; that of the elements of a list; NaN for `null`, which is what a number that is none becomes
    /// in JSON.
    pub(super) fn number(&self, key: &str) -> Result<f64> {
        match self.get(key)? {
            Value::Null => Ok(f64::NAN),
            Value::Array(values) => Ok(values.len() as f64),
            value => value.as_f64().ok_or_else(|| {
                self.wrong(key, &format!("expected a number, found {}", short(value)))
            }),
        }
    }

    /// The same, NaN too where there is none and there need not be.
    pub(super) fn figure(&self, key: &str, optional: bool) -> Result<f64> {
        if optional && self.value.pointer(key).is_none() {
            return Ok(f64::NAN);
        }
        self.number(key)
    }

    fn wrong(&self, key: &str, what: &str) -> Error {
        let key = key.trim_start_matches('/').replace('/', ".");
        Error::input(
            &self.path,
            format!("{key}: {what}; expected a summary.json as hlod-bench writes it"),
        )
    }
}

/// In what two runs differ that makes their figures say nothing about a change of the program.
pub(super) fn differences(base: &SummaryFile, new: &SummaryFile) -> Result<Vec<String>> {
    let mut found = Vec::new();
    let versions = [base, new].map(|file| file.get("/format_version"));
    for (version, file) in versions.into_iter().zip([base, new]) {
        if version? != SUMMARY_VERSION {
            let path = file.path.display();
            found.push(format!("{path}: format_version: this program writes {SUMMARY_VERSION}"));
        }
    }
    let [old_clock, new_clock] = [base.get("/clock")?, new.get("/clock")?];
    let drawn = old_clock == "wall" || new_clock == "wall";
    let keys = [
        ("/format_version", true),
        ("/scene_fingerprint", true),
        ("/path_fingerprint", true),
        ("/frames", true),
        ("/policy", true),
        ("/clock", true),
        ("/parameters", true),
        // A clock on the wall has no constants; a model has no adapter.
        ("/clock_constants", !drawn),
        ("/adapter", drawn),
    ];
    for (key, _) in keys.into_iter().filter(|(_, matters)| *matters) {
        collect(key.trim_start_matches('/'), base.get(key)?, new.get(key)?, &mut found);
    }
    // Figures of pictures say something about each other where both runs have some.
    let pictures = [base, new].map(|file| file.value.pointer("/accuracy").unwrap_or(&Value::Null));
    if pictures.iter().all(|accuracy| accuracy.is_object()) {
        for key in ["every", "adapter"] {
            let [old, now] = pictures.map(|accuracy| &accuracy[key]);
            collect(&format!("accuracy.{key}"), old, now, &mut found);
        }
    }
    if found.len() > MOST_DIFFERENCES {
        let more = found.len() - MOST_DIFFERENCES;
        found.truncate(MOST_DIFFERENCES);
        found.push(format!("and {more} more"));
    }
    Ok(found)
}

/// Leaves of two values that are not the same.
fn collect(name: &str, base: &Value, new: &Value, found: &mut Vec<String>) {
    match (base, new) {
        _ if name == MEASURED => {}
        (Value::Object(old), Value::Object(now)) => {
            let added = now.keys().filter(|key| !old.contains_key(*key));
            for key in old.keys().chain(added) {
                let side = |object: &serde_json::Map<_, _>| object.get(key).cloned();
                let (old, now) = (side(old).unwrap_or_default(), side(now).unwrap_or_default());
                collect(&format!("{name}.{key}"), &old, &now, found);
            }
        }
        _ if base == new => {}
        _ => found.push(format!("{name}: {} against {}", short(base), short(new))),
    }
}

/// A value for a message.
fn short(value: &Value) -> String {
    const MOST: usize = 60;
    let text = value.to_string();
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
