//! On how many threads a build runs.

use rayon::prelude::*;

use crate::{Error, Result};

/// More threads than any machine has cores would only take its memory.
const MOST_THREADS: usize = 1024;

/// Runs a build on a pool of its own with this many threads; 0 is one per core.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    if threads > MOST_THREADS {
        return Err(Error::Usage(format!("{threads} threads, expected 0 to {MOST_THREADS}")));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Error::Usage(format!("{threads} threads cannot be started: {error}")))
        .map(|pool| pool.install(work))
}

/// Blocks of an input in parallel, in order.
pub(super) fn in_parallel<I: Send, O: Send>(
    items: Vec<I>,
    work: impl Fn(usize, I) -> Result<O> + Sync,
) -> Result<Vec<O>> {
    items.into_par_iter().enumerate().map(|(number, item)| work(number, item)).collect()
}
