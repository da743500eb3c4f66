//! Builds without one step of the ladder of simplification, on one thread, to measure what that is
//! worth (`scripts/ladder`).
//!
//! usage: build_without STEP|nothing INPUT... OUT

use std::error::Error;
use std::path::{Path, PathBuf};

use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::progress::Silent;
use hlod::builder::simplify::simplified::LadderStep;
use hlod::builder::threads::with_threads;
use hlod::builder::{BuildOptions, build};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [step, inputs @ .., out] = &arguments[..] else {
        return Err("usage: build_without STEP|nothing INPUT... OUT".into());
    };
    let without = match step.as_str() {
        "nothing" => None,
        "permissive" => Some(LadderStep::Permissive),
        "prune" => Some(LadderStep::Prune),
        "oriented" => Some(LadderStep::Oriented),
        "clustering" => Some(LadderStep::Clustering),
        "boxes" => Some(LadderStep::Boxes),
        other => return Err(format!("no step {other}").into()),
    };
    let hierarchy = HierarchyOptions { without, ..Default::default() };
    let options = BuildOptions { hierarchy, ..Default::default() };
    let inputs: Vec<PathBuf> = inputs.iter().map(PathBuf::from).collect();
    with_threads(1, || build(&inputs, Path::new(out), &options, &Silent))??;
    Ok(())
}
