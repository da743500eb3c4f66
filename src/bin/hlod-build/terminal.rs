//! What is printed, and progress on a terminal.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use hlod::{Error, Result};
use indicatif::{HumanCount, ProgressBar, ProgressStyle};

/// To standard output; that nobody reads on (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::output("standard output", error.to_string()))
        }
        _ => Ok(()),
    }
}

/// A bar on a terminal that is not to be quiet.
pub fn bar(quiet: bool, template: &str) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key(
            "rate",
            |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
                let rate = HumanCount(state.per_sec() as u64);
                let _ = write!(out, "{rate} triangles/s");
            },
        ));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
