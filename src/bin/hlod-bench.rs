//! `hlod-bench OUT PATH.csv`: replays a camera path over a built scene. Not there yet.

use std::process::ExitCode;

fn main() -> ExitCode {
    eprintln!(
        "hlod-bench: replaying camera paths is not part of this version yet; \
         `hlod-build inspect OUT` shows what a build made"
    );
    ExitCode::from(1)
}
