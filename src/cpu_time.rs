//! Time of threads, summed.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Adds up the time that threads are at work.
#[derive(Debug, Default)]
pub struct CpuTime {
    nanoseconds: AtomicU64,
}

impl CpuTime {
    /// Runs `work`, which must not hand work to other threads, and counts its time.
    pub fn time<T>(&self, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        self.add(begin.elapsed());
        result
    }

    /// Counts time that was measured elsewhere.
    pub fn add(&self, time: Duration) {
        self.nanoseconds.fetch_add(time.as_nanos() as u64, Ordering::Relaxed);
    }

    /// The sum so far.
    pub fn total(&self) -> Duration {
        Duration::from_nanos(self.nanoseconds.load(Ordering::Relaxed))
    }
}
