//! When a run counts as steady again.

use std::ops::RangeInclusive;

use super::rig::{Frames, SECOND};

/// Seconds that are compared, from a second after a fault on.
const COMPARED: usize = 4;

/// Triangles of fronts, over those of the other run: a single node of the city is 6 %. Nodes that rank
/// nearly alike may be refined in another order, and some faults shift what noise is remembered.
pub const DETAIL: RangeInclusive<f64> = 0.93..=1.1;

/// As many levels more may toggle, two a second, since nodes that changed lately rest no longer.
const MORE_TOGGLES: u32 = 2 * COMPARED as u32;

/// From a second after a fault that was over before frame `end` on, a run is like another in which
/// nothing went wrong: no more frames are late, in each half second there is as much `detail`, and hardly more
/// levels toggle.
pub fn assert_steady(
    what: &str,
    run: &Frames,
    other: &Frames,
    end: usize,
    detail: &RangeInclusive<f64>,
) {
    let compared = end + SECOND..end + (1 + COMPARED) * SECOND;
    let [late, of_other] = [run, other].map(|run| run.late(compared.clone()));
    assert!(late <= of_other, "{what}: {late} frames are late, otherwise {of_other}");
    let mut found = Vec::new();
    for from in compared.clone().step_by(SECOND / 2) {
        let half = from..from + SECOND / 2;
        let [triangles, of_other] = [run, other].map(|run| run.triangles(half.clone()));
        found.push(format!("{:.3}", triangles / of_other));
        let is_as_fine = detail.contains(&(triangles / of_other));
        assert!(
            is_as_fine,
            "{what}, from frame {from}: {triangles} triangles, otherwise {of_other}"
        );
    }
    let [toggles, of_other] = [run, other].map(|run| run.toggles(compared.clone()));
    println!("{what}: detail {}, toggles {toggles}, {of_other}", found.join(" "));
    assert!(toggles <= of_other + MORE_TOGGLES, "{what}: {toggles} toggles, otherwise {of_other}");
}
