//! Progress on standard error: a bar on a terminal, a line every half minute elsewhere.

use std::fmt::Write as _;
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// The bar is drawn again this often, also while no frame ends.
const TICK: Duration = Duration::from_millis(200);

/// Interval between lines of progress where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(30);

/// The progress of a command; ends with it.
pub struct Progress {
    bar: ProgressBar,
    lines: Option<Lines>,
}

/// The thread that prints lines.
struct Lines {
    stop: Sender<()>,
    thread: JoinHandle<()>,
}

impl Progress {
    /// Begins something of so many steps. `what` is shown until the first step is done.
    pub fn new(quiet: bool, steps: u64, what: &str) -> Self {
        let has_bar = !quiet && std::io::stderr().is_terminal();
        let target = match has_bar {
            true => ProgressDrawTarget::stderr(),
            false => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(steps), target).with_message(what.to_owned());
        if has_bar {
            if let Ok(style) = ProgressStyle::with_template("{wide_bar} {msg}{left}") {
                let left = |state: &ProgressState, out: &mut dyn std::fmt::Write| {
                    let _ = out.write_str(&left(state.pos(), state.eta()));
                };
                bar.set_style(style.with_key("left", left));
            }
            bar.enable_steady_tick(TICK);
        }
        let lines = if quiet || has_bar { None } else { Lines::start(bar.clone()) };
        Self { bar, lines }
    }

    /// Counts further steps as done; `message` describes the last.
    pub fn advance(&self, steps: u64, message: impl FnOnce() -> String) {
        if !self.bar.is_hidden() || self.lines.is_some() {
            self.bar.set_message(message());
        }
        self.bar.inc(steps);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if let Some(Lines { stop, thread }) = self.lines.take() {
            drop(stop);
            // It prints and does nothing else.
            let _ = thread.join();
        }
    }
}

impl Lines {
    /// `None` where the system gives no thread: there are no lines then.
    fn start(bar: ProgressBar) -> Option<Self> {
        let (stop, stopped) = channel();
        let print = move || {
            while stopped.recv_timeout(LINE_EVERY) == Err(RecvTimeoutError::Timeout) {
                let left = left(bar.position(), bar.eta());
                eprintln!("hlod-bench: {}{left}", bar.message());
            }
        };
        let thread = std::thread::Builder::new().name("progress".into()).spawn(print).ok()?;
        Some(Self { stop, thread })
    }
}

/// The time left, once something is known of it.
fn left(position: u64, eta: Duration) -> String {
    let mut text = String::new();
    if position > 0 {
        let _ = write!(text, ", {} left", HumanDuration(eta));
    }
    text
}
