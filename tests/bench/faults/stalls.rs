//! Adapters that stall.

use super::rig::{Fault, Ground, frames};
use super::steady::{Detail, assert_steady};

/// The frame in which stalls begin, when the run has been steady for long.
const BEGIN: usize = 300;

const ROOM: u64 = 1 << 30;

/// Of more stalls in a row, prices are learned that hold some detail back until they are forgotten.
const FEW: usize = 5;

/// How many frames stall, and milliseconds of each.
const STALLS: [(usize, f64); 8] = [
    (1, 200.0),
    (1, 500.0),
    (1, 2000.0),
    (2, 1000.0),
    (5, 500.0),
    (10, 200.0),
    (20, 200.0),
    (25, 2000.0),
];

fn stalls_pass(ground: &Ground, policy: &str, is_walking: bool) {
    let pose = |frame| ground.walk(if is_walking { frame } else { BEGIN });
    let run = |stalls: usize, stall_ms: f64| {
        let fault = |frame| match (BEGIN..BEGIN + stalls).contains(&frame) {
            true => Fault { stall_ms, ..Fault::default() },
            false => Fault::default(),
        };
        frames(ground, policy, BEGIN + 40 + 150, ROOM, pose, fault)
    };
    let undisturbed = run(0, 0.0);
    for (stalls, stall_ms) in STALLS {
        let what = format!("{} {policy} {is_walking} {stalls} of {stall_ms} ms", ground.name);
        let detail = if stalls <= FEW { Detail::AtOnce } else { Detail::InTheEnd };
        assert_steady(&what, &run(stalls, stall_ms), &undisturbed, BEGIN + stalls, detail);
    }
}

#[test]
fn a_second_after_stalls_all_is_as_before() {
    for ground in [Ground::city(), Ground::street()] {
        for is_walking in [false, true] {
            stalls_pass(&ground, "gain-over-price", is_walking);
        }
    }
}
