//! When a run counts as steady again.

use std::ops::RangeInclusive;

use super::rig::{Frames, SECOND};

/// Seconds that are compared, from a second after a fault on.
const COMPARED: usize = 4;

/// Triangles of fronts, over those of the other run: a single node of the city is 6 %. Nodes that rank
/// nearly alike may be refined in another order, and some faults shift what noise is remembered.
const DETAIL: RangeInclusive<f64> = 0.93..=1.1;

/// The same on average, while prices that were learned of a slow machine are forgotten.
const FORGETTING: RangeInclusive<f64> = 0.85..=1.1;

/// How much detail a run has from a second after a fault on.
#[derive(Clone, Copy)]
pub enum Detail {
    /// As much as the other run in each half second.
    AtOnce,
    /// Less at first, but as much in the last half second.
    InTheEnd,
}

/// As many levels more may toggle, two a second, since nodes that changed lately rest no longer.
const MORE_TOGGLES: u32 = 2 * COMPARED as u32;

/// From a second after a fault that was over before frame `end` on, a run is like another in which
/// nothing went wrong: no more frames are late, there is as much `detail`, and hardly more levels toggle.
pub fn assert_steady(what: &str, run: &Frames, other: &Frames, end: usize, detail: Detail) {
    let compared = end + SECOND..end + (1 + COMPARED) * SECOND;
    let [late, of_other] = [run, other].map(|run| run.late(compared.clone()));
    assert!(late <= of_other, "{what}: {late} frames are late, otherwise {of_other}");
    let halves: Vec<f64> = compared
        .clone()
        .step_by(SECOND / 2)
        .map(|from| {
            let half = from..from + SECOND / 2;
            run.triangles(half.clone()) / other.triangles(half)
        })
        .collect();
    let found: Vec<String> = halves.iter().map(|half| format!("{half:.3}")).collect();
    let found = found.join(" ");
    let mean = halves.iter().sum::<f64>() / halves.len() as f64;
    let is_as_fine = match detail {
        Detail::AtOnce => halves.iter().all(|half| DETAIL.contains(half)),
        Detail::InTheEnd => {
            FORGETTING.contains(&mean) && DETAIL.contains(&halves[halves.len() - 1])
        }
    };
    assert!(is_as_fine, "{what}: detail {found}");
    let [toggles, of_other] = [run, other].map(|run| run.toggles(compared.clone()));
    println!("{what}: detail {found}, toggles {toggles}, {of_other}");
    assert!(toggles <= of_other + MORE_TOGGLES, "{what}: {toggles} toggles, otherwise {of_other}");
}
