//! Files of a scene that cannot be used.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::Error;

/// More files than this are not named: a folder may be missing as a whole.
const MOST_NAMED: usize = 1000;

/// Files of a scene that cannot be used, each with what is wrong with it, in the order in which
/// that was found; the first thousand.
#[derive(Clone, Debug, Default)]
pub struct BrokenFiles {
    paths: BTreeSet<PathBuf>,
    messages: Vec<String>,
}

impl BrokenFiles {
    /// Adds a file, unless it is known already: a texture that several nodes share is named once.
    pub fn add(&mut self, error: &Error) {
        let is_new = match error {
            _ if self.messages.len() == MOST_NAMED => false,
            Error::Input { path, .. } => self.paths.insert(path.clone()),
            _ => true,
        };
        if is_new {
            self.messages.push(error.to_string());
        }
    }

    /// A message for each file.
    pub fn messages(&self) -> &[String] {
        &self.messages
    }
}
