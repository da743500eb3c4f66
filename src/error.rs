//! The one error type of the library: what happened, in which file, what was expected and found.

use std::path::PathBuf;

/// Result with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can stop the library. Each variant maps to an exit code of the programs.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input is missing, unreadable, or not what it should be. `what` names line or element.
    #[error("{}: {what}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, what was expected and found, and what to try.
        what: String,
    },
    /// The output could not be written, or holds something that is not ours.
    #[error("{}: {what}", path.display())]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// What happened and what to try.
        what: String,
    },
    /// Options that contradict each other or are out of range.
    #[error("{0}")]
    Usage(String),
    /// No graphics adapter can be used; says which there are, or what to install.
    #[error("{0}")]
    NoAdapter(String),
    /// The graphics device failed: out of memory, lost, or a refusal of its driver.
    #[error("graphics: {0}")]
    Graphics(String),
    /// A promise of the library itself that did not hold.
    #[error("internal error: {0} (please report this)")]
    Internal(String),
}

impl Error {
    /// An input error.
    pub fn input(path: impl Into<PathBuf>, what: impl Into<String>) -> Self {
        Self::Input { path: path.into(), what: what.into() }
    }

    /// An output error.
    pub fn output(path: impl Into<PathBuf>, what: impl Into<String>) -> Self {
        Self::Output { path: path.into(), what: what.into() }
    }

    /// The exit code: 1 anything else, 2 usage, 3 input, 4 output, 5 no graphics adapter.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Input { .. } => 3,
            Self::Output { .. } => 4,
            Self::NoAdapter(_) => 5,
            Self::Graphics(_) | Self::Internal(_) => 1,
        }
    }
}
