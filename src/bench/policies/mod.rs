//! All policies along the same paths, over the same loader, cap and clock.

mod figures;
mod plan;
mod table;

pub use figures::{FIGURES, Figure, Inspected, PolicyRun};
pub use plan::{ORACLE, PoliciesPlan, RunKey, WITH_CELLS};
pub use table::{Interval, PoliciesTable};
