//! Processor time of the stages of a build, summed over threads.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Sums the processor time that threads spend in [`StageTimer::time`].
///
/// Clones share one sum. On Unix a thread's own clock is read, which stands still while the thread
/// sleeps or waits for a processor; elsewhere wall time is taken in its place.
///
/// Calls may be nested: time in an inner call is counted by the inner timer alone. That includes a
/// job of another stage that a thread of the pool runs while it waits for its own.
#[derive(Clone, Debug, Default)]
pub struct StageTimer {
    nanoseconds: Arc<AtomicU64>,
}

/// The call of [`StageTimer::time`] that a thread is in.
#[derive(Default)]
struct Running {
    timer: StageTimer,
    /// Time of the inner calls that have ended.
    nested: Duration,
}

thread_local! {
    static RUNNING: RefCell<Running> = RefCell::default();
}

impl StageTimer {
    /// The timer of the innermost call that this thread is in. Work that is handed to other threads
    /// is counted where each of its pieces runs in `time` of this timer. Outside of any call it is
    /// a timer that nobody reads.
    pub fn current() -> Self {
        RUNNING.with_borrow(|running| running.timer.clone())
    }

    /// Runs `work` and counts the processor time that this thread spends in it.
    pub fn time<T>(&self, work: impl FnOnce() -> T) -> T {
        let inner = Running { timer: self.clone(), nested: Duration::ZERO };
        let outer = Outer { timer: self, before: RUNNING.replace(inner), begin: thread_time() };
        let result = work();
        drop(outer);
        result
    }

    /// The sum so far.
    pub fn total(&self) -> Duration {
        Duration::from_nanos(self.nanoseconds.load(Ordering::Relaxed))
    }
}

/// Ends a call of [`StageTimer::time`] when dropped, also while a panic unwinds.
struct Outer<'a> {
    timer: &'a StageTimer,
    before: Running,
    begin: Duration,
}

impl Drop for Outer<'_> {
    fn drop(&mut self) {
        let elapsed = thread_time().saturating_sub(self.begin);
        self.before.nested += elapsed;
        let Running { nested, .. } = RUNNING.replace(std::mem::take(&mut self.before));
        let own = elapsed.saturating_sub(nested).as_nanos() as u64;
        self.timer.nanoseconds.fetch_add(own, Ordering::Relaxed);
    }
}

/// Processor time of this thread since it began.
#[cfg(unix)]
pub fn thread_time() -> Duration {
    use rustix::time::{ClockId, clock_gettime};
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// Wall time, since there is no clock of a thread.
#[cfg(not(unix))]
pub fn thread_time() -> Duration {
    use std::sync::LazyLock;
    use std::time::Instant;
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGIN.elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uses the processor for a while.
    fn spin(time: Duration) {
        let begin = thread_time();
        while thread_time() - begin < time {
            std::hint::spin_loop();
        }
    }

    const MILLISECOND: Duration = Duration::from_millis(1);

    #[cfg(unix)]
    #[test]
    fn sleep_is_not_counted_and_work_is() {
        let timer = StageTimer::default();
        timer.time(|| std::thread::sleep(30 * MILLISECOND));
        assert!(timer.total() < 10 * MILLISECOND, "{:?}", timer.total());
        assert_eq!(timer.time(|| spin(10 * MILLISECOND)), ());
        assert!(timer.total() >= 10 * MILLISECOND, "{:?}", timer.total());
        assert!(timer.total() < 30 * MILLISECOND, "{:?}", timer.total());
    }

    #[test]
    fn nested_work_is_counted_once_by_the_inner_timer() {
        let [outer, inner] = [StageTimer::default(), StageTimer::default()];
        let begin = thread_time();
        outer.time(|| {
            inner.time(|| spin(5 * MILLISECOND));
            outer.time(|| spin(2 * MILLISECOND));
            spin(MILLISECOND);
        });
        let all = thread_time() - begin;
        assert!(inner.total() >= 5 * MILLISECOND, "{:?}", inner.total());
        assert!(outer.total() >= 3 * MILLISECOND, "{:?}", outer.total());
        assert!(outer.total() + inner.total() <= all, "{outer:?} {inner:?} {all:?}");
    }

    #[test]
    fn work_on_other_threads_counts_for_the_current_timer() {
        let timer = StageTimer::default();
        timer.time(|| {
            let current = StageTimer::current();
            std::thread::scope(|scope| {
                for _ in 0..2 {
                    scope.spawn(|| current.time(|| spin(4 * MILLISECOND)));
                }
            });
        });
        assert!(timer.total() >= 8 * MILLISECOND, "{:?}", timer.total());
        let before = timer.total();
        StageTimer::current().time(|| spin(MILLISECOND));
        assert_eq!(timer.total(), before, "outside of any call");
    }

    #[test]
    fn a_panic_leaves_the_outer_timer_in_place() {
        let [outer, inner] = [StageTimer::default(), StageTimer::default()];
        outer.time(|| {
            let work = || inner.time(|| panic!("as tested"));
            assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).is_err());
            StageTimer::current().time(|| spin(MILLISECOND));
        });
        assert!(outer.total() >= MILLISECOND, "{:?}", outer.total());
    }
}
