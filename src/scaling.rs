//! For tests: work that grows no faster than n log n.

use std::time::Duration;

use crate::stage_timer::StageTimer;

/// Work of sixteen times the size takes at most so many times as long. Linear work takes 16 times,
/// n log n about 20, quadratic 256; caches and noise take their part.
const MOST: u32 = 48;

/// What is shorter than this is not told apart from noise.
const LEAST: Duration = Duration::from_millis(1);

/// Runs `work` on what `prepare` makes of a size and of sixteen times that, and compares the
/// processor time. Work that grows too fast does so every time; what the machine adds does not.
pub fn assert_scales<I, O>(size: usize, prepare: impl Fn(usize) -> I, work: impl Fn(I) -> O) {
    let time = |size: usize| {
        let input = prepare(size);
        let timer = StageTimer::default();
        std::hint::black_box(timer.time(|| work(input)));
        timer.total()
    };
    let mut found = Vec::new();
    for _ in 0..3 {
        let (small, large) = (time(size).max(LEAST), time(16 * size));
        if large <= MOST * small {
            return;
        }
        found.push((small, large));
    }
    panic!("{size} and {} take {found:?}", 16 * size);
}
