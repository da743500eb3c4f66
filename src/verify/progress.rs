//! What a verification tells while it runs.

/// Hears how far the verification is; called from many threads.
pub trait Progress: Sync {
    /// A phase of so many steps begins.
    fn phase(&self, _name: &str, _steps: u64) {}
    /// Steps that are done.
    fn done(&self, _steps: u64) {}
}

/// Says nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}
