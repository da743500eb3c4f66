//! Builds with other constants, or without one step of the ladder of simplification, on one thread,
//! to measure what they are worth (`scripts/constants`, `scripts/ladder`).
//!
//! usage: build_with CHANGES INPUT... OUT
//!
//! CHANGES is a JSON object: `{}`, `{"without": "prune"}`, `{"constants": {"cut": {"row": 8}}}`; its
//! values replace those of [`HierarchyOptions`]. With no other argument it prints all constants.

use std::error::Error;
use std::path::{Path, PathBuf};

use hlod::builder::constants::Constants;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::progress::Silent;
use hlod::builder::simplify::simplified::LadderStep;
use hlod::builder::threads::with_threads;
use hlod::builder::{BuildOptions, build};

#[derive(serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Changes {
    without: Option<String>,
    desired_tris: u32,
    constants: Constants,
}

impl Default for Changes {
    fn default() -> Self {
        let HierarchyOptions { desired_tris, constants, .. } = HierarchyOptions::default();
        Self { without: None, desired_tris, constants }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (changes, rest) =
        arguments.split_first().ok_or("usage: build_with CHANGES INPUT... OUT")?;
    let Changes { without, desired_tris, constants } = serde_json::from_str(changes)?;
    let [inputs @ .., out] = rest else {
        println!("{}", serde_json::to_string_pretty(&constants)?);
        return Ok(());
    };
    let without = match without.as_deref() {
        None => None,
        Some("prune") => Some(LadderStep::Prune),
        Some("oriented") => Some(LadderStep::Oriented),
        Some("clustering") => Some(LadderStep::Clustering),
        Some("prisms") => Some(LadderStep::Prisms),
        Some(other) => return Err(format!("no step {other}").into()),
    };
    let hierarchy = HierarchyOptions { without, desired_tris, constants, ..Default::default() };
    let options = BuildOptions { hierarchy, ..Default::default() };
    let inputs: Vec<PathBuf> = inputs.iter().map(PathBuf::from).collect();
    with_threads(1, || build(&inputs, Path::new(out), &options, &Silent))??;
    Ok(())
}
