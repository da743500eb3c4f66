//! For tests: work that grows no faster than n log n.

use std::time::Duration;

use crate::stage_timer::StageTimer;

/// Sizes in units of the smallest, and how many times as long their work takes, at most. Linear work
/// takes 4 and 16 times as long, n log n about 5 and 20, quadratic 16 and 256; caches and noise take
/// their part.
const MOST: [(usize, u32); 2] = [(4, 9), (16, 48)];

/// What is shorter than this is not told apart from noise.
const LEAST: Duration = Duration::from_millis(1);

/// Runs `work` on what `prepare` makes of a size, of four and of sixteen times that, and compares the
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
        let smallest = time(size).max(LEAST);
        let larger = MOST.map(|(times, most)| (time(times * size), most * smallest));
        if larger.iter().all(|(time, most)| time <= most) {
            return;
        }
        found.push((smallest, larger.map(|(time, _)| time)));
    }
    panic!("{size} and {:?} times that take {found:?}", MOST.map(|(times, _)| times));
}
